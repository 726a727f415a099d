"""The report as one HTML page that needs nothing else, and as a PDF."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from functools import cache
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from pidcfg.output.report.content import contents_of, measurement_text, text
from pidcfg.output.report.runs import metric_unit
from pidcfg.output.report.sheets import FIRST
from pidcfg.text.diagnostics import Severity, words_of
from pidcfg.text.frozen import frozen
from pidcfg.text.signs import printable

if TYPE_CHECKING:
    from collections.abc import Iterable

    from jinja2 import Environment
    from markupsafe import Markup

    from pidcfg.output.report.content import Content, Fact, LoopSheet, RegisterBlock, Setting, Sheet, Title
    from pidcfg.text.diagnostics import Diagnostic

# --- The report as one HTML page that needs nothing else: its script stands in it, nothing comes from elsewhere -------

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
    from pidcfg.pictures.page import POLICY, SCRIPT, STYLE

    return _rendered(
        "page.html",
        content,
        full=full,
        policy=POLICY,
        figure_style=STYLE,
        script=SCRIPT,
        groups=group_findings(content.findings),
        marks={d: f"finding-{i}" for i, d in enumerate(content.findings, start=1)},
        rows=title_rows(content.title, content),
        sign_off=SIGN_OFF,
    )


def door_sheet(content: Content) -> str:
    """All loops with their main values and words on one sheet, for the door of the cabinet."""
    policy = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
    return _rendered(
        "sheet.html",
        content,
        policy=policy,
        places=main_places,
        tuning=tuning,
        alarms=alarms,
        alarm_names=alarm_names(content),
        files=content.files,
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


@cache
def _environment() -> Environment:
    """Everything is escaped, and a name that is misspelled in a template is an error; a template is compiled once."""
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
    env.globals |= {"metric_unit": metric_unit, "main_settings": main_settings, "compared": compared_words}
    return env


# --- what is shown ---------------------------------------------------------------------------------------------------


@frozen
class FindingGroup:
    """Findings that are explained alike: everything but message and place is said once."""

    first: Diagnostic
    findings: tuple[Diagnostic, ...]

    @property
    def rows(self) -> list[list[Diagnostic]]:
        """Those together that say the same of several loops."""
        rows: dict[str, list[Diagnostic]] = {}
        for d in self.findings:
            rows.setdefault(words_of(d), []).append(d)
        return list(rows.values())


def group_findings(findings: Iterable[Diagnostic]) -> list[FindingGroup]:
    """The findings of one rule with the same words of explanation together, in the order of the first."""
    groups: dict[tuple[object, ...], list[Diagnostic]] = {}
    for d in findings:
        groups.setdefault((d.severity, d.code, d.plc_effect, d.reference, d.help), []).append(d)
    return [FindingGroup(group[0], tuple(group)) for group in groups.values()]


def main_settings(sheet: Sheet) -> list[Setting]:
    """What the file says of a loop, without the units, which stand beside the values."""
    rows = (setting for group in sheet.groups for setting in group.settings if setting.given)
    return [row for row in rows if row.path.rpartition(".")[2] != "unit"]


def compared_words(blocks: Iterable[RegisterBlock]) -> list[tuple[str, str]]:
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


def alarms(sheet: LoopSheet) -> dict[str, Setting]:
    """The limits of a loop's alarms, as far as the file says them, by what they are called."""
    rows = [row for row in main_settings(sheet) if row.path.startswith("alarms.") and not isinstance(row.value, bool)]
    return {
        row.path.removeprefix("alarms.").removeprefix("pv.").replace("_", "-").replace(".", " "): row for row in rows
    }


def alarm_names(content: Content) -> list[str]:
    """The alarms that any loop has."""
    return list(dict.fromkeys(name for _, sheet in content.loops for name in alarms(sheet)))


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
    return "–" if value is None else measurement_text(value)


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


# ----------------------------------------------------------------------------------------------------------------------
# A page as a PDF: printed by the Chromium, Chrome or Edge that is on the computer, without a window or a network.

BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "msedge",
    "microsoft-edge",
    "microsoft-edge-stable",
)
"""Names on the path."""
PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
    r"C:\Program Files\Microsoft\Edge\Application\msedge.exe",
)
"""Where they are installed on systems that do not put them there."""
VARIABLE = "PIDCFG_BROWSER"
"""Of the environment: the browser to take."""
FLAGS = (
    "--headless",
    "--disable-gpu",
    "--disable-extensions",
    "--disable-background-networking",
    "--disable-sync",
    "--no-first-run",
    "--no-pdf-header-footer",
)
PATIENCE = 300
"""Seconds that a page may take."""
TIMES = re.compile(rb"(/(?:CreationDate|ModDate) \(D:)\d{14}")
EPOCH = b"20000101000000"
"""What stands for the times in every file, so that the same report gives the same bytes."""


class PdfError(Exception):
    """Why there is no PDF, and what to do."""


def browser() -> str:
    """The path of the browser that prints; raises `PdfError` where there is none."""
    wanted = os.environ.get(VARIABLE)
    names = (wanted,) if wanted else (*BROWSERS, *PLACES)
    path = next((path for path in map(shutil.which, names) if path), None)
    if path is not None:
        return path
    if wanted:
        raise PdfError(f"{VARIABLE} names {wanted!r}, which is no program here")
    raise PdfError(
        "a PDF is printed by Chromium, Chrome or Edge, and none of them is here; install one, name it in the variable "
        f"{VARIABLE}, or write report.html and print that from a browser"
    )


def pdf(html: str, path: str) -> bytes:
    """The page, printed by the browser at a path; raises `PdfError` with what the browser says where it fails."""
    with TemporaryDirectory(prefix="pidcfg-", ignore_cleanup_errors=True) as folder:
        page, target = Path(folder) / "report.html", Path(folder) / "report.pdf"
        page.write_text(html, "utf-8")
        root = ["--no-sandbox"] if sys.platform == "linux" and os.geteuid() == 0 else []
        own = [f"--user-data-dir={folder}/profile", f"--print-to-pdf={target}"]
        try:
            result = subprocess.run(  # noqa: S603 - a browser that the user has installed or named, and no shell
                [path, *FLAGS, *root, *own, page.as_uri()], capture_output=True, timeout=PATIENCE, check=False
            )
        except OSError as error:
            raise PdfError(f"{path} cannot be started: {error.strerror}") from None
        except subprocess.TimeoutExpired:
            raise PdfError(f"{path} has not printed the page within {PATIENCE} s") from None
        if not target.is_file():
            words = result.stderr.decode("utf-8", "replace").strip().splitlines()
            raise PdfError(f"{path} has printed nothing: {words[-1] if words else f'exit code {result.returncode}'}")
        return TIMES.sub(rb"\g<1>" + EPOCH, target.read_bytes())
