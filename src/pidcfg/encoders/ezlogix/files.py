"""The files that an EZLogix image is written to and read from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.ezlogix.tags import merge_tags, read_tags, write_tags
from pidcfg.encoders.files import DecodeOption, FileKind, columns, listings
from pidcfg.encoders.maps.ezlogix import SPACE
from pidcfg.encoders.settings import address_of, listed, one_of
from pidcfg.schemas.ezlogix import DISCRETES, REGISTERS, parse_tag

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
}


def _output(text: str) -> dict[str, str] | None:
    return None if text == "none" else {"tag": parse_tag("O")(text)}


DECODE_OPTIONS = (
    DecodeOption(
        "registers",
        "R,R…",
        "Where each loop's registers begin.",
        "R100,R132",
        listed(address_of(REGISTERS)),
        needed=True,
    ),
    DecodeOption(
        "discretes",
        "S,S…",
        "Where each loop's discretes begin.",
        "S100,S108",
        listed(address_of(DISCRETES)),
        needed=True,
    ),
    DecodeOption(
        "action",
        "direct|reverse,…",
        "Each loop's controller action; reverse is heating.",
        "reverse",
        listed(one_of("direct", "reverse")),
        needed=True,
    ),
    DecodeOption(
        "algorithm",
        "position|velocity,…",
        "Each loop's algorithm.",
        "position",
        listed(one_of("position", "velocity")),
        needed=True,
    ),
    DecodeOption(
        "pv_tag", "IR|R,…", "The tag of each loop's PV.", "IR1,IR2", listed(parse_tag("IR", "R")), needed=True
    ),
    DecodeOption(
        "cv_tag", "OR|R,…", "The tag of each loop's CV.", "OR1,OR2", listed(parse_tag("OR", "R")), needed=True
    ),
    DecodeOption(
        "output_tag",
        "O|none,…",
        "The tag of each loop's control output; none: not enabled.",
        "O1,none",
        listed(_output),
    ),
)


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
