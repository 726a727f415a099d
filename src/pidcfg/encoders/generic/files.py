"""The files that neutral parameters are written to and read from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.parameter_files import parameter_listings

if TYPE_CHECKING:
    from pidcfg.schemas.generic import GenericFile

FORMATS = parameter_listings("parameter listing")


def checklist(config: GenericFile) -> tuple[str, ...]:
    """What no file does by itself: a neutral form goes to no PLC."""
    if not config.loops:
        return ()
    action = "; ".join(
        f"{loop.name} the PV {'rises' if loop.output_raises_pv else 'falls'} when the output rises"
        for loop in config.loops
    )
    return (
        "this is the neutral form: convert it to a vendor's own before a download",
        f"direction of control: {action}",
    )
