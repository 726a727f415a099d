"""The result of `pidcfg.explain`, its JSON, and the pages of rules."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.output.explanation.answer import Page
from pidcfg.output.explanation.shown import explanation_data
from pidcfg.output.findings import Data, errors_in, findings_data, short_repr
from pidcfg.text.frozen import frozen
from pidcfg.validate.texts import RuleText, as_data, page, text_by_code

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document

Example = tuple[str, str, str]
"""A thing that can be asked for, what it is, and the vendor's title."""


@frozen
class ExplainResult:
    """Explanations, one for each reading of each thing; or, where no thing was named, examples of what can be."""

    __repr__ = short_repr

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
        return explanation_data(self.pages, self.examples) if self.ok else findings_data(errors_in(self.findings))


def rule_page(rule: RuleText) -> Page:
    """The page of a rule."""
    return Page("rule", rule.code, rule.title, reference=rule.reference, markdown=page(rule), extra=as_data(rule))


def rule_pages(things: Sequence[str]) -> tuple[Page, ...]:
    """The pages of things that are all codes of rules, for which nothing else has to be asked; else none."""
    found = [text_by_code(thing.strip().upper()) for thing in things]
    return tuple(rule_page(rule) for rule in found if rule is not None) if None not in found else ()
