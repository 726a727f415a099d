"""What a reading tells about itself: contents that nobody has meant."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.spaces import SINGLE
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.encoders.image import Image

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


def doubts(image: Image) -> Iterator[str]:
    """Remarks on what was read."""
    numbers = [cell for cell in image.cells if cell.kind is SINGLE and cell.value]
    odd = [cell for cell in numbers if abs(cell.value) < NOTHING]
    if len(odd) > len(numbers) / 2 and len(odd) > 1:
        named = ", ".join(f"{cell.address} {cell.value:.3g}" for cell in odd[:FEW])
        more = f" and {len(odd) - FEW} more" if len(odd) > FEW else ""
        yield (
            f"{named}{more} are next to 0: the two registers of a number seem to stand in the other order; look at the "
            "set-up of the gateway, or state a map with high-first by --map"
        )
