"""A scenario file with all that it needs: its configuration or listing, and findings."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.decoding import check_settings, read_listing
from pidcfg.encoders.listing import ListingError
from pidcfg.schemas.base import SECONDS
from pidcfg.schemas.scenario import Scenario, rejoin_expressions
from pidcfg.sim.engine.influence import wrong_actions
from pidcfg.sim.engine.network import initial_values, settle_plants
from pidcfg.sim.engine.run import plc_options, prepare_network
from pidcfg.text.diagnostics import Diagnostic, Severity, Span, sort_findings
from pidcfg.text.paths import dotted_text, leaves, parse_path
from pidcfg.text.reader import DISK, SUFFIXES, Reader, may_be_quoted, read_failure, read_named_file, similar_file
from pidcfg.text.source import read_document
from pidcfg.validate.catalog import is_unusable
from pidcfg.validate.engine import check_document, is_scenario
from pidcfg.validate.rule import SCENARIO_CODES, key_of, value_of
from pidcfg.validate.schema import read_model
from pidcfg.validate.terms import stated_number, with_numbers
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pidcfg.encoders.listing import Listing
    from pidcfg.sim.controllers.plc import Controller, Plc
    from pidcfg.sim.engine.expressions import Problem
    from pidcfg.study.uncertainty import Uncertainty
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Path
    from pidcfg.validate.engine import Checked
    from pidcfg.vendors import Vendor

# --- A scenario file with everything it needs: its configuration or memory listing, and the virtual PLC ---------------

HEAD_BYTES = 1000
"""Bytes of a listing in which the name of its vendor stands, if at all."""
STDIN = "-"
SEVERITY_BY_LABEL = {severity.label: severity for severity in Severity}


@dataclass(slots=True)
class LoadedScenario:
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
    reader: Reader = DISK
    """Of the files that the scenario names."""

    @property
    def controller(self) -> Controller:
        """The vendor's controller module."""
        if self.vendor is None:
            raise ValueError(f"{self.document.file} has no vendor")
        controller: Controller = self.vendor.module("controller")
        return controller

    def new_plc(self) -> Plc:
        """A new virtual PLC with the scenario's image."""
        if self.scenario is None or self.image is None:
            raise ValueError(f"{self.document.file} could not be loaded")
        controller = self.controller
        plc = controller.load(self.image, plc_options(self.scenario, controller))
        units = ((entry.get("loop"), (entry.get("pv") or {}).get("unit")) for entry in self.image.settings)
        plc.units = {str(loop): str(unit) for loop, unit in units if unit}
        return plc

    def uncertainties(self, plc: Plc) -> tuple[list[Uncertainty], list[Problem]]:
        """What varies, and what is wrong with it."""
        if self.scenario is None or self.scenario.vary is None:
            return [], []
        from pidcfg.study.uncertainty import find_uncertainties

        return find_uncertainties(self.scenario, plc, self.documents.get(self.config))

    def refuse_config(self, message: str, cure: str | None = None) -> None:
        """A configuration that cannot be used."""
        path = ("config",)
        span = self.document.locate(path)
        self.findings.append(Diagnostic("PID058", Severity.ERROR, message, self.document.file, span, path, help=cure))

    def add_problems(self, problems: Iterable[Problem]) -> None:
        """Problems of the scenario as findings with places."""
        problems_with_cures = [replace(entry, help=self.cures.get(entry.path) or entry.help) for entry in problems]
        self.findings = sort_findings(
            [*self.findings, *(place_problem(problem, self.document) for problem in problems_with_cures)]
        )


def load_scenario(doc: Document, reader: Reader = DISK) -> LoadedScenario:
    """Reads a scenario and what it names; ``findings`` say why it cannot run, if so."""
    loaded = LoadedScenario(doc, list(doc.problems), documents={doc.file: doc}, reader=reader)
    if doc.data is None or is_unreadable(doc.problems):
        return loaded
    scenario, loaded.findings = read_scenario(doc)
    loaded.scenario = scenario
    if scenario is not None:
        _read_config(loaded, scenario, reader)
        _use_own_units(loaded)
    return loaded


def _use_own_units(loaded: LoadedScenario) -> None:
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
                path = parse_path(loaded.new_plc().setpoint) if dotted_text(keys) == "setpoint" else keys
                stated, place_of = stated_number(loaded.vendor, loop, path, value), ("events", i, "set", *below)
                if stated is not None and stated.is_in_key_unit:
                    numbers[place_of] = stated.number
                elif stated is not None:
                    loaded.cures[place_of] = stated.cure
    if numbers:
        loaded.document = with_numbers(doc, numbers)
        loaded.scenario, loaded.findings = read_scenario(loaded.document)


def read_scenario(doc: Document) -> tuple[Scenario | None, list[Diagnostic]]:
    """The typed content of a scenario file, and what is wrong with its text and its keys."""
    data: Any = rejoin_expressions(doc.data)
    scenario, errors = read_model(Scenario, replace(doc, data=data))
    return scenario, sort_findings([*doc.problems, *errors])


def is_unreadable(findings: Iterable[Diagnostic]) -> bool:
    """Whether a text can be read in more than one way, such as a key that stands twice: what runs would be a guess."""
    return any(map(is_unusable, findings))


def check_scenario(doc: Document, reader: Reader = DISK) -> list[Diagnostic]:
    """All findings of a scenario file; those of its configuration are reported with the configuration."""
    loaded = load_scenario(doc, reader)
    if loaded.scenario is not None and loaded.image is not None:
        plc = loaded.new_plc()
        net = prepare_network(loaded.scenario, plc)
        loaded.add_problems([*net.problems, *loaded.uncertainties(plc)[1]])
        if not any(problem.severity == "error" for problem in net.problems):
            settle_plants(net, initial_values(net))
            loaded.add_problems(wrong_actions(net, plc))
        if loaded.scenario.reference is not None:
            from pidcfg.study.accepted import reference_of

            findings = reference_of(loaded.document, loaded.scenario, plc.loops, reader).findings
            loaded.findings = sort_findings([*loaded.findings, *findings])
    return loaded.findings


def place_problem(problem: Problem, doc: Document) -> Diagnostic:
    """A problem of the scenario with its position; within an expression, of the character."""
    span = doc.locate(problem.path, key=problem.key)
    if problem.kind == "expression" and span.line == span.end_line:
        row = doc.lines[span.line - 1]
        quoted = row[span.column - 1 : span.column] in {'"', "'"}
        column = span.column + problem.offset + quoted
        span = Span(span.line, column, span.line, column + 1)
    code, severity = SCENARIO_CODES[problem.kind], SEVERITY_BY_LABEL[problem.severity]
    return Diagnostic(
        code,
        severity,
        problem.message,
        doc.file,
        span,
        problem.path,
        problem.loop or "",
        plc_effect=problem.effect,
        help=problem.help,
        key=key_of(doc, problem.path),
        value=value_of(doc, problem.path),
    )


def _read_config(loaded: LoadedScenario, scenario: Scenario, reader: Reader) -> None:
    """The configuration or listing, relative to the scenario."""
    loaded.config = reader.resolve(loaded.document.file, scenario.config)
    if scenario.config == STDIN:
        loaded.refuse_config(f"{scenario.config} is no file", "name a configuration or a memory listing")
        return
    try:
        data = read_named_file(reader, loaded.config, loaded.document.limits.listing_bytes + 1)
    except (OSError, ValueError) as error:
        quoted = may_be_quoted(reader, loaded.document.file, loaded.config)
        near = similar_file(loaded.config, reader) if quoted else None
        meant = f"did you mean {PurePath(near).name}? " if near else ""
        loaded.refuse_config(read_failure(loaded.config, error), f"{meant}the path is relative to the scenario file")
        return
    if PurePath(loaded.config).suffix.lower() in SUFFIXES:
        _use_configuration(loaded, data)
    else:
        _use_listing(loaded, data, quoted=may_be_quoted(reader, loaded.document.file, loaded.config))


def _use_configuration(loaded: LoadedScenario, data: bytes) -> None:
    """Encodes a configuration; errors that the PLC survives do not keep it from running."""
    doc = read_document(data, loaded.config, loaded.document.limits)
    loaded.documents[doc.file] = doc
    if is_scenario(doc):
        loaded.refuse_config(f"{loaded.config} is a scenario", "name the configuration that it runs")
        return
    checked = check_document(doc)
    if is_unreadable(checked.findings):
        first = next(d for d in checked.findings if is_unusable(d))
        cure = f"run 'pidcfg validate {loaded.config}'"
        loaded.refuse_config(f"{loaded.config}:{first.span.line}:{first.span.column}: {first.message}", cure)
        return
    if checked.encoding is None or not checked.encoding.is_complete:
        worst = next((d for d in checked.findings if d.severity is Severity.ERROR), None)
        reason = f"{worst.span.line}:{worst.span.column}: {worst.message}" if worst else " it has no memory image"
        loaded.refuse_config(f"{loaded.config}:{reason}", f"run 'pidcfg validate {loaded.config}'")
        return
    loaded.config_errors = [d for d in checked.findings if d.severity is Severity.ERROR]
    loaded.checked, loaded.vendor, loaded.image = checked, checked.vendor, checked.encoding.image


def _use_listing(loaded: LoadedScenario, data: bytes, *, quoted: bool) -> None:
    """Takes the words of a memory listing as they are, once what stands beside them is known to be sound.

    The vendor is the one that can read it; of those that cannot, the one that it names, or that got furthest, says why.
    """
    errors: list[tuple[bool, int, ListingError]] = []
    for vendor in VENDORS.values():
        try:
            listing = read_listing(data, vendor, loaded.document.limits)
        except ListingError as error:
            errors.append((vendor.key.encode() in data[:HEAD_BYTES], error.line, error))
            continue
        _use_words(loaded, vendor, listing)
        return
    _, line, worst = max(errors, key=lambda row: row[:2])
    if quoted:
        loaded.refuse_config(f"{loaded.config}: line {line}: {worst}")
    else:
        cure = f"'pidcfg decode {loaded.config} --vendor VENDOR' says why (a file outside of this folder is not quoted)"
        loaded.refuse_config(f"{loaded.config}: line {line} cannot be read as one of a memory listing", cure)


def _use_words(loaded: LoadedScenario, vendor: Vendor, listing: Listing) -> None:
    """The image of a listing; one that has no meaning without its settings must have them.

    A word that is no value does not keep it from running: the PLC has it, and the run is told what it does with it.
    """
    needs_options = any(option.needed for option in vendor.load("decode_options"))
    if needs_options or not vendor.banks or listing.settings or listing.plc:
        try:
            check_settings(listing, vendor)
        except DecodeError as error:
            cure = f"run 'pidcfg decode {loaded.config} --vendor {vendor.key}'"
            if needs_options and not listing.settings:
                cure += " with that option, and name the configuration that it writes"
            loaded.refuse_config(f"{loaded.config}: {error}", cure)
            return
    loaded.vendor, loaded.image = vendor, listing.make_image(vendor.key)
