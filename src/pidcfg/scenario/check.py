"""The findings of a file, whether it is a configuration or a scenario."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.diagnostics import ordered
from pidcfg.reader import DISK, Reader
from pidcfg.validate.engine import check_document, is_scenario

if TYPE_CHECKING:
    from pidcfg.diagnostics import Diagnostic
    from pidcfg.document import Document
    from pidcfg.limits import Limits


def check_any(doc: Document, limits: Limits, reader: Reader = DISK) -> list[Diagnostic]:
    """The findings of a configuration, or of a scenario and what it names."""
    if is_scenario(doc):
        from pidcfg.scenario.load import check_scenario
        from pidcfg.validate.curly import curly_quotes

        return [*check_scenario(doc, limits, reader), *curly_quotes(doc)]
    checked = check_document(doc, limits)
    if checked.vendor is None or checked.encoding is None or not checked.encoding.whole or not has_map(doc):
        return list(checked.findings)
    from pidcfg.map_files import check_map

    wrong = check_map(doc, checked.vendor, checked.encoding.image, reader, limits)
    return ordered([*checked.findings, *wrong])


def has_map(doc: Document) -> bool:
    """Whether a configuration names a Modbus map."""
    plc = (doc.data or {}).get("plc")
    return isinstance(plc, dict) and "map" in plc
