"""What a reading tells about itself: contents that nobody has meant."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.parameters import Entry
from pidcfg.encoders.spaces import SINGLE
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.encoders.image import Image
    from pidcfg.encoders.parameters import Program

D880 = Decision(
    880,
    "numbers next to 0 are told as registers in the other order",
    "Where more of a PLC's single-precision numbers lie between 0 and 1e-30 than beyond, `pull` and `compare` say that "
    "the two registers of a number seem to stand in the other order. The contents are taken as they are.",
    "140.0 in the other order is 2.4e-41. No quantity of a loop is as small; a gateway that exchanges words is the "
    "usual cause, and each number for itself looks like a difference.",
)
NOTHING = 1e-30
FEW = 3


def doubts(image: Image | Program) -> Iterator[str]:
    """Remarks on what was read."""
    numbers = dict(_singles(image))
    odd = [f"{name} {value:.3g}" for name, value in numbers.items() if abs(value) < NOTHING]
    if len(odd) > len(numbers) / 2 and len(odd) > 1:
        more = f" and {len(odd) - FEW} more" if len(odd) > FEW else ""
        yield (
            f"{', '.join(odd[:FEW])}{more} are next to 0: the two registers of a number seem to stand in the other "
            "order; look at the set-up of the gateway, or state the order by --map"
        )


def _singles(image: Image | Program) -> Iterator[tuple[str, float]]:
    """The numbers in single precision that are not 0."""
    for cell in image.cells:
        if isinstance(cell, Entry):
            if isinstance(cell.raw, float) and cell.raw and not cell.type.double:
                yield cell.address, cell.raw
        elif cell.kind is SINGLE and cell.value:
            yield cell.address, cell.value
