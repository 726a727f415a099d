"""The files that an EZLogix image is written to and read from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.ezlogix.tags import merge_tags, read_tags, write_tags
from pidcfg.encoders.files import FileKind, listings
from pidcfg.encoders.map_template import map_kind, space_rows
from pidcfg.encoders.maps.ezlogix import MAP_SPACE, SPACE
from pidcfg.encoders.tables import columns

if TYPE_CHECKING:
    from pidcfg.schemas.ezlogix import EzlogixFile

FORMATS = listings(SPACE, "register listing") | {
    "tags": FileKind(
        "tags",
        "tag list (CSV)",
        write_tags,
        read_tags,
        lambda text: {"tag", "address"} <= set(columns(text)),
        merge=merge_tags,
        whole=False,
    ),
    "modbus-map": map_kind(lambda _image: space_rows(SPACE, MAP_SPACE)),
}


def checklist(config: EzlogixFile) -> tuple[str, ...]:
    """What stands in the PID dialog only, to be entered by hand."""
    loops = [f"{loop.name}: {loop.algorithm}, {loop.action}, {loop.pv.tag}, {loop.output.tag}" for loop in config.loops]
    items = [
        "set in the PID dialog, since no register holds them: algorithm, controller action, PV and CV tag of "
        + "; ".join(loops)
    ]
    pulsed = [f"{loop.name} ({loop.output.pulse.tag})" for loop in config.loops if loop.output.pulse is not None]
    if pulsed:
        items.append(f"enable the control output in the PID dialog: {', '.join(pulsed)}")
    stopped = "check" if config.plc.process_when_stopped else "clear"
    items.append(f"{stopped} 'Process PID when PLC is Stopped' in the PID dialog")
    return tuple(items)
