"""``validate --fix`` and ``--diff``: corrected files, written whole or not at all."""

from __future__ import annotations

import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from pidcfg.cli import settings
from pidcfg.cli.console import note, remark, write_user_file
from pidcfg.cli.inputs import FILES, STDIN, UNNAMED, document
from pidcfg.cli.main import Exit
from pidcfg.cli.options import selects_code
from pidcfg.cli.outputs import difference, print_patch, replace_files
from pidcfg.cli.policy import Rules, count, read_baseline
from pidcfg.cli.terminal import progress
from pidcfg.output.findings import check_any, correct
from pidcfg.text.diagnostics import number_of
from pidcfg.validate.catalog import unusable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.cli.formats.report_options import Report
    from pidcfg.cli.inputs import Input
    from pidcfg.validate.fixes import Fixed


# --- ``validate --fix`` and ``--diff``: corrected files, written whole or not at all ----------------------------------


def fix_inputs(inputs: Sequence[Input], rules: Rules, ctx: click.Context) -> list[Input]:
    """Corrects the inputs and returns them as they are now; ``--diff`` shows the corrections and ends the command."""
    diff, quiet = ctx.params["diff"], ctx.params["quiet"]
    piped = [entry for entry in inputs if entry.piped]
    asked = ctx.get_parameter_source("fmt") is not ParameterSource.DEFAULT  # a CI job's own format is nobody's wish
    if piped and not diff and (len(inputs) > 1 or (asked and ctx.params["fmt"] != "text")):
        raise click.UsageError("--fix prints the corrected text of -, so it takes no other path and no --format", ctx)
    work = progress((_fix_input(entry, rules, ctx) for entry in inputs), "correcting", len(inputs))
    done = list(zip(inputs, work, strict=True))
    changed = [(entry, fixed) for entry, fixed in done if fixed.data != entry.data]
    corrected = [fixed for _, fixed in changed if fixed.fixed]
    total = f"{count(sum(len(f.fixed) for f in corrected), 'finding')} in {count(len(corrected), 'file')}"
    if diff:
        print_patch("".join(difference(_shown(entry), entry.data, fixed.data) for entry, fixed in changed))
        if not quiet:
            note(f"{total} would be corrected")
        unread = any(unusable(d) for _, fixed in done for d in fixed.left)
        ctx.exit(Exit.UNUSABLE if unread else Exit.FINDINGS if corrected else Exit.OK)
    if piped:
        write_user_file(done[0][1].data)
    else:
        replace_files({entry.name: (entry.data, fixed.data) for entry, fixed in changed})
    if not quiet:
        for entry, fixed in changed:
            remark(f"{entry.name}: {_tally(fixed)}")
        note(f"{total} corrected")
    return [replace(entry, data=fixed.data) for entry, fixed in done]


def _shown(entry: Input) -> str:
    """A name in the header of a patch."""
    return STDIN if entry.name == UNNAMED else entry.name


def _tally(fixed: Fixed) -> str:
    """How many findings of which code were corrected."""
    tally = sorted(Counter(d.code for d in fixed.fixed).items(), key=lambda row: number_of(row[0]))
    return f"corrected {', '.join(f'{n} x {code}' for code, n in tally)}"


def refuse_options(ctx: click.Context, reports: Sequence[Report]) -> None:
    """Ends the command where an option would go unheard, or a report could not be written after the corrections."""
    named = [f"--{name}-baseline" for name in ("create", "shrink") if ctx.params[name]]
    named += ["--report-output"] * bool(reports)
    named += ["--format"] * (ctx.get_parameter_source("fmt") is ParameterSource.COMMANDLINE)
    if ctx.params["diff"] and named:
        raise click.UsageError(f"--diff prints a patch and nothing else, so it takes no {' or '.join(named)}", ctx)
    baseline = ctx.params["baseline"]
    if ctx.params["fix"] and baseline is not None and Path(baseline).exists() == ctx.params["create"]:
        there = "exists and only shrinks" if ctx.params["create"] else "is not there; --create-baseline makes it"
        raise click.ClickException(f"{baseline} {there}; nothing was corrected")
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


def _fix_input(entry: Input, rules: Rules, ctx: click.Context) -> Fixed:
    """One input with its corrections."""
    from pidcfg.validate.fixes import Fixed

    doc = document(entry)
    if entry.problem is not None:
        return Fixed(entry.data, (), tuple(check_any(doc, FILES)))
    ignore = [*rules.ignore, *settings.current(ctx).ignored_in(entry.name)]
    return correct(entry.data, doc, FILES, lambda d: selects_code(d.code, rules.select, ignore))
