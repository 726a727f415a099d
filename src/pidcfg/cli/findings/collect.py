"""The findings of the inputs of a command, and the one configuration that some commands work on."""

from __future__ import annotations

import os
from itertools import repeat
from typing import TYPE_CHECKING

import click

from pidcfg.cli.files.inputs import document, read_inputs
from pidcfg.cli.findings.reads import Reads
from pidcfg.cli.terminal.progress import held

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.cli.files.inputs import Input
    from pidcfg.cli.findings.cache import Cache
    from pidcfg.diagnostics import Diagnostic
    from pidcfg.limits import Limits
    from pidcfg.source import Document

MANY, CHUNK = 200, 25
"""From so many files on a process per processor pays for its start; files are handed out so many at a time."""


def check_all(
    inputs: Sequence[Input], limits: Limits, *, cached: bool = True
) -> Iterator[tuple[Document, list[Diagnostic]]]:
    """Each input's text and findings, in order; many files are shared out among the processors.

    ``cached``: findings of files that have not changed are taken from the user's cache (`pidcfg.cli.findings.cache`).
    """
    cache = _cache(limits) if cached else None
    if cache is None:
        yield from ((document, findings) for document, findings, _ in _checked(inputs, limits))
        return
    kept = {i: found for i, entry in enumerate(inputs) if (found := cache.get(entry))}
    rest = _checked([entry for i, entry in enumerate(inputs) if i not in kept], limits)
    for i, entry in enumerate(inputs):
        if i in kept:
            yield kept[i]
            continue
        document, findings, reads = next(rest)
        cache.put(entry, findings, reads)
        yield document, findings


def _cache(limits: Limits) -> Cache | None:
    from pidcfg.cli.findings.cache import Cache

    return Cache.open(limits)


def _checked(inputs: Sequence[Input], limits: Limits) -> Iterator[tuple[Document, list[Diagnostic], Reads]]:
    """Inputs that have to be checked, each with what was read for it."""
    processors = os.cpu_count() or 1
    if len(inputs) < MANY or processors == 1:
        yield from (check_input(entry, limits) for entry in inputs)
        return
    from concurrent.futures import ProcessPoolExecutor

    yield check_input(inputs[0], limits)  # a process that is forked has what this one has loaded for it
    with ProcessPoolExecutor(processors) as pool:
        with held():
            checked = pool.map(check_input, inputs[1:], repeat(limits), chunksize=CHUNK)
        yield from checked


def check_input(entry: Input, limits: Limits) -> tuple[Document, list[Diagnostic], Reads]:
    """One input's text and findings; the data are let go, since a report needs the text only."""
    from pidcfg.api import check

    reads = Reads(entry.name)
    result = check(document(entry, limits), files=reads, comments=False, limits=limits)
    return result.document.bare(), list(result.findings), reads


def one_configuration(path: str, limits: Limits) -> Document:
    """The single configuration that a command works on; ends the command when the path names none or several."""
    from pidcfg.validate.engine import is_scenario

    documents = list(read_inputs((path,), limits))
    if len(documents) != 1:
        raise click.ClickException(f"{path} stands for {len(documents)} files; name one configuration")
    if is_scenario(documents[0]):
        raise click.ClickException(f"{path} is a scenario; name the configuration it runs")
    return documents[0]


def show_errors(findings: Sequence[Diagnostic], document: Document | None, fmt: str) -> None:
    """The errors of a configuration: in full on stderr, or as the result where JSON was asked for."""
    from pidcfg.cli.formats.reporters import json_v1, text
    from pidcfg.cli.terminal.console import echo_json, note
    from pidcfg.results.findings import errors_in

    documents = {} if document is None else {document.file: document}
    if fmt == "json":
        echo_json(json_v1(errors_in(findings), documents))
    else:
        note(text(errors_in(findings), documents).rstrip())
