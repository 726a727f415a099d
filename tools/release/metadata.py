"""What an index is told of pidcfg beyond pyproject.toml: its addresses, and README.md so that it can be read alone.

Run by hatchling when the package is built (``[tool.hatch.metadata.hooks.custom]``).
"""

from __future__ import annotations

import re
import runpy
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

if TYPE_CHECKING:
    from collections.abc import Mapping

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"(?P<image>!?)\[(?P<text>[^\[\]]*)\]\((?P<target>[^()\s]+)\)")
REMARK = re.compile(rf"\s*\({LINK.pattern}\)")
BLOCKS = re.compile(r"(^```.*?^```$)", re.MULTILINE | re.DOTALL)


def addresses(root: Path = ROOT) -> dict[str, str]:
    """The table of src/pidcfg/about.py; pidcfg itself need not be importable for it."""
    table = runpy.run_path(str(root / "src/pidcfg/about.py"))
    return {name: value for name, value in table.items() if name.isupper() and name != "VERSION"}


def urls(table: Mapping[str, str]) -> dict[str, str]:
    """The links beside the project's name, of the addresses that there are."""
    repository = table["REPOSITORY"].rstrip("/")
    found = {"Documentation": table["SITE"], "Repository": repository}
    if repository:
        found |= {"Changelog": f"{repository}/blob/main/CHANGELOG.md", "Issues": f"{repository}/issues"}
    return {name: address for name, address in found.items() if address}


def readme(text: str, version: str, table: Mapping[str, str]) -> str:
    """README.md with links that lead somewhere wherever it is shown.

    A page of docs/ is on the documentation site, any other file in the repository at the version's tag. Without their
    address a link is the text that it has; a picture, a remark in brackets and a paragraph that are nothing but links
    are left out.
    """

    def there(target: str, *, image: bool) -> str:
        if re.match(r"[a-z]+:|#", target):
            return target
        page = re.fullmatch(r"docs/([\w-]+)\.md(#.*)?", target)
        if page and table["SITE"]:
            return f"{table['SITE']}{page[1]}.html{page[2] or ''}"
        kind = "raw" if image else "blob"
        return f"{table['REPOSITORY'].rstrip('/')}/{kind}/v{version}/{target}" if table["REPOSITORY"] else ""

    def written(link: re.Match[str]) -> str:
        address = there(link["target"], image=bool(link["image"]))
        if address:
            return f"{link['image']}[{link['text']}]({address})"
        return "" if link["image"] else link["text"]

    def remark(brackets: re.Match[str]) -> str:
        return brackets[0] if there(brackets["target"], image=False) else ""

    def alone(paragraph: str) -> str:
        found = LINK.sub(written, REMARK.sub(remark, paragraph))
        return found if LINK.search(found) or re.search(r"\w", LINK.sub("", paragraph)) else ""

    parts = BLOCKS.split(text)  # every second one is a block of code
    parts[::2] = ["\n\n".join(filter(None, map(alone, part.split("\n\n")))) for part in parts[::2]]
    return "\n\n".join(filter(None, (part.strip("\n") for part in parts))) + "\n"


class Hook(MetadataHookInterface):
    """Puts the addresses and README.md into the metadata."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Called by hatchling; an sdist has both already."""
        root, table = Path(self.root), addresses(Path(self.root))
        text = readme((root / "README.md").read_text("utf-8"), metadata["version"], table)
        metadata.setdefault("readme", {"content-type": "text/markdown", "text": text})
        metadata.setdefault("urls", urls(table))
