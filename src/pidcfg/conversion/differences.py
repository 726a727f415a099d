"""What a comparison of two configurations gives, and how grave a difference is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from decimal import Decimal
from typing import Any, Literal, NamedTuple

from pidcfg.conversion import json_value, number_of
from pidcfg.conversion.terms import CALCULATED_TEXT, Subject
from pidcfg.conversion.vendor_terms import outputs_of
from pidcfg.encoders.contract import tables_of
from pidcfg.encoders.decoding import owner_name
from pidcfg.schemas.iec import Wire
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision
from pidcfg.vendors import Vendor

# --- What a comparison of two configurations gives: their loops, and what differs in each, by what can go wrong -------

Risk = Literal["critical", "high", "medium", "low", "cosmetic"]
Status = Literal["same", "disturbed", "changed", "renamed", "moved", "added", "removed"]
StateKind = Literal["error", "stopped", "tuning"]
RISKS: tuple[Risk, ...] = ("critical", "high", "medium", "low", "cosmetic")
"""From harmful to harmless."""


@frozen
class Difference:
    """One key that differs; ``note`` says what it means.

    Within a vendor ``key`` is the file's, and the numbers are the file's in ``unit``; ``field`` is the neutral field
    that it becomes, else the key itself. Between vendors there is the neutral field alone.
    """

    field: str
    risk: Risk
    before: Any
    after: Any
    note: str = ""
    key: str = ""
    unit: str = ""
    address: str = ""
    """The register, as the vendor writes it; empty: no register holds it."""
    word_before: str | None = None
    word_after: str | None = None
    """The content of the register as the PLC shows it."""

    @property
    def other_word_only(self) -> bool:
        """Whether the value is the same on a scale that is another one, so that its word differs."""
        return self.before is not None and self.before == self.after and self.word_before != self.word_after


@frozen
class State:
    """What a word says of a loop that does not run as it is set up."""

    kind: StateKind
    text: str
    key: str
    """The register's name."""
    address: str
    word: str
    """Its content as the PLC shows it."""
    side: str = ""
    """The name of the listing, where both sides are listings."""


@frozen
class LoopComparison:
    """A loop on both sides, or on one side only."""

    loop: str
    """Its name on the second side, or on the only one; empty: what belongs to no loop."""
    status: Status
    differences: tuple[Difference, ...] = ()
    was: str = ""
    """Its name on the first side, where that is another one."""
    moved: tuple[str, str] | None = None
    """Where its registers begin on both sides, where that differs; without addresses, its number in the file."""
    operated: tuple[Difference, ...] = ()
    """What the operator sets: shown apart, and no difference."""
    left_out: tuple[str, ...] = ()
    """Keys of words that differ and that the PLC or the process writes."""
    missing: tuple[str, ...] = ()
    """Keys that a listing does not hold."""
    states: tuple[State, ...] = ()
    """What a listing says of a loop that does not run as it is set up."""

    @property
    def same(self) -> bool:
        """Whether nothing differs that counts, and the loop runs as it is set up."""
        return self.status == "same"

    def with_states(self, states: tuple[State, ...]) -> LoopComparison:
        """The same, and what listings say of its state; that is no setting of the operator's beside it."""
        told_keys = {state.key for state in states}
        operated = tuple(d for d in self.operated if d.key not in told_keys)
        status: Status = "disturbed" if states and self.same else self.status
        return replace(self, states=states, operated=operated, status=status)


def rank_by_risk(loop: str, differences: Iterable[Difference]) -> LoopComparison:
    """A loop on both sides, what can go most wrong first."""
    rows = sort_by_risk(differences)
    return LoopComparison(loop, "changed" if rows else "same", rows)


def sort_by_risk(differences: Iterable[Difference]) -> tuple[Difference, ...]:
    """What can go most wrong first."""
    return tuple(sorted(differences, key=lambda difference: RISKS.index(difference.risk)))


# --- How grave a difference of the neutral loops is: what can go wrong with the plant ---------------------------------

LARGE_FACTOR = Decimal(2)
"""A gain that grows or falls by more than this factor is another controller."""
ROUNDING_TOLERANCE = Decimal("0.001")
"""Of a value, and of its scale: differences below this are what two vendors' registers make of one value."""

# fmt: off
LOW_ENDS = ("setpoint.limits.0", "output.limits.0")
HIGH_ENDS = ("setpoint.limits.1", "output.limits.1")
HIGH_ALARMS = ("alarms.pv.high", "alarms.pv.high_high", "alarms.deviation.high", "alarms.deviation.high_high",
               "alarms.rate_of_change")
LOW_ALARMS = ("alarms.pv.low", "alarms.pv.low_low")
FIELD_RISKS: dict[str, tuple[Risk, str]] = {
    "output_raises_pv":    ("critical", "the action is reversed: positive feedback on the same plant"),
    "pv.range.0":          ("high", "every quantity on the PV's scale and the gain mean something else"),
    "pv.range.1":          ("high", "every quantity on the PV's scale and the gain mean something else"),
    "pv.square_root":      ("high", "the PV means something else"),
    "output.range.0":      ("high", "the output's scale and the gain mean something else"),
    "output.range.1":      ("high", "the output's scale and the gain mean something else"),
    "anti_windup":         ("high", "the integral behaves otherwise at the limits"),
    "tuning.proportional": ("high", "the proportional action is switched"),
    "setpoint.source":     ("high", "the set point comes from elsewhere"),
    "mode":                ("high", "the loop starts in another mode"),
    "output.max_rate":     ("high", "the output moves at another speed"),
}
COSMETIC_FIELDS = ("name", "description", "pv.unit", "output.unit")
SWITCH_FIELDS = ("anti_windup", "tuning.proportional", "pv.square_root", "output_raises_pv")
"""Fields that a number becomes only when it is switched on or off."""
RANKED_FIELDS = frozenset((*FIELD_RISKS, *LOW_ENDS, *HIGH_ENDS, *HIGH_ALARMS, *LOW_ALARMS))
"""Fields that are ranked by name; a vendor's key may have the same one."""
# fmt: on


# fmt: off
LOOP_SET_KEYS: dict[str, str] = {
    "plc.number_of_loops": "how many loops the PLC calculates, from the first on",
    "plc.loop_table":      "the PLC takes every loop from other words",
    "configuration":       "",
}
# fmt: on
"""Keys that decide which loops there are, whatever their own words say."""
PLACE_KEYS = ("loop_table", "registers", "discretes", "bits", "integers", "floats", "device")
SIGNAL_WORDS = ("tag", "format", "transfer", "counts", "pwm", "curve")
"""Words of keys that say which signal is read or driven, and what its counts mean."""
LABEL_KEYS = ("bumpless", "slot", "channel")
"""Words of keys whose numbers are names: half as much of them means nothing."""
_FORM_NOTE = "integral and derivative mean something else: times with one, gains with the other"
FORM_KEYS = {"Indep": _FORM_NOTE, "PID_EQ": _FORM_NOTE, "reset_unit": "the word of the reset counts in another unit"}
"""Keys by which the same numbers are other terms, and what they change."""
ACTION_KEYS = ("action", "Direct", "PID_DIR", "output_raises_pv")
"""Keys of the direction of control, whatever the vendor calls it."""


def judge_key(
    key: str, fields: Iterable[str], before: object, after: object, *, is_scaled: bool = False
) -> tuple[str, Risk, str]:
    """The field that a key of a vendor is, how grave its difference is, and what it means.

    ``fields``: the neutral fields that it becomes; of several the one of which most can go wrong. ``is_scaled``: both
    are numbers, each with a unit of its own.
    """
    last = key.rpartition(".")[2]
    if last in ACTION_KEYS:
        return ("output_raises_pv", *FIELD_RISKS["output_raises_pv"])
    if last in FORM_KEYS:
        return key, "high", FORM_KEYS[last]
    one, two = number_of(before), number_of(after)
    is_word = not is_scaled and (isinstance(before, bool | str) or isinstance(after, bool | str))
    is_switched = is_word or bool(before) != bool(after)
    ends = {_matching_field(name, key) for name in fields if is_switched or name not in SWITCH_FIELDS}
    names = sorted(name for name in ends if name is not None)
    names = names or [key] * (key in RANKED_FIELDS)
    ranks = [(name, *_field_risk(name, before, after, one, two)) for name in names]
    field, risk, note = min(ranks, key=lambda rank: RISKS.index(rank[1]), default=(key, *_key_risk(key, before, after)))
    if one and two is not None and not note and last not in LABEL_KEYS:
        note = _percent_text(one, two)
    return field, risk, note


def _matching_field(name: str, key: str) -> str | None:
    """The neutral field of a key that may be one end of a pair; None where the name is of the other end."""
    ends = ("0", "1")
    end, other = key.rpartition(".")[2], name.rpartition(".")[2]
    if end not in ends:
        return name
    return f"{name}.{end}" if other not in ends else name if end == other else None


def _key_risk(key: str, before: object, after: object) -> tuple[Risk, str]:
    """How grave a difference of a key is that becomes no neutral field."""
    if key in LOOP_SET_KEYS:
        is_gone = before == CALCULATED_TEXT
        return "high", "the PLC no longer runs this loop" if is_gone else LOOP_SET_KEYS[key]
    last = key.rpartition(".")[2]
    if last in {*COSMETIC_FIELDS, "unit"}:
        return "cosmetic", ""
    if last in PLACE_KEYS:
        return "low", ""
    if last.endswith("enabled") and key.startswith("alarms"):
        return ("high", "the alarm is gone") if before and not after else ("low", "a new alarm")
    return ("high" if any(word in key for word in SIGNAL_WORDS) else "medium"), ""


def judge_difference(field: str, before: object, after: object, width: Decimal | None = None) -> Difference:
    """The difference of a field, with its risk and what it means; ``width``: of the scale that it is a point of."""
    one, two = number_of(before), number_of(after)
    risk, note = _field_risk(field, before, after, one, two)
    if one and two is not None and abs(two - one) <= ROUNDING_TOLERANCE * min(abs(one), width or abs(one)):
        risk, note = "cosmetic", "the registers' rounding"
    elif one and two is not None and not note:
        note = _percent_text(one, two)
    return Difference(field, risk, json_value(before), json_value(after), note)


def _percent_text(one: Decimal, two: Decimal) -> str:
    percent = float(two / one - 1) * 100
    return f"{percent:+.0f} %" if 1000 <= abs(percent) < 1e6 else f"{percent:+.3g} %"


def _field_risk(
    field: str, before: object, after: object, one: Decimal | None, two: Decimal | None
) -> tuple[Risk, str]:
    """How grave a difference is, and what it means."""
    if field in COSMETIC_FIELDS:
        return "cosmetic", ""
    if field in FIELD_RISKS:
        return FIELD_RISKS[field]
    if field in {*LOW_ALARMS, *HIGH_ALARMS}:
        return _alarm_risk(field, before, after, one, two)
    if field in {*LOW_ENDS, *HIGH_ENDS} and one is not None and two is not None:
        wider = two > one if field in HIGH_ENDS else two < one
        return ("high", "the limit is wider") if wider else ("medium", "the limit is narrower")
    if field == "tuning.gain" and one and two is not None and not LARGE_FACTOR >= two / one >= 1 / LARGE_FACTOR:
        return "high", ""
    return "medium", ""


def _alarm_risk(
    field: str, before: object, after: object, one: Decimal | None, two: Decimal | None
) -> tuple[Risk, str]:
    if after is None:
        return "high", "the alarm is gone"
    if before is None:
        return "low", "a new alarm"
    outward = one is not None and two is not None and (two > one if field in HIGH_ALARMS else two < one)
    return ("high", "the alarm comes later") if outward else ("low", "the alarm comes earlier")


# --- States: what a listing's words say of a loop that does not run as it is set up -----------------------------------

D921 = Decision(
    921,
    "a loop that does not run as it is set up is not the same",
    "`diff` against a listing and `compare` with a PLC tell of each loop what its words say: an error of the loop or "
    "its set-up, PID_RUN FALSE, an auto-tune that runs or holds the output, one that has ended with an error. Such a "
    "loop is `disturbed` where its configuration is the same, and counts for --exit-code. Modes, alarms, warnings and "
    "saturation are left out as before, and so is a state that the file asks for, `PID_RUN: false`.",
    "Who compares an upload asks whether the plant runs what the file says. A mode and an alarm come and go with the "
    "process; an error stays until somebody corrects it, and the loop stands in Manual, or still, meanwhile.",
)


class StateRule(NamedTuple):
    """A register or parameter that tells of a state, and which contents do; ``text`` may quote them, and a meaning."""

    register: str
    kind: StateKind
    text: str = "{meaning}"
    bits: tuple[int, ...] = ()
    """Each of these by itself; their meanings are the titles of the map."""
    contents: tuple[object, ...] = ()
    """Without bits: these; none given: whatever is not 0."""


TUNE_RUNNING = "an auto-tune is running"
OUTPUT_ERRORS = ("ErrBits.", "Error", "AutoTuneError")
"""Outputs of NextoPID's blocks that tell of an error, and the structure of the error bits."""
# fmt: off
STATE_RULES: Mapping[str, tuple[StateRule, ...]] = {
    "dl06": (
        StateRule("mode_and_alarm_status", "error", bits=(10, 11, 13)),
        StateRule("mode_and_alarm_status", "tuning", TUNE_RUNNING, bits=(12,)),
        StateRule("ramp_soak_errors", "error", bits=(0, 1, 4)),
        StateRule("error_flags", "error", bits=(0, 1, 2, 3)),
    ),
    "click": (
        StateRule("error_code", "error", "error {content}{meaning}"),
        StateRule("autotune_request", "tuning", TUNE_RUNNING),
    ),
    "ezlogix": (
        StateRule("autotune_status", "tuning", f"{TUNE_RUNNING}{{meaning}}", contents=(1, 2)),
        StateRule("autotune_status", "error", "autotune error {content}{meaning}", contents=(5, 6, 7, 8, 9, 10)),
    ),
    "dpide": (
        StateRule("PID_RUN", "stopped", "PID_RUN is FALSE{meaning}", contents=(False,)),
        StateRule("PID_MODE", "tuning", TUNE_RUNNING, contents=(1,)),
    ),
    "nextopid": (
        *(StateRule(name, "error", "{register} is TRUE{meaning}", contents=(True,)) for name in OUTPUT_ERRORS),
        StateRule("AutoTune", "tuning", f"AutoTune is TRUE: {TUNE_RUNNING}, or holds MV at its end", contents=(True,)),
    ),
}
# fmt: on
"""By vendor."""


def states_of(subject: Subject, other: Subject) -> Iterator[tuple[str, State]]:
    """What a listing says of its loops and blocks, each with its name; empty: of all of them.

    What the other side, a file of the same vendor, says as well is no trouble but its will.
    """
    if subject.reading is None:
        return
    other_words = other.encoding.image.words if other.reading is None and other.vendor is subject.vendor else {}
    rules = STATE_RULES.get(subject.vendor.key, ())
    for owner, register, number, content, meanings in _listing_contents(subject):
        for rule in rules:
            if _matches_register(rule, register) and other_words.get(number, object()) != content:
                yield from (
                    (owner, state) for state in _content_states(rule, subject, register, number, content, meanings)
                )


def _matches_register(rule: StateRule, register: str) -> bool:
    name = rule.register
    return register.startswith(name) if name.endswith(".") else register == name


def _content_states(
    rule: StateRule, subject: Subject, register: str, number: object, content: Any, meanings: Mapping[int | None, str]
) -> Iterator[State]:
    """The states that a content shows."""
    space = subject.encoding.space
    address, word = (
        (str(number), str(content).upper())
        if space is None
        else (space.name(number), space.content_text(number, content))
    )
    for bit in rule.bits:
        if content >> bit & 1:
            yield State(rule.kind, rule.text.format(meaning=meanings[bit]), register, f"{address}.{bit}", "1")
    if not rule.bits and (content in rule.contents if rule.contents else content):
        text = rule.text.removesuffix("{meaning}")
        meaning = _content_meaning(subject.vendor, register, content) or meanings.get(None, "")
        more = f": {meaning}" if meaning and text != rule.text else ""
        yield State(rule.kind, text.format(content=content, register=register) + more, register, address, word)


def _content_meaning(vendor: Vendor, register: str, content: object) -> str:
    """What a number, or the state of a switch, stands for."""
    tables = tables_of(vendor)
    codes = (code.title for code in getattr(tables, "CODES", ()) if (code.register, code.number) == (register, content))
    return next(codes, "") or str(getattr(tables, "STATES", {}).get((register, content), ""))


def _listing_contents(subject: Subject) -> Iterator[tuple[str, str, Any, Any, Mapping[int | None, str]]]:
    """What a listing holds: owner, register, number, content, and titles of bits; None: of the whole."""
    words = {} if subject.reading is None else subject.reading.listing.words
    if subject.encoding.space is None:
        titles = outputs_of(subject.vendor)
        names = [owner_name(entry) for entry in subject.encoding.image.settings]
        for number, content in words.items():
            owner = max((name for name in names if str(number).startswith(f"{name}.")), key=len, default="")
            if owner and not isinstance(content, Wire):
                register = str(number).removeprefix(f"{owner}.")
                yield owner, register, number, content, {None: titles.get(register, "")}
        return
    for block in subject.encoding.blocks:
        for row in block.table.words:
            content = words.get(block.start + row.offset)
            if content is not None:
                bits = {bit.bits[0]: bit.title for bit in block.table.bits if bit.offset == row.offset}
                yield block.loop or "", row.name, block.start + row.offset, content, bits
