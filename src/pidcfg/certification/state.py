"""What `--resume` keeps: how far a batch has come, with a key that says of what."""

from __future__ import annotations

import hashlib
import json
import platform
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pidcfg
from pidcfg.certification.tally import Tally, json_of
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from pidcfg.certification.workers import Job

KEPT = Decision(
    803,
    "what --resume keeps",
    "The file holds the counts, distributions and worst samples after the samples so far, in the order of their "
    "numbers, never single samples: it does not grow. Its key is a hash of the scenario's and the configuration's "
    "bytes, the seed, the sources of pidcfg, Python and the machine. With another key, with more samples than are "
    "wanted, or damaged it is refused and left alone. Engine and number of processes are no part of the key: they give "
    "the same results.",
    "A result that is put together from two programs or two scenarios would be nobody's.",
)
FORMAT = 1


class StateError(ValueError):
    """A state that cannot be continued, and why."""


@cache
def sources() -> str:
    """A hash of the package as it runs."""
    folder = Path(pidcfg.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def key_of(job: Job) -> str:
    """A hash of everything that a result depends on."""
    parts = (
        *(FORMAT, job.scenario, job.config.hex(), job.seed, sources()),
        *(sys.version, platform.machine(), platform.system()),
    )
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def written(tally: Tally, key: str) -> bytes:
    """A state as the file has it, with a checksum."""
    body = json_of({"key": key, "tally": tally.state()})
    return f"{hashlib.sha256(body.encode()).hexdigest()}\n{body}\n".encode()


def read(data: bytes, key: str, samples: int) -> Tally:
    """The tally of a state; raises `StateError`."""
    try:
        checksum, _, rest = data.decode().partition("\n")
        body = rest.removesuffix("\n")
        if hashlib.sha256(body.encode()).hexdigest() != checksum:
            raise StateError("it is damaged, or no file of --resume")
        state: dict[str, Any] = json.loads(body)
    except UnicodeDecodeError:
        raise StateError("it is no file of --resume") from None
    if state["key"] != key:
        raise StateError("it belongs to another scenario, configuration, seed or program")
    tally = Tally.of_state(state["tally"])
    if tally.samples > samples:
        raise StateError(f"it has {tally.samples} samples already, more than {samples}")
    return tally
