"""Examples changed by what they are made of, through every step of the product, held to what must always be true."""

from __future__ import annotations

import copy
import json
import random
import traceback
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pidcfg.api import check, convert, decode, diff, encode, simulate
from pidcfg.document import Plain
from pidcfg.limits import DEFAULT
from pidcfg.results.argument_types import ArgumentError
from pidcfg.source import read_document
from pidcfg.validate.fixes import Fixer
from pidcfg.vendors import VENDORS

ROOT = Path(__file__).parents[2]
EXAMPLES = [
    p for p in sorted((ROOT / "examples").rglob("*.yaml")) if ".scenario" not in p.name and "mistakes" not in str(p)
]
VALUES = ("0", "1", "-1", "0.1", "99.99", "100", "0.04", "65535", "32767.5", "1e-9", "1e9", "3.4e38", "true", "false",
          "off", "V2000", "V7640", "DS1", "DF500", "x", "[0, 100]", "[100, 0]", "[]", "{}", "1 min", "500 ms", "auto",
          "manual", "cascade", "direct", "reverse", "2048 counts", "999 %")  # fmt: skip
"""Values that mean something somewhere."""
STEPS = 5_000
"""Loop-steps of a simulation."""


@dataclass
class Found:
    """How far mutants came, and what was not true of them."""

    mutants: int = 0
    valid: int = 0
    codecs: int = 0
    conversions: int = 0
    simulations: int = 0
    fixes: int = 0
    failures: list[str] = field(default_factory=list)


def written(value: Any) -> str:
    """Data of the reader as YAML in flow style, plain texts as they were."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)}: {written(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(written, value)) + "]"
    return "" if value is None else str(value) if isinstance(value, Plain) else json.dumps(value, ensure_ascii=False)


def file_of(data: dict[str, Any]) -> str:
    """A configuration, a key a line."""
    return "".join(f"{key}: {written(value)}\n" for key, value in data.items())


def _places(value: Any, above: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [place for key, inner in items for place in ((*above, key), *_places(inner, (*above, key)))]


def _value(data: Any, place: tuple[Any, ...]) -> Any:
    for step in place:
        data = data[step]
    return data


def mutated(data: dict[str, Any], donor: dict[str, Any], rng: random.Random) -> dict[str, Any]:
    """A copy with one to three changes: a value, a key gone, an item twice, a part of another example."""
    data = copy.deepcopy(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        places = [place for place in _places(data) if place[0] not in {"pidcfg", "vendor"}]
        if not places:
            break
        place = rng.choice(places)
        parent, kind = _value(data, place[:-1]), rng.randrange(6)
        if kind == 0:
            del parent[place[-1]]
        elif kind == 1 and isinstance(parent, list):
            parent.insert(place[-1], copy.deepcopy(parent[place[-1]]))
        elif kind == 2:
            others = [other for other in _places(donor) if other[-1] == place[-1]]
            if others:
                parent[place[-1]] = copy.deepcopy(_value(donor, rng.choice(others)))
        elif kind == 3:
            others = [other for other in _places(donor) if isinstance(other[-1], str) and other[0] == place[0]]
            if others and isinstance(parent, dict):
                other = rng.choice(others)
                parent[other[-1]] = copy.deepcopy(_value(donor, other))
        elif kind == 4 and isinstance(parent[place[-1]], Plain) and parent[place[-1]].replace(".", "").isdigit():
            factor = rng.choice((0.0, 0.01, 0.5, 1.01, 2.0, 10.0, 1000.0, -1.0))
            parent[place[-1]] = Plain(f"{float(parent[place[-1]]) * factor:g}")
        else:
            parent[place[-1]] = Plain(rng.choice(VALUES))
    return data


def words_of(image: Any) -> Any:
    """What an image says, place by place."""
    return [(cell.number, cell.raw) for cell in image.cells]


class Fuzz:
    """Mutants of the examples, a row of them for each seed."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.examples = [(p, read_document(p.read_bytes(), p.name).data) for p in EXAMPLES]
        self.found = Found()

    def run(self, number: int, *, deep: bool = True) -> None:
        """One mutant through all steps; ``deep``: conversion and simulation too."""
        rng = random.Random(f"{self.seed} {number}")
        path, data = rng.choice(self.examples)
        donors = [d for p, d in self.examples if p.parent == path.parent]
        text = file_of(mutated(data, rng.choice(donors), rng))
        self.found.mutants += 1
        step = "check"
        try:
            for name, work in self._steps(text, rng, deep=deep):
                step = name
                work()
        except AssertionError as error:
            self._failed(number, path, step, str(error) or "an assertion")
        except Exception:  # noqa: BLE001 - whatever is raised is a finding
            self._failed(number, path, step, traceback.format_exc().strip().replace("\n", " | ")[-400:])

    def _failed(self, number: int, path: Path, step: str, why: str) -> None:
        self.found.failures.append(f"{self.seed} {number} {path.parent.name}/{path.stem} {step}: {why}")

    def _steps(self, text: str, rng: random.Random, *, deep: bool) -> Any:
        result = check(text, name="m.yaml")
        yield "fix", lambda: self._fix(text)
        if not result.ok:
            return
        self.found.valid += 1
        vendor = str(read_document(text.encode(), "m.yaml").data["vendor"])
        yield "encode", lambda: self._codec(text, vendor)
        if deep:
            yield "diff", lambda: self._same(text)
            target = rng.choice([key for key in VENDORS if key != vendor])
            yield f"convert to {target}", lambda: self._convert(text, target)
            if rng.randrange(4) == 0:
                yield "simulate", lambda: self._simulate(text)

    def _fix(self, text: str) -> None:
        fixer = Fixer(lambda b: read_document(b, "m.yaml"), lambda d: list(check(d.text, name="m.yaml").findings),
                      bool)  # fmt: skip
        once = fixer.fix(text.encode())
        if once.fixed:
            self.found.fixes += 1
            again = fixer.fix(once.data)
            assert again.data == once.data, "a second --fix changes the file again"
            codes = {(d.code, d.path) for d in once.left}
            assert not any((d.code, d.path) in codes for d in once.fixed), "a finding that was corrected is still there"

    def _codec(self, text: str, vendor: str) -> None:
        first = encode(text, "json", name="m.yaml")
        assert first.ok, "what validates does not encode"
        back = decode(first.text, vendor, name="m.json")
        assert back.ok, f"what encodes does not decode: {back.findings[:1]}"
        second = encode(back.text, "json", name="b.yaml", allow_errors=True)
        self.found.codecs += 3
        faults = [d.message for d in second.findings if d.severity.name == "ERROR"]
        assert second.ok, f"what was decoded does not encode: {faults[:2]}"
        noted = any("these words differ" in note for note in back.notes)
        assert noted or words_of(first.image) == words_of(second.image), "other words come back, and no note says so"

    def _same(self, text: str) -> None:
        result = diff(text, text)
        assert result.ok and result.same, "a file differs from itself"  # noqa: PT018

    def _convert(self, text: str, target: str) -> None:
        try:
            result = convert(text, target, name="m.yaml")
        except ArgumentError:
            return
        self.found.conversions += 1
        if result.text:
            again = check(result.text, name="c.yaml")
            faults = [d.code for d in again.findings if d.code.startswith("PID0") and d.severity.name == "ERROR"]
            assert not faults, f"the converted file is refused: {faults[:3]}"
            assert result.text == convert(text, target, name="m.yaml").text, "twice is not the same"

    def _simulate(self, text: str) -> None:
        import dataclasses

        limits = dataclasses.replace(DEFAULT, loop_steps=STEPS)
        once = [simulate(text, engine="python", name="m.yaml", limits=limits).to_json() for _ in range(2)]
        self.found.simulations += 1
        assert once[0] == once[1], "two runs differ"
