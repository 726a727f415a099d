"""One file's findings, whatever kind of file it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from pidcfg.cli.inputs import read_inputs
from pidcfg.cli.reporters import text
from pidcfg.validate.engine import Checked, check_document, is_scenario

if TYPE_CHECKING:
    from pidcfg.diagnostics import Diagnostic
    from pidcfg.limits import Limits
    from pidcfg.source import Document


def check_any(doc: Document, limits: Limits) -> list[Diagnostic]:
    """The findings of a configuration or of a scenario and its configuration."""
    if is_scenario(doc):
        from pidcfg.cli.simulate import check_scenario

        return check_scenario(doc, limits)
    return list(check_document(doc, limits).findings)


def one_configuration(path: str, limits: Limits) -> Checked:
    """The single configuration that a command works on; ends the command when the path names none or several."""
    documents = list(read_inputs((path,), limits))
    if len(documents) != 1:
        raise click.ClickException(f"{path} stands for {len(documents)} files; name one configuration")
    if is_scenario(documents[0]):
        raise click.ClickException(f"{path} is a scenario; name the configuration it runs")
    return check_document(documents[0], limits)


def show_errors(checked: Checked) -> None:
    """The errors of a configuration on stderr, in full."""
    from pidcfg.cli.console import note
    from pidcfg.diagnostics import Severity

    errors = [d for d in checked.findings if d.severity is Severity.ERROR]
    note(text(errors, {checked.document.file: checked.document}).rstrip())
