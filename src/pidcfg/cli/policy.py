"""The triage of findings: what is reported, what comments, settings or a baseline leave of it, and ``--fix``."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from pidcfg.cli import options
from pidcfg.cli.console import write_note, write_remark, write_user_file
from pidcfg.cli.inputs import RECORDED_DISK, STDIN, STDIN_TITLE, document_of_input
from pidcfg.cli.main import Exit
from pidcfg.cli.options import selects_code
from pidcfg.cli.terminal import progress
from pidcfg.output.findings import check_any, correct_file
from pidcfg.text.diagnostics import Severity, number_of, sort_findings
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import read_file
from pidcfg.validate.catalog import is_unusable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pidcfg.cli.formats.report_options import Report
    from pidcfg.cli.inputs import Input
    from pidcfg.cli.settings import Settings
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document
    from pidcfg.validate.baseline import Entry, IgnoredFinding
    from pidcfg.validate.fixes import FixedFile

# --- The triage of findings: what is reported, what comments, settings or a baseline set aside, and remarks on it -----

MAX_BASELINE_BYTES = 64 << 20
"""Bytes of a baseline."""


@frozen
class Rules:
    """What the options choose: beginnings of codes, and what is to be done with a baseline."""

    select: list[str]
    ignore: list[str]
    baseline: str | None = None
    create: bool = False
    shrink: bool = False


@dataclass(slots=True)
class Triage:
    """What is reported, what a comment ignores (with its reason), what the baseline knows, and remarks for stderr."""

    reported: list[Diagnostic]
    ignored: list[IgnoredFinding] = field(default_factory=list)
    known: list[Diagnostic] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    left_out_count: int = 0
    """How many findings a settings file leaves out."""

    @property
    def hides_findings(self) -> bool:
        """Whether even a quiet run has to mention findings that it does not show."""
        return bool(self.ignored or self.known or self.left_out_count)

    def suppressed(self, severity: Severity) -> list[tuple[Diagnostic, str | None]]:
        """What is not reported, with the reason that a comment gives; None: the baseline knows it."""
        by_comment = [(entry.finding, entry.reason) for entry in self.ignored]
        return [(d, reason) for d, reason in (*by_comment, *((d, None) for d in self.known)) if d.severity >= severity]

    @property
    def reasons(self) -> Iterator[str]:
        """What is not reported, one by one, and why not."""
        rows = [(one.finding, f"ignored, {one.reason or 'for no reason'}") for one in self.ignored]
        for d, why in (*rows, *((d, "in the baseline") for d in self.known)):
            yield f"{d.file}:{d.span.line}:{d.span.column}: {d.code}: {why}"
        if self.left_out_count:
            yield f"{count_text(self.left_out_count, 'finding')}, by the settings"

    @property
    def counts_text(self) -> str:
        """The end of the summary."""
        fixable = sum(bool(d.edits) for d in self.reported)
        rows = (
            (fixable, "correctable with --fix"),
            (len(self.ignored), "ignored"),
            (len(self.known), "in the baseline"),
        )
        return "".join(f"; {number} {what}" for number, what in rows if number)


def triage_findings(
    findings: Sequence[Diagnostic], documents: dict[str, Document], settings: Settings, rules: Rules
) -> Triage:
    """Sorts findings into reported, ignored and known; writes or shrinks the baseline as the options ask."""
    result = _apply_comments(findings, documents)
    all_findings = result.reported
    ignored_codes = {file: settings.ignored_codes(file) for file in documents}

    def is_selected(d: Diagnostic) -> bool:
        return bool(options.select_findings([d], rules.select, [*rules.ignore, *ignored_codes.get(d.file, ())]))

    result.ignored = [entry for entry in result.ignored if is_selected(entry.finding)]
    result.reported = [d for d in all_findings if is_selected(d)]
    result.left_out_count = len(all_findings) - len(result.reported) if settings.file is not None else 0
    if rules.baseline is not None:
        _apply_baseline(result, all_findings, is_selected, documents, rules)
    elif rules.create or rules.shrink:
        raise click.UsageError("name the baseline with --baseline FILE")
    return result


def validated_findings(findings: Sequence[Diagnostic], doc: Document) -> tuple[tuple[Diagnostic, ...], str]:
    """What ``validate`` lists of the findings of a file that is named, and why its settings do not count, if so."""
    from pidcfg.cli.settings import Settings, settings_of

    settings, remark = Settings(), ""
    try:
        settings = settings_of([doc.file], None) if Path(doc.file).is_absolute() else settings
        result = triage_findings(findings, {doc.file: doc}, settings, _rules_of(settings))
    except click.ClickException as error:
        settings, remark = Settings(), error.format_message()
        result = triage_findings(findings, {doc.file: doc}, settings, _rules_of(settings))
    threshold = Severity.WARNING if settings.values.get("strict") else Severity.ERROR
    min_severity = min(Severity[str(settings.values.get("severity", "info")).upper()], threshold)
    return tuple(d for d in result.reported if d.severity >= min_severity), remark


def _rules_of(settings: Settings) -> Rules:
    """What a settings file chooses."""
    values = settings.values
    return Rules(values.get("select", []), values.get("ignore", []), values.get("baseline"))


def _apply_comments(findings: Sequence[Diagnostic], documents: Mapping[str, Document]) -> Triage:
    """The findings without those that comments ignore, file by file."""
    if not any("ignore" in doc.text for doc in documents.values()):
        return Triage(list(findings))
    from pidcfg.validate.baseline import suppress

    by_file: dict[str, list[Diagnostic]] = {file: [] for file in documents}
    result = Triage([d for d in findings if d.file not in by_file])
    for d in findings:
        by_file.get(d.file, []).append(d)
    for file, file_findings in by_file.items():
        suppression = suppress(file_findings, documents[file])
        is_changed = len(suppression.findings) != len(file_findings) or suppression.ignored
        result.reported += sort_findings(suppression.findings) if is_changed else file_findings
        result.ignored += suppression.ignored
    return result


def _apply_baseline(
    result: Triage,
    all_findings: list[Diagnostic],
    is_selected: Callable[[Diagnostic], bool],
    documents: Mapping[str, Document],
    rules: Rules,
) -> None:
    """Takes known findings out, and reports or removes what no longer occurs; or writes the first baseline."""
    from pidcfg.cli.inputs import relative_path
    from pidcfg.validate import baseline

    name = rules.baseline or ""
    folder = Path(os.path.abspath(name)).parent

    def file_of(file: str) -> str:
        return relative_path(file, folder)

    if rules.create:
        result.known = [d for d in result.reported if baseline.may_be_in_baseline(d) and d.file != STDIN_TITLE]
        new_ids = {id(d) for d in result.known}
        result.reported = [d for d in result.reported if id(d) not in new_ids]
        text = baseline.baseline_text(baseline.entry_of(d, file_of) for d in result.known)
        _write_baseline(name, text, "--create-baseline")
        result.remarks.append(f"{name}: {count_text(len(result.known), 'finding')} written")
        return
    entries, text = read_baseline(name)
    files = {e.file for e in entries}
    checked_files = {file_of(file) for file in documents} | {file for file in files if not (folder / file).exists()}
    comparison = baseline.compare(all_findings, is_selected, entries, checked_files, file_of)
    result.reported, result.known = comparison.new, comparison.known
    if rules.shrink and comparison.stale:
        from pidcfg.cli.outputs import write_files

        write_files({name: baseline.baseline_text(baseline.remove_entries(entries, comparison.stale))}, force=True)
        result.remarks.append(f"{name}: {count_text(len(comparison.stale), 'entry', 'entries')} removed")
        return
    ignored = {baseline.entry_of(one.finding, file_of) for one in result.ignored}
    stale = baseline.stale_findings(comparison.stale, ignored, entries, text, Path(name).as_posix())
    result.reported += [d for d in stale if is_selected(d)]


def count_text(number: int, singular: str, plural: str | None = None) -> str:
    """A number with its word."""
    return f"{number} {singular if number == 1 else plural or singular + 's'}"


def read_baseline(name: str) -> tuple[list[Entry], str]:
    """What a baseline says, and its text; ends the command with one clear error where it cannot be read."""
    from pidcfg.validate.baseline import BaselineError, parse_baseline

    text = _read_baseline_text(name)
    try:
        return parse_baseline(text), text
    except BaselineError as error:
        raise click.ClickException(f"{name}:{error}; a new one is made with --create-baseline") from None


def _read_baseline_text(name: str) -> str:
    """The text of a baseline."""
    try:
        data = read_file(name, MAX_BASELINE_BYTES + 1)
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise click.ClickException(f"{name} is not UTF-8") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise click.ClickException(f"cannot read {name}: {reason}; --create-baseline makes one") from None
    if len(data) > MAX_BASELINE_BYTES:
        raise click.ClickException(f"{name} is larger than {MAX_BASELINE_BYTES} bytes")
    return text


def _write_baseline(name: str, text: str, option: str) -> None:
    """A new baseline; findings never enter one that is there."""
    from pidcfg.cli.outputs import write_files

    if Path(name).exists():
        raise click.ClickException(
            f"{name} exists and only shrinks: {option} makes a new one; delete it first to accept what is there now"
        )
    write_files({name: text})


# --- ``validate --fix`` and ``--diff``: corrected files, written whole or not at all ----------------------------------


def fix_inputs(inputs: Sequence[Input], rules: Rules, ctx: click.Context) -> list[Input]:
    """Corrects the inputs and returns them as they are now; ``--diff`` shows the corrections and ends the command."""
    from pidcfg.cli.outputs import patch_text, print_patch, replace_files

    shows_diff, quiet = ctx.params["diff"], ctx.params["quiet"]
    piped_inputs = [entry for entry in inputs if entry.is_piped]
    has_format = (
        ctx.get_parameter_source("fmt") is not ParameterSource.DEFAULT
    )  # a CI job's own format is nobody's wish
    if piped_inputs and not shows_diff and (len(inputs) > 1 or (has_format and ctx.params["fmt"] != "text")):
        raise click.UsageError("--fix prints the corrected text of -, so it takes no other path and no --format", ctx)
    corrections = progress((_fix_input(entry, rules, ctx) for entry in inputs), "correcting", len(inputs))
    pairs = list(zip(inputs, corrections, strict=True))
    changes = [(entry, fixed) for entry, fixed in pairs if fixed.data != entry.data]
    corrected = [fixed for _, fixed in changes if fixed.fixed]
    total = f"{count_text(sum(len(f.fixed) for f in corrected), 'finding')} in {count_text(len(corrected), 'file')}"
    if shows_diff:
        print_patch("".join(patch_text(_patch_name(entry), entry.data, fixed.data) for entry, fixed in changes))
        if not quiet:
            write_note(f"{total} would be corrected")
        is_unread = any(is_unusable(d) for _, fixed in pairs for d in fixed.remaining)
        ctx.exit(Exit.UNUSABLE if is_unread else Exit.FINDINGS if corrected else Exit.OK)
    if piped_inputs:
        write_user_file(pairs[0][1].data)
    else:
        replace_files({entry.name: (entry.data, fixed.data) for entry, fixed in changes})
    if not quiet:
        for entry, fixed in changes:
            write_remark(f"{entry.name}: {_tally_text(fixed)}")
        write_note(f"{total} corrected")
    return [replace(entry, data=fixed.data) for entry, fixed in pairs]


def _patch_name(entry: Input) -> str:
    """A name in the header of a patch."""
    return STDIN if entry.name == STDIN_TITLE else entry.name


def _tally_text(fixed: FixedFile) -> str:
    """How many findings of which code were corrected."""
    tally = sorted(Counter(d.code for d in fixed.fixed).items(), key=lambda row: number_of(row[0]))
    return f"corrected {', '.join(f'{n} x {code}' for code, n in tally)}"


def refuse_options(ctx: click.Context, reports: Sequence[Report]) -> None:
    """Ends the command where an option would go unheard, or a report could not be written after the corrections."""
    import tempfile

    options_named = [f"--{name}-baseline" for name in ("create", "shrink") if ctx.params[name]]
    options_named += ["--report-output"] * bool(reports)
    options_named += ["--format"] * (ctx.get_parameter_source("fmt") is ParameterSource.COMMANDLINE)
    if ctx.params["diff"] and options_named:
        raise click.UsageError(
            f"--diff prints a patch and nothing else, so it takes no {' or '.join(options_named)}", ctx
        )
    baseline = ctx.params["baseline"]
    if ctx.params["fix"] and baseline is not None and Path(baseline).exists() == ctx.params["create"]:
        reason_text = "exists and only shrinks" if ctx.params["create"] else "is not there; --create-baseline makes it"
        raise click.ClickException(f"{baseline} {reason_text}; nothing was corrected")
    if ctx.params["fix"] and baseline is not None and not ctx.params["create"]:
        try:
            read_baseline(baseline)
        except click.ClickException as error:
            raise click.ClickException(f"{error.message}; nothing was corrected") from None
    for report in reports:
        try:
            with tempfile.TemporaryFile(dir=Path(report.path).resolve().parent):
                pass
        except OSError as error:
            reason = f"cannot write {report.path}: {error.strerror}"
            raise click.ClickException(f"{reason}; nothing was corrected") from None


def _fix_input(entry: Input, rules: Rules, ctx: click.Context) -> FixedFile:
    """One input with its corrections."""
    from pidcfg.cli import settings
    from pidcfg.validate.fixes import FixedFile

    doc = document_of_input(entry)
    if entry.problem is not None:
        return FixedFile(entry.data, (), tuple(check_any(doc, RECORDED_DISK)))
    ignore = [*rules.ignore, *settings.current_settings(ctx).ignored_codes(entry.name)]
    return correct_file(entry.data, doc, RECORDED_DISK, lambda d: selects_code(d.code, rules.select, ignore))
