"""A scenario file with all that it needs: its configuration or listing, plants, what is uncertain, findings."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from decimal import Decimal
from math import inf
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, cast

from pydantic_core import PydanticCustomError

from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.decoding import check_settings, read_listing
from pidcfg.encoders.listing import ListingError
from pidcfg.schemas.base import DURATION, SECONDS, parse_seconds
from pidcfg.schemas.numbers import decimal_text
from pidcfg.schemas.scenario import Amount, Scenario, Spread, parse_amount, whole
from pidcfg.sim.controllers.plc import SETPOINT
from pidcfg.sim.engine.checks import LARGEST, MODEL_KEYS, NOT_NEGATIVE, OWN_KEYS, POSITIVE, SMALLEST
from pidcfg.sim.engine.expressions import Problem, unknown_name
from pidcfg.sim.engine.influence import wrong_actions
from pidcfg.sim.engine.network import initial_values, rest
from pidcfg.sim.engine.run import options, prepare
from pidcfg.text.diagnostics import Diagnostic, Severity, Span, sort_findings
from pidcfg.text.document import Plain
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import dotted, leaves, steps, value_at
from pidcfg.text.reader import DISK, SUFFIXES, Reader, may_be_quoted, read_other, refusal
from pidcfg.text.references import Decision
from pidcfg.text.source import read_document
from pidcfg.validate.catalog import unusable
from pidcfg.validate.engine import check_document, is_scenario
from pidcfg.validate.own_units import stated_number, with_numbers
from pidcfg.validate.rule import SCENARIO_KINDS, key_of, value_of
from pidcfg.validate.schema import read_model
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from pidcfg.encoders.listing import Listing
    from pidcfg.schemas.scenario import Plant
    from pidcfg.sim.controllers.plc import Controller, Plc
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Path
    from pidcfg.validate.engine import Checked
    from pidcfg.vendors import Vendor

# --- What a scenario's ``vary`` stands for: each uncertain number with its ends ---------------------------------------

D800 = Decision(
    800,
    "what varies, and when it is written",
    "A varied number of a plant takes the place of the file's. A varied key of a loop is written as an event `set` at "
    "0 s would write it, before the events of the scenario and after a pre-roll, which runs with the configured "
    "values; so it is rounded to its word as ever. ± is a share of the value that the file has at that key; where it "
    "has none, or 0, uniform or normal is wanted. Drawn numbers have ten significant digits. A number that must be "
    "above 0 or not negative is refused before the run where its spread goes further.",
    "A sample is then a scenario that anybody can run, with the bytes that would be deployed.",
)
PLANT_NUMBERS = ("gain", "load", "noise", "dead_time", "initial")
"""Numbers of every plant."""
PLANT_TIMES = ("time_constant", "time_constants", "lead", "lag", "dead_time")
DRAWN_DIGITS = 10
"""Significant digits of a drawn number."""
HALF = 0.5
FAR_DEVIATIONS = 3.0
"""Standard deviations that a drawn number may well be away from its mean."""


class NumberSpread(NamedTuple):
    """A number's spread in its unit: uniform from ``low`` to ``high``, or normal within them."""

    low: float = -inf
    high: float = inf
    mean: float = 0.0
    sigma: float | None = None
    """None: uniform."""


@frozen
class Uncertainty:
    """One number that varies."""

    of: Literal["plants", "loops"]
    name: str
    """Of the plant or the loop."""
    key: str
    text: str
    """How it is spread, for people."""
    ends: NumberSpread
    unit: str = ""
    """Written behind a drawn number."""
    whole: bool = False
    """Its word takes whole numbers alone."""

    @property
    def row(self) -> str:
        """What its random numbers hang on: neither the place in the file nor the other ones."""
        return f"{self.of}.{self.name}.{self.key}"

    @property
    def label(self) -> str:
        """For people."""
        return f"{self.name} {self.key}"

    def written(self, value: float) -> str:
        """A drawn number as a scenario has it."""
        number = Decimal(f"{value:.{DRAWN_DIGITS}g}")
        return f"{decimal_text(round(number) + Decimal(0) if self.whole else number)} {self.unit}".rstrip()


class VaryError(Exception):
    """Why a number cannot vary so."""

    def __init__(self, message: str, cure: str | None = None) -> None:
        super().__init__(message)
        self.cure = cure


def uncertainties(scenario: Scenario, plc: Plc, config: Document | None) -> tuple[list[Uncertainty], list[Problem]]:
    """All numbers that vary, in the order of the file, and what is wrong with ``vary``.

    ``config``: the configuration, whose numbers a ± is a share of; None: a listing, which has none.
    """
    found: list[Uncertainty] = []
    problems: list[Problem] = []
    for path, what in _entries(scenario, plc, config):
        if isinstance(what, Problem):
            problems.append(what)
            continue
        try:
            found.append(what())
        except VaryError as error:
            problems.append(Problem(path, str(error), "value", help=error.cure))
            continue
        if found[-1].of == "plants" and found[-1].key == "gain":
            problems += _turned_round(path, found[-1])
    return found, problems


def _turned_round(path: Path, gain: Uncertainty) -> Iterator[Problem]:
    """A process whose direction is as uncertain as its gain."""
    low, high, mean, sigma = gain.ends
    if sigma is not None:
        low, high = max(low, mean - FAR_DEVIATIONS * sigma), min(high, mean + FAR_DEVIATIONS * sigma)
    if low < 0 < high:
        message = f"the gain of {gain.name} goes from {low:.4g} to {high:.4g}: with the other sign the loop runs away"
        yield Problem(path, message, "value", "warning", help="keep the gain on one side of 0")


def _entries(scenario: Scenario, plc: Plc, config: Document | None) -> Iterator[tuple[Path, Any]]:
    """The place of each number, and what makes its `Uncertainty`, or a problem of its name."""
    if scenario.vary is None:
        return
    plants = {str(text.name or key): text for key, text in scenario.plants.items()}
    for name, keys in scenario.vary.plants.items():
        for key, spread in keys.items():
            path = ("vary", "plants", name, key)
            if name not in plants:
                yield path, unknown_name(path[:3], "plant of the scenario", name, plants, key=True)
                break
            yield path, lambda name=name, key=key, spread=spread: vary_plant(name, key, spread, plants[name])
    for name, keys in scenario.vary.loops.items():
        for key, spread in keys.items():
            path = ("vary", "loops", name, key)
            if name not in plc.loops:
                yield path, unknown_name(path[:3], "loop", name, plc.loops, key=True)
                break
            yield path, lambda name=name, key=key, spread=spread: vary_loop(name, key, spread, plc, config)


# --- plants ----------------------------------------------------------------------------------------------------------


def vary_plant(name: str, key: str, spread: Spread, plant: Plant) -> Uncertainty:
    """A number of a plant; a `VaryError` says why it cannot vary so."""
    base = key.partition(".")[0]
    own = [k for k in OWN_KEYS if getattr(plant, k) is not None and any(k in keys for keys in MODEL_KEYS[plant.model])]
    own = [k for one in own for k in ((f"{one}.0", f"{one}.1") if one == "time_constants" else (one,))]
    if key not in (*PLANT_NUMBERS, *own):
        near = unknown_name((), f"number of {name} that can vary", key, [*PLANT_NUMBERS, *own])
        raise VaryError(near.message, near.help)
    written = [one for one in (*spread.pair, *(spread.limits or ())) if one.unit and spread.kind != "share"]
    if written and base not in PLANT_TIMES:
        raise VaryError(f"{key} is a plain number, not {written[0]}", "leave out the unit")
    value = value_at(plant, steps(key))
    stands = None if value is None else Amount(value)
    ends = number_spread(spread, stands, f"{name} has no {key}", time=base in PLANT_TIMES)
    lowest, highest = (ends.low, ends.high) if ends.sigma is None or ends.low > -inf else (ends.mean, ends.mean)
    above = base in POSITIVE or base == "time_constants"
    if above or base in NOT_NEGATIVE:
        wanted = "above 0" if above else "at least 0"
        if ends.sigma is not None and ends.low == -inf:
            cure = f"add limits, such as limits: [{ends.mean / 2:g}, {ends.mean * 2:g}]"
            raise VaryError(f"{key} must be {wanted}, and a normal spread without limits goes below", cure)
        if lowest < 0 or (above and lowest == 0):
            raise VaryError(f"{key} must be {wanted}, and {spread} goes down to {lowest:g}", "narrow it")
    if above and lowest < float(SMALLEST):
        raise VaryError(f"{key} goes below {SMALLEST:g}", "narrow it")
    if max(abs(lowest), abs(highest)) > LARGEST:
        raise VaryError(f"{key} goes beyond {LARGEST:g}")
    return Uncertainty("plants", name, key, str(spread), ends)


# --- loops -----------------------------------------------------------------------------------------------------------


def vary_loop(name: str, key: str, spread: Spread, plc: Plc, config: Document | None) -> Uncertainty:
    """A key of a loop that ``set`` may change; a `VaryError` says why it cannot vary so."""
    unknown_key = _refusal(Uncertainty("loops", name, key, "", NumberSpread()), 1.0, plc)
    if unknown_key is not None and unknown_key.type == "set_key":
        raise VaryError(unknown_key.message(), (unknown_key.context or {}).get("help"))
    stands = file_value(name, key, plc, config) if spread.kind == "share" else None
    ends = number_spread(spread, stands, f"the configuration file gives {name} no number at {key}")
    unit = stands.unit if stands is not None else spread.pair[0].unit
    one = Uncertainty("loops", name, key, str(spread), ends, unit)
    inner = [ends.mean] if ends.sigma is not None and ends.low == -inf else [ends.low, ends.high]
    middle = (inner[0] + inner[-1]) / 2
    fraction = middle // 1 + HALF
    if _refusal(one, fraction, plc) is not None and _refusal(one, fraction - HALF, plc) is None:
        one = Uncertainty("loops", name, key, str(spread), ends, unit, whole=True)
    for value in inner:
        error = _refusal(one, value, plc)
        if error is not None:
            raise VaryError(f"{one.written(value)}: {error.message()}", (error.context or {}).get("help"))
    return one


def _refusal(one: Uncertainty, value: float, plc: Plc) -> PydanticCustomError | None:
    """What the controller has against a value."""
    try:
        plc.check_set(plc.loops.index(one.name), tuple(one.key.split(".")), Plain(one.written(value)))
    except PydanticCustomError as error:
        return error
    return None


def file_value(name: str, key: str, plc: Plc, config: Document | None) -> Amount | None:
    """The number that the configuration file has at a key of a loop; None: it has none there, or is a listing."""
    loops = config.data.get("loops") if config is not None and config.data else None
    entries = (
        [e for e in loops if isinstance(e, dict) and str(e.get("name")) == name] if isinstance(loops, list) else []
    )
    if not entries:
        return None
    wanted = plc.setpoint if key in SETPOINT else key
    values = [value for keys, value, _ in leaves(entries[0]) if dotted(keys) == wanted]
    values = values or [value for keys, value, _ in leaves(entries[0]) if keys[-1] == wanted]
    pair = value_at(entries[0], steps(wanted))
    if not values and pair is not None:
        values = [pair]
    if len(values) != 1:
        return None
    try:
        return parse_amount(values[0])
    except PydanticCustomError:
        return None


# --- ends ------------------------------------------------------------------------------------------------------------


def number_spread(spread: Spread, stands: Amount | None, without: str, *, time: bool = False) -> NumberSpread:
    """The ends of a spread around what ``stands`` in the file; ``time``: in s."""
    if spread.kind == "share":
        if stands is None:
            raise VaryError(f"{without}, of which {spread} could be a share", "write uniform: [low, high]")
        if not stands.value:
            raise VaryError(f"{spread} of 0 is 0", "write uniform: [low, high]")
        reach = abs(stands.value) * spread.pair[0].value / 100
        return NumberSpread(float(stands.value - reach), float(stands.value + reach))
    first, second = (_number(one, time=time) for one in spread.pair)
    if spread.kind == "uniform":
        return NumberSpread(first, second)
    low, high = (-inf, inf) if spread.limits is None else (_number(one, time=time) for one in spread.limits)
    return NumberSpread(low, high, first, second)


def _number(amount: Amount, *, time: bool) -> float:
    """An amount in its own unit; a ``time`` in s."""
    if not time or not amount.unit:
        return float(amount.value)
    if not DURATION.fullmatch(f"{amount.value:f} {amount.unit}"):
        raise VaryError(f"{amount} is not a time", f"units are {', '.join(SECONDS)}, as in 250 ms")
    return float(parse_seconds(Plain(f"{amount.value:f} {amount.unit}")))


# --- A scenario file with everything it needs: its configuration or memory listing, and the virtual PLC ---------------

HEAD_BYTES = 1000
"""Bytes of a listing in which the name of its vendor stands, if at all."""
STDIN = "-"
SEVERITIES = {severity.label: severity for severity in Severity}


@dataclass(slots=True)
class Loaded:
    """A scenario as far as it could be loaded; it can run when ``image`` is there."""

    document: Document
    findings: list[Diagnostic] = field(default_factory=list)
    scenario: Scenario | None = None
    config: str = ""
    """The name of the configuration file as reports print it."""
    documents: dict[str, Document] = field(default_factory=dict)
    """Every file that a finding may point into, by name."""
    config_errors: list[Diagnostic] = field(default_factory=list)
    """What is wrong with the configuration, though the PLC takes it."""
    checked: Checked | None = None
    """The configuration that runs, and its findings."""
    vendor: Vendor | None = None
    image: Any = None
    cures: dict[Path, str] = field(default_factory=dict)
    """What to do about values of events that carry another unit than their key."""

    @property
    def controller(self) -> Controller:
        """The vendor's controller module."""
        if self.vendor is None:
            raise ValueError(f"{self.document.file} has no vendor")
        return cast("Controller", self.vendor.module("controller"))

    def plc(self) -> Plc:
        """A new virtual PLC with the scenario's image."""
        if self.scenario is None or self.image is None:
            raise ValueError(f"{self.document.file} could not be loaded")
        controller = self.controller
        plc = controller.load(self.image, options(self.scenario, controller))
        units = ((entry.get("loop"), (entry.get("pv") or {}).get("unit")) for entry in self.image.settings)
        plc.units = {str(loop): str(unit) for loop, unit in units if unit}
        return plc

    def uncertainties(self, plc: Plc) -> tuple[list[Uncertainty], list[Problem]]:
        """What varies, and what is wrong with it."""
        if self.scenario is None:
            return [], []
        return uncertainties(self.scenario, plc, self.documents.get(self.config))

    def refuse(self, message: str, cure: str | None = None) -> None:
        """A configuration that cannot be used."""
        path = ("config",)
        span = self.document.locate(path)
        self.findings.append(Diagnostic("PID058", Severity.ERROR, message, self.document.file, span, path, help=cure))

    def add(self, problems: Iterable[Problem]) -> None:
        """Problems of the scenario as findings with places."""
        told = [replace(one, help=self.cures.get(one.path) or one.help) for one in problems]
        self.findings = sort_findings([*self.findings, *(place_problem(problem, self.document) for problem in told)])


def load(doc: Document, reader: Reader = DISK) -> Loaded:
    """Reads a scenario and what it names; ``findings`` say why it cannot run, if so."""
    loaded = Loaded(doc, list(doc.problems), documents={doc.file: doc})
    if doc.data is None or unreadable(doc.problems):
        return loaded
    scenario, loaded.findings = read_scenario(doc)
    loaded.scenario = scenario
    if scenario is not None:
        _read_config(loaded, scenario, reader)
        _use_own_units(loaded)
    return loaded


def _use_own_units(loaded: Loaded) -> None:
    """Events may set a key in its own unit, as the configuration may: ``90 degC`` where the PV is in degC is 90.

    Times are read with their units wherever they stand.
    """
    doc, config = loaded.document, loaded.documents.get(loaded.config)
    if loaded.image is None or loaded.vendor is None or config is None or doc.data is None:
        return
    loops = {str(loop.get("name")): loop for loop in (config.data or {})["loops"]}
    numbers = {}
    for i, event in enumerate(doc.data.get("events") or ()):
        loop = loops.get(str(event.get("loop")))
        for keys, value, below in leaves(event.get("set") or {}) if loop is not None else ():
            if isinstance(value, str) and " " in value and value.split()[-1] not in SECONDS:
                path = steps(loaded.plc().setpoint) if dotted(keys) == "setpoint" else keys
                said, place_of = stated_number(loaded.vendor, loop, path, value), ("events", i, "set", *below)
                if said is not None and said.unit == said.own:
                    numbers[place_of] = said.number
                elif said is not None:
                    loaded.cures[place_of] = said.cure
    if numbers:
        loaded.document = with_numbers(doc, numbers)
        loaded.scenario, loaded.findings = read_scenario(loaded.document)


def read_scenario(doc: Document) -> tuple[Scenario | None, list[Diagnostic]]:
    """The typed content of a scenario file, and what is wrong with its text and its keys."""
    scenario, errors = read_model(Scenario, replace(doc, data=cast("dict[str, Any]", whole(doc.data))))
    return scenario, sort_findings([*doc.problems, *errors])


def unreadable(findings: Iterable[Diagnostic]) -> bool:
    """Whether a text can be read in more than one way, such as a key that stands twice: what runs would be a guess."""
    return any(map(unusable, findings))


def check_scenario(doc: Document, reader: Reader = DISK) -> list[Diagnostic]:
    """All findings of a scenario file; those of its configuration are reported with the configuration."""
    loaded = load(doc, reader)
    if loaded.scenario is not None and loaded.image is not None:
        plc = loaded.plc()
        net = prepare(loaded.scenario, plc)
        loaded.add([*net.problems, *loaded.uncertainties(plc)[1]])
        if not any(problem.severity == "error" for problem in net.problems):
            rest(net, initial_values(net))
            loaded.add(wrong_actions(net, plc))
    return loaded.findings


def place_problem(problem: Problem, doc: Document) -> Diagnostic:
    """A problem of the scenario with its position; within an expression, of the character."""
    span = doc.locate(problem.path, key=problem.key)
    if problem.kind == "expression" and span.line == span.end_line:
        row = doc.lines[span.line - 1]
        quoted = row[span.column - 1 : span.column] in {'"', "'"}
        column = span.column + problem.offset + quoted
        span = Span(span.line, column, span.line, column + 1)
    code, severity = SCENARIO_KINDS[problem.kind], SEVERITIES[problem.severity]
    return Diagnostic(
        code,
        severity,
        problem.message,
        doc.file,
        span,
        problem.path,
        problem.loop or "",
        help=problem.help,
        key=key_of(doc, problem.path),
        value=value_of(doc, problem.path),
    )


def _read_config(loaded: Loaded, scenario: Scenario, reader: Reader) -> None:
    """The configuration or listing, relative to the scenario."""
    loaded.config = reader.resolve(loaded.document.file, scenario.config)
    if scenario.config == STDIN:
        loaded.refuse(f"{scenario.config} is no file", "name a configuration or a memory listing")
        return
    try:
        data = read_other(reader, loaded.config, loaded.document.limits.file_bytes + 1)
    except (OSError, ValueError) as error:
        loaded.refuse(refusal(loaded.config, error), "the path is relative to the scenario file")
        return
    if PurePath(loaded.config).suffix.lower() in SUFFIXES:
        _use_configuration(loaded, data)
    else:
        _use_listing(loaded, data, quoted=may_be_quoted(reader, loaded.document.file, loaded.config))


def _use_configuration(loaded: Loaded, data: bytes) -> None:
    """Encodes a configuration; errors that the PLC survives do not keep it from running."""
    doc = read_document(data, loaded.config, loaded.document.limits)
    loaded.documents[doc.file] = doc
    if is_scenario(doc):
        loaded.refuse(f"{loaded.config} is a scenario", "name the configuration that it runs")
        return
    checked = check_document(doc)
    if unreadable(checked.findings):
        first = next(d for d in checked.findings if unusable(d))
        cure = f"run 'pidcfg validate {loaded.config}'"
        loaded.refuse(f"{loaded.config}:{first.span.line}:{first.span.column}: {first.message}", cure)
        return
    if checked.encoding is None or not checked.encoding.whole:
        worst = next((d for d in checked.findings if d.severity is Severity.ERROR), None)
        reason = f"{worst.span.line}:{worst.span.column}: {worst.message}" if worst else " it has no memory image"
        loaded.refuse(f"{loaded.config}:{reason}", f"run 'pidcfg validate {loaded.config}'")
        return
    loaded.config_errors = [d for d in checked.findings if d.severity is Severity.ERROR]
    loaded.checked, loaded.vendor, loaded.image = checked, checked.vendor, checked.encoding.image


def _use_listing(loaded: Loaded, data: bytes, *, quoted: bool) -> None:
    """Takes the words of a memory listing as they are, once what stands beside them is known to be sound.

    The vendor is the one that can read it; of those that cannot, the one that it names, or that got furthest, says why.
    """
    wrong: list[tuple[bool, int, ListingError]] = []
    for vendor in VENDORS.values():
        try:
            listing = read_listing(data, vendor, loaded.document.limits)
        except ListingError as error:
            wrong.append((vendor.key.encode() in data[:HEAD_BYTES], error.line, error))
            continue
        _use_words(loaded, vendor, listing)
        return
    _, line, worst = max(wrong, key=lambda row: row[:2])
    if quoted:
        loaded.refuse(f"{loaded.config}: line {line}: {worst}")
    else:
        told = f"'pidcfg decode {loaded.config} --vendor VENDOR' says why (a file outside of this folder is not quoted)"
        loaded.refuse(f"{loaded.config}: line {line} cannot be read as one of a memory listing", told)


def _use_words(loaded: Loaded, vendor: Vendor, listing: Listing) -> None:
    """The image of a listing; one that has no meaning without its settings must have them.

    A word that is no value does not keep it from running: the PLC has it, and the run is told what it does with it.
    """
    needed = any(option.needed for option in vendor.load("decode_options"))
    if needed or not vendor.banks or listing.settings or listing.plc:
        try:
            check_settings(listing, vendor)
        except DecodeError as error:
            cure = f"run 'pidcfg decode {loaded.config} --vendor {vendor.key}'"
            if needed and not listing.settings:
                cure += " with that option, and name the configuration that it writes"
            loaded.refuse(f"{loaded.config}: {error}", cure)
            return
    loaded.vendor, loaded.image = vendor, listing.image(vendor.key)
