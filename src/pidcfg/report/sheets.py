"""A checked configuration as loop sheets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from pidcfg.diagnostics import ordered
from pidcfg.differences.risk import PLACES
from pidcfg.encoders.parameters import Program
from pidcfg.encoders.spaces import NoRegisterError
from pidcfg.report.content import LoopSheet, PlcSheet
from pidcfg.report.facts import facts, stored_setpoint
from pidcfg.report.roots import settings_before_root, with_shares
from pidcfg.report.settings import NOWHERE, groups_of, sides, table_units
from pidcfg.report.texts import text
from pidcfg.report.words import Words, parameters_of, places_of, with_words

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.validate.engine import Checked
    from pidcfg.vendors import Vendor

ELSEWHERE = ("loop", "block", "description", "name")
"""Of what no register holds: keys that a report prints elsewhere."""
DEVICES = "devices."


def plc_sheet(checked: Checked) -> PlcSheet:
    """The sheet of one configuration, without anchors; without a model, its name is all there is."""
    config, vendor, doc, encoding = checked.config, checked.vendor, checked.document, checked.encoding
    if config is None or vendor is None or encoding is None or not has_image(encoding):
        return PlcSheet(file=doc.file, name="", description="", vendor=vendor.title if vendor else "")
    image: Any = encoding.image
    named = isinstance(image, Program)
    loops, findings = neutral(checked), gravest_first(checked.findings)
    return PlcSheet(
        file=doc.file,
        name=config.name or "",
        description=config.description or "",
        vendor=vendor.title,
        groups=groups_of(config, vendor, doc.data, {}),
        blocks=() if named else Words(encoding).blocks(None),
        parameters=parameters_of(image, None, book_of(vendor)) if named else (),
        outside=tuple(flat({key: value for key, value in image.plc.items() if key not in ELSEWHERE})),
        checklist=checked.checklist,
        loops=tuple(_loop_sheet(checked, i, findings, loops[i]) for i in range(len(config.loops))),
    )


def gravest_first(findings: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Findings as a report lists them."""
    return sorted(ordered(list(findings)), key=lambda d: -d.severity)


def book_of(vendor: Vendor) -> Any:
    """What is known of the vendor's registers or parameters."""
    return vendor.load("explainer")


def has_image(encoding: Any) -> bool:
    """Whether every word has an address; one outside of the PLC's memory has none."""
    try:
        return encoding.image is not None
    except NoRegisterError:
        return False


def _loop_sheet(checked: Checked, i: int, findings: Sequence[Diagnostic], neutral_loop: Mapping[str, Any]) -> LoopSheet:
    vendor, encoding, loop = checked.vendor, checked.encoding, checked.config.loops[i]
    if vendor is None or encoding is None:
        raise ValueError(f"{checked.document.file} has no image")
    image, data = cast("Any", encoding.image), (checked.document.data or {}).get("loops")
    settings: Mapping[str, Any] = next((entry for entry in image.settings if entry.get("loop") == loop.name), {})
    outside = {key: value for key, value in settings.items() if key not in ELSEWHERE}
    named = isinstance(image, Program)
    places = _places(encoding, i, loop.name)
    if not named:
        places = {key: NOWHERE for key, _ in flat(outside) if key not in PLACES} | places
    groups = groups_of(loop, vendor, data[i] if isinstance(data, list) and i < len(data) else None, places)
    setting_units = {setting.path: setting.unit for group in groups for setting in group.settings}
    units = table_units(vendor, sides(loop)) | {path: unit for path, unit in setting_units.items() if unit}
    pv_unit = sides(loop)["pv"]
    stored = {} if named else stored_setpoint(encoding, i, pv_unit)
    shares = {} if named else settings_before_root(encoding, i)
    blocks = () if named else Words(encoding, sides(loop), setting_units, book_of(vendor).writers).blocks(i)
    return LoopSheet(
        name=loop.name,
        description=loop.description or "",
        facts=tuple(with_words(facts(vendor, loop, neutral_loop, groups, stored), blocks)),
        groups=with_shares(groups, shares, pv_unit),
        blocks=blocks,
        parameters=parameters_of(image, loop.name, book_of(vendor), units) if named else (),
        outside=tuple((key, value) for key, value in flat(outside) if not key.startswith((DEVICES, *PLACES))),
        findings=tuple(d for d in findings if loop.name == d.loop),
    )


def _places(encoding: Any, number: int, loop: str) -> dict[str, str]:
    """Where the PLC holds each setting of a loop: its registers, or the device of its parameter."""
    if isinstance(encoding.image, Program):
        return {entry.field: entry.device for entry in encoding.image.cells if entry.loop == loop and entry.device}
    return places_of(encoding, number)


def neutral(checked: Checked) -> list[Mapping[str, Any]]:
    """The loops in the neutral form, as far as the configuration says it; empty where it has errors."""
    if checked.failed or checked.vendor is None:
        return [{}] * len(checked.config.loops)
    return [loop.data for loop in checked.vendor.load("to_neutral")(checked.config)]


def flat(data: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Nested settings as one row each."""
    for key, value in data.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{key}.")
        else:
            shown = " to ".join(map(text, value)) if isinstance(value, list | tuple) else text(value)
            yield f"{prefix}{key}", shown or "none"
