"""Configurations taken apart into their loops, and edits that do not touch a given loop.

The files are the cases of the rules and the good plants: nearly every rule has findings in them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path

from good_plants import PLANTS, WRITERS
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document

CASES = Path(__file__).parent / "cases"
FIRST = re.compile(r"^loops:[^\n]*\n", re.MULTILINE)
NAME = re.compile(r"^(\s*- (?:\{)?name: )([^\s,}#][^\s,}]*|\"[^\"]*\")", re.MULTILINE)
ADDRESSES = re.compile(r"remote_setpoint|number_of_loops|ramp_soak|address:|\{loop\}|&|\*\w")
"""What refers to places of other loops by number, or shares text: an edit elsewhere does touch it."""
MOST = 6
"""Loops of a file that grows in these tests, so that no PLC runs out of room."""


@dataclass(frozen=True)
class Parts:
    """A file: what stands before its loops, each of them, and what stands behind."""

    vendor: str
    head: str
    loops: tuple[str, ...]
    tail: str

    @property
    def text(self) -> str:
        return self.head + "".join(self.loops) + self.tail

    @property
    def names(self) -> list[str]:
        return [NAME.search(loop)[2].strip('"') for loop in self.loops]


def parts_of(text: str) -> Parts | None:
    """A file in parts; None for one that cannot be taken apart by its lines."""
    vendor, first = re.search(r"^vendor: (\w+)", text, re.MULTILINE), FIRST.search(text)
    if vendor is None or first is None or ADDRESSES.search(text):
        return None
    head, body = text[: first.end()], text[first.end() :]
    end = re.search(r"^[a-z]\w*:", body, re.MULTILINE)
    body, tail = (body[: end.start()], body[end.start() :]) if end else (body, "")
    loops = [part if part.endswith("\n") else f"{part}\n" for part in re.split(r"(?=^  - )", body, flags=re.MULTILINE)]
    if loops and not loops[0].startswith("  - "):
        head += loops.pop(0)
    found = Parts(vendor[1], head, tuple(loops), tail)
    named = all(NAME.search(loop) for loop in loops) and len(set(found.names)) == len(loops)
    return found if named and 1 < len(loops) <= MOST and checked(found.text).config is not None else None


@lru_cache(512)
def checked(text: str):
    """What is found in a text; every example begins with that of a file as it is."""
    return check_document(read_document(text.encode(), "plant.yaml"))


@cache
def pool(vendor: str) -> list[Parts]:
    """The files of a vendor that have a finding of a loop."""
    texts = [path.read_text("utf-8") for path in sorted(CASES.glob("*.yaml"))]
    texts = [text for text in texts if f"\nvendor: {vendor}\n" in text]
    files = map(_small, [*texts, *(WRITERS[vendor](plant) for plant in PLANTS)])
    return [parts for parts in files if parts and any(d.loop for d in checked(parts.text).findings)]


def _small(text: str) -> Parts | None:
    """A file with so few loops that more can be added."""
    pieces = re.split(r"(?=^  - name: )", text, flags=re.MULTILINE)
    return parts_of("".join(pieces[:5]) if len(pieces) > MOST + 1 and "blocks:" not in text else text)


NEW = {
    "dl06": "    sample_rate: 7\n    action: direct\n    tuning: {{gain: 1}}\n",
    "click": "    bits: C1{n}1\n    integers: DS1{n}1\n    floats: DF4{n}1\n    action: direct\n"
    "    action_verified: true\n    sample_rate: 1 s\n    tuning: {{proportional_gain: 1, reset_time: 60}}\n"
    "    pv: {{range: [0, 100]}}\n",
    "ezlogix": "    registers: R3{n}01\n    discretes: S3{n}1\n    algorithm: position\n    action: reverse\n"
    "    sample_rate: 1\n    tuning: {{proportional_gain: 1, integral_time: 60}}\n    pv: {{tag: IR3{n}}}\n"
    "    output: {{tag: OR3{n}}}\n",
    "nextopid": "    type: PIDA_REAL\n    SP: 5.0\n    Kp: 1.0\n    Ti_Ki: 60.0\n    Td_Kd: 0.0\n    MinMV: 0.0\n"
    "    MaxMV: 100.0\n    MinPV: 0.0\n    MaxPV: 10.0\n",
    "dpide": "    device: D2{n}100\n    SV: 5\n    CYCLE: 100 ms\n    PID_EQ: true\n    Kc_Kp: 1\n    Ti_Ki: 60 s\n"
    "    Td_Kd: 0\n    PID_DIR: true\n    MV_MAX: 100\n    MV_MIN: 0\n",
    "generic": "    output_raises_pv: true\n    sample_time: 1 s\n    tuning: {{gain: 1, integral_time: 60 s}}\n"
    "    pv: {{range: [0, 100]}}\n    setpoint: {{value: 5}}\n    output: {{range: [0, 100]}}\n",
}
"""A loop of each vendor that concerns no other one; ``n`` keeps its registers apart."""


def inserted(parts: Parts, at: int, n: int) -> Parts:
    """With a new loop at a place."""
    loop = f"  - name: ADDED{n}\n" + NEW[parts.vendor].format(n=n)
    return replace(parts, loops=(*parts.loops[:at], loop, *parts.loops[at:]))


def reordered(parts: Parts, order: list[int]) -> Parts:
    return replace(parts, loops=tuple(parts.loops[i % len(parts.loops)] for i in order))


def renamed(parts: Parts, name: str) -> Parts:
    """With another name for a loop; the same where something else speaks of it."""
    i = parts.names.index(name)
    rest = parts.head + parts.tail + "".join(loop for j, loop in enumerate(parts.loops) if j != i)
    own = parts.loops[i].replace(name, "", 1)
    if re.search(rf"(?<!\w){re.escape(name)}(?!\w)", rest + own):
        return parts
    loop = NAME.sub(lambda match: match[1] + "RENAMED", parts.loops[i], count=1)
    return replace(parts, loops=(*parts.loops[:i], loop, *parts.loops[i + 1 :]))


MOVES = {
    "dl06": (r"loop_table: V2000", "loop_table: V2400"),
    "click": (r"floats: DF\d+", "floats: DF476"),
    "ezlogix": (r"discretes: S\d+", "discretes: S201"),
    "dpide": (r"device: D\d+", "device: D25000"),
}
"""How the words of a PLC, or of another loop, get another address."""


def moved(parts: Parts, name: str) -> Parts:
    """With other addresses: of the whole table where it is one, else of one loop."""
    pattern, text = MOVES.get(parts.vendor, (r"\Z\A", ""))
    if parts.vendor == "dl06":
        return replace(parts, head=re.sub(pattern, text, parts.head))
    i = parts.names.index(name)
    return replace(parts, loops=(*parts.loops[:i], re.sub(pattern, text, parts.loops[i]), *parts.loops[i + 1 :]))


def spaced(parts: Parts, at: int) -> Parts:
    """With remarks and empty lines between the loops."""
    return replace(parts, loops=(*parts.loops[:at], f"\n  # a remark\n\n{parts.loops[at]}", *parts.loops[at + 1 :]))
