"""A file whose keys are those of another vendor than the one that it names."""

from __future__ import annotations

from difflib import get_close_matches
from typing import TYPE_CHECKING

from pydantic import ValidationError

from pidcfg.diagnostics import Diagnostic, Severity
from pidcfg.odd_signs import plain
from pidcfg.vendors import VENDORS, Vendor

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.source import Document

OF_KEYS = frozenset(("PID020", "PID021"))
"""Findings of keys that are unknown or missing."""
FEWEST = 3
"""So many of them before the vendor itself is doubted."""


MADE = (
    ("directlogic", "dl06"),
    ("koyo", "dl06"),
    ("d0-06", "dl06"),
    ("dl0", "dl06"),
    ("click", "click"),
    ("c0-", "click"),
    ("c2-", "click"),
    ("ez", "ezlogix"),
    ("altus", "nextopid"),
    ("nexto", "nextopid"),
    ("codesys", "nextopid"),
    ("delta", "dpide"),
    ("isp", "dpide"),
    ("as2", "dpide"),
    ("as3", "dpide"),
    ("neutral", "generic"),
)
"""How names begin that people give to a family: its maker, its program, its parts."""


def vendor_meant(name: str) -> str | None:
    """The family that a name seems to mean; None where nothing tells."""
    word = plain(name).casefold().replace(" ", "").replace("_", "-")
    near = next(iter(get_close_matches(word.replace("-", ""), VENDORS, 1, 0.7)), None)
    return near or next((vendor for begins, vendor in MADE if word.startswith(begins)), None)


def of_another_vendor(vendor: Vendor, doc: Document, errors: Sequence[Diagnostic]) -> list[Diagnostic]:
    """The finding that names the vendor whose keys these are; none where the keys fit no other one better."""
    if sum(d.code in OF_KEYS for d in errors) < FEWEST:
        return []
    others = [other.key for other in VENDORS.values() if other.key != vendor.key and _has_keys_of(other, doc)]
    if len(others) != 1:
        return []
    message = f"this looks like {others[0]}: its keys are those of the file, and those of {vendor.key} are not"
    cure = f"write vendor: {others[0]}, or convert the file with 'pidcfg convert'"
    path = ("vendor",)
    return [Diagnostic("PID031", Severity.ERROR, message, doc.file, doc.locate(path), path, help=cure)]


def _has_keys_of(vendor: Vendor, doc: Document) -> bool:
    """Whether a vendor knows every key of a file, and misses none."""
    try:
        vendor.model.model_validate({**(doc.data or {}), "vendor": vendor.key})
    except ValidationError as error:
        return not {e["type"] for e in error.errors(include_url=False)} & {"extra_forbidden", "missing"}
    return True
