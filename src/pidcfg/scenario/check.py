"""The findings of a file, whether it is a configuration or a scenario."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
    return list(check_document(doc, limits).findings)
