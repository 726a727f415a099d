"""What stands behind the sliders of a what-if page: values are turned, snapped to the PLC's words, and run.

It makes public calls alone. The page calls it in the browser, in a worker; texts go in, and plain data come out.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterator, Mapping
from decimal import Decimal
from math import isfinite, log10
from typing import TYPE_CHECKING, Any

import pidcfg

if TYPE_CHECKING:
    from pidcfg.output.handles import HeldNumber
    from pidcfg.output.runs import SimulateResult
    from pidcfg.output.words import EncodeResult
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Data

Progress = Callable[[float], None]

POSITIONS_PER_DECADE, REACH_FACTOR = 60, 10.0
"""Positions of a slider a decade, and how far it reaches: from a tenth of the filed value to ten times of it."""
RANGE_POSITIONS = 100
"""Positions of a slider over the range of a PV, or around a load."""
PLANT_PERCENT = tuple(range(70, 131))
"""Of what the file says of a plant, in %."""
NUMBER_LABELS = {"gain": "Gain", "integral": "Reset (integral)", "derivative": "Rate (derivative)"}
PLANT_LABELS = {"gain": "gain", "time": "time constant", "dead": "dead time"}
TIME_KEYS = ("time_constant", "time_constants", "lead", "lag")
NUMBER_PATTERN = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)(.*)", re.DOTALL)
"""A number, and the unit behind it."""


class UnusableError(ValueError):
    """Files that make no page: what is wrong with them, in a line."""


def refuse_errors(result: SimulateResult) -> None:
    """Raises `UnusableError` for a run that could not be made."""
    if result.report is None:
        errors = [d for d in result.findings if d.severity.label == "error"] or list(result.findings)
        first = errors[0]
        raise UnusableError(f"{first.file}:{first.span.line}:{first.span.column}: {first.message} ({first.code})")


NO_SCENARIO_TEXT = "the file is no scenario; 'pidcfg init --scenario' writes one for a configuration"


class Session:
    """One scenario as filed, and as it is with other values."""

    def __init__(
        self, scenario: str, files: Mapping[str, str], other_config: str | None = None, progress: Progress | None = None
    ) -> None:
        """``files`` by their names, ``scenario`` and ``other_config`` (another configuration) among them.

        Raises `UnusableError` where nothing can run.
        """
        self.name, self.files, self.other_config = scenario, dict(files), other_config
        loaded: Any = pidcfg.load(self.files[scenario], name=scenario)
        if loaded.model is None or loaded.kind != "scenario":
            finding = next(iter(loaded.findings), None) if loaded.kind in {"scenario", None} else None
            raise UnusableError(f"{scenario}: {finding.message if finding else NO_SCENARIO_TEXT}")
        self.model: Any = loaded.model
        self.scenario = loaded.document
        self.config = posixpath.normpath(posixpath.join(posixpath.dirname(scenario), self.model.config))
        if not self.config.lower().endswith((".yaml", ".yml")):
            raise UnusableError(f"{self.config} is a memory listing; decode it first, a page turns a configuration")
        if self.config not in self.files:
            refuse_errors(pidcfg.simulate(self.scenario, files=self.files))
        self.filed_doc = pidcfg.load(self.files[self.config], name=self.config).document
        current_run = self._simulate(self.scenario, self.filed_doc.text, progress)
        refuse_errors(current_run)
        self.before = current_run
        if other_config is not None:
            self.before = pidcfg.simulate(
                self.scenario, record=True, reference=False, engine="python", files=self._files_of(other_config)
            )
            refuse_errors(self.before)
        self.gains = pidcfg.gains(self.scenario, files=self.files)
        self.numbers = {number.path: number for loop in self.gains.loops for number in loop.numbers}
        self.lock_reasons = {loop.loop: self._lock_reason(loop.numbers) for loop in self.gains.loops}
        self.words = pidcfg.encode(
            self.filed_doc if other_config is None else self.files[other_config], allow_errors=True
        )
        self.current: tuple[SimulateResult, Document, Document] = (current_run, self.filed_doc, self.scenario)

    # --- what can be turned ------------------------------------------------------------------------------------------

    def describe(self) -> Data:
        """Everything that the page shows before the first move."""
        knobs = [*self._number_knobs(), *self._event_knobs(), *self._plant_knobs()]
        return {
            "title": self.model.scenario,
            "scenario": self.name,
            "config": self.config,
            "sides": [self.other_config or "as filed", self.config if self.other_config else "now"],
            "first": self._first_loop(),
            "loops": [
                {
                    "name": loop.loop,
                    "numbers": bool(loop.numbers),
                    "locked": self.lock_reasons[loop.loop],
                }
                for loop in self.gains.loops
            ],
            "knobs": knobs,
        }

    def _first_loop(self) -> str:
        """The loop that the page begins with: the one that something happens to, or that something is expected of."""
        loops = [loop.loop for loop in self.gains.loops]
        names = [event.loop for event in self.model.events] + [one.loop for one in self.model.expect]
        return next((str(name) for name in names if name in loops), loops[0])

    def _lock_reason(self, numbers: tuple[HeldNumber, ...]) -> str:
        """Why the numbers of a loop cannot be turned; empty: they can."""
        if not numbers:
            return "It switches on and off, and has no gains."
        if all(number.value is None for number in numbers):
            return "Expressions of the program give its gains."
        try:
            pidcfg.change(
                self.filed_doc,
                {
                    number.path: number.written(number.hold(number.value * 2 or 1))
                    for number in numbers
                    if number.value is not None
                },
            )
        except ValueError:
            return f"It shares its numbers with other loops, by a template or an anchor: change them in {self.config}."
        return ""

    def _number_knobs(self) -> Iterator[Data]:
        for loop in self.gains.loops:
            if self.lock_reasons[loop.loop]:
                continue
            for number in loop.numbers:
                if number.value is None:
                    continue
                yield {
                    "id": f"number:{number.path}",
                    "loop": loop.loop,
                    "group": "number",
                    "label": NUMBER_LABELS[number.part],
                    "key": number.key,
                    "unit": number.unit,
                    "value": float(number.value),
                    "positions": knob_positions(number),
                    "step": None if number.step is None else float(number.step),
                }

    def _event_knobs(self) -> Iterator[Data]:
        """Numbers that events set: set points, and loads of plants."""
        ranges = {loop: axes.pv_range for loop, axes in self.before.outcome.axes.items()}
        for i, event in enumerate(self.model.events):
            start = time_text(float(event.at))
            for key, value in (event.set or {}).items():
                number = number_of(value)
                if number is None or "." in key:
                    continue
                low, high = ranges.get(event.loop or "", (0.0, 0.0))
                reach = abs(number) or 1.0
                low, high = (low, high) if low <= number <= high and low < high else (number - reach, number + reach)
                yield event_knob(
                    f"event:events.{i}.set.{key}", event.loop or "", f"{key} from {start}", number, low, high
                )
            for key, value in (event.disturb or {}).items():
                number = float(value)
                reach = abs(number) or 1.0
                name = event.loop or event.plant or ""
                path = f"event:events.{i}.disturb.{key}"
                yield event_knob(path, name, f"{key} from {start}", number, number - reach, number + reach)

    def _plant_knobs(self) -> Iterator[Data]:
        """Each plant's gain, time constants and dead time, in % of what the file says."""
        for key, plant in self.model.plants.items():
            name = str(plant.name or key)
            for part, label in PLANT_LABELS.items():
                if any(self._plant_values(key, part)):
                    yield {
                        "id": f"plant:{key}:{part}",
                        "loop": name,
                        "group": "plant",
                        "label": f"{label} of {name}",
                        "key": "",
                        "unit": "%",
                        "value": 100.0,
                        "positions": [float(share) for share in PLANT_PERCENT],
                        "step": 1.0,
                    }

    def _plant_values(self, key: str | int, part: str) -> Iterator[tuple[str, str]]:
        """The numbers of a plant in the file with their paths; a gain that the file does not say is 1."""
        plants: Any = (self.scenario.data or {})["plants"]
        plant = plants[key if isinstance(plants, list) else str(key)]
        if part == "time":
            for name in TIME_KEYS:
                value = plant.get(name)
                rows = enumerate(value) if isinstance(value, list) else [(None, value)]
                for i, text in rows:
                    if text is not None:
                        yield f"plants.{key}.{name}" + ("" if i is None else f".{i}"), str(text)
            return
        name = "gain" if part == "gain" else "dead_time"
        text = plant.get(name, "1" if part == "gain" else None)
        if text is not None:
            yield f"plants.{key}.{name}", str(text)

    # --- a move ------------------------------------------------------------------------------------------------------

    def snap_values(self, values: Mapping[str, float]) -> dict[str, float]:
        """The values as they can be: what registers hold, plants within ± 30 %."""
        snapped_values = {}
        for name, value in values.items():
            kind, _, path = name.partition(":")
            if kind == "number":
                snapped_values[name] = float(self.numbers[path].hold(value))
            else:
                snapped_values[name] = (
                    min(max(value, PLANT_PERCENT[0]), PLANT_PERCENT[-1]) if kind == "plant" else float(f"{value:.6g}")
                )
        return snapped_values

    def move(self, values: Mapping[str, float], progress: Progress | None = None) -> Data:
        """Runs the scenario with these values of knobs; those that are not named are as filed.

        Whatever ``progress`` raises ends the run; the last one stays what it was.
        """
        snapped_values = self.snap_values(values)
        numbers, events = {}, {}
        for name, value in snapped_values.items():
            kind, _, path = name.partition(":")
            if kind == "number":
                number = self.numbers[path]
                if (held := Decimal(str(value))) != number.value:
                    numbers[path] = number.written(held)
            elif kind == "event":
                events[path] = f"{value:g}"
            elif value != PLANT_PERCENT[len(PLANT_PERCENT) // 2]:
                events |= self._scale_plant(path, value / 100)
        config = pidcfg.change(self.filed_doc, numbers).document
        scenario = pidcfg.change(self.scenario, events).document
        result = self._simulate(scenario, config.text, progress)
        self.current = (result, config, scenario)
        return {"values": snapped_values, **self.state_data()}

    def state_data(self) -> Data:
        """What a move answers, of the values as they are."""
        result, config, _ = self.current
        return {"yaml": config.text, **self._run_data(result, config)}

    def _scale_plant(self, path: str, factor: float) -> dict[str, str]:
        """The texts of a plant's numbers, each times a share."""
        key, _, part = path.rpartition(":")
        texts = {}
        for name, text in self._plant_values(key if isinstance(self._plants, dict) else int(key), part):
            match = NUMBER_PATTERN.fullmatch(text)
            if match is not None:
                texts[name] = f"{float(match[1]) * factor:.6g}{match[2]}"
        return texts

    @property
    def _plants(self) -> object:
        return (self.scenario.data or {})["plants"]

    def _run_data(self, result: SimulateResult, config: Document) -> Data:
        """What a run says besides its picture."""
        encoded = pidcfg.encode(config, allow_errors=True)
        findings = [d for d in (*encoded.findings, *result.findings) if d.severity.label != "info"]
        known_keys = {key_of(d) for d in (*self.words.findings, *self.before.findings)}
        rows = [
            {
                "code": d.code,
                "severity": d.severity.label,
                "message": d.message,
                "loop": d.loop,
                "new": key_of(d) not in known_keys,
            }
            for d in {(d.code, d.where, d.message): d for d in findings}.values()
        ]
        return {
            "ran": result.report is not None,
            "words": changed_words(self.words, encoded),
            "metrics": self.metrics(result),
            "findings": sorted(rows, key=lambda row: (not row["new"], row["severity"])),
        }

    def picture(self, loop: str) -> str:
        """The trend of a loop, now against as filed, as HTML; empty: the loop has none."""
        result = self.current[0]
        if result.report is None or loop not in result.report.loops:
            return ""
        return result.html(self.before, (loop,), self._sides)

    @property
    def _sides(self) -> tuple[str, str]:
        return (self.other_config, self.config) if self.other_config else ("as filed", "now")

    def metrics(self, result: SimulateResult) -> Data:
        """Overshoot in %, IAE and alarms of each loop, before and now."""
        rows: Data = {}
        for side, run in (("before", self.before), ("now", result)):
            for name, loop in run.report.loops.items() if run.report is not None else ():
                row = {"overshoot": loop.metrics.get("overshoot"), "iae": loop.metrics.get("iae")}
                row = {key: four_digits(value) for key, value in row.items()}
                rows.setdefault(name, {})[side] = {**row, "alarms": sorted({alarm.alarm for alarm in loop.alarms})}
        return rows

    def margins(self) -> Data:
        """Ms of each loop, before and now; where there is none, why."""
        _, config, scenario = self.current
        now = pidcfg.gains(scenario, files={**self.files, self.config: config.text})
        before = self.gains
        if self.other_config is not None:
            before = pidcfg.gains(self.scenario, files=self._files_of(self.other_config))
        rows: Data = {}
        for side, result in (("before", before), ("now", now)):
            for loop in result.loops:
                ms = None if loop.margins is None else four_digits(loop.margins.ms)
                rows.setdefault(loop.loop, {})[side] = {"ms": ms, "why": loop.why}
        return rows

    # --- runs --------------------------------------------------------------------------------------------------------

    def _files_of(self, config: str | None) -> dict[str, str]:
        """The files, with another configuration in the place of the scenario's."""
        return self.files if config is None else {**self.files, self.config: self.files[config]}

    def _simulate(self, scenario: Document, text: str, progress: Progress | None = None) -> SimulateResult:
        files = {**self.files, self.config: text}
        return pidcfg.simulate(scenario, record=True, reference=False, engine="python", files=files, progress=progress)


# --- words, numbers and sliders ---------------------------------------------------------------------------------------


def changed_words(before: EncodeResult, after: EncodeResult) -> list[Data]:
    """The words that differ, in the order of the memory; nothing where the PLCs differ."""
    if before.image is None or after.image is None or before.vendor != after.vendor:
        return []
    cells_before = {cell.address: cell for cell in before.image.cells}
    return [
        {
            "address": cell.address,
            "loop": cell.loop,
            "field": cell.field,
            "before": None if (was := cells_before.get(cell.address)) is None else word_text(was),
            "after": word_text(cell),
        }
        for cell in after.image.cells
        if cell.address not in cells_before or cells_before[cell.address].raw != cell.raw
    ]


def key_of(finding: Diagnostic) -> tuple[str, str, str]:
    """What tells a finding from others, whatever the numbers in it are."""
    return finding.code, finding.where, finding.loop


def word_text(cell: Any) -> str:
    """A word as a listing has it: hexadecimal digits of a register, a number in floating point as such."""
    data = cell.data()
    if cell.single_value is not None:
        return f"{cell.single_value:g}"
    return str(data["hex"] if "hex" in data else data.get("value", data.get("expression")))


def four_digits(value: float | None) -> float | None:
    """A number for a table."""
    return None if value is None or not isfinite(value) else float(f"{value:.4g}")


def number_of(value: object) -> float | None:
    """The number of a value without a unit; None: it is none."""
    try:
        number = float(str(value))
    except ValueError:
        return None
    return number if isfinite(number) and not isinstance(value, bool) else None


def event_knob(name: str, loop: str, label: str, value: float, low: float, high: float) -> Data:
    """A slider over a range, with the value that the file has among its positions."""
    positions = {float(f"{low + (high - low) * i / RANGE_POSITIONS:.4g}") for i in range(RANGE_POSITIONS + 1)} | {value}
    texts = {"id": name, "loop": loop, "group": "event", "label": label, "key": "", "unit": ""}
    return {**texts, "value": value, "positions": sorted(positions), "step": None}


def knob_positions(number: HeldNumber) -> list[float]:
    """What the register holds around the filed value, a decade to either side, without gaps that a word would fill."""
    value = float(number.value or 0)
    minimum = float(number.step or 0.01)
    centre = value or max(minimum * 10, 1.0)
    low, high = max(centre / REACH_FACTOR, minimum), centre * REACH_FACTOR
    steps = round(POSITIONS_PER_DECADE * log10(high / low)) if high > low else 0
    targets = {low * (high / low) ** (i / steps) for i in range(steps + 1)} if steps else {centre}
    positions = {float(number.hold(float(f"{position:.3g}"))) for position in targets} | {value}
    if number.part != "gain" and (number.low is None or number.low <= 0):
        positions.add(0.0)
    return sorted(positions)


def time_text(seconds: float) -> str:
    """A time of a run in the largest unit that it is whole in."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds and seconds % size == 0:
            return f"{seconds / size:g} {unit}"
    return f"{seconds:g} s"


# --- What the worker calls: one session a page ------------------------------------------------------------------------

SESSIONS: dict[str, Session] = {}


def begin(values: Data, progress: Progress | None = None) -> Data:
    """Reads the files of the page and runs the scenario as filed."""
    session = Session(values["scenario"], values["files"], values.get("against"), progress)
    SESSIONS["page"] = session
    return {**session.describe(), **session.state_data()}


def move(values: Data, progress: Progress | None = None) -> Data:
    """A move, with the picture of a loop."""
    session = SESSIONS["page"]
    return {**session.move(values["knobs"], progress), "picture": session.picture(values["loop"])}


def picture(values: Data, _: Progress | None = None) -> Data:
    """The picture of another loop."""
    return {"picture": SESSIONS["page"].picture(values["loop"])}


def margins(_: Data, __: Progress | None = None) -> Data:
    """Ms of all loops: it comes after the picture, which need not wait for it."""
    return {"margins": SESSIONS["page"].margins()}
