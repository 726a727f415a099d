"""The report as one HTML page that needs nothing else: its script stands in it, nothing comes from elsewhere."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING

from pidcfg.control_characters import printable
from pidcfg.diagnostics import Severity
from pidcfg.report.content import contents_of
from pidcfg.report.facts import FIRST
from pidcfg.report.runs import metric_unit
from pidcfg.report.texts import measured, text

if TYPE_CHECKING:
    from collections.abc import Iterable

    from jinja2 import Environment
    from markupsafe import Markup

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.report.content import Block, Content, Fact, LoopSheet, Setting, Sheet, Title

TEMPLATES = Path(__file__).parent / "templates"
CODE = re.compile("`([^`]+)`")
PARTS = re.compile("[^._]*[._]|[^._]+")
CLAUSE = re.compile(r"[.;:,](?= |$)| or `")
"""Where the first clause of a meaning ends."""
OFFSETS = re.compile(r" \([^)]*n\+\d[^)]*\)")
"""A register by its offset, whose address stands beside the meaning."""
SIGN_OFF = ("Prepared", "Checked", "Commissioned", "Accepted")
GENERAL = {*(title for title, *_ in FIRST), "Direction", "Form", "Pulses", "Duty cycle"}
"""Facts that are not the terms of the equation."""
MANY = 4
"""Words of zeros that stand as one."""


def page(content: Content, *, full: bool = False) -> str:
    """The page, with the charts of its runs; ``full``: with what is at its default, and all words and signals."""
    from pidcfg.pictures.trend import POLICY, SCRIPT, STYLE

    return _rendered(
        "page.html",
        content,
        full=full,
        policy=POLICY,
        figure_style=STYLE,
        script=SCRIPT,
        groups=grouped(content.findings),
        marks={d: f"finding-{i}" for i, d in enumerate(content.findings, start=1)},
        rows=title_rows(content.title, content),
        sign_off=SIGN_OFF,
    )


def door_sheet(content: Content) -> str:
    """All loops with their main values and words on one sheet, for the door of the cabinet."""
    policy = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
    return _rendered(
        "sheet.html", content, policy=policy, places=main_places, tuning=tuning, alarms=alarms, files=content.files
    )


def _rendered(template: str, content: Content, **more: object) -> str:
    title = content.title
    return printable(
        _environment()
        .get_template(template)
        .render(
            content=content,
            title=title,
            counts=counts(content),
            running=css_string(" · ".join(part for part in (title.project, title.title) if part)),
            marking=css_string(" · ".join(part for part in (title.document, _revision(title)) if part)),
            tool=css_string(f"pidcfg {title.version}"),
            **more,
        )
    )


def _revision(title: Title) -> str:
    return f"rev. {title.revision}" if title.revision else ""


def _environment() -> Environment:
    """Everything is escaped, and a name that is misspelled in a template is an error."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    env = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    env.filters |= {
        "prose": prose,
        "soft": soft,
        "cell": text,
        "number": number,
        "clause": clause,
        "fact_pair": fact_pair,
        "rising": rising,
    }
    env.globals |= {"metric_unit": metric_unit, "main_settings": main_settings, "compared": compared}
    return env


# --- what is shown ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class FindingGroup:
    """Findings that are explained alike: everything but message and place is said once."""

    first: Diagnostic
    findings: tuple[Diagnostic, ...]


def grouped(findings: Iterable[Diagnostic]) -> list[FindingGroup]:
    """The findings of one rule with the same words of explanation together, in the order of the first."""
    groups: dict[tuple[object, ...], list[Diagnostic]] = {}
    for d in findings:
        groups.setdefault((d.severity, d.code, d.plc_effect, d.reference, d.help), []).append(d)
    return [FindingGroup(group[0], tuple(group)) for group in groups.values()]


def main_settings(sheet: Sheet) -> list[Setting]:
    """What the file says of a loop, without the units, which stand beside the values."""
    rows = (setting for group in sheet.groups for setting in group.settings if setting.given)
    return [row for row in rows if row.path.rpartition(".")[2] != "unit"]


def compared(blocks: Iterable[Block]) -> list[tuple[str, str]]:
    """What is compared with the PLC, by address; many zeros in a row stand as one."""
    rows: list[tuple[str, str]] = []
    for content, run in groupby(contents_of(tuple(blocks)).items(), key=itemgetter(1)):
        addresses = [address for address, _ in run]
        many = not content.strip("0") and len(addresses) >= MANY
        rows += [(f"{addresses[0]} to {addresses[-1]}", content)] if many else [(one, content) for one in addresses]
    return rows


def main_places(sheet: LoopSheet) -> dict[str, tuple[str, str]]:
    """The facts of a loop with their places, by title."""
    return {fact.title: (fact.text, fact.place) for fact in sheet.facts}


def tuning(sheet: LoopSheet) -> list[Fact]:
    """The three terms of a loop."""
    return [fact for fact in sheet.facts if fact.title not in GENERAL]


def alarms(sheet: LoopSheet) -> list[Setting]:
    """The limits of a loop's alarms, as far as the file says them."""
    rows = main_settings(sheet)
    return [row for row in rows if row.path.startswith("alarms.") and not isinstance(row.value, bool)]


def rising(direction: str) -> str:
    """The first words of a direction."""
    return direction.partition(" when ")[0]


def fact_pair(fact: Fact) -> tuple[str, str]:
    """A fact without its place."""
    return fact.title, fact.text


# --- how it is shown -------------------------------------------------------------------------------------------------


def prose(sentence: str) -> Markup:
    """A text of ours as HTML: what stands between backticks is code."""
    from markupsafe import Markup, escape

    parts = CODE.split(sentence)
    return Markup("").join(
        Markup("<code>{}</code>").format(part) if i % 2 else escape(part) for i, part in enumerate(parts)
    )


def clause(sentence: str) -> str:
    """The first clause of a meaning, for a line of its own."""
    return CLAUSE.split(OFFSETS.sub("", sentence), maxsplit=1)[0]


def soft(name: str) -> Markup:
    """A name that may be broken after a dot or an underscore."""
    from markupsafe import Markup, escape

    return Markup("").join(escape(part) + Markup("<wbr>") * part.endswith((".", "_")) for part in PARTS.findall(name))


def number(value: float | None) -> str:
    """A measured number; a dash where there is none."""
    return "–" if value is None else measured(value)


def counts(content: Content) -> dict[str, int]:
    """How many findings there are of each severity, the gravest first."""
    return {s.label: sum(d.severity is s for d in content.findings) for s in sorted(Severity, reverse=True)}


def title_rows(title: Title, content: Content) -> list[tuple[str, str]]:
    """The title block: what was given, then what the files say."""
    plants = ", ".join(dict.fromkeys(plc.name for plc in content.plcs if plc.name))
    rows = [
        ("Project", title.project),
        ("Customer", title.customer),
        ("Plant", title.plant or plants),
        ("PLC", ", ".join(content.vendors)),
        ("Document", title.document),
        ("Revision", title.revision),
        ("Author", title.author),
        ("Date", title.date),
        ("Made by", f"pidcfg {title.version}"),
    ]
    return [(name, value) for name, value in rows if value]


def css_string(words: str) -> str:
    """A text as a string of a style sheet: whatever is no letter, digit or blank is written as its number."""
    return '"' + "".join(c if c.isascii() and (c.isalnum() or c == " ") else f"\\{ord(c):x} " for c in words) + '"'
