"""How Sphinx makes the site: Markdown pages, one theme, nothing from the network."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from pygments.lexers.shell import BashLexer, ShellSessionBaseLexer  # type: ignore[import-untyped]

from pidcfg import __version__
from pidcfg.about import SITE
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from sphinx.application import Sphinx

HERE = Path(__file__).parent

# --- the order of the pages ------------------------------------------------------------------------------------------

VENDOR_PAGES = {
    name: [
        f"Keys <{name}-keys>",
        f"Registers <{name}-registers>",
        f"Rules <rules-{name}>",
        f"The manual's sections <{name}-coverage>",
    ]
    for name in VENDORS
}
ORDER = {
    "Tutorial": ["The first hour <tutorial>"],
    "How-to guides": [
        "converting",
        "tuning",
        "whatif",
        "certify",
        "scale",
        "ci",
        "living-with-findings",
        "pictures",
        "commissioning-report",
        "explain",
        "editors",
        "completion",
        "kit",
        "commissioning-day",
        "live",
        "migrating-a-line",
        "a-repository-with-ci",
        "adding-a-rule",
        "adding-a-register",
        "adding-a-format",
        "adding-a-vendor",
        "release",
    ],
    "The PLCs": [
        "DL06 <dl06>",
        "CLICK <click>",
        "EZLogix <ezlogix>",
        "NextoPID <nextopid>",
        "DPIDE <dpide>",
        "DPIDE programs <dpide-program>",
        "The neutral form <generic>",
    ],
    "Reference": [
        "commands",
        "file-format",
        "scenarios",
        "what-green-means",
        "settings",
        "environment",
        "output-formats",
        "From Python <api>",
        "rules",
        "The manuals' sections <coverage>",
        "exit-codes",
        "reliability",
        "dependencies",
        "changelog",
    ],
    "Explanation": ["why-text", "engine", "speed", "decisions", "architecture"],
}
"""Captions of the list of contents and their pages. What is not there is left out, what is not named comes last."""
BELOW = {
    **VENDOR_PAGES,
    "scenarios": ["Keys <scenario-keys>"],
    "settings": ["Keys <settings-keys>"],
    "rules": ["rules-reading", "rules-common"],
}
"""Pages that stand below another one in the list of contents."""


def contents(name: str) -> str:
    """The list of contents that a page ends with: Markdown of its own, so that files read well without a site."""
    there = {path.stem for path in HERE.glob("*.md")} - {"index"}
    if name in BELOW:
        return toctree("", [page for page in BELOW[name] if stem(page) in there], "hidden")
    if name != "index":
        return ""
    known = {stem(page) for pages in (*ORDER.values(), *BELOW.values()) for page in pages}
    parts = [toctree(caption, [page for page in pages if stem(page) in there]) for caption, pages in ORDER.items()]
    return "".join(parts) + toctree("More", sorted(there - known))


def stem(page: str) -> str:
    """The file of a page that may have a shorter title in the list: `Keys <dl06-keys>`."""
    return page.rpartition("<")[2].removesuffix(">")


def toctree(caption: str, pages: list[str], *flags: str) -> str:
    """A list of contents as a directive, or nothing when it would be empty."""
    options = "".join(f":{flag}:\n" for flag in flags) + "".join([f":caption: {caption}\n"] if caption else [])
    return "\n```{toctree}\n:maxdepth: 1\n" + options + "\n" + "\n".join(pages) + "\n```\n" if pages else ""


def add_contents(app: Sphinx, name: str, source: list[str]) -> None:
    """Called when a page has been read."""
    del app
    source[0] += contents(name)


class Session(ShellSessionBaseLexer):  # type: ignore[misc]  # Pygments ships no types
    """A session whose commands begin with `$ `; a `#` begins a line that a command prints."""

    name = "pidcfg session"
    _innerLexerCls = BashLexer  # noqa: N815 - the name that the base class reads
    _ps1rgx = re.compile(r"^(\$ )(.*\n?)")
    _ps2 = "> "


def copy_schemas(app: Sphinx, error: Exception | None) -> None:
    """Called at the end: puts the JSON Schemas beside the pages, under names that stay."""
    if error is None:
        shutil.copytree(HERE / "schemas", app.outdir / "schemas", dirs_exist_ok=True)


def setup(app: Sphinx) -> None:
    """Called by Sphinx at the start."""
    app.add_lexer("console", Session)
    app.connect("source-read", add_contents)
    app.connect("build-finished", copy_schemas)


# --- what Sphinx reads -----------------------------------------------------------------------------------------------

project = "pidcfg"
author = "pidcfg contributors"
copyright = "pidcfg contributors"  # noqa: A001 - the name that Sphinx reads
version = release = __version__

extensions = ["myst_parser"]
exclude_patterns = ["schemas"]
nitpicky = True
myst_heading_anchors = 4  # the anchors that code-hosting sites make, so that one link works in both

html_theme = "furo"
html_title = f"pidcfg {release}"
html_baseurl = SITE
html_favicon = "_static/favicon.svg"
html_static_path = ["_static"]
html_css_files = ["pidcfg.css"]
html_copy_source = False
html_use_index = False
html_show_sourcelink = False
html_show_sphinx = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#0a5c8a", "color-brand-content": "#0a5c8a"},
    "dark_css_variables": {"color-brand-primary": "#6cb6ff", "color-brand-content": "#6cb6ff"},
}
pygments_style = "friendly"
pygments_dark_style = "github-dark"
