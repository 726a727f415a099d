"""What a batch has found so far: counts, distributions, the worst samples, and what ``--resume`` keeps."""

from __future__ import annotations

import hashlib
import json
import platform
import struct
import sys
from dataclasses import asdict, dataclass, field
from math import ceil, inf, isfinite
from typing import TYPE_CHECKING, Any

from pidcfg.sim.judgement.meters import METRICS
from pidcfg.study.certification.samples import Trial, fifth_bounds, hash_sources
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.study.certification.samples import Job, SampleResult
    from pidcfg.study.uncertainty import Uncertainty

# --- Quantiles and means of numbers that come one by one, in little memory --------------------------------------------

D802 = Decision(
    802,
    "quantiles and means of a batch",
    "A number falls into the bin of its sign, its exponent and the first 8 bits of its mantissa (0.4 % wide); a "
    "quantile is the upper edge of the bin in which it lies, or the largest number where that is less; 0 stays 0. "
    "Means are sums over blocks of 1,024 samples by index, the blocks in order. What a sample does not measure is not "
    "counted.",
    "Memory does not grow with the samples, and no sum depends on who calculated which sample.",
)
CUT_BITS = 52 - 8
"""Bits of the mantissa that a bin leaves out."""
BLOCK_SAMPLES = 1_024
"""Samples of a block."""
SMALLEST_NORMAL = 2.0**-1022
"""Smaller amounts count as 0."""


def bin_of(value: float) -> int:
    """The bin of a number: its highest 20 bits."""
    if abs(value) < SMALLEST_NORMAL:
        return 0
    bits: int = struct.unpack(">Q", struct.pack(">d", value))[0]
    return bits >> CUT_BITS


def upper_edge(number: int) -> float:
    """The highest number that a bin stands for."""
    if not number:
        return 0.0
    negative = number >> (63 - CUT_BITS)
    edge: float = struct.unpack(">d", struct.pack(">Q", (number if negative else number + 1) << CUT_BITS))[0]
    return edge


@dataclass(slots=True)
class Distribution:
    """One metric of one loop over all samples so far."""

    bins: dict[int, int] = field(default_factory=dict)
    count: int = 0
    low: float = 0.0
    high: float = 0.0
    total: float = 0.0
    """Of whole blocks."""
    block_total: float = 0.0
    """Of the block that is not complete."""

    def add_number(self, value: float) -> None:
        """The next sample's number."""
        bin_number = bin_of(value)
        self.bins[bin_number] = self.bins.get(bin_number, 0) + 1
        self.low = min(self.low, value) if self.count else value
        self.high = max(self.high, value) if self.count else value
        self.count += 1
        self.block_total += value

    def end_block(self) -> None:
        """The block is complete."""
        self.total, self.block_total = self.total + self.block_total, 0.0

    def append_block(self, other: Distribution) -> None:
        """The numbers of the next block; this one has whole blocks alone."""
        for bin_number, number in other.bins.items():
            self.bins[bin_number] = self.bins.get(bin_number, 0) + number
        if other.count:
            self.low = min(self.low, other.low) if self.count else other.low
            self.high = max(self.high, other.high) if self.count else other.high
        self.count += other.count
        self.total += other.total
        self.block_total = other.block_total

    @property
    def mean(self) -> float:
        """Of what was measured; there must be something."""
        return (self.total + self.block_total) / self.count

    def quantile(self, share: float) -> float:
        """What so large a share does not exceed, as the upper edge of its bin."""
        rank, count = max(1, ceil(share * self.count)), 0
        for edge, number in sorted((upper_edge(place), number) for place, number in self.bins.items()):
            count += number
            if count >= rank:
                return edge
        raise ValueError("nothing was measured")

    def to_json(self) -> dict[str, Any]:
        """As JSON, from which `of_json` makes the same again."""
        return {
            "bins": {str(place): number for place, number in sorted(self.bins.items())},
            "numbers": [self.count, self.low, self.high, self.total, self.block_total],
        }

    @classmethod
    def of_json(cls, state: dict[str, Any]) -> Distribution:
        """What `to_json` has given."""
        return cls({int(place): int(number) for place, number in state["bins"].items()}, *state["numbers"])


# ----------------------------------------------------------------------------------------------------------------------
# What a batch has found so far: counts, distributions and the worst samples, added up in the order of the samples.

Sizes = tuple[int, int, int, int]
"""How many expectations, standing ones, loops and uncertainties are counted."""
MAX_WORST_SAMPLES = 100
"""Worst samples that are kept."""
MAX_REASONS = 5
"""Samples that could not run whose reasons are told."""


@dataclass(slots=True)
class NearLimit:
    """A sample that came near a limit, or beyond it."""

    sample: int
    margin: float
    """(limit − value) / |limit|, the smallest of all expectations; infinite where nothing has a number."""
    expectation: int
    """Which of them; −1: a standing one, or the sample could not run."""
    numbers: list[float]


@dataclass(slots=True)
class Tally:
    """Everything that is known after so many samples; its state is what `--resume` keeps."""

    first: int = 0
    """The number of its first sample: 0, or that of a block which another one counts."""
    samples: int = 0
    passed: int = 0
    """Samples in which everything holds."""
    failed_to_run: int = 0
    held: list[int] = field(default_factory=list)
    """Of each expectation, in how many samples."""
    standing_failed: list[int] = field(default_factory=list)
    """Of each standing expectation: samples that fail it, or do not prove it; those alone; and where it was judged."""
    standing_unproven: list[int] = field(default_factory=list)
    standing_judged: list[int] = field(default_factory=list)
    metrics: list[list[Distribution]] = field(default_factory=list)
    """Of each loop each metric."""
    lowest: list[list[int]] = field(default_factory=list)
    """Of each uncertainty: samples in its lowest fifth, and how many of these passed; likewise ``highest``."""
    highest: list[list[int]] = field(default_factory=list)
    worst: list[NearLimit] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)

    @classmethod
    def empty(cls, sizes: Sizes, first: int = 0) -> Tally:
        """Before the first sample."""
        expectations, standing, loops, varies = sizes
        return cls(
            first,
            held=[0] * expectations,
            standing_failed=[0] * standing,
            standing_unproven=[0] * standing,
            standing_judged=[0] * standing,
            metrics=[[Distribution() for _ in METRICS] for _ in range(loops)],
            lowest=[[0, 0] for _ in range(varies)],
            highest=[[0, 0] for _ in range(varies)],
        )

    def add_result(self, result: SampleResult, varies: Sequence[Uncertainty]) -> None:
        """The next sample."""
        if result.sample != self.end:
            raise ValueError(f"sample {result.sample} comes after {self.end} samples")
        self.samples += 1
        self.passed += result.passed
        if result.reason:
            self.failed_to_run += 1
            if len(self.reasons) < MAX_REASONS:
                self.reasons.append(f"sample {result.sample}: {result.reason}")
        else:
            self._count_verdicts(result)
        self._compare_numbers(result, varies)
        self._keep_worst(result)
        if self.end % BLOCK_SAMPLES == 0:
            for distributions in self.metrics:
                for distribution in distributions:
                    distribution.end_block()

    @property
    def end(self) -> int:
        """The number of the next sample."""
        return self.first + self.samples

    def append_block(self, block: Tally) -> None:
        """The next samples as others have counted them, from the beginning of a block to its end at most."""
        if block.first != self.end or block.first % BLOCK_SAMPLES or block.samples > BLOCK_SAMPLES:
            raise ValueError(f"{block.samples} samples from {block.first} come after {self.end} samples")
        self.samples += block.samples
        self.passed += block.passed
        self.failed_to_run += block.failed_to_run
        self.held = _add_counts(self.held, block.held)
        self.standing_failed = _add_counts(self.standing_failed, block.standing_failed)
        self.standing_unproven = _add_counts(self.standing_unproven, block.standing_unproven)
        self.standing_judged = _add_counts(self.standing_judged, block.standing_judged)
        self.lowest = [_add_counts(*pair) for pair in zip(self.lowest, block.lowest, strict=True)]
        self.highest = [_add_counts(*pair) for pair in zip(self.highest, block.highest, strict=True)]
        for row, of_block in zip(self.metrics, block.metrics, strict=True):
            for distribution, other in zip(row, of_block, strict=True):
                distribution.append_block(other)
        self.reasons = [*self.reasons, *block.reasons][:MAX_REASONS]
        self.worst = sorted([*self.worst, *block.worst], key=_worst_key)[:MAX_WORST_SAMPLES]

    def _count_verdicts(self, result: SampleResult) -> None:
        """Verdicts and metrics of a sample that ran."""
        for i, held in enumerate(result.held):
            self.held[i] += held
        for i, sign in enumerate(result.standing):
            self.standing_failed[i] += sign in "-!"
            self.standing_unproven[i] += sign == "!"
            self.standing_judged[i] += sign != "?"
        for loop, values in zip(self.metrics, result.metrics, strict=True):
            for distribution, value in zip(loop, values, strict=True):
                if value is not None and isfinite(value):
                    distribution.add_number(value)

    def _compare_numbers(self, result: SampleResult, varies: Sequence[Uncertainty]) -> None:
        """In which fifth each number lies, and whether the sample passed."""
        for i, (uncertainty, number) in enumerate(zip(varies, result.numbers, strict=False)):
            low, high = fifth_bounds(uncertainty.spread)
            for counts in [self.lowest[i]] * (number < low) + [self.highest[i]] * (number >= high):
                counts[0] += 1
                counts[1] += result.passed

    def _keep_worst(self, result: SampleResult) -> None:
        """The worst so far; of two alike the earlier one is worse."""
        self.worst.append(NearLimit(result.sample, result.margin, result.tightest, list(result.numbers)))
        self.worst.sort(key=_worst_key)
        del self.worst[MAX_WORST_SAMPLES:]

    def to_json(self) -> dict[str, Any]:
        """As JSON, from which `of_json` makes the same again."""
        state = asdict(self)
        state["metrics"] = [[d.to_json() for d in loop] for loop in self.metrics]
        state["worst"] = [[w.sample, _margin_text(w.margin), w.expectation, w.numbers] for w in self.worst]
        return state

    @classmethod
    def of_json(cls, state: dict[str, Any]) -> Tally:
        """What `to_json` has given."""
        tally = cls(**state)
        tally.metrics = [[Distribution.of_json(d) for d in loop] for loop in state["metrics"]]
        tally.worst = [NearLimit(sample, float(margin), i, numbers) for sample, margin, i, numbers in state["worst"]]
        return tally


def _worst_key(sample: NearLimit) -> tuple[float, int]:
    """The least is the worst."""
    return sample.margin, sample.sample


def _add_counts(ours: Sequence[int], others: Sequence[int]) -> list[int]:
    return [a + b for a, b in zip(ours, others, strict=True)]


def _margin_text(margin: float) -> str:
    """A margin as JSON can hold it."""
    return repr(margin) if isfinite(margin) else "inf" if margin == inf else "-inf"


def json_of(state: dict[str, Any]) -> str:
    """A state as text: the same state, the same text."""
    return json.dumps(state, sort_keys=True, separators=(",", ":"), allow_nan=False)


# --- What `--resume` keeps: how far a batch has come, with a key that says of what ------------------------------------

D803 = Decision(
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
STATE_FORMAT = 2
DAMAGED_TEXT = "it is damaged, or no file of --resume"


class StateError(ValueError):
    """A state that cannot be continued, and why."""


@dataclass(slots=True)
class Progress:
    """How far a batch has come."""

    tally: Tally
    trial: Trial = field(default_factory=Trial)
    early_blocks: dict[int, Tally] = field(default_factory=dict)
    """Blocks that are ready before an earlier one, by the number of their first sample."""


def key_of(job: Job) -> str:
    """A hash of everything that a result depends on."""
    parts = (
        *(STATE_FORMAT, job.scenario, job.config.hex(), job.seed, hash_sources()),
        *(sys.version, platform.machine(), platform.system()),
    )
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def state_text(progress: Progress, key: str) -> bytes:
    """A state as the file has it, with a checksum."""
    body = json_of(
        {
            "key": key,
            "tally": progress.tally.to_json(),
            "trial": [progress.trial.samples, progress.trial.digest],
            "ahead": [block.to_json() for _, block in sorted(progress.early_blocks.items())],
        }
    )
    return f"{hashlib.sha256(body.encode()).hexdigest()}\n{body}\n".encode()


def read_state(data: bytes, key: str, job: Job, samples: int) -> Progress:
    """What a state holds; raises `StateError`."""
    try:
        state = _read_document(data, key)
        tally = Tally.of_json(state["tally"])
        blocks = {block.first: block for block in map(Tally.of_json, state["ahead"]) if block.samples == BLOCK_SAMPLES}
        count, digest = int(state["trial"][0]), state["trial"][1]
        too_many = tally.samples > samples
    except StateError:
        raise
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError):
        raise StateError(DAMAGED_TEXT) from None
    if too_many:
        raise StateError(f"it has {tally.samples} samples already, more than {samples}")
    trial = Trial()
    trial.run_samples(job, count)
    if trial.digest != digest:
        raise StateError("its first samples come out otherwise here: this machine does not calculate alike")
    return Progress(tally, trial, blocks)


def _read_document(data: bytes, key: str) -> Any:
    """The document of a state whose checksum and key are right."""
    try:
        checksum, _, rest = data.decode().partition("\n")
    except UnicodeDecodeError:
        raise StateError("it is no file of --resume") from None
    body = rest.removesuffix("\n")
    if hashlib.sha256(body.encode()).hexdigest() != checksum:
        raise StateError(DAMAGED_TEXT)
    state = json.loads(body)
    if state["key"] != key:
        raise StateError("it belongs to another scenario, configuration, seed or program")
    return state
