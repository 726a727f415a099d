"""The inputs of a report: every file is read, checked and run once."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pidcfg.cli.files.inputs import FILES, document, gather, read_input
from pidcfg.document import Document, Node
from pidcfg.encoders.settings import read_settings
from pidcfg.encoders.words import DecodeError
from pidcfg.report.content import SourceFile
from pidcfg.report.run_content import Units
from pidcfg.report.runs import Run
from pidcfg.validate.engine import Checked, check_document, is_scenario

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pidcfg.cli.files.inputs import Input
    from pidcfg.diagnostics import Diagnostic
    from pidcfg.limits import Limits
    from pidcfg.scenario.axes import Axes
    from pidcfg.scenario.outcome import Outcome


@dataclass(slots=True)
class Gathered:
    """Everything that was read, in the order of the command line; a configuration stands before its first run."""

    limits: Limits
    progress: Callable[[float], None] | None = None
    pictures: bool = True
    """Whether the runs are recorded for charts."""
    files: dict[Path, SourceFile] = field(default_factory=dict)
    configurations: dict[Path, Checked] = field(default_factory=dict)
    runs: list[Run] = field(default_factory=list)
    outcomes: list[Outcome] = field(default_factory=list)
    findings: list[Diagnostic] = field(default_factory=list)

    def take(self, entry: Input) -> None:
        """One file of the command line; a file that cannot be opened ends the command."""
        doc = document(entry, self.limits)
        if entry.problem is not None:
            raise click.ClickException(entry.problem)
        if is_scenario(doc):
            self._note(entry, "scenario")
            self._run(doc)
        else:
            self._configuration(entry, doc)

    def _note(self, entry: Input, kind: str) -> None:
        """A file's hash, once."""
        digest = hashlib.sha256(entry.data).hexdigest()
        self.files.setdefault(Path(entry.name).resolve(), SourceFile(entry.name, kind, len(entry.data), digest))

    def _configuration(self, entry: Input, doc: Document) -> None:
        place = Path(entry.name).resolve()
        self._note(entry, "configuration")
        if place not in self.configurations:
            self.configurations[place] = checked = check_document(doc, self.limits)
            self.findings += checked.findings

    def _run(self, doc: Document) -> None:
        """Runs a scenario and takes what it names along."""
        from pidcfg.scenario.charts import charts_of, signals_before_root
        from pidcfg.scenario.load import load
        from pidcfg.scenario.outcome import simulate_loaded
        from pidcfg.sim.run import Settings

        loaded = load(doc, self.limits, FILES)
        if loaded.config:
            self._named(loaded)
        settings = Settings(max_loop_steps=self.limits.loop_steps, progress=self.progress)
        outcome = simulate_loaded(loaded, settings, record=self.pictures)
        charts = charts_of(outcome) if outcome.recording is not None else ()
        roots = signals_before_root(outcome)
        self.outcomes.append(outcome)
        self.findings += [d for d in outcome.findings if d.file == doc.file or d.file not in loaded.documents]
        title = str((doc.data or {}).get("scenario") or "")
        units = {loop: units_of(axes) for loop, axes in outcome.axes.items()}
        self.runs.append(
            Run(
                outcome.file,
                outcome.config,
                outcome.report,
                passed=outcome.passed,
                unjudged=outcome.unjudged,
                title=title,
                charts=charts,
                units=units,
                before_root=roots,
            )
        )

    def _named(self, loaded: Any) -> None:
        """The configuration that a scenario names, or the memory listing."""
        entry = read_input(loaded.config, self.limits)
        if entry.problem is not None or Path(entry.name).resolve() in self.configurations:
            return
        if loaded.config in loaded.documents:
            self._configuration(entry, loaded.documents[loaded.config])
        elif loaded.vendor is not None:
            self._note(entry, "memory listing")
            self.configurations[Path(entry.name).resolve()] = decoded(entry.name, loaded)


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


def gathered(
    paths: Sequence[str], limits: Limits, progress: Callable[[float], None] | None, *, pictures: bool
) -> Gathered:
    """All files of a command line, folders and patterns included."""
    content = Gathered(limits, progress, pictures)
    for entry in gather(paths, limits):
        if not entry.foreign:
            content.take(entry)
    return content
