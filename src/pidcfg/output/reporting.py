"""The commissioning report as a result: what it is made from, read, checked and run, and `pidcfg.report`."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass, field, replace
from decimal import Decimal
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.contract import encoder_of
from pidcfg.encoders.image import read_settings
from pidcfg.output.findings import findings_data, short_repr
from pidcfg.output.report import Run, SourceFile, Units, run_sheet
from pidcfg.output.report.sheets import compose_report, plc_sheet, rename_files
from pidcfg.text.diagnostics import sort_findings
from pidcfg.text.document import Document, Node
from pidcfg.text.frozen import frozen
from pidcfg.validate.engine import Checked, check_document, is_scenario

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pidcfg.output.report import Content, PlcSheet, RunSheet, Title
    from pidcfg.sim.controllers.plc import Axes
    from pidcfg.sim.engine.run import Settings
    from pidcfg.study.outcome import Outcome
    from pidcfg.study.scenario import LoadedScenario
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.paths import Data
    from pidcfg.text.reader import Reader

File = tuple[str, bytes]
"""The name of a file, and what it holds."""

# --- What a report is made from: every file is read, checked and run once ---------------------------------------------


@frozen
class ConfigurationInput:
    """A configuration or a memory listing, and the sheet on it."""

    file: SourceFile
    sheet: PlcSheet
    findings: Sequence[Diagnostic] = ()


@frozen
class RunInput:
    """A scenario and its run; it travels between processes."""

    file: SourceFile
    sheet: RunSheet
    outcome: Outcome
    """Without the recording and the texts of the files."""
    findings: Sequence[Diagnostic]
    configuration: ConfigurationInput | None
    """What it runs, unless the command line has a file by this name."""


ReadInput = ConfigurationInput | RunInput


def configuration_input(file: File, checked: Checked, kind: str = "configuration") -> ConfigurationInput:
    """A checked configuration with its sheet."""
    return ConfigurationInput(source_file(file, kind), plc_sheet(checked), sort_findings(list(checked.findings)))


def source_file(file: File, kind: str) -> SourceFile:
    """A file with its hash."""
    name, data = file
    return SourceFile(name, kind, len(data), hashlib.sha256(data).hexdigest())


def named_input(file: File, loaded: LoadedScenario) -> ConfigurationInput | None:
    """The configuration that a scenario names, or the memory listing."""
    if loaded.checked is not None:
        return configuration_input(file, loaded.checked)
    if loaded.config in loaded.documents:
        return configuration_input(file, check_document(loaded.documents[loaded.config]))
    if loaded.vendor is not None:
        return configuration_input(file, decode_listing(loaded.config, loaded), "memory listing")
    return None


def run_input(
    file: File, loaded: LoadedScenario, settings: Settings, configuration: ConfigurationInput | None, *, pictures: bool
) -> RunInput:
    """A scenario that has been read, run; ``pictures``: recorded for charts."""
    from pidcfg.study.outcome import charts_of, signals_before_root, simulate_loaded

    outcome = simulate_loaded(loaded, settings, record=pictures)
    doc = loaded.document
    run = Run(
        outcome.file,
        outcome.config,
        outcome.report,
        passed=outcome.passed,
        lacks_expectations=outcome.lacks_expectations,
        title=str((doc.data or {}).get("scenario") or ""),
        charts=charts_of(outcome) if outcome.recording is not None else (),
        units={loop: units_of(axes) for loop, axes in outcome.axes.items()},
        root_signals=signals_before_root(outcome),
    )
    findings = [d for d in outcome.findings if d.file == doc.file or d.file not in loaded.documents]
    light_outcome = replace(outcome, recording=None, documents={}, axes={})
    return RunInput(source_file(file, "scenario"), run_sheet(run), light_outcome, findings, configuration)


def processing_time(entry: ReadInput) -> float:
    """What a file has taken beside its reading, in µs."""
    return entry.outcome.estimated_cost if isinstance(entry, RunInput) else 0.0


def units_of(axes: Axes) -> Units:
    """The units of a loop and its signals; before a root a PV has none."""
    pv = "" if axes.root is not None else axes.pv_unit
    signals = {axes.pv: pv, axes.setpoint: pv, axes.output: axes.output_unit}
    return Units(pv, axes.output_unit, {name: unit for name, unit in signals.items() if name})


def decode_listing(name: str, loaded: Any) -> Checked:
    """A memory listing as a configuration, as far as it carries what one needs."""
    doc, vendor, image = Document(name, "", None, Node(None)), loaded.vendor, loaded.image
    try:
        data = encoder_of(vendor).decode(image.words, image.settings, image.plc).data
        config = read_settings(vendor.model, data, name)
    except DecodeError:
        return Checked(doc, (), vendor)
    return Checked(Document(name, "", data, Node(None)), (), vendor, config, encoder_of(vendor).encode(config))


@dataclass(slots=True)
class ReportInputs:
    """Everything that was read, in the order of the command line; a configuration stands before its first run."""

    files: dict[Path, SourceFile] = field(default_factory=dict)
    sheets: dict[Path, PlcSheet] = field(default_factory=dict)
    runs: list[RunSheet] = field(default_factory=list)
    outcomes: list[Outcome] = field(default_factory=list)
    findings: list[Diagnostic] = field(default_factory=list)
    on_disk: bool = True
    """Whether the names are those of files, which links may name twice."""

    def add_file(self, file: ReadInput, configuration: ConfigurationInput | None) -> None:
        """One file, with the configuration that it names where it is a scenario."""
        if isinstance(file, ConfigurationInput):
            self._add_configuration(file)
            return
        self._add_source(file.file)
        if configuration is not None:
            self._add_configuration(configuration)
        self.runs.append(file.sheet)
        self.outcomes.append(file.outcome)
        self.findings += file.findings

    def _add_source(self, file: SourceFile) -> None:
        """A file, once."""
        self.files.setdefault(self._path_of(file), file)

    def _path_of(self, file: SourceFile) -> Path:
        return Path(file.name).resolve() if self.on_disk else Path(os.path.normpath(file.name))

    def _add_configuration(self, configuration: ConfigurationInput) -> None:
        self._add_source(configuration.file)
        path = self._path_of(configuration.file)
        if path not in self.sheets:
            self.sheets[path] = configuration.sheet
            self.findings += configuration.findings


def collect_inputs(inputs: Sequence[ReadInput], *, on_disk: bool = True) -> ReportInputs:
    """Everything together; a configuration that is given is the one that scenarios of this report run."""
    configs = {entry.file.name: entry for entry in inputs if isinstance(entry, ConfigurationInput)}
    content = ReportInputs(on_disk=on_disk)
    for entry in inputs:
        content.add_file(
            entry, configs.get(entry.outcome.config, entry.configuration) if isinstance(entry, RunInput) else None
        )
    return content


def shortener(names: Sequence[str]) -> Callable[[str], str]:
    """Names as a report shows them: those that are absolute from the folder that they have in common.

    On several drives there is none: then names stay as they are.
    """
    folders = [str(Path(name).parent) for name in names if Path(name).is_absolute()]
    try:
        base = os.path.commonpath(folders) if folders else ""
    except ValueError:
        return lambda name: Path(name).as_posix()
    return lambda name: Path(os.path.relpath(name, base)).as_posix() if Path(name).is_absolute() else name


def content_of(inputs: ReportInputs, title_block: Title) -> Content:
    """The report on what was read, with names of files as it shows them."""
    content = compose_report(
        title_block, list(inputs.files.values()), list(inputs.sheets.values()), inputs.runs, inputs.findings
    )
    return rename_files(content, shortener([file.name for file in content.files]))


# --- The result of `pidcfg.report` ------------------------------------------------------------------------------------


@frozen
class ReportResult:
    """A report on configurations and runs, which is written in several ways."""

    __repr__ = short_repr

    content: Content
    """What it says, as data."""

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        """Of all files, the gravest first."""
        return self.content.findings

    @property
    def ok(self) -> bool:
        """Whether there is no error and every run has passed."""
        return self.content.verdict[0] != "FAILED"

    def page(self, *, full: bool = False) -> str:
        """The report as HTML; ``full``: also what is at its default, every word and every signal."""
        from pidcfg.output.report.formats import report_page

        return report_page(self.content, full=full)

    def sheet(self) -> str:
        """One landscape page with all loops, for the cabinet's door, as HTML."""
        from pidcfg.output.report.formats import door_sheet

        return door_sheet(self.content)

    @property
    def tables(self) -> dict[str, str]:
        """The tables as CSV, by the names of their files."""
        from pidcfg.output.report.formats import csv_files, tables_of

        return csv_files(tables_of(self.content))

    def to_json(self) -> Data:
        """The tables as lists of rows below their columns, and the findings."""
        from pidcfg.output.report.formats import tables_of

        tables = {
            table.key: {"columns": list(table.columns), "rows": [list(map(_json_cell, row)) for row in table.rows]}
            for table in tables_of(self.content)
        }
        verdict, why = self.content.verdict
        return {
            **findings_data(self.findings, len(self.content.files)),
            "verdict": verdict,
            "why": why,
            "tables": tables,
        }


def _json_cell(value: object) -> str | int | float | None:
    """A cell as JSON has it."""
    if isinstance(value, Decimal | float):
        return float(value) if isfinite(value) else None
    return value if value is None or isinstance(value, int) else str(value)


def report_sources(
    documents: Sequence[Document],
    reader: Reader,
    title_block: Title,
    progress: Callable[[float], None] | None,
    *,
    pictures: bool,
    on_disk: bool,
) -> ReportResult:
    """The report on documents, and on the configurations that scenarios among them name."""
    from pidcfg.sim.engine.run import Settings
    from pidcfg.study.scenario import load_scenario

    names = {doc.file for doc in documents}
    inputs: list[ReadInput] = []
    for i, doc in enumerate(documents):
        file = (doc.file, doc.text.encode())
        if not is_scenario(doc):
            inputs.append(configuration_input(file, check_document(doc)))
            continue
        loaded = load_scenario(doc, reader)
        configuration = None
        if loaded.config and loaded.config not in names and (data := _data_of(loaded.config, reader, doc)) is not None:
            configuration = named_input((loaded.config, data), loaded)
        part_progress = None if progress is None else _part_progress(progress, i, len(documents))
        settings = Settings(max_loop_steps=doc.limits.loop_steps, progress=part_progress, runs=len(documents))
        inputs.append(run_input(file, loaded, settings, configuration, pictures=pictures))
    return ReportResult(content_of(collect_inputs(inputs, on_disk=on_disk), title_block))


def _part_progress(progress: Callable[[float], None], done: int, total: int) -> Callable[[float], None]:
    return lambda share: progress((done + share) / total)


def _data_of(name: str, reader: Reader, doc: Document) -> bytes | None:
    try:
        return reader.read(name, doc.limits.listing_bytes + 1)
    except (OSError, ValueError):
        return None
