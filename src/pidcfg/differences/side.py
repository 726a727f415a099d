"""One side of a comparison in the neutral form: a configuration as its PLC holds it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.ledger import ConvertError
from pidcfg.conversion.pipeline import generic_file
from pidcfg.encoders.parameters import Program

if TYPE_CHECKING:
    from pidcfg.conversion.ledger import NeutralLoop
    from pidcfg.schemas.generic import Loop
    from pidcfg.vendors import Vendor


@dataclass(frozen=True, slots=True)
class Side:
    """One configuration: its vendor and its loops, in their order."""

    vendor: Vendor
    names: tuple[str, ...]
    loops: tuple[Loop | None, ...]
    """In the neutral form; None: it has none."""


def side_of(config: Any, vendor: Vendor, *, partial: bool = False) -> Side:
    """A configuration as its PLC holds it.

    Raises `ConvertError` where it does not say what its values mean, unless it may be ``partial``: loops without a
    neutral form are then none. A vendor that names its parameters may have such loops in any case.
    """
    image = vendor.encoder(config).image
    held: Any = vendor.model.model_validate(vendor.load("decode")(image.words, image.settings, image.plc).data)
    neutral: list[NeutralLoop] = vendor.load("to_neutral")(held)
    missing = [entry for loop in neutral for entry in loop.missing]
    if missing and not partial and not isinstance(image, Program):
        raise ConvertError(missing)
    whole = [loop for loop in neutral if not loop.missing]
    models = iter(generic_file(held, whole).loops if whole else ())
    loops = tuple(None if loop.missing else next(models) for loop in neutral)
    return Side(vendor, tuple(loop.name for loop in held.loops), loops)
