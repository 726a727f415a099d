"""What a register, a bit, a number or a code means: the result of `pidcfg.explain`, and its JSON."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pidcfg.explanation.configuration import Configured
from pidcfg.explanation.decisions import all_decisions
from pidcfg.explanation.lookup import check_starts, explain, forms
from pidcfg.explanation.question import Question
from pidcfg.explanation.render import as_data
from pidcfg.results.arguments import ArgumentError
from pidcfg.results.findings import Data, errors_in, findings_data
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.document import Document
    from pidcfg.explanation.page import Page
    from pidcfg.validate.engine import Checked

Example = tuple[str, str, str]
"""A thing that can be asked for, what it is, and the vendor's title."""


@dataclass(frozen=True, slots=True)
class ExplainResult:
    """Explanations, one for each reading of each thing; or, where no thing was named, examples of what can be."""

    pages: tuple[Page, ...] = ()
    examples: tuple[Example, ...] = ()
    findings: tuple[Diagnostic, ...] = ()
    """What keeps the configuration from being read; empty where there is none."""
    document: Document | None = None
    """The configuration, where one was given."""

    @property
    def ok(self) -> bool:
        """Whether there is something to read."""
        return bool(self.pages or self.examples)

    def to_json(self) -> Data:
        """What ``pidcfg explain --format json`` prints; where the configuration cannot be read, its errors."""
        return as_data(self.pages, self.examples) if self.ok else findings_data(errors_in(self.findings))


def explained(
    things: Sequence[str], vendor: str | None, blocks: tuple[str, ...], checked: Checked | None, *, loop: bool
) -> ExplainResult:
    """Every reading of every thing; with a configuration, in its vendor's terms."""
    document = configured = family = None
    if checked is not None:
        document = checked.document
        if checked.encoding is None or checked.vendor is None:
            return ExplainResult(findings=checked.findings, document=document)
        family, configured = checked.vendor.key, Configured(checked)
        if vendor not in {None, family}:
            raise ArgumentError(f"`config` is of vendor {family}, not {vendor}", "config")
    vendors = list(VENDORS) if (key := vendor or family) is None else [key]
    if not things:
        return ExplainResult(examples=tuple(forms(vendors)), document=document)
    if blocks:
        check_starts(blocks, vendors)
    pages = []
    for thing in things:
        question = Question.of(thing, loop=loop, starts=blocks, config=configured)
        pages += explain(question, vendors, all_decisions)
    return ExplainResult(tuple(pages), document=document)
