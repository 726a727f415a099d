"""The numbers that the message of a finding quotes of its own loop: they make it this fault and no other one.

A fault may lie between two keys of a loop, of which only one is the key of the finding: ``low`` is not above
``low_low``. So the numbers of a message are a part of what a finding is known by, whatever key they come from and
however they were worked out. What follows from other loops or from the place in the file is left out: names, addresses,
and every number of a fault that several loops share. Words are no part of it, so that a better wording makes no new
finding.
"""

from __future__ import annotations

import re
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pidcfg.validate.identity import loop_name, shortened
from pidcfg.validate.rule import PLACEHOLDER

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.document import Document
    from pidcfg.validate.rule import Finding, Rule

NUMBER = re.compile(r"(?<![\w.\-/#])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w\-/#]|\.\d)")
"""A number that stands for itself: no part of a name (``TIC-101``), an address (``V2005.3``) or a version."""


class Quotes:
    """What the findings of one file quote."""

    def __init__(self, doc: Document) -> None:
        self._doc = doc

    def of(self, rule: Rule, findings: Sequence[Finding]) -> str | None:
        """The numbers of a rule's findings at one key; None where there are none, or no loop that they are of."""
        path = findings[0].path
        if not loop_name(self._doc, path):
            return None
        fields = PLACEHOLDER.findall(rule.message)
        own = (" | ".join(str(one.values[name]) for name in fields) for one in findings if not one.with_loops)
        texts = dict.fromkeys(" ".join(self._numbers(text)) for text in own)
        return shortened("; ".join(filter(None, texts))) or None

    def _numbers(self, text: str) -> list[str]:
        return NUMBER.findall(self._numbered.sub("", text) if self._numbered else text)

    @cached_property
    def _numbered(self) -> re.Pattern[str] | None:
        """The names of loops, blocks and signals that hold a number of their own, ``Oven 2``; 2.5 holds no name."""
        lists = [items for items in (self._doc.data or {}).values() if isinstance(items, list)]
        names = {str(item["name"]) for items in lists for item in items if _is_named(item)}
        several = sorted(filter(NUMBER.search, names), key=len, reverse=True)
        return re.compile(rf"(?<![\w.\-])(?:{'|'.join(map(re.escape, several))})(?!\w|\.\d)") if several else None


def _is_named(item: Any) -> bool:
    return isinstance(item, dict) and isinstance(item.get("name"), str)
