"""Names of the neutral loops as IEC identifiers, none like another but for capital letters."""

from __future__ import annotations

import re
import unicodedata

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES, PIDA_OUTPUTS, TUNE_OUTPUTS
from pidcfg.schemas.iec import FUNCTIONS, IDENTIFIER_LENGTH, KEYWORDS
from pidcfg.schemas.nextopid import Plc

STRUCTURES = {key.partition(".")[0] for key, _, _ in (*PIDA_OUTPUTS, *TUNE_OUTPUTS) if "." in key}
"""Members of a block whose types have names like theirs."""
TAKEN = {
    name.casefold() for name in (*BLOCK_TYPES, *STRUCTURES, *KEYWORDS, *FUNCTIONS, Plc.model_fields["program"].default)
}
"""What no instance may be called."""
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
        while name.casefold() in self.taken:
            count += 1
            name = _joined(stem, f"_{count}{ending}")
        self.taken.add(name.casefold())
        return name


def _joined(stem: str, ending: str) -> str:
    return stem[: IDENTIFIER_LENGTH - len(ending)].rstrip("_") + ending
