"""One file's findings, whatever kind of file it is."""

from __future__ import annotations

import os
from itertools import repeat
from typing import TYPE_CHECKING

import click

from pidcfg.cli.files.inputs import document, read_inputs
from pidcfg.cli.formats.reporters import json_v1, text
from pidcfg.cli.terminal.progress import held
from pidcfg.validate.engine import Checked, check_document, is_scenario

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.cli.files.inputs import Input
    from pidcfg.diagnostics import Diagnostic
    from pidcfg.limits import Limits
    from pidcfg.source import Document

MANY, CHUNK = 200, 25
"""From so many files on a process per processor pays for its start; files are handed out so many at a time."""


def check_any(doc: Document, limits: Limits) -> list[Diagnostic]:
    """The findings of a configuration or of a scenario and its configuration."""
    if is_scenario(doc):
        from pidcfg.cli.commands.simulate import check_scenario

        return check_scenario(doc, limits)
    return list(check_document(doc, limits).findings)


def check_all(inputs: Sequence[Input], limits: Limits) -> Iterator[tuple[Document, list[Diagnostic]]]:
    """Each input's text and findings, in order; many files are shared out among the processors."""
    processors = os.cpu_count() or 1
    if len(inputs) < MANY or processors == 1:
        yield from (check_input(entry, limits) for entry in inputs)
        return
    from concurrent.futures import ProcessPoolExecutor

    with ProcessPoolExecutor(processors) as pool:
        with held():
            checked = pool.map(check_input, inputs, repeat(limits), chunksize=CHUNK)
        yield from checked


def check_input(entry: Input, limits: Limits) -> tuple[Document, list[Diagnostic]]:
    """One input's text and findings; the data are let go, since a report needs the text only."""
    doc = document(entry, limits)
    return doc.bare(), check_any(doc, limits)


def one_configuration(path: str, limits: Limits) -> Checked:
    """The single configuration that a command works on; ends the command when the path names none or several."""
    documents = list(read_inputs((path,), limits))
    if len(documents) != 1:
        raise click.ClickException(f"{path} stands for {len(documents)} files; name one configuration")
    if is_scenario(documents[0]):
        raise click.ClickException(f"{path} is a scenario; name the configuration it runs")
    return check_document(documents[0], limits)


def show_errors(checked: Checked, fmt: str) -> None:
    """The errors of a configuration: in full on stderr, or as the result where JSON was asked for."""
    from pidcfg.cli.terminal.console import echo_json, note
    from pidcfg.diagnostics import Severity

    errors = [d for d in checked.findings if d.severity is Severity.ERROR]
    documents = {checked.document.file: checked.document}
    if fmt == "json":
        echo_json(json_v1(errors, documents))
    else:
        note(text(errors, documents).rstrip())
