"""What a person turns at a loop, and values put into a file: the results of `pidcfg.gains` and `pidcfg.change`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from decimal import Decimal
from math import inf, isfinite
from typing import TYPE_CHECKING, Any, Literal

from pidcfg.encoders.codecs import EncodeError
from pidcfg.encoders.contract import encoder_of
from pidcfg.encoders.regmap import LoopTuning
from pidcfg.output.arguments import ArgumentError
from pidcfg.output.findings import errors_in, findings_data, short_repr
from pidcfg.output.retune import format_like
from pidcfg.schemas.base import number_of
from pidcfg.schemas.numbers import decimal_text
from pidcfg.schemas.scenario import Plant, Scenario
from pidcfg.sim.controllers.plc import Axes, axes_of
from pidcfg.study.scenario import LoadedScenario, load_scenario
from pidcfg.text.diagnostics import Diagnostic
from pidcfg.text.document import Document
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Data, Path, dotted_text, has_key, parse_path, value_at
from pidcfg.text.reader import Reader
from pidcfg.text.references import Decision
from pidcfg.text.source import read_document
from pidcfg.tuning.margins import Margins, margins
from pidcfg.tuning.robust import gain_factor
from pidcfg.tuning.rules import Gains, is_usable
from pidcfg.tuning.transfer import Transfer
from pidcfg.validate.engine import Checked, check_document, is_scenario
from pidcfg.validate.fixes import PlacingError, replace_values

if TYPE_CHECKING:
    from pydantic import BaseModel

# --- The three numbers of each loop as the PLC holds them, and how robust they are ------------------------------------

Part = Literal["gain", "integral", "derivative"]
PARTS: tuple[Part, Part, Part] = ("gain", "integral", "derivative")
D1000 = Decision(
    1000,
    "Ms of a loop of a scenario",
    "The margins are those of the continuous loop (D708) with the numbers that the registers hold and the plant that "
    "reads the loop's output and gives its PV as it is, with half the sample time as dead time. A plant that reads "
    "anything else, another loop's PV among it, a valve, and a plant that swings have none.",
    "What a filter, a dead band or a limit does is seen in the run, and nothing else has one number for it.",
)


@frozen
class HeldNumber:
    """One of the three numbers of a loop: where it stands, and what its register holds."""

    part: Part
    path: str
    """Where it stands in the file, for `pidcfg.change`: ``loops.1.tuning.gain``."""
    key: str
    """Its key in the loop: ``tuning.gain``."""
    unit: str
    text: str | None
    """As it is written; None: it is not."""
    value: Decimal | None
    """As the register holds it; None: an expression decides."""
    low: Decimal | None
    high: Decimal | None
    """What the manual allows, in ``unit``; None: no limit."""
    step: Decimal | None
    """What two neighbours differ by; None: a number in floating point."""
    loop: LoopTuning = field(repr=False)

    def hold(self, value: Decimal | float) -> Decimal:
        """What the register holds of a number, which is brought within its limits first; raises `ArgumentError`."""
        try:
            number = Decimal(str(value))
            number = number if self.low is None else max(number, self.low)
            number = number if self.high is None else min(number, self.high)
            if self.step is not None and 0 < number < self.step:  # half a step and less would switch it off
                number = self.step if number >= self.step / 2 else Decimal(0)
            return self.loop.words.stored_value(self._name, number)
        except (EncodeError, ArithmeticError) as error:
            raise ArgumentError(f"`value`: {value} {error}", "value") from None

    def written(self, value: Decimal) -> str:
        """How the file says a number that the register holds, in the unit that stands there; 0 is switched off."""
        if not value and self.part != "gain":
            return self.loop.off_texts[0 if self.part == "integral" else 1]
        return format_like(self.text, value, self.unit, self.hold)

    @property
    def _name(self) -> str:
        return self.loop.words.names[PARTS.index(self.part)]

    def to_json(self) -> Data:
        """Its place and its numbers."""
        numbers = {key: getattr(self, key) for key in ("value", "low", "high", "step")}
        floats = {key: None if number is None else float(number) for key, number in numbers.items()}
        return {"part": self.part, "path": self.path, "key": self.key, "unit": self.unit, "text": self.text, **floats}


@frozen
class LoopGains:
    """The three numbers of a loop, and its margins with its plant."""

    loop: str
    numbers: tuple[HeldNumber, ...]
    """None: it switches on and off."""
    margins: Margins | None = None
    """Ms, gain margin and phase margin of a scenario's loop (D1000)."""
    why: str = ""
    """Why there are none: the file is a configuration, no plant of one number, an unstable loop."""

    def to_json(self) -> Data:
        """The numbers and the margins; an infinite one is None."""
        margins = self.margins
        values = None if margins is None else [margins.ms, margins.gain_margin, margins.phase_margin]
        names = ("ms", "gain_margin", "phase_margin")
        finite_values = values and {k: v if isfinite(v) else None for k, v in zip(names, values, strict=True)}
        return {
            "loop": self.loop,
            "numbers": [number.to_json() for number in self.numbers],
            "margins": finite_values,
            "why": self.why,
        }


@frozen
class GainsResult:
    """What can be tuned at each loop of a file."""

    __repr__ = short_repr

    document: Document
    findings: tuple[Diagnostic, ...]
    """Of the configuration, or why the scenario cannot run."""
    loops: tuple[LoopGains, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether there is no error."""
        return not errors_in(self.findings)

    def to_json(self) -> Data:
        """The loops and the findings."""
        return {**findings_data(self.findings), "loops": [loop.to_json() for loop in self.loops]}


def gains_of(document: Document, reader: Reader) -> GainsResult:
    """The numbers of each loop of a configuration, or of the one that a scenario runs, with margins then."""
    if not is_scenario(document):
        checked = check_document(document)
        return GainsResult(document, checked.findings, _loops_gains(checked))
    loaded = load_scenario(document, reader)
    if loaded.checked is None:
        return GainsResult(document, tuple(loaded.findings))
    loops = _loops_gains(loaded.checked, loaded)
    return GainsResult(document, (*loaded.findings, *loaded.config_errors), loops)


def _loops_gains(checked: Checked, loaded: LoadedScenario | None = None) -> tuple[LoopGains, ...]:
    if checked.vendor is None or checked.config is None:
        return ()
    axes: Mapping[str, Axes] = {}
    if loaded is not None and loaded.image is not None:
        axes = axes_of(loaded.new_plc(), loaded.image.settings)
    config: Any = checked.config
    model = checked.vendor.model
    loops = []
    for i, loop in enumerate(config.loops):
        tuning = encoder_of(checked.vendor).tuning_of(config, loop)
        numbers = (
            ()
            if tuning.current_values == (None, None, None) and tuning.obstacle
            else _held_numbers(checked.document, model, i, tuning)
        )
        loop_margins: Margins | None = None
        why = "" if loaded is None or loaded.scenario is None else tuning.obstacle
        if not why and loaded is not None and loaded.scenario is not None:
            loop_margins, why = _loop_margins(tuning, loaded.scenario, axes.get(loop.name), loop.name)
        loops.append(LoopGains(loop.name, numbers, loop_margins, why))
    return tuple(loops)


def _held_numbers(document: Document, model: type[BaseModel], i: int, tuning: LoopTuning) -> tuple[HeldNumber, ...]:
    """The three numbers of a loop."""
    numbers = []
    for part, name, unit, current in zip(PARTS, tuning.words.names, tuning.units(), tuning.current_values, strict=True):
        key, limits = tuning.words.key(name), tuning.words.limits(model, name)
        path = ("loops", i, *parse_path(key))
        text = value_at(document.data, path)
        ends = (None, None) if limits is None else (limits.low, limits.high)
        low, high = (None if end is None else number_of(end) for end in ends)
        step, written = tuning.words.step(name), None if text is None else str(text)
        numbers.append(HeldNumber(part, dotted_text(path), key, unit, written, current, low, high, step, tuning))
    return tuple(numbers)


def held_gains(tuning: LoopTuning) -> Gains | None:
    """The numbers of a loop in output units per PV unit and seconds; None: not known, or no gain."""
    if None in tuning.current_values:
        return None
    gain, integral, derivative = (float(number or 0) for number in tuning.current_values)
    try:
        gain /= gain_factor(tuning)
    except (ValueError, ZeroDivisionError):
        return None
    if not is_usable(gain):
        return None
    if tuning.independent:
        return Gains(gain, gain / integral if integral else inf, derivative / gain)
    return Gains(gain, integral * (60 if tuning.minutes else 1) or inf, derivative)


def _loop_margins(tuning: LoopTuning, scenario: Scenario, axes: Axes | None, loop: str) -> tuple[Margins | None, str]:
    """The margins of a loop with its plant, or why there are none."""
    gains = held_gains(tuning)
    if gains is None or axes is None:
        return None, "its gain is not known"
    name = scenario.connect.get(axes.pv, loop)
    plant = next((p for key, p in scenario.plants.items() if name in {str(key), p.name}), None)
    if plant is None:
        return None, "its PV is no plant's alone"
    if plant.input is not None and plant.input.strip() != axes.output:
        return None, f"its plant reads {plant.input}, not {axes.output} alone"
    transfer = _plant_transfer(plant)
    if transfer is None:
        return None, f"a plant of the model {plant.model} with these numbers has no margins here"
    transfer = replace(transfer, dead_time=transfer.dead_time + (tuning.sample_time or axes.sample_time) / 2)
    loop_margins = margins(gains, transfer)
    return loop_margins, "" if loop_margins is not None else "the loop is unstable by the continuous model"


def _plant_transfer(plant: Plant) -> Transfer | None:
    """A plant of lags, or an integrator; None: another one."""
    gain, dead_time = float(plant.gain), float(plant.dead_time)
    if not is_usable(gain):
        return None
    lag = float(plant.time_constant or 0)
    if plant.model == "first_order" and lag:
        return Transfer(gain, (), (lag,), 0, dead_time)
    if plant.model == "second_order" and plant.time_constants is not None:
        return Transfer(gain, (), tuple(float(time) for time in plant.time_constants), 0, dead_time)
    if plant.model == "integrator":
        return Transfer(gain, (), (), 1, dead_time)
    return None


# --- Other values in a file -------------------------------------------------------------------------------------------


@frozen
class ChangeResult:
    """A file with other values at some places; every other byte is as it was."""

    __repr__ = short_repr

    document: Document
    """The file as it is now, for other calls."""
    text: str
    findings: tuple[Diagnostic, ...] = ()
    """Of the text alone; `pidcfg.check` judges it."""

    @property
    def ok(self) -> bool:
        """Whether the text can be read."""
        return not errors_in(self.findings)

    def to_json(self) -> Data:
        """The text."""
        return {"version": 1, "file": self.document.file, "text": self.text}


def change_document(document: Document, values: Mapping[Any, object]) -> ChangeResult:
    """A file with other texts at some paths; raises `ArgumentError` for a place that cannot have one."""
    if document.data is None:
        raise ArgumentError(f"`source`: {document.file} cannot be read: {document.problems[0].message}", "source")
    texts, predecessors = {}, {}
    for name, value in values.items():
        if not isinstance(name, str) or not name:
            raise ArgumentError(f"`values`: {name!r} is no path; write it like loops.0.name", "values")
        path = parse_path(name)
        texts[path] = value if isinstance(value, str) else _number_text(name, value)
        if not has_key(document.data, path):
            predecessors[path] = _last_sibling_key(document, path, name)
    if not texts:
        return ChangeResult(document, document.text, document.problems)
    try:
        data = replace_values(document.text.encode(), document, texts, predecessors)
    except (PlacingError, KeyError) as error:
        raise ArgumentError(f"`values`: {error} ({document.file}); change it by hand", "values") from None
    new = read_document(data, document.file, document.limits)
    return ChangeResult(new, new.text, new.problems)


def _number_text(name: str, value: object) -> str:
    """A number as a file writes it."""
    if isinstance(value, bool) or not isinstance(value, int | float | Decimal) or not isfinite(value):
        raise ArgumentError(f"`values`: {name} is {value!r}; write a text or a number", "values")
    return decimal_text(Decimal(str(value)))


def _last_sibling_key(document: Document, path: Path, name: str) -> Path:
    """The key of the file that a missing one goes behind: the last one beside it."""
    mapping = value_at(document.data, path[:-1])
    if not isinstance(mapping, dict) or not mapping:
        raise ArgumentError(
            f"`values`: {document.file} has no {name}, and nothing that it could stand beside", "values"
        )
    return (*path[:-1], list(mapping)[-1])
