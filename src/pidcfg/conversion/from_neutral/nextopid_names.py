"""Names of the neutral loops as IEC identifiers, none like another but for capital letters."""

from __future__ import annotations

import re
import unicodedata

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.schemas.iec import IDENTIFIER_LENGTH, KEYWORDS
from pidcfg.schemas.nextopid import Plc

STANDARD = "EXP LIMIT LN LOG MUX SEL SIN COS TAN TRUNC MOVE"
"""Functions whose names a program can give away, but should not."""
TAKEN = {name.casefold() for name in (*BLOCK_TYPES, *KEYWORDS, *STANDARD.split(), Plc.model_fields["program"].default)}
"""What no instance may be called."""
STRUCTURES = re.compile(r"autotune_(p|pi|pid|param|result|mode)|(pida|on_off)_(error|warning)_bits")
"""Types of the library that are no blocks, in small letters."""
OTHER = re.compile(r"[^A-Za-z0-9]+")


class Names:
    """The names of a program, given one after the other."""

    def __init__(self) -> None:
        self.taken = set(TAKEN)

    def new(self, wanted: str, ending: str = "") -> str:
        """A name that is still free, as near to the wanted one as can be."""
        plain = unicodedata.normalize("NFKD", wanted).encode("ascii", "ignore").decode()
        stem = OTHER.sub("_", plain).strip("_") or "Loop"
        stem = stem if stem[0].isalpha() else f"L_{stem}"
        name, count = _joined(stem, ending), 1
        while name.casefold() in self.taken or STRUCTURES.fullmatch(name.casefold()):
            count += 1
            name = _joined(stem, f"_{count}{ending}")
        self.taken.add(name.casefold())
        return name


def _joined(stem: str, ending: str) -> str:
    return stem[: IDENTIFIER_LENGTH - len(ending)].rstrip("_") + ending
