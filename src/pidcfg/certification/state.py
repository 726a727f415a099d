"""What `--resume` keeps: how far a batch has come, with a key that says of what."""

from __future__ import annotations

import hashlib
import json
import platform
import sys
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pidcfg.certification.histogram import BLOCK
from pidcfg.certification.sources import sources
from pidcfg.certification.tally import Tally, json_of
from pidcfg.certification.trial import Trial
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from pidcfg.certification.workers import Job

KEPT = Decision(
    803,
    "what --resume keeps",
    "The file holds the counts, distributions and worst samples after the samples so far, in the order of their "
    "numbers, never single samples: it does not grow. Blocks of a cluster that were ready before an earlier one stand "
    "in it beside them. Its key is a hash of the scenario's and the configuration's bytes, the seed, the sources of "
    "pidcfg, Python and the machine; a hash of what was seen of the first 64 samples goes with it, and these run again "
    "before the batch goes on. With another key or another hash, with more samples than are wanted, or damaged it is "
    "refused and left alone. Engine and number of processes are no part of the key: they give the same results.",
    "A result that is put together from two programs, two scenarios or two ways to calculate would be nobody's.",
)
FORMAT = 2
DAMAGED = "it is damaged, or no file of --resume"


class StateError(ValueError):
    """A state that cannot be continued, and why."""


@dataclass(slots=True)
class Progress:
    """How far a batch has come."""

    tally: Tally
    trial: Trial = field(default_factory=Trial)
    ahead: dict[int, Tally] = field(default_factory=dict)
    """Blocks that are ready before an earlier one, by the number of their first sample."""


def key_of(job: Job) -> str:
    """A hash of everything that a result depends on."""
    parts = (
        *(FORMAT, job.scenario, job.config.hex(), job.seed, sources()),
        *(sys.version, platform.machine(), platform.system()),
    )
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def written(progress: Progress, key: str) -> bytes:
    """A state as the file has it, with a checksum."""
    body = json_of(
        {
            "key": key,
            "tally": progress.tally.state(),
            "trial": [progress.trial.samples, progress.trial.digest],
            "ahead": [block.state() for _, block in sorted(progress.ahead.items())],
        }
    )
    return f"{hashlib.sha256(body.encode()).hexdigest()}\n{body}\n".encode()


def read(data: bytes, key: str, job: Job, samples: int) -> Progress:
    """What a state holds; raises `StateError`."""
    try:
        state = _body(data, key)
        tally = Tally.of_state(state["tally"])
        ahead = {block.first: block for block in map(Tally.of_state, state["ahead"]) if block.samples == BLOCK}
        count, digest = int(state["trial"][0]), state["trial"][1]
        too_many = tally.samples > samples
    except StateError:
        raise
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError):
        raise StateError(DAMAGED) from None
    if too_many:
        raise StateError(f"it has {tally.samples} samples already, more than {samples}")
    trial = Trial()
    trial.run(job, count)
    if trial.digest != digest:
        raise StateError("its first samples come out otherwise here: this machine does not calculate alike")
    return Progress(tally, trial, ahead)


def _body(data: bytes, key: str) -> Any:
    """The document of a state whose checksum and key are right."""
    try:
        checksum, _, rest = data.decode().partition("\n")
    except UnicodeDecodeError:
        raise StateError("it is no file of --resume") from None
    body = rest.removesuffix("\n")
    if hashlib.sha256(body.encode()).hexdigest() != checksum:
        raise StateError(DAMAGED)
    state = json.loads(body)
    if state["key"] != key:
        raise StateError("it belongs to another scenario, configuration, seed or program")
    return state
