"""Batches of samples in the formats of `pidcfg certify`: text for people, JSON, and JUnit's XML."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.cli.formats.certification_text import figure, text
from pidcfg.diagnostics import Severity
from pidcfg.results.certification import batches_data
from pidcfg.writer import json_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.certification.outcome import Certification, Outcome, Share
    from pidcfg.cli.formats.junit import Case

Written = dict[tuple[str, int], str]
"""Files of samples, by scenario file and number."""


def render_batches(name: str, outcomes: Sequence[Outcome], written: Mapping[tuple[str, int], str]) -> str:
    """The batches in one of the formats."""
    if name == "json":
        return json_text(batches_data(outcomes, written), allow_nan=False)
    return junit(outcomes) if name == "junit" else text(outcomes, written)


def junit(outcomes: Sequence[Outcome]) -> str:
    """A suite a scenario: whether all samples ran, then each expectation, the standing ones last."""
    from pidcfg.cli.formats.findings import display_name
    from pidcfg.cli.formats.junit import document

    return document("pidcfg certify", {display_name(one.file): list(_cases(one)) for one in outcomes})


def _cases(outcome: Outcome) -> Iterator[Case]:
    from pidcfg.cli.formats.junit import Case, entry

    found = outcome.certification
    errors = [d for d in outcome.findings if d.severity is Severity.ERROR]
    if found is None:
        yield Case("the samples run", errors=tuple(entry(d) for d in errors))
        return
    failures = tuple(entry(d) for d in errors) if outcome.unjudged else ()
    if found.failed_to_run:
        message = f"{found.failed_to_run:,} of {found.samples:,} samples cannot run"
        failures += (("error PID062", message, "\n".join(found.reasons)),)
    yield Case("the samples run", failures)
    for one in (*found.expectations, *found.standing):
        yield _case(one, found)


def _case(one: Share, found: Certification) -> Case:
    from pidcfg.cli.formats.junit import Case

    said = f"{one.held:,} of {one.samples:,} samples, so at least {figure(one.bound)} %"
    if one.judged == 0 and not found.failed_to_run:
        return Case(one.text, skipped="not judged in any sample")
    if one.passed:
        return Case(one.text, output=said)
    wanted = "all samples are wanted" if one.wanted is None else f"{one.wanted:g} % are wanted"
    return Case(one.text, (("error PID061", f"{said}; {wanted}", said),))
