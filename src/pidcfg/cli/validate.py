"""``pidcfg validate``: all findings of all files."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from pidcfg.cli import options
from pidcfg.cli.console import echo_json, note, show
from pidcfg.cli.inputs import gather
from pidcfg.cli.main import Exit
from pidcfg.cli.progress import progress
from pidcfg.cli.reporters import REPORTERS, summary
from pidcfg.diagnostics import Diagnostic, Severity

if TYPE_CHECKING:
    from pidcfg.limits import Limits
    from pidcfg.source import Document

EPILOG = options.examples(
    "pidcfg validate reactor.yaml",
    "pidcfg validate loops/ --severity warning --strict",
    "pidcfg validate *.yaml --format json --ignore PID220",
)


@click.command("validate", epilog=EPILOG)
@click.argument("paths", nargs=-1, required=True)
@options.output_format(*REPORTERS)
@options.SELECT
@options.IGNORE
@options.SEVERITY
@options.STRICT
@options.QUIET
@options.LIMITS
def command(
    paths: tuple[str, ...], fmt: str, select: list[str], ignore: list[str], severity: str, strict: bool, quiet: bool,
    limits: Limits,
) -> None:  # fmt: skip
    """Find every mistake in PATHS: configurations, scenarios, folders of them, or - for standard input."""
    from pidcfg.cli.checks import check_all

    documents: dict[str, Document] = {}
    found: list[Diagnostic] = []
    gathered = list(gather(paths, limits))
    inputs = [entry for entry in gathered if not entry.foreign]
    skipped = len(gathered) - len(inputs)
    for doc, findings in progress(check_all(inputs, limits), "checking", len(inputs)):
        documents[doc.file] = doc
        found += findings
    kept = options.chosen(found, select, ignore)
    (echo_json if fmt == "json" else show)(REPORTERS[fmt](options.severe(kept, severity), documents))
    if fmt == "text" and not quiet:
        note(summary(kept, len(documents), skipped))
    click.get_current_context().exit(exit_code(kept, strict=strict))


def exit_code(found: list[Diagnostic], *, strict: bool = False) -> Exit:
    """Unusable input outweighs findings: CI must not mistake a file that was not read for one that was checked."""
    from pidcfg.validate.codes import UNUSABLE

    if any(d.code in UNUSABLE for d in found):
        return Exit.UNUSABLE
    worst = max((d.severity for d in found), default=Severity.INFO)
    return Exit.FOUND if worst is Severity.ERROR or (strict and worst is Severity.WARNING) else Exit.OK
