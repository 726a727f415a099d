"""What the rules of several vendors look for: each check once, over the little that they have in common."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from functools import cached_property
from itertools import pairwise, permutations
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, Protocol, TypeVar

from pidcfg.encoders.contract import tables_of
from pidcfg.encoders.image import is_enabled
from pidcfg.encoders.regmap import RegisterMap
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.diagnostics import Severity
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Path, value_at
from pidcfg.text.references import Basis, Decision
from pidcfg.validate.rule import Finding, Findings, make_finding

if TYPE_CHECKING:
    from pidcfg.vendors import Vendor

# --- What the rules of all vendors look at: a configuration, its loops, and numbers as messages write them ------------

MAX_DIGITS = 12
"""More of a number than a message shows."""
Pair = tuple["Decimal", "Decimal"]


class NamedLoop(Protocol):
    """A loop of any vendor."""

    @property
    def name(self) -> str:
        """Its name, which is unique in the file."""


class PlacedLoop(Protocol):
    """A loop at its place in the file, for rules that report findings there."""

    @property
    def name(self) -> str:
        """The loop's name."""

    @property
    def report(self) -> Callable[..., Finding]:
        """Makes a finding at a place below the loop."""

    @property
    def report_key(self) -> Callable[..., Finding]:
        """Makes a finding at a key."""


LoopT = TypeVar("LoopT", bound=NamedLoop)
ConfigT = TypeVar("ConfigT")
EncodingT = TypeVar("EncodingT")
Value = TypeVar("Value")


@frozen
class View(Generic[LoopT]):
    """A loop and its place in the file."""

    index: int
    loop: LoopT

    @property
    def name(self) -> str:
        """The loop's name."""
        return self.loop.name

    def report(
        self,
        *path: str | int,
        plc_effect: str | None = None,
        severity: Severity | None = None,
        fix: str | None = None,
        basis: Basis | None = None,
        **values: object,
    ) -> Finding:
        """A finding at a place below this loop, with the values of the message and what differs from the label."""
        place = ("loops", self.index, *path)
        return Finding(place, values, plc_effect=plc_effect, severity=severity, fix=fix, basis=basis)

    def report_key(
        self,
        *path: str | int,
        plc_effect: str | None = None,
        **values: object,
    ) -> Finding:
        """A finding that points at a key: what it opens is a block of lines."""
        return Finding(("loops", self.index, *path), values, key=True, plc_effect=plc_effect)


@frozen
class SwitchedView(View[LoopT]):
    """A loop of a PLC that switches alarms and terms by bits of their own."""

    @cached_property
    def pv_alarms_on(self) -> bool:
        """Whether the bit of the four PV alarms is set."""
        return is_enabled(self.loop, "alarms.pv.enabled")

    @cached_property
    def deviation_alarms_on(self) -> bool:
        """Whether the bit of the two deviation alarms is set."""
        return is_enabled(self.loop, "alarms.deviation.enabled")

    @cached_property
    def pv_filter_on(self) -> bool:
        """Whether the PV filter's bit is set."""
        return is_enabled(self.loop, "pv.filter_enabled")

    @cached_property
    def derivative_limit_on(self) -> bool:
        """Whether the derivative gain limit's bit is set."""
        return is_enabled(self.loop, "derivative_gain_limit_enabled")

    @cached_property
    def deadband_on(self) -> bool:
        """Whether the deadband's bit is set."""
        return is_enabled(self.loop, "error.deadband_enabled")


@frozen
class Context(Generic[ConfigT, EncodingT]):
    """A configuration with its encoding."""

    config: ConfigT
    encoding: EncodingT

    @property
    def explained_paths(self) -> frozenset[Path]:
        """Places that a rule of the vendor's own explains better than the rules for every vendor."""
        return frozenset()


def all_or_none(values: Iterable[Value | None]) -> list[Value]:
    """All of some values; empty as soon as one of them is None."""
    items = list(values)
    known = [value for value in items if value is not None]
    return known if len(known) == len(items) else []


def value_or_switch_key(part: object, key: str) -> str:
    """The key to point at where a feature is on: its value's, or that of its switch where no value is given."""
    return key if getattr(part, key) is not None else f"{key}_enabled"


def number_text(value: Decimal) -> str:
    """A number as people write it; more than 12 digits are shortened."""
    text = decimal_text(value)
    return text if len(text) <= MAX_DIGITS else f"{float(value):.6g}"


def number_with_unit(value: Decimal, unit: str | None) -> str:
    """A number as people write it, with its unit."""
    return f"{number_text(value)} {unit}" if unit else number_text(value)


# --- Alarms of the PV and of its deviation, against the set point, the deadband and the hysteresis --------------------

PV_POINTS = ("low_low", "low", "high", "high_high")
"""The alarm points of the PV, from below."""
Number = TypeVar("Number", int, "Decimal")
"""What registers hold: counts, or numbers in the PV's unit."""


class AlarmView(PlacedLoop, Protocol, Generic[Number]):
    """A loop with four PV alarms, deviation alarms and a hysteresis, each in a register of its own."""

    @property
    def pv_alarms_on(self) -> bool:
        """Whether the bit of the four PV alarms is set."""

    @property
    def deviation_alarms_on(self) -> bool:
        """Whether the bit of the two deviation alarms is set."""

    @property
    def deadband_on(self) -> bool:
        """Whether the deadband's bit is set."""

    def value(self, name: str) -> object:
        """The value of a register; None when there is none."""

    def register_values(self, *names: str) -> list[Number]:
        """What several registers hold; empty as soon as one value does not fit."""

    def quote(self, name: str) -> str:
        """A register's value as a message quotes it."""

    def distance(self, value: Number) -> str:
        """A distance on the PV's scale as a message quotes it."""


def neighbours_out_of_order(
    view: AlarmView[Number], prefix: str, points: Sequence[str] = PV_POINTS
) -> Iterator[tuple[str, str, bool]]:
    """Neighbouring alarm points that do not ascend, and whether they are equal."""
    for low, high in pairwise(points):
        words = view.register_values(f"{prefix}_{low}", f"{prefix}_{high}")
        if words and words[0] >= words[1]:
            yield low, high, words[0] == words[1]


def exceeded_alarm(view: AlarmView[Number], value: Number) -> str | None:
    """The PV alarm, low or high, that a value lies beyond; None between them, or where they are off or crossed."""
    points = view.register_values("pv_low", "pv_high")
    if not view.pv_alarms_on or not points or points[0] >= points[1] or points[0] <= value <= points[1]:
        return None
    return "low" if value < points[0] else "high"


def zero_deadband_findings(view: AlarmView[Number]) -> Findings:
    """A deadband that is on and ignores nothing."""
    if view.deadband_on and view.register_values("deadband") == [0]:
        key = "deadband_enabled" if view.value("deadband") is None else "deadband"
        yield view.report("error", key, value=view.quote("deadband"))


def nearby_alarm(
    view: AlarmView[Number], width: Number, setpoint: Number | None, deviation: tuple[str, str]
) -> tuple[str, Number] | None:
    """The first alarm that is no further from the set point than a width, and how far it is.

    ``deviation``: the name and the register of the nearer one of the deviation alarms.
    """
    name, register = deviation
    distances = [(name, limit) for limit in view.register_values(register)] if view.deviation_alarms_on else []
    points = view.register_values("pv_low", "pv_high") if view.pv_alarms_on else []
    if points and setpoint is not None:
        distances += [("low", setpoint - points[0]), ("high", points[1] - setpoint)]
    return next(((alarm, distance) for alarm, distance in distances if 0 < distance <= width), None)


def hysteresis_spans_normal_zone(view: AlarmView[Number], max_hysteresis: Number | None = None) -> Findings:
    """A hysteresis as wide as the zone between low and high alarm; above ``max_hysteresis`` another rule reports it."""
    words = view.register_values("pv_low", "pv_high", "hysteresis")
    if (
        view.pv_alarms_on
        and words
        and 0 < words[1] - words[0] <= words[2]
        and (max_hysteresis is None or words[2] <= max_hysteresis)
    ):
        zone = view.distance(words[1] - words[0])
        yield view.report("alarms", "hysteresis", value=view.quote("hysteresis"), zone=zone)


# ----------------------------------------------------------------------------------------------------------------------
# Blocks of registers at addresses of their own: where they lie, which of them overlap, and how many there may be.


class Extent(NamedTuple):
    """The registers of one block: its key in the file, its bank, first and last number."""

    key: str
    prefix: str
    first: int
    last: int

    def __str__(self) -> str:
        return f"{self.prefix}{self.first} to {self.prefix}{self.last}"


class BlockView(PlacedLoop, Protocol):
    """A loop with blocks, in the order of their banks."""

    @property
    def extents(self) -> tuple[Extent, ...]:
        """Its blocks."""


def extents_of(loop: object, blocks: Mapping[str, tuple[str, RegisterMap]]) -> tuple[Extent, ...]:
    """The blocks of a loop, whose keys in the file name their starts."""
    starts = ((key, prefix, getattr(loop, key), table.size) for key, (prefix, table) in blocks.items())
    return tuple(Extent(key, prefix, start, start + size - 1) for key, prefix, start, size in starts)


def block_beyond_bank(view: BlockView, last: Mapping[str, int]) -> Findings:
    """Blocks of a loop that reach past the last address of their bank; ``last``: it, by bank."""
    for extent in view.extents:
        end = last[extent.prefix]
        if extent.last > end:
            latest = end - (extent.last - extent.first)
            yield view.report(
                extent.key, block=extent.key, extent=extent, prefix=extent.prefix, last=end, latest=latest
            )


def blocks_overlap(views: Sequence[BlockView]) -> Findings:
    """Loops whose blocks share registers, at each of them."""
    for view, other in permutations(views, 2):
        for extent, other_extent in zip(view.extents, other.extents, strict=True):
            if extent.first <= other_extent.last and other_extent.first <= extent.last:
                key = extent.key
                finding = view.report(
                    key, block=key, extent=extent, loop=view.name, other_extent=other_extent, other=other.name
                )
                yield finding.with_other_loops(other.name)


def too_many_loops(views: Sequence[PlacedLoop], max_loops: int) -> Findings:
    """A file with more loops than its PLC has room for."""
    if len(views) > max_loops:
        yield make_finding("loops", key=True, count=len(views), limit=max_loops)


# --- Cascades: loops that take their set points from each other -------------------------------------------------------


def find_circles(masters: Sequence[int | None]) -> Iterator[list[int]]:
    """The loops that follow each other in a circle, each circle once: from its first loop on, each before its master.

    ``masters`` has the index of each loop's master; a loop that is its own master is a ring of one.
    """
    visited: set[int] = set()
    for start in range(len(masters)):
        steps_from_start: dict[int, int] = {}
        current: int | None = start
        while current is not None and current not in steps_from_start and current not in visited:
            steps_from_start[current] = len(steps_from_start)
            current = masters[current]
        visited.update(steps_from_start)
        if current in steps_from_start:
            ring = list(steps_from_start)[steps_from_start[current] :]
            first = ring.index(min(ring))
            yield ring[first:] + ring[:first]


# --- What several loops have in common, reported at each of them: what no two may share, and what concerns a pair -----


class HasName(Protocol):
    """A loop, or a block of a program."""

    @property
    def name(self) -> str:
        """Its name."""


MAX_NAMES = 8
"""Loops that a message names before it only counts."""
Key = TypeVar("Key", bound="Hashable")
ViewT = TypeVar("ViewT", bound=HasName)


def find_shared_keys(rows: Iterable[tuple[Key, ViewT]]) -> Iterator[tuple[Key, ViewT, tuple[str, ...]]]:
    """Every loop whose key another one has too: the key, the loop, and the names of the others."""
    groups: dict[Key, list[ViewT]] = {}
    for key, view in rows:
        groups.setdefault(key, []).append(view)
    for key, views in groups.items():
        for view in views:
            others = tuple(dict.fromkeys(other.name for other in views if other is not view))
            if others:
                yield key, view, others


def report_at_both(first: HasName, at_one: Finding, other: HasName, at_other: Finding, /, **values: object) -> Findings:
    """A finding at each of two loops, which names the other one; with the values of the message that both have."""
    yield at_one.with_values(**values).with_other_loops(other.name)
    yield at_other.with_values(**values).with_other_loops(first.name)


D955 = Decision(
    955,
    "crossed set points of loops that read one PV",
    "Of two loops that read one PV the one that raises it may not have the higher set point: a warning at both, where "
    "the set points are on one scale and neither comes from another loop.",
    "As D181 for the EZLogix. Between crossed set points both outputs are on and work against each other, whatever the "
    "PLC is.",
)


def pairs_with_same_key(
    views: Iterable[ViewT], key: Callable[[ViewT], Key | None]
) -> Iterator[tuple[ViewT, ViewT, Key]]:
    """Pairs of views with one key, with that key, as `combinations` orders them; None: a view that has none."""
    keyed_views = [(view, key_value) for view in views if (key_value := key(view)) is not None]
    later_views: dict[Key, list[ViewT]] = {}
    for view, key_value in reversed(keyed_views):
        later_views.setdefault(key_value, []).append(view)
    for view, key_value in keyed_views:
        later_views[key_value].pop()
        yield from ((view, other, key_value) for other in reversed(later_views[key_value]))


def crossed_set_points(
    pairs: Iterable[tuple[ViewT, ViewT]],
    raises_pv: Callable[[ViewT], bool],
    setpoint: Callable[[ViewT], Decimal | int | None],
) -> Iterator[tuple[ViewT, ViewT]]:
    """Of pairs of loops with one PV those of which one raises it to a set point above that of the other.

    Each is told as heating and cooling; None as a set point: it is not known, or not on the other's scale.
    """
    for pair in pairs:
        loops = {raises_pv(view): view for view in pair}
        if len(loops) == 2:
            high, low = setpoint(loops[True]), setpoint(loops[False])
            if high is not None and low is not None and high > low:
                yield loops[True], loops[False]


def list_names(names: Sequence[str]) -> str:
    """Names as a message lists them: ``A, B and C``; after eight of them only how many more there are."""
    if len(names) > MAX_NAMES:
        return f"{', '.join(names[:MAX_NAMES])} and {len(names) - MAX_NAMES} more"
    return " and ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)


# --- Numbers that lie outside the limits or the range which they belong to --------------------------------------------

NUMBER_FIELDS = ("value", "low", "high")
"""What a message quotes."""


def outside_limits_findings(
    view: PlacedLoop,
    *path: str | int,
    value: Number | None,
    limits: tuple[Number, Number] | None,
    quote: Callable[[Number], str],
    units: Collection[str] = ("value", "high"),
    field: str = "value",
    **values: object,
) -> Findings:
    """A finding at a key whose value is not within limits; none where either is not known.

    ``quote`` writes a number with its unit, which those of value, ``low`` and ``high`` carry that ``units`` names. In
    the message the value is called ``field``.
    """
    if value is None or limits is None or limits[0] <= value <= limits[1]:
        return
    numbers = {"value": value, "low": limits[0], "high": limits[1]}
    texts = {key: quote(number) if key in units else number_text(Decimal(number)) for key, number in numbers.items()}
    yield view.report(*path, **{field: texts.pop("value")}, **texts, **values)


# --- What a loop is for, heating or cooling, by words in English and German: the only list of them --------------------


def _word_pattern(*patterns: str) -> re.Pattern[str]:
    """Whole words; a number may follow (``OVEN2``)."""
    return re.compile(rf"\b(?:{'|'.join(patterns)})(?![^\W\d_])", re.IGNORECASE)


HEATING_WORDS = _word_pattern(
    r"heat(?! (?:exchang|pump|recover|transfer|meter|sink|remov|loss|of ))",
    r"(?:re|pre)?heat(?:s|ed|ers?|ing)",
    r"ovens?|furnaces?|kilns?|boilers?|burners?",
    r"\w*heiz\w*",
    r"\w*erhitz\w*",
    r"(?:er|an|auf|vor)w(?:ä|ae)rm\w*",
    r"ofen\w*|(?:\w*(?:[^\Wh]|[aceoü]h))?(?:ofen|öfen|oefen)",
    r"\w*brenner(?!ei)\w*|brennkammer\w*|dampfkessel\w*",
)
COOLING_WORDS = _word_pattern(
    r"cool(?:s|ed|ers?|ing)?|cold(?! (?:junction|start))|chill(?:s|ed|ers?|ing)?",
    r"fridges?|freez(?:ers?|ing)|refrigerat\w*|air condition\w*",
    r"\w*k(?:ü|ue)hl\w*",
    r"\w*k(?:ä|ae)lte\w*|kalt(?!leiter|st[ae])\w*|\w*gefrier\w*|eiswasser\w*",
)
INVERSE_ACTUATORS = _word_pattern(
    r"air to close|(?:normally|fails?) open|inver(?:ted|s|se|tiert)|reversed|bypass\w*",
    r"exhaust|draft|draught|vents?|vented|venting|ventilat\w*|fans?|dampers?|quench\w*",
    r"stromlos (?:offen|auf)|feder\w* (?:ö|oe)ffne\w*|umgekehrt\w*",
    r"\w*abluft\w*|\w*l(?:ü|ue)fte[rn]\w*|\w*l(?:ü|ue)ftung\w*|gebl(?:ä|ae)se\w*|\w*klappen?|abschreck\w*",
)
"""An actuator that may work the other way round: nothing can be said then."""
OTHER_QUANTITIES = _word_pattern(
    r"[flpqsw][dfq]?[ir]?ca? ?\d*",
    r"flow|level|pressure|speed|vacuum|humidity",
    r"\w*druck\w*|\w*durchflu(?:ss|ß)\w*|\w*menge\w*|\w*f(?:ü|ue)llstand\w*|niveau\w*|\w*drehzahl\w*|\w*feuchte\w*",
)
"""What a loop without a unit controls instead; its name by ISA 5.1 (``FIC-101``) tells it, too."""
TEMPERATURE_UNIT = re.compile(
    r"(?:deg|°|º)? ?[cfk]|(?:deg(?:rees?)?|grad|°) ?\w*|℃|℉|celsius|fahrenheit|kelvin", re.IGNORECASE
)
WORD_BREAK = re.compile(r"[\W_]|(?<=[a-zäöüß])(?=[A-ZÄÖÜ][a-zäöüß])")
PURPOSE_KEYS = ("name", "description")


@frozen
class Purpose:
    """What a loop is for."""

    heats: bool
    word: str
    """As the file has it."""
    key: str
    """The key where it stands."""

    @property
    def text(self) -> str:
        """``heating`` or ``cooling``."""
        return "heating" if self.heats else "cooling"


def purpose_of(loop: Any) -> Purpose | None:
    """What a loop's words say that it does; None where they say nothing, or both."""
    texts = {key: WORD_BREAK.sub(" ", getattr(loop, key, None) or "") for key in PURPOSE_KEYS}
    all_text, unit = " ".join(texts.values()), loop.pv.unit
    if INVERSE_ACTUATORS.search(all_text) or (
        OTHER_QUANTITIES.search(all_text) if unit is None else not TEMPERATURE_UNIT.fullmatch(unit)
    ):
        return None
    heats, cools = HEATING_WORDS.search(all_text), COOLING_WORDS.search(all_text)
    if (heats is None) is (cools is None):
        return None
    pattern = HEATING_WORDS if heats else COOLING_WORDS
    words = ((match[0], key) for key, text in texts.items() if (match := pattern.search(text)))
    return next((Purpose(heats is not None, word, key) for word, key in words), None)


# --- The action, by the word that each vendor has for it --------------------------------------------------------------

ACTION_KEY = "action"
"""The key of those whose word stands alone."""


@frozen
class Action:
    """What a loop's configuration says of the way from output to PV."""

    key: str
    raises_pv: bool
    """Whether the loop takes it that the PV rises with the output."""
    own_text: str
    """The key with its value."""
    opposite_text: str
    """The key with the opposite value."""


def action_key(vendor: Vendor) -> str:
    """The key that says the action of a loop."""
    key, blank, _ = tables_of(vendor).TUNING_NUMBERS.heating.partition(" ")
    return key.rstrip(":") if blank else ACTION_KEY


def action_word(vendor: Vendor, *, raises_pv: bool) -> str:
    """How the action is written of a loop whose PV rises with its output, or falls."""
    tuned = tables_of(vendor).TUNING_NUMBERS
    return (tuned.heating if raises_pv else tuned.cooling).rpartition(" ")[2].lower()


def action_of(vendor: Vendor, loop: object) -> Action | None:
    """The action of a loop; None where an expression gives it."""
    texts = {action_word(vendor, raises_pv=rises): rises for rises in (True, False)}
    key = action_key(vendor)
    value = value_at(loop, (key,))
    word = str(value).lower()
    if not isinstance(value, bool | str) or word not in texts:
        return None
    other = next(text for text in texts if text != word)
    return Action(key, texts[word], f"{key}: {word}", f"{key}: {other}")
