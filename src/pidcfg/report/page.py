"""The report as one HTML page that needs nothing else: no script, no font, no picture from elsewhere."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from pidcfg.control_characters import printable
from pidcfg.diagnostics import Severity
from pidcfg.report.texts import measured, text

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

    from pidcfg.report.content import Content, Title

TEMPLATES = Path(__file__).parent / "templates"
CODE = re.compile("`([^`]+)`")
PARTS = re.compile("[^._]*[._]|[^._]+")
SIGN_OFF = ("Prepared", "Checked", "Commissioned", "Accepted")
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
"""What the page may load: its own styles, and pictures that it holds itself."""


def page(content: Content) -> str:
    """The page, with the charts of its runs."""
    from pidcfg.pictures.page import FIGURE_STYLE, figures

    title = content.title
    return printable(
        _environment()
        .get_template("page.html")
        .render(
            content=content,
            title=title,
            pictures={run.anchor: figures(run.charts) for run in content.runs},
            figure_style=FIGURE_STYLE,
            policy=POLICY,
            counts=counts(content),
            marks={d: f"finding-{i}" for i, d in enumerate(content.findings, start=1)},
            rows=title_rows(title, content),
            running=css_string(" · ".join(part for part in (title.project, title.title) if part)),
            marking=css_string(" · ".join(part for part in (title.document, _revision(title)) if part)),
            tool=css_string(f"pidcfg {title.version}"),
            sign_off=SIGN_OFF,
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
    env.filters |= {"prose": prose, "soft": soft, "cell": text, "number": number}
    return env


def prose(sentence: str) -> Markup:
    """A text of ours as HTML: what stands between backticks is code."""
    from markupsafe import Markup, escape

    parts = CODE.split(sentence)
    return Markup("").join(
        Markup("<code>{}</code>").format(part) if i % 2 else escape(part) for i, part in enumerate(parts)
    )


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
