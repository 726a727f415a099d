"""One side of a comparison: a configuration as its PLC holds it, in the neutral form and in the vendor's own fields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.ledger import ConvertError
from pidcfg.conversion.pipeline import generic_file
from pidcfg.differences.parameters import parameters_of
from pidcfg.differences.vendor_fields import vendor_fields

if TYPE_CHECKING:
    from pidcfg.conversion.ledger import NeutralLoop
    from pidcfg.differences.parameters import Parameters
    from pidcfg.schemas.generic import Loop
    from pidcfg.vendors import Vendor


@dataclass(frozen=True, slots=True)
class Side:
    """One configuration: its vendor and its loops, in their order."""

    vendor: Vendor
    names: tuple[str, ...]
    loops: tuple[Loop | None, ...]
    """In the neutral form; None: a loop of named parameters may have none."""
    fields: tuple[dict[str, Any], ...]
    """What the neutral form does not say of each loop."""
    parameters: Parameters | None = None
    """Of a vendor that names them."""


def side_of(config: Any, vendor: Vendor) -> Side:
    """A configuration as its PLC holds it; raises `ConvertError` where it does not say what its values mean."""
    image = vendor.encoder(config).image
    held: Any = vendor.model.model_validate(vendor.load("decode")(image.words, image.settings, image.plc).data)
    neutral: list[NeutralLoop] = vendor.load("to_neutral")(held)
    missing = [entry for loop in neutral for entry in loop.missing]
    whole = [loop for loop in neutral if not loop.missing]
    names = tuple(loop.name for loop in held.loops)
    parameters = parameters_of(image, names, neutral)
    if missing and parameters is None:
        raise ConvertError(missing)
    models = iter(generic_file(held, whole).loops if whole else ())
    loops = tuple(None if loop.missing else next(models) for loop in neutral)
    fields: list[dict[str, Any]] = [{row.path: row.value for row in loop.fields if not row.to} for loop in neutral]
    if parameters is None:
        fields = [rows | vendor_fields(held, i, neutral[i]) for i, rows in enumerate(fields)]
    return Side(vendor, names, loops, tuple(fields), parameters)
