"""The inputs of a report: every file is read, checked and run once, by this process or by several."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pidcfg.cli.files.identity import note_read
from pidcfg.cli.files.inputs import FILES, document, read_entries, read_input
from pidcfg.diagnostics import ordered
from pidcfg.document import Document, Node
from pidcfg.encoders.settings import read_settings
from pidcfg.encoders.words import DecodeError
from pidcfg.processes import Crew
from pidcfg.report.content import SourceFile
from pidcfg.report.run_content import Units
from pidcfg.report.runs import Run, run_sheet
from pidcfg.report.sheets import plc_sheet
from pidcfg.validate.engine import Checked, check_document, is_scenario

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from pidcfg.cli.files.inputs import Input
    from pidcfg.diagnostics import Diagnostic
    from pidcfg.limits import Limits
    from pidcfg.report.content import PlcSheet
    from pidcfg.report.run_content import RunSheet
    from pidcfg.scenario.axes import Axes
    from pidcfg.scenario.load import Loaded
    from pidcfg.scenario.outcome import Outcome

SCENARIO = re.compile(rb"^scenario[ \t]*:", re.MULTILINE)
"""What a scenario looks like to whoever only counts them."""


@dataclass(frozen=True, slots=True)
class Configured:
    """A configuration or a memory listing, and the sheet on it."""

    file: SourceFile
    sheet: PlcSheet
    findings: Sequence[Diagnostic] = ()


@dataclass(frozen=True, slots=True)
class Ran:
    """A scenario and its run; it travels between processes."""

    file: SourceFile
    sheet: RunSheet
    outcome: Outcome
    """Without the recording and the texts of the files."""
    findings: Sequence[Diagnostic]
    named: Configured | None
    """What it runs, unless the command line has a file by this name."""


Taken = Configured | Ran


@dataclass(frozen=True)
class Taker:
    """Reads, checks and runs one file after the other."""

    limits: Limits
    names: frozenset[str]
    """The files of the command line."""
    runs: int
    """About how many of them are scenarios."""
    pictures: bool
    """Whether the runs are recorded for charts."""
    progress: Callable[[float], None] | None = None

    @cached_property
    def configured(self) -> dict[str, Configured]:
        """The configurations that scenarios have named, and that the command line does not."""
        return {}

    @cached_property
    def run(self) -> dict[str, Checked]:
        """The configuration that was run last, checked; it often is the next file."""
        return {}

    def __call__(self, entry: Input) -> Taken:
        """One file of the command line; a file that cannot be opened ends the command."""
        if not entry.piped:
            entry = read_input(entry.name, self.limits)
        run = self.run.pop(entry.name, None)
        if run is not None and run.document.text.encode() == entry.data:
            return configured(entry, run)
        doc = document(entry, self.limits)
        if entry.problem is not None:
            raise click.ClickException(entry.problem)
        return self._run(entry, doc) if is_scenario(doc) else configured(entry, check_document(doc, self.limits))

    def _run(self, entry: Input, doc: Document) -> Ran:
        from pidcfg.scenario.charts import charts_of, signals_before_root
        from pidcfg.scenario.load import load
        from pidcfg.scenario.outcome import simulate_loaded
        from pidcfg.sim.run import Settings

        loaded = load(doc, self.limits, FILES)
        settings = Settings(max_loop_steps=self.limits.loop_steps, progress=self.progress, runs=self.runs)
        outcome = simulate_loaded(loaded, settings, record=self.pictures)
        run = Run(
            outcome.file,
            outcome.config,
            outcome.report,
            passed=outcome.passed,
            unjudged=outcome.unjudged,
            title=str((doc.data or {}).get("scenario") or ""),
            charts=charts_of(outcome) if outcome.recording is not None else (),
            units={loop: units_of(axes) for loop, axes in outcome.axes.items()},
            before_root=signals_before_root(outcome),
        )
        findings = [d for d in outcome.findings if d.file == doc.file or d.file not in loaded.documents]
        slim = replace(outcome, recording=None, documents={}, axes={})
        self.run.clear()
        if loaded.checked is not None:
            self.run[loaded.config] = loaded.checked
        return Ran(source_file(entry, "scenario"), run_sheet(run), slim, findings, self._named(loaded))

    def _named(self, loaded: Loaded) -> Configured | None:
        """The configuration that a scenario names, or the memory listing."""
        name = loaded.config
        if not name or name in self.names:
            return None
        if name not in self.configured:
            entry = read_input(name, self.limits)
            if entry.problem is not None:
                return None
            if loaded.checked is not None:
                self.configured[name] = configured(entry, loaded.checked)
            elif name in loaded.documents:
                self.configured[name] = configured(entry, check_document(loaded.documents[name], self.limits))
            elif loaded.vendor is not None:
                self.configured[name] = configured(entry, decoded(name, loaded), "memory listing")
        return self.configured.get(name)


def configured(entry: Input, checked: Checked, kind: str = "configuration") -> Configured:
    """A checked configuration with its sheet."""
    return Configured(source_file(entry, kind), plc_sheet(checked), ordered(list(checked.findings)))


def source_file(entry: Input, kind: str) -> SourceFile:
    """A file with its hash."""
    return SourceFile(entry.name, kind, len(entry.data), hashlib.sha256(entry.data).hexdigest())


def effort(taken: Taken) -> float:
    """What a file has taken beside its reading, in µs."""
    return taken.outcome.effort if isinstance(taken, Ran) else 0.0


def units_of(axes: Axes) -> Units:
    """The units of a loop and its signals; before a root a PV has none."""
    pv = "" if axes.root is not None else axes.pv_unit
    signals = {axes.pv: pv, axes.setpoint: pv, axes.output: axes.output_unit}
    return Units(pv, axes.output_unit, {name: unit for name, unit in signals.items() if name})


def decoded(name: str, loaded: Any) -> Checked:
    """A memory listing as a configuration, as far as it carries what one needs."""
    doc, vendor, image = Document(name, "", None, Node(None)), loaded.vendor, loaded.image
    try:
        data = vendor.load("decode")(image.words, image.settings, image.plc).data
        config = read_settings(vendor.model, data, name)
    except DecodeError:
        return Checked(doc, (), vendor)
    return Checked(Document(name, "", data, Node(None)), (), vendor, config, vendor.encoder(config))


@dataclass(slots=True)
class Gathered:
    """Everything that was read, in the order of the command line; a configuration stands before its first run."""

    files: dict[Path, SourceFile] = field(default_factory=dict)
    sheets: dict[Path, PlcSheet] = field(default_factory=dict)
    runs: list[RunSheet] = field(default_factory=list)
    outcomes: list[Outcome] = field(default_factory=list)
    findings: list[Diagnostic] = field(default_factory=list)

    def add(self, taken: Taken, named: Configured | None) -> None:
        """One file, with the configuration that it names where it is a scenario."""
        if isinstance(taken, Configured):
            self._configuration(taken)
            return
        self._note(taken.file)
        if named is not None:
            self._configuration(named)
        self.runs.append(taken.sheet)
        self.outcomes.append(taken.outcome)
        self.findings += taken.findings

    def _note(self, file: SourceFile) -> None:
        """A file, once."""
        self.files.setdefault(Path(file.name).resolve(), file)

    def _configuration(self, one: Configured) -> None:
        self._note(one.file)
        place = Path(one.file.name).resolve()
        if place not in self.sheets:
            self.sheets[place] = one.sheet
            self.findings += one.findings


def gathered(
    paths: Sequence[str], limits: Limits, progress: Callable[[float], None] | None, *, pictures: bool, jobs: int = 1
) -> Gathered:
    """All files of a command line, folders and patterns included; ``progress`` is told the share that is done."""
    entries, scenarios = [], 0
    for entry in read_entries(paths, limits):
        if entry.problem is not None:
            raise click.ClickException(entry.problem)
        scenarios += SCENARIO.search(entry.data) is not None
        entries.append(entry if entry.piped else replace(entry, data=b""))
    names = frozenset(entry.name for entry in entries)
    taken = list(_taken(entries, (limits, names, max(scenarios, 1), pictures), jobs, progress))
    own = {one.file.name: one for one in taken if isinstance(one, Configured)}
    content = Gathered()
    for one in taken:
        content.add(one, own.get(one.outcome.config, one.named) if isinstance(one, Ran) else None)
    return content


def _taken(
    entries: Sequence[Input], given: tuple[Any, ...], jobs: int, progress: Callable[[float], None] | None
) -> Iterator[Taken]:
    """The files one by one; what other processes have read counts as read here."""
    done = 0

    def part(share: float) -> None:
        if progress is not None:
            progress((done + share) / len(entries))

    def make(*arguments: Any) -> Taker:
        return replace(Taker(*arguments), progress=part)

    for one in Crew(jobs, Taker, given).results_soon(entries, effort, make):
        done += 1
        part(0.0)
        if isinstance(one, Ran):
            note_read(one.outcome.config)
        yield one
