"""Files that repeat the version or an address: ``python tasks.py generate`` writes both into them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import pidcfg
from release.metadata import ROOT, addresses

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

VERSION = "VERSION"


@dataclass(frozen=True)
class Place:
    """A part of a file: the group of ``pattern``, ``{}`` in ``text`` being the version or an address."""

    file: str
    fact: str
    """``VERSION``, or a name of src/pidcfg/about.py."""
    pattern: str
    text: str = "{}"
    without: str = ""
    """What stands there as long as there is no address."""
    times: int = 1

    def written(self, content: str, fact: str) -> str:
        """The file with the fact in this place."""
        wanted = self.text.format(fact) if fact else self.without
        found = list(re.finditer(self.pattern, content, re.MULTILINE))
        if len(found) != self.times:
            message = f"{self.file} has {len(found)} places for {self.fact} by {self.pattern!r}, not {self.times}"
            raise ValueError(message)
        for match in reversed(found):
            content = content[: match.start(1)] + wanted + content[match.end(1) :]
        return content


PLACES = (
    Place("CITATION.cff", VERSION, r"^version: (.*)$"),
    Place("CITATION.cff", "REPOSITORY", r"^license: MIT\n((?:repository-code: .*\n)?)", "repository-code: {}\n"),
    Place("CITATION.cff", "SITE", r"^type: software\n((?:url: .*\n)?)", "url: {}\n"),
    Place("Dockerfile", VERSION, r'org\.opencontainers\.image\.version="(.*?)"'),
    Place("Dockerfile", "REPOSITORY", r'licenses="MIT"((?: \\\n.*\.image\.source=".*")?)',
          ' \\\n      org.opencontainers.image.source="{}"'),
    Place("Dockerfile", "SITE", r'small PLCs, written as YAML"((?: \\\n.*\.image\.documentation=".*")?)',
          ' \\\n      org.opencontainers.image.documentation="{}"'),
    Place("docs/ci.md", VERSION, r"^    rev: v(\S+)$"),
    Place("docs/ci.md", "REPOSITORY", r"^  - repo: (https\S+)", "{}", "https://example.com/your/pidcfg"),
    Place("docs/ci.md", "ACTION", r"uses: (\S+)@0123456789abcdef", "{}", "your/pidcfg"),
    Place("docs/ci.md", "IMAGE", r"docker run --rm -v \"\$PWD:/work\" (\S+) validate", "{}", "pidcfg"),
    Place("editors/vscode/package.json", VERSION, r'^  "version": "(.*)",$'),
    Place("editors/vscode/package.json", "REPOSITORY", r'^  "license": "MIT",\n((?:  "repository": .*\n)?)',
          '  "repository": {{"type": "git", "url": "{}"}},\n'),
    Place("editors/vscode/package-lock.json", VERSION, r'^ +"name": "pidcfg",\n +"version": "(.*)",$', times=2),
    Place(".github/workflows/release.yml", "INDEX", r"^      name: pypi\n((?:      url: .*\n)?)", "      url: {}\n"),
    Place("requirements/pidcfg.cdx.json", VERSION, r'"pkg:pypi/pidcfg@([^"]+)"'),
    Place("requirements/pidcfg.cdx.json", VERSION,
          r'"pkg:pypi/pidcfg@[^"]+",\n +"type": "application",\n +"version": "([^"]+)"'),
)  # fmt: skip


def files(root: Path = ROOT, table: Mapping[str, str] | None = None, version: str = "") -> dict[Path, bytes]:
    """Each of these files as it has to be."""
    facts = {**(addresses(root) if table is None else table), VERSION: version or pidcfg.__version__}
    texts: dict[Path, str] = {}
    for place in PLACES:
        path = root / place.file
        text = texts.get(path) or path.read_text("utf-8")
        texts[path] = place.written(text, facts[place.fact])
    return {path: text.encode() for path, text in texts.items()}


def stale(root: Path = ROOT) -> list[str]:
    """The files that say something else."""
    return [str(path.relative_to(root)) for path, data in files(root).items() if path.read_bytes() != data]
