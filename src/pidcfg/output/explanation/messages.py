"""What pidcfg itself says, asked for as it stands: a message, a line of the checklist, a note of a run."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.output.explanation.symptoms import Symptom, rows_of
from pidcfg.validate.catalog import CODE
from pidcfg.validate.texts import PREFIX, texts
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

TABLE = Path(__file__).with_name("messages.toml")
LINES = "line"
HOLE = re.compile(r"\{[^{}]*\}")
"""Where a template has something else each time."""
LEAST, LEAST_OF_HEAD = 6, 15
"""Letters that a template, and a beginning of one, must have of its own."""
END = re.compile(r" \(|[:;] ")
"""What a message goes into detail with."""
PLACE = re.compile(
    r"^\s*(?:\S+:[0-9]+(?::[0-9]+)?:?\s+)?(?:(?:error|warning|info|note|Error|check after the download):?\s+)?"
)
"""What stands before a message in a terminal."""
LOOP_BEHIND = re.compile(r"\s*\[[^\][]+\]$")
WRITTEN_CODE = re.compile(rf"\b{CODE.pattern}\b")
WRITTEN_ADDRESS = re.compile(r"\b([A-Z]{1,2})[0-9]+\b")
SPACES = re.compile(r"\s+")


class Template(NamedTuple):
    """A text with holes, as a pattern; ``own``: how many of its letters are its own."""

    pattern: re.Pattern[str]
    own: int
    means: str | Symptom
    """The code of a rule, or a line."""

    @classmethod
    def of(cls, text: str, means: str | Symptom) -> Template:
        """``unknown key {}`` as a pattern."""
        parts = [re.escape(SPACES.sub(" ", part)) for part in HOLE.split(text)]
        own = sum(map(len, HOLE.split(text)))
        return cls(re.compile(".*?".join(parts), re.IGNORECASE), own, means)


@cache
def templates() -> tuple[Template, ...]:
    """Those of all rules, then those of the table; a text that is nothing but a hole is none."""
    import tomllib

    table = tomllib.loads(TABLE.read_text("utf-8"))
    found = [Template.of(rule.message, code) for code, rule in texts().items()]
    found += [Template.of(text, code) for code, texts in table["rules"].items() for text in texts]
    found += [Template.of(text, row) for row in rows_of(table[LINES]) for text in row.words]
    return tuple(template for template in found if template.own >= LEAST)


@cache
def beginnings() -> tuple[Template, ...]:
    """Messages up to where they go into detail: people ask for as much as a line on their screen has."""
    heads = [(END.split(rule.message, maxsplit=1), code) for code, rule in texts().items()]
    found = [Template.of(parts[0], code) for parts, code in heads if len(parts) > 1]
    return tuple(template for template in found if template.own >= LEAST_OF_HEAD)


def said(text: str, vendors: Sequence[str]) -> list[str | Symptom]:
    """The rules, by their codes, and lines that a text is of: by a code in it, and by its wording."""
    means: list[str | Symptom] = [code for code in dict.fromkeys(WRITTEN_CODE.findall(text)) if code in texts()]
    found = [template for template in _matching(text) if _is_of(template, vendors)]
    banks = set(WRITTEN_ADDRESS.findall(text))
    addressed = [key for key in vendors if banks & {*VENDORS[key].banks}]
    found = [template for template in found if _is_of(template, addressed, shared=False)] or found
    most = max((template.own for template in found), default=0)
    for template in found:
        if template.own == most and template.means not in means:
            means.append(template.means)
    return means


def _is_of(template: Template, vendors: Sequence[str], *, shared: bool = True) -> bool:
    """Whether a template is of one of some vendors; ``shared``: or of all."""
    prefixes = tuple(VENDORS[key].prefix for key in vendors)
    if not isinstance(template.means, str) or template.means.startswith(PREFIX):
        return shared
    return template.means.startswith(prefixes)


def _matching(text: str) -> Iterator[Template]:
    """The templates that a text is of: as it stands, without its place, without the loop behind or before it."""
    whole = SPACES.sub(" ", text).strip()
    plain = PLACE.sub("", whole)
    texts = {whole, plain, LOOP_BEHIND.sub("", plain), plain.partition(": ")[2] or plain}
    whole_ones = [template for template in templates() if any(map(template.pattern.fullmatch, texts))]
    most = max((template.own for template in whole_ones), default=None)
    heads = (t for t in beginnings() if most in {None, t.own} and any(map(t.pattern.fullmatch, texts)))
    return iter((*whole_ones, *heads))
