"""The pages of coverage: what becomes of each section of a manual, from docs/covered/VENDOR.yaml.

A row of such a file has a heading of the manual as ``section`` (or several as ``sections``; below another one with
`` > ``) and what there is of it: ``keys`` of the configuration (of the function block ``block``), ``rules`` by code,
what the virtual PLC ``runs`` (``D55`` becomes a link), ``tools`` (commands), ``pages`` of docs/, and under ``not``
what there is not, with the reason. Where the keys stand in the PLC's memory is looked up in the tables that encode
and decode. A rule whose basis is a place in the manual stands at that section by itself.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ruamel.yaml import YAML

from pidcfg.encoders.parameters import ParameterTable
from pidcfg.output.explanation.lookup import all_decisions
from pidcfg.schemas.document import models_in
from pidcfg.text import references as refs
from pidcfg.validate.catalog import find_rules, group_of, rule_anchor
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from pydantic import BaseModel

    from pidcfg.text.references import Decision, Manual
    from pidcfg.vendors import Vendor

FOLDER = Path(__file__).parent / "covered"
NEVER = "-"
PAGE = """\
# What is covered of the {vendor} manual

{manual}: its sections in its order, and what becomes of each. The keys of the file are written to the words and read
back from them by one table, so that both stand in one column. The last column says what there is not, and why. A
section of which there is nothing at all says so there alone. {counts}

| section | keys | {words} | checked by | the virtual PLC | more | not |
|---|---|---|---|---|---|---|
"""
INDEX = """\
# What is covered of the manuals

Section by section: what a file can say, which words it becomes, what is checked, what the virtual PLC executes, and
what there is not, with the reason. Each key of a PLC stands at a section of its manual, and each rule at the one that
it rests on.

| PLC | sections | with keys | with rules | executed | with a command or a page | nothing |
|---|---|---|---|---|---|---|
"""


class Row(NamedTuple):
    """One row of a table: headings of the manual that share a statement, and what is said of them."""

    sections: tuple[str, ...]
    block: str | None
    keys: tuple[str, ...]
    rules: tuple[str, ...]
    runs: str
    tools: tuple[str, ...]
    pages: tuple[str, ...]
    missing: str

    @property
    def nothing(self) -> bool:
        """Whether there is only a reason."""
        return not (self.keys or self.rules or self.runs or self.tools or self.pages)


class Coverage(NamedTuple):
    """The table of one manual."""

    manual: Manual
    rows: tuple[Row, ...]


def coverage_pages() -> dict[str, str]:
    """The index, and a page a manual."""
    pages = {"coverage.md": INDEX + "".join(summary(vendor) for vendor in covered())}
    return pages | {f"{vendor.key}-coverage.md": coverage_page(vendor) for vendor in covered()}


def covered() -> list[Vendor]:
    """The PLCs that have a manual."""
    return [vendor for vendor in VENDORS.values() if (FOLDER / f"{vendor.key}.yaml").exists()]


@cache
def coverage(key: str) -> Coverage:
    """The table of a vendor; raises `TypeError` or `ValueError` for a row with a key that there is none of."""
    data = YAML(typ="safe").load((FOLDER / f"{key}.yaml").read_text("utf-8"))
    rows = [row(**entry) for entry in data["sections"]]
    resting: dict[str, list[str]] = {}
    for code, rule in find_rules(VENDORS[key].prefix).items():
        if isinstance(rule.basis, refs.Ref):
            resting.setdefault(rule.basis.place, []).append(code)
    return Coverage(getattr(refs, data["manual"]), tuple(with_rules(r, resting) for r in rows))


def with_rules(r: Row, resting: dict[str, list[str]]) -> Row:
    """A row with the rules that rest on its sections of the manual, which are taken out of ``resting``.

    Of two sections of one name the first one has them.
    """
    places = [name.rpartition(" > ")[2].rstrip(":") for name in r.sections]
    return r._replace(rules=tuple(sorted({*r.rules, *(code for p in places for code in resting.pop(p, ()))})))


def unplaced(vendor: Vendor) -> list[str]:
    """The vendor's rules that stand at no section: they rest on decisions alone."""
    return sorted({*find_rules(vendor.prefix)} - {code for r in coverage(vendor.key).rows for code in r.rules})


def row(section: str = "", sections: Sequence[str] = (), block: str | None = None, runs: str = "", **lists: Any) -> Row:
    """A row of the file."""
    keys, codes, tools, pages = (tuple(lists.pop(name, ())) for name in ("keys", "rules", "tools", "pages"))
    found = Row(tuple(sections) or (section,), block, keys, codes, runs, tools, pages, lists.pop("not", ""))
    if lists or bool(section) == bool(sections):
        raise ValueError(f"{found.sections}: {', '.join(lists) or 'one of section and sections'}")
    return found


# --- a page ----------------------------------------------------------------------------------------------------------


def summary(vendor: Vendor) -> str:
    """A vendor's line of the index."""
    rows = coverage(vendor.key).rows
    counts = (
        sections(rows),
        sections(r for r in rows if r.keys),
        sections(r for r in rows if r.rules),
        sections(r for r in rows if r.runs),
        sections(r for r in rows if r.tools or r.pages),
        sections(r for r in rows if r.nothing),
    )
    return f"| [{vendor.title}]({vendor.key}-coverage.md) | {' | '.join(map(str, counts))} |\n"


def sections(rows: Iterable[Row]) -> int:
    """How many headings of the manual the rows have."""
    return sum(len(r.sections) for r in rows)


def coverage_page(vendor: Vendor) -> str:
    """The table of one manual."""
    manual, rows = coverage(vendor.key)
    words = "parameters" if isinstance(vendor.load("registers")[0], ParameterTable) else "words"
    counts = f"Of {sections(rows)} sections there is nothing of {sections(r for r in rows if r.nothing)}."
    head = PAGE.format(vendor=vendor.title, manual=manual.title, words=words, counts=counts)
    left = ", ".join(rule_link(code) for code in unplaced(vendor))
    return (
        head + "".join(line(vendor, r) for r in rows) + (f"\nRules that rest on no section: {left}.\n" if left else "")
    )


def line(vendor: Vendor, r: Row) -> str:
    """A row of the page."""
    more = [f"[`{tool}`](commands.md#pidcfg-{tool})" for tool in r.tools] + [
        f"[{page.partition('#')[0].removesuffix('.md')}]({page})" for page in r.pages
    ]
    cells = (
        "<br>".join(r.sections),
        ", ".join(f"`{key}`" for key in r.keys),
        ", ".join(words_of(vendor, r)),
        ", ".join(rule_link(code) for code in r.rules),
        linked(r.runs),
        ", ".join(more),
        linked(r.missing),
    )
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') or NEVER for cell in cells)} |\n"


def rule_link(code: str) -> str:
    """A rule's code with its place."""
    return f"[{code}](rules-{group_of(code)}.md#{rule_anchor(find_rules(code)[code])})"


def linked(text: str) -> str:
    """A text whose decisions are links."""
    return re.sub(
        r"\bD(\d{2,4})\b", lambda found: f"[{found[0]}](decisions.md{slug(decisions()[int(found[1])])})", text
    )


@cache
def decisions() -> dict[int, Decision]:
    """The decisions by their numbers; every module is looked through for them."""
    return {found.number: found for found in all_decisions()}


def slug(d: Decision) -> str:
    """Where a decision's heading is, as code-hosting sites and the documentation site both make it.

    The page itself where its title has angle brackets, of which the two make different things.
    """
    heading = re.sub(r"[^\w\- ]", "", f"D{d.number:02d} {d.title}".lower()).replace(" ", "-")
    return "" if "<" in d.title else f"#{heading}"


# --- keys and words ---------------------------------------------------------------------------------------------------


def words_of(vendor: Vendor, r: Row) -> list[str]:
    """Where the keys of a row stand in the PLC's memory: offsets as the manual writes them, or types."""
    tables = vendor.load("registers")
    if isinstance(tables[0], ParameterTable):
        return sorted({p.type.name for p in parameters_of(vendor, r.block) if p.name.partition(".")[0] in top_names(r)})
    found = []
    for table in tables:
        places = {table.offset_text(w.offset): None for w in table.words if any(holds(w.path, key) for key in r.keys)}
        for b in table.bits:
            if any(holds(b.path, key) for key in r.keys):
                places[
                    f"{table.offset_text(b.offset)} bit {', '.join(map(str, b.bits))}"
                    if b.mask > 1
                    else table.offset_text(b.offset)
                ] = None
        alone = sum(other.label == table.label for other in tables) == 1
        found += [place if alone else f"{table.title.partition(' (')[0].lower()} {place}" for place in places]
    return found


def top_names(r: Row) -> set[str]:
    """The parameters that the keys of a row are, or are members of."""
    return {key.partition(".")[0] for key in r.keys}


def parameters_of(vendor: Vendor, block: str | None) -> Iterator[Any]:
    """The rows of a function block's table; of all where none is named."""
    for table in vendor.load("registers"):
        if block in {None, table.title}:
            yield from table.rows


def holds(path: str | None, key: str) -> bool:
    """Whether a word holds a key, a part of it (a range has two words), or more than it (a transfer is one word)."""
    return path is not None and (
        f"{path}.".startswith(f"{key}.") or f".{key}".endswith(f".{path}") or key.startswith(f"{path}.")
    )


def key_paths(model: type[BaseModel], above: str = "") -> Iterator[str]:
    """Every key of a vendor's file, from its loop down: `tuning.gain`, `plc.loop_table`."""
    for name, field in model.model_fields.items():
        key = field.alias or name
        inner = models_in(field.annotation)
        for part in inner:
            yield from key_paths(part, "" if not above and key in {"loops", "blocks"} else f"{above}{key}.")
        if not inner:
            yield above + key
