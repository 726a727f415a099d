"""Examples changed by what they are made of, through every step of the product, held to what must always be true."""

from __future__ import annotations

import random
import re
import traceback
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from conversion_measure import unspoken
from pidcfg.api import check, convert, decode, diff, encode, simulate
from pidcfg.encoders.listing import UnwritableError
from pidcfg.output.arguments import ArgumentError
from pidcfg.output.sheet_reader import read_configuration
from pidcfg.output.sheets import as_csv
from pidcfg.schemas.iec import Wire
from pidcfg.sim.engine import choice as engine
from pidcfg.text.reader import DEFAULT
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document
from pidcfg.validate.fixes import Fixer
from pidcfg.vendors import VENDORS
from reliability import commands
from reliability.mutations import file_of, mutated

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from pidcfg.output.runs import SimulateResult
    from pidcfg.sim.engine.choice import EngineName

    Step = tuple[str, Callable[[], None]]

ROOT = Path(__file__).parents[2]
EXAMPLES = [p for p in sorted((ROOT / "examples").rglob("*.yaml")) if ".scenario" not in p.name]
SOUND = [p for p in EXAMPLES if p.parent.name != "mistakes"]
LIMITS = replace(DEFAULT, loop_steps=100_000)
SHORT = "100 s"
"""The duration of some changed scenarios."""
TOO_LONG = f"loop-steps; the limit is {LIMITS.loop_steps}"
SIMULATED = 3
"""Of so many valid mutants one is simulated."""
NAME = "m.yaml"
TENTHS = re.compile(r"\b([0-9]+)\.0+\b")


@dataclass
class Found:
    """How far mutants came, and what was not true of them."""

    mutants: int = 0
    valid: int = 0
    codecs: int = 0
    conversions: int = 0
    sheets: int = 0
    simulations: int = 0
    compiled: int = 0
    fixes: int = 0
    commands: int = 0
    branches: int = 0
    """New ones."""
    failures: list[str] = field(default_factory=list)


def words_of(image: Any) -> Any:
    """What an image says, place by place."""
    return [(cell.number, cell.raw) for cell in image.cells]


def meant(image: Any) -> Any:
    """The same, where 2 and 2.0 in an expression are one number."""
    return [(place, TENTHS.sub(r"\1", raw.text) if isinstance(raw, Wire) else raw) for place, raw in words_of(image)]


def by_place(image: Any) -> Any:
    """The same, whichever of the signals is declared first."""
    return sorted(meant(image), key=str)


class Fuzz:
    """Mutants of the examples, a row of them for each seed."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.examples = [(p, read_document(p.read_bytes(), p.name).data) for p in EXAMPLES]
        self.scenarios = {p: _data(p.with_suffix(".scenario.yaml")) for p in SOUND}
        self.found = Found()

    def prepare(self) -> None:
        """Compiles what is to be in the memory of every copy of this process."""
        if engine.is_installed():
            for path, data in self.scenarios.items():
                text = file_of({**data, "duration": SHORT, "events": [], "expect": []})
                files = {str(data["config"]): path.read_text("utf-8")}
                simulate(text, engine="numba", name="s.yaml", files=files)

    def run(self, number: int, *, deep: bool = True) -> None:
        """One mutant through all steps; ``deep``: conversion, simulation and commands too."""
        rng = random.Random(f"{self.seed} {number}")
        path, data = rng.choice(self.examples)
        donors = [d for p, d in self.examples if p.parent == path.parent]
        text = file_of(mutated(data, rng.choice(donors), rng))
        self.found.mutants += 1
        step = "check"
        try:
            for name, work in self._steps(text, path, rng, deep=deep):
                step = name
                work()
        except AssertionError as error:
            self._failed(number, path, step, str(error) or "an assertion")
        except Exception:  # noqa: BLE001 - whatever is raised is a finding
            self._failed(number, path, step, traceback.format_exc().strip().replace("\n", " | ")[-400:])

    def _failed(self, number: int, path: Path, step: str, why: str) -> None:
        self.found.failures.append(f"{self.seed} {number} {path.parent.name}/{path.stem} {step}: {why}")

    def _steps(self, text: str, path: Path, rng: random.Random, *, deep: bool) -> Iterator[Step]:
        result = check(text, name=NAME)
        vendor = str(read_document(text.encode(), NAME).data["vendor"])
        target = rng.choice([key for key in VENDORS if key != vendor])
        yield "fix", lambda: self._fix(text)
        if deep:
            scenario = self._scenario(path, rng)
            yield "command", lambda: self._command(text, scenario, vendor, rng, ok=result.ok)
            yield "diff with the example", lambda: self._other(path.read_text("utf-8"), text)
        if not result.ok:
            if deep:
                yield f"convert to {target}", lambda: self._refused(text, target)
            return
        self.found.valid += 1
        yield "encode", lambda: self._codec(text, vendor, rng.choice([*VENDORS[vendor].load("formats"), "json"]))
        if deep:
            yield "sheet", lambda: self._sheet(text, vendor)
            yield "diff", lambda: self._same(text)
            yield f"convert to {target}", lambda: self._convert(text, target)
            if rng.randrange(SIMULATED) == 0:
                yield "simulate", lambda: self._simulate(text, path, scenario)

    def _scenario(self, path: Path, rng: random.Random) -> str:
        """The example's scenario, mostly changed, sometimes shorter."""
        near = [data for p, data in self.scenarios.items() if p.parent == path.parent]
        data = self.scenarios.get(path) or rng.choice(list(self.scenarios.values()))
        if rng.randrange(3):
            data = mutated(data, rng.choice(near or [data]), rng)
        data = data if rng.randrange(4) else {**data, "duration": SHORT}
        return file_of({**data, "config": NAME})

    # --- the steps ----------------------------------------------------------------------------------------------------

    def _fix(self, text: str) -> None:
        fixer = Fixer(lambda b: read_document(b, NAME), lambda d: list(check(d.text, name=NAME).findings), bool)
        once = fixer.fix(text.encode())
        if once.fixed:
            self.found.fixes += 1
            again = fixer.fix(once.data)
            assert again.data == once.data, "a second --fix changes the file again"
            codes = {(d.code, d.path) for d in once.remaining}
            assert not any((d.code, d.path) in codes for d in once.fixed), "a finding that was corrected is still there"

    def _command(self, text: str, scenario: str, vendor: str, rng: random.Random, *, ok: bool) -> None:
        self.found.commands += 1
        commands.run(text, scenario, vendor, rng, ok=ok)

    def _other(self, example: str, text: str) -> None:
        result = diff(example, text)
        if result.ok and result.same:
            one, two = (encode(side, "json", name=NAME) for side in (example, text))
            images = one.image and two.image
            assert not images or by_place(one.image) == by_place(two.image), "the same, and their words differ"

    def _refused(self, text: str, target: str) -> None:
        """A file with errors: every call says so in its findings."""
        assert encode(text, "json", name=NAME, allow_errors=True).findings, "nothing is said of a file with errors"
        assert convert(text, target, name=NAME).data is None, "a file with errors was converted"
        assert simulate(text, name=NAME, limits=LIMITS).findings, "a file with errors was simulated without a word"

    def _codec(self, text: str, vendor: str, name: str) -> None:
        first = encode(text, "json", name=NAME)
        assert first.ok, "what validates does not encode"
        back = decode(first.text, vendor, name="m.json")
        assert back.ok, f"what encodes does not decode: {back.findings[:1]}"
        second = encode(back.text, "json", name="b.yaml", allow_errors=True)
        self.found.codecs += 3
        faults = [d.message for d in second.findings if d.severity.name == "ERROR"]
        assert second.ok, f"what was decoded does not encode: {faults[:2]}"
        noted = any("these words differ" in note for note in back.notes)
        assert noted or words_of(first.image) == words_of(second.image), "other words come back, and no note says so"
        if name != "json" and VENDORS[vendor].load("formats")[name].is_complete:
            self._format(text, vendor, name, first.image)

    def _format(self, text: str, vendor: str, name: str, image: Any) -> None:
        """The same through a format that holds every register."""
        try:
            written_so = encode(text, name, name=NAME)
        except UnwritableError:
            return
        if not written_so.ok or not written_so.text:
            return
        back = decode(written_so.text, vendor, format=name, like=text, name="m.txt")
        self.found.codecs += 2
        assert back.ok, f"{name}: what encodes does not decode: {back.findings[:1]}"
        second = encode(back.text, "json", name="b.yaml", allow_errors=True)
        noted = any("these words differ" in note for note in back.notes)
        assert second.ok, f"{name}: what was decoded does not encode"
        assert noted or meant(image) == meant(second.image), f"{name}: other words come back, and no note says so"

    def _sheet(self, text: str, vendor: str) -> None:
        document = read_document(text.encode(), NAME)
        sheet = as_csv(document, VENDORS[vendor])
        back = read_configuration(sheet.encode(), "m.csv", None, DEFAULT)
        self.found.sheets += 1
        one, two = (check_document(doc).config for doc in (document, read_document(back.text.encode(), "b.yaml")))
        assert one == two, "a sheet comes back as another configuration"

    def _same(self, text: str) -> None:
        result = diff(text, text)
        assert result.ok and result.same, "a file differs from itself"  # noqa: PT018

    def _convert(self, text: str, target: str) -> None:
        try:
            result = convert(text, target, name=NAME)
        except ArgumentError:
            return
        self.found.conversions += 1
        if not result.text:
            return
        again = check(result.text, name="c.yaml")
        faults = [d.code for d in again.findings if d.code.startswith("PID0") and d.severity.name == "ERROR"]
        assert not faults, f"the converted file is refused: {faults[:3]}"
        assert result.text == convert(text, target, name=NAME).text, "twice is not the same"
        config = check_document(read_document(text.encode(), NAME)).config
        silent = [f for i, _ in result.pairs for f in unspoken(config, i, result.loops[i].changes)]
        assert not silent, f"no line of the report speaks of {silent[:3]}"

    def _simulate(self, text: str, path: Path, scenario: str) -> None:
        """The scenario of the example, changed as well, or the one that is drafted: the same in every engine."""
        if len(scenario) % 2 and path in self.scenarios:
            source, files = scenario, {NAME: text}
            fine = check(source, name="s.yaml", files=files).ok
        else:
            source, files, fine = text, None, False
        results = [self._run(source, files, name) for name in self._engines()]
        self.found.simulations += 1
        refused = results[0][0] == "refused" and TOO_LONG not in results[0][1]
        assert not (fine and refused), f"checked without an error, and not run: {results[0][1]}"
        assert all(one == results[0] for one in results), "engines differ"

    def _engines(self) -> tuple[EngineName, ...]:
        """CPython twice, since a run may leave nothing behind, and compiled kernels where there are any."""
        if not engine.is_installed():
            return "python", "python"
        self.found.compiled += 1
        return "python", "python", "numba"

    def _run(self, source: str, files: dict[str, str] | None, name: EngineName) -> tuple[str, str]:
        result: SimulateResult = simulate(source, engine=name, name="s.yaml", files=files, limits=LIMITS)
        if result.report is None:
            return "refused", repr([d.message for d in result.findings])
        data = result.to_json()
        data.pop("engine")
        return "ran", repr(data)


def _data(path: Path) -> dict[str, Any]:
    data: dict[str, Any] = read_document(path.read_bytes(), path.name).data
    return data
