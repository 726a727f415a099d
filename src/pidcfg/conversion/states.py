"""What a listing's words say of a loop that does not run as it is set up: errors, a stop, an auto-tune."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.conversion.differences import State
from pidcfg.conversion.vendor_terms import outputs_of
from pidcfg.encoders.contract import tables_of
from pidcfg.encoders.decoding import name_in
from pidcfg.schemas.iec import Wire
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.conversion.differences import StateKind
    from pidcfg.conversion.terms import Subject
    from pidcfg.vendors import Vendor

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


class Trouble(NamedTuple):
    """A register or parameter that tells of a state, and which contents do; ``text`` may quote them, and a meaning."""

    register: str
    kind: StateKind
    text: str = "{meaning}"
    bits: tuple[int, ...] = ()
    """Each of these by itself; their meanings are the titles of the map."""
    contents: tuple[Any, ...] = ()
    """Without bits: these; none given: whatever is not 0."""


RUNNING = "an auto-tune is running"
OUTPUT_ERRORS = ("ErrBits.", "Error", "AutoTuneError")
"""Outputs of NextoPID's blocks that tell of an error, and the structure of the error bits."""
# fmt: off
TROUBLES: Mapping[str, tuple[Trouble, ...]] = {
    "dl06": (
        Trouble("mode_and_alarm_status", "error", bits=(10, 11, 13)),
        Trouble("mode_and_alarm_status", "tuning", RUNNING, bits=(12,)),
        Trouble("ramp_soak_errors", "error", bits=(0, 1, 4)),
        Trouble("error_flags", "error", bits=(0, 1, 2, 3)),
    ),
    "click": (
        Trouble("error_code", "error", "error {content}{meaning}"),
        Trouble("autotune_request", "tuning", RUNNING),
    ),
    "ezlogix": (
        Trouble("autotune_status", "tuning", f"{RUNNING}{{meaning}}", contents=(1, 2)),
        Trouble("autotune_status", "error", "autotune error {content}{meaning}", contents=(5, 6, 7, 8, 9, 10)),
    ),
    "dpide": (
        Trouble("PID_RUN", "stopped", "PID_RUN is FALSE{meaning}", contents=(False,)),
        Trouble("PID_MODE", "tuning", RUNNING, contents=(1,)),
    ),
    "nextopid": (
        *(Trouble(name, "error", "{register} is TRUE{meaning}", contents=(True,)) for name in OUTPUT_ERRORS),
        Trouble("AutoTune", "tuning", f"AutoTune is TRUE: {RUNNING}, or holds MV at its end", contents=(True,)),
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
    wanted = other.encoding.image.words if other.reading is None and other.vendor is subject.vendor else {}
    troubles = TROUBLES.get(subject.vendor.key, ())
    for owner, register, number, content, meanings in _contents(subject):
        for trouble in troubles:
            if _tells_of(trouble, register) and wanted.get(number, object()) != content:
                yield from ((owner, state) for state in _states(trouble, subject, register, number, content, meanings))


def _tells_of(trouble: Trouble, register: str) -> bool:
    name = trouble.register
    return register.startswith(name) if name.endswith(".") else register == name


def _states(
    trouble: Trouble, subject: Subject, register: str, number: Any, content: Any, meanings: Mapping[int | None, str]
) -> Iterator[State]:
    """The states that a content shows."""
    space = subject.encoding.space
    address, word = (
        (str(number), str(content).upper()) if space is None else (space.name(number), space.shown(number, content))
    )
    for bit in trouble.bits:
        if content >> bit & 1:
            yield State(trouble.kind, trouble.text.format(meaning=meanings[bit]), register, f"{address}.{bit}", "1")
    if not trouble.bits and (content in trouble.contents if trouble.contents else content):
        text = trouble.text.removesuffix("{meaning}")
        meaning = _meaning(subject.vendor, register, content) or meanings.get(None, "")
        more = f": {meaning}" if meaning and text != trouble.text else ""
        yield State(trouble.kind, text.format(content=content, register=register) + more, register, address, word)


def _meaning(vendor: Vendor, register: str, content: Any) -> str:
    """What a number, or the state of a switch, stands for."""
    tables = tables_of(vendor)
    codes = (code.title for code in getattr(tables, "CODES", ()) if (code.register, code.number) == (register, content))
    return next(codes, "") or str(getattr(tables, "STATES", {}).get((register, content), ""))


def _contents(subject: Subject) -> Iterator[tuple[str, str, Any, Any, Mapping[int | None, str]]]:
    """What a listing holds: owner, register, number, content, and titles of bits; None: of the whole."""
    words = {} if subject.reading is None else subject.reading.listing.words
    if subject.encoding.space is None:
        titles = outputs_of(subject.vendor)
        names = [name_in(entry) for entry in subject.encoding.image.settings]
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
