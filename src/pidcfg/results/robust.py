"""Gains by the method robust: for a loop of a file, for a PLC, or as real numbers; and what holds on which plants."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.tuned import LoopTuning
from pidcfg.results.arguments import ArgumentError
from pidcfg.results.processes import model_of, process_of, refuse_missing
from pidcfg.tuning.judgement import finite
from pidcfg.tuning.robust import Robust, robust
from pidcfg.tuning.sampled import Sampling, default_sample_time
from pidcfg.tuning.search import Search
from pidcfg.tuning.uncertainty import Spread, plants_of, read_spreads, spread_of

if TYPE_CHECKING:
    from pidcfg.limits import Limits
    from pidcfg.results.confirm import Confirmation
    from pidcfg.results.findings import Data
    from pidcfg.results.processes import Known, Robustness
    from pidcfg.results.targets import Target
    from pidcfg.tuning.identify import Identified
    from pidcfg.tuning.methods import Method
    from pidcfg.tuning.rules import Form, Model, Process
    from pidcfg.vendors import Vendor

WIDE = (0.0, 100.0)
"""The range of a PV in % of its span."""


@dataclass(frozen=True, slots=True)
class RobustGains:
    """What holds on which plants."""

    found: Robust
    sampling: Sampling
    assumed: tuple[str, ...]
    """What nobody said."""
    confirmed: Confirmation | None = None
    """What `certify` says; None: it was not asked, or cannot run this."""
    negative: bool = False
    """Whether the process's gain is; those of the plants are amounts."""

    @property
    def worst(self) -> Process:
        """The plant with the largest Ms."""
        return self.found.search.plants[self.found.result.worst_ms]

    @property
    def slowest(self) -> Process:
        """The plant with the largest IAE."""
        return self.found.search.plants[self.found.result.worst_error]

    def to_json(self) -> Data:
        """Of the result's JSON, under ``robust``."""
        found, sampling = self.found, self.sampling
        result, real = found.result, found.real
        margins = found.search.margins(result.gains, result.worst_ms)
        return {
            "ms_limit": found.limit,
            "plants": found.plants,
            "varies": {s.name: {"low": s.low, "high": s.high} for s in found.spreads},
            "sample_time": sampling.sample_time,
            "pv_share": sampling.pv_share,
            "worst_ms": result.ms,
            "worst_ms_plant": numbers_of(self.worst),
            "gain_margin": finite(margins.gain_margin),
            "phase_margin": finite(margins.phase_margin),
            "worst_iae": result.error,
            "worst_iae_plant": numbers_of(self.slowest),
            "every_word": found.every_word if found.words else None,
            "real": {**asdict(real.gains), "worst_iae": real.error, "worst_ms": real.ms},
            "cost_percent": round(found.cost_percent, 4),
            "assumed": list(self.assumed),
            "certified": None if self.confirmed is None else self.confirmed.to_json(),
        }


def numbers_of(process: Process) -> dict[str, float]:
    """The numbers of a plant that it has."""
    keys = ("gain", "time_constant", "second_time_constant", "dead_time")
    own = [key for key in keys if getattr(process, key) and not (process.integrating and key == "time_constant")]
    names = {"second_time_constant": "time_constant_2"}
    return {names.get(key, key): getattr(process, key) for key in own}


@dataclass(frozen=True, slots=True)
class Searched:
    """The gains that were found, and where they go."""

    form: Form
    model: Model
    process: Process
    """As given, with the sample time of the loop."""
    robust: RobustGains
    loop: LoopTuning | None
    target: Target


def searched(
    method: Method,
    form: Form | None,
    known: Known,
    fit: Identified | None,
    target: Target,
    limits: Limits,
) -> Searched:
    """The gains that robust finds; raises `ArgumentError` and `TuningError` as the rules do."""
    wish = known.wish
    if wish is None:
        raise AssertionError("robust says what it wants")
    if known.transfer is not None:
        raise ArgumentError("robust needs the numbers of the process, not `transfer`", "transfer")
    chosen: Form = form or "PI"
    if chosen not in method.forms:
        raise ArgumentError(f"{method.name} has no rule for {form}; it has {' and '.join(method.forms)}")
    model = model_of(method, known)
    refuse_missing(method, {key: v for key, v in known.numbers.items() if key != "sample_time"}, model)
    process = replace(process_of(known.numbers, model), sample_time=0.0)
    negative = known.numbers["gain"] < 0
    spreads = spreads_of(wish, process, fit, negative=negative)
    vendor, loop, target, assumed = _loop(target, limits)
    sampling, more = _sampling(known, process, loop, target)
    _refuse_too_fast(sampling, process)
    search = Search(plants_of(process, spreads), sampling, wish.ms, derivative=chosen == "PID")
    found = robust(chosen, search, loop, None if vendor is None else vendor.model, spreads)
    confirmation = None
    if wish.samples:
        from pidcfg.results.confirm import confirmed

        confirmation = confirmed(found, process, vendor, loop, wish.samples, limits)
    gains = RobustGains(found, sampling, (*assumed, *more), confirmation, negative)
    return Searched(chosen, model, replace(process, sample_time=sampling.sample_time), gains, loop, target)


def spreads_of(wish: Robustness, process: Process, fit: Identified | None, *, negative: bool) -> list[Spread]:
    """What varies: as it is said, and of an identified process all else within its confidence."""
    told = [] if wish.vary is None else read_spreads(wish.vary, process, negative=negative)
    if fit is None:
        return told
    names = {spread.name for spread in told}
    out = list(told)
    for name, sure in zip(("gain", "time_constant", "dead_time"), fit.confidence, strict=True):
        middle = getattr(process, name)
        if name in names or not sure or (name == "time_constant" and process.integrating):
            continue
        low = middle - sure if middle > sure else middle * LEAST_SHARE
        out.append(spread_of(name, low, middle + sure, process))
    return out


MOST_IN_DEAD_TIME = 1000
"""Samples: a run of more would not come to rest within the samples that are looked at."""


def _refuse_too_fast(sampling: Sampling, process: Process) -> None:
    """Raises `ArgumentError` for a loop that samples the dead time so often that the search would not end."""
    samples = process.dead_time / sampling.sample_time
    if samples > MOST_IN_DEAD_TIME * (1 + LEAST_SHARE):
        raise ArgumentError(
            f"`sample_time` {sampling.sample_time:g} s divides the dead time {process.dead_time:g} s by "
            f"{samples:,.0f}; robust searches up to {MOST_IN_DEAD_TIME:,}: let the loop sample every "
            f"{process.dead_time / MOST_IN_DEAD_TIME:.3g} s or slower, which costs next to nothing",
            "sample_time",
        )


LEAST_SHARE = 0.01
"""Of a number that its confidence does not tell from 0."""


def _loop(target: Target, limits: Limits) -> tuple[Vendor | None, LoopTuning | None, Target, tuple[str, ...]]:
    """The loop that is to hold the gains, and what is assumed of it."""
    if target.into is not None:
        from pidcfg.results.retune import loop_tuning

        target.refuse_ranges()
        return *loop_tuning(target, target.into, limits), target, ()
    assumed: tuple[str, ...] = ()
    if target.vendor is None:
        return None, None, target, assumed
    vendor = target.vendor
    words = vendor.load("tuned")
    if target.pv_range is None and words.gain_unit == "span":
        assumed = ("the gain is in % of the PV's span per % of the output; --pv-range says another",)
        target = replace(target, pv_range=WIDE, output_range=target.output_range or WIDE)
    target.refuse_ranges()
    spans = [
        Decimal(str(high)) - Decimal(str(low)) for low, high in (target.pv_range or (0, 1), target.output_range or WIDE)
    ]
    return vendor, LoopTuning(words, pv_span=spans[0], output_span=spans[1]), target, assumed


def _sampling(
    known: Known, process: Process, loop: LoopTuning | None, target: Target
) -> tuple[Sampling, tuple[str, ...]]:
    """How the loop samples and filters, and what is assumed of it."""
    told = known.numbers.get("sample_time")
    if loop is not None and loop.sample_time is not None:
        if told is not None and abs(told - loop.sample_time) > LEAST_SHARE * told:
            name = "" if target.into is None else f"{target.into.name}: "
            message = (
                f"`sample_time` is {told:g} s, and {name}the loop samples every {loop.sample_time:g} s: leave it out"
            )
            raise ArgumentError(message, "sample_time")
        shares = (loop.pv_share, loop.derivative_share, loop.derivative_limit)
        return Sampling(loop.sample_time, *shares), ()
    if told is not None:
        return Sampling(told), ()
    seconds = default_sample_time(process)
    return Sampling(seconds), (f"the loop samples every {seconds:g} s; --sample-time says another",)
