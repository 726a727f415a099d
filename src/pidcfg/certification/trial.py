"""Whether two machines calculate alike, which is tried and not assumed: the first samples of a batch, as a hash."""

from __future__ import annotations

import hashlib
import platform
import sys
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from pidcfg.certification.run import run_sample
from pidcfg.certification.sources import sources

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.certification.run import Seen
    from pidcfg.certification.workers import Job

SAMPLES = 64
"""Of the beginning of a batch."""
PACKAGES = ("numba", "NumPy", "llvmlite", "distributed")
"""What calculates, and what carries the results, besides Python and pidcfg."""
NONE = "none"
SHOWN = 12
"""Characters of a hash that are shown."""


@dataclass(slots=True)
class Trial:
    """The first samples of a batch: how many, and a hash of all that was seen of them."""

    samples: int = 0
    _hash: Any = field(default_factory=hashlib.sha256)

    def take(self, seen: Seen) -> None:
        """The next sample of the batch; those that come later than the first ones do not count."""
        if seen.sample == self.samples < SAMPLES:
            self._hash.update(repr(seen).encode())
            self.samples += 1

    def run(self, job: Job, samples: int) -> None:
        """Runs what is missing of so many first samples."""
        wanted = min(samples, SAMPLES)
        if self.samples < wanted:
            loaded, batch = job.loaded()
            for sample in range(self.samples, wanted):
                self.take(run_sample(loaded, batch, sample, job.settings)[0])

    @property
    def digest(self) -> str:
        """The hash."""
        return str(self._hash.hexdigest())


def machine() -> dict[str, str]:
    """What calculates here."""
    return {
        "Python": sys.version,
        "machine": f"{platform.machine()} {platform.system()}",
        "pidcfg": sources(),
        **{package: _version(package) for package in PACKAGES},
    }


def facts(job: Job, samples: int) -> dict[str, str]:
    """All that must be alike: what calculates, and the hash of the first samples, or why they cannot run."""
    trial = Trial()
    try:
        trial.run(job, samples)
    except Exception as error:  # noqa: BLE001 - whatever goes wrong on another machine is what differs there
        return {**machine(), "samples": f"{type(error).__name__}: {error}"}
    return {**machine(), "samples": trial.digest}


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return NONE


def differences(mine: Mapping[str, str], other: Mapping[str, str]) -> list[str]:
    """What differs, in words; nothing: the two calculate alike."""
    return [
        f"{name} {_short(other.get(name, NONE))} and not {_short(text)}"
        for name, text in mine.items()
        if text != other.get(name)
    ]


def _short(text: str) -> str:
    """A hash by its beginning, a text in one line."""
    one = " ".join(text.split())
    return f"{one[:SHOWN]}…" if len(one) == len(hashlib.sha256().hexdigest()) and " " not in one else one
