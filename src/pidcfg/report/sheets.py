"""A checked configuration as loop sheets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast, get_args

from pidcfg.differences.vendor_fields import PLACES
from pidcfg.encoders.named import ParameterTable, Program
from pidcfg.report.content import LoopSheet, PlcSheet
from pidcfg.report.facts import facts, held_setpoint
from pidcfg.report.roots import settings_before_root, told
from pidcfg.report.settings import NOWHERE, groups_of, sides, table_units, texts_of
from pidcfg.report.texts import text
from pidcfg.report.words import Sense, blocks_of, parameters_of, places_of
from pidcfg.schemas.document import models_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.validate.engine import Checked
    from pidcfg.vendors import Vendor

OWN = ("loop", "block", "description", "name")
"""Of what no register holds: keys that a report prints elsewhere."""
DEVICES = "devices."


def plc_sheet(checked: Checked, number: int, findings: Sequence[Diagnostic]) -> PlcSheet:
    """The sheet of one configuration; without a model, its name and findings are all there is."""
    config, vendor, doc, encoding = checked.config, checked.vendor, checked.document, checked.encoding
    anchor = f"plc-{number}"
    if config is None or vendor is None or encoding is None or not has_image(encoding):
        return PlcSheet(doc.file, anchor, "", "", vendor.title if vendor else "", (), (), (), (), (), ())
    image: Any = encoding.image
    named = isinstance(image, Program)
    loops = neutral(checked)
    kinds = {entry["block"]: entry.get("type", "") for entry in image.settings if "block" in entry}
    return PlcSheet(
        file=doc.file,
        anchor=anchor,
        name=config.name or "",
        description=config.description or "",
        vendor=vendor.title,
        groups=groups_of(config, vendor, doc.data, {}),
        blocks=() if named else blocks_of(encoding, None, {}, {}, {}),
        parameters=parameters_of(image, None, lambda name: sense_of(vendor, kinds.get(name))) if named else (),
        outside=tuple(flat({key: value for key, value in image.plc.items() if key not in OWN})),
        checklist=vendor.load("checklist")(config),
        loops=tuple(
            _loop_sheet(checked, i, f"{anchor}-loop-{i + 1}", findings, loops[i]) for i in range(len(config.loops))
        ),
    )


def writers_of(vendor: Vendor) -> Mapping[str, str]:
    """Who writes a register that is not the PLC's alone, by its name."""
    writers: Mapping[str, str] = vendor.load("explainer").writers
    return writers


def has_image(encoding: Any) -> bool:
    """Whether every word has an address; one outside of the PLC's memory has none."""
    try:
        return encoding.image is not None
    except IndexError:
        return False


def _loop_sheet(
    checked: Checked, i: int, anchor: str, findings: Sequence[Diagnostic], neutral_loop: Mapping[str, Any]
) -> LoopSheet:
    vendor, encoding, loop = checked.vendor, checked.encoding, checked.config.loops[i]
    if vendor is None or encoding is None:
        raise ValueError(f"{checked.document.file} has no image")
    image, data = cast("Any", encoding.image), (checked.document.data or {}).get("loops")
    own: Mapping[str, Any] = next((entry for entry in image.settings if entry.get("loop") == loop.name), {})
    outside = {key: value for key, value in own.items() if key not in OWN}
    named = isinstance(image, Program)
    places = _places(encoding, i, loop.name)
    if not named:
        places = {key: NOWHERE for key, _ in flat(outside) if key not in PLACES} | places
    groups = groups_of(loop, vendor, data[i] if isinstance(data, list) and i < len(data) else None, places)
    settled = {setting.path: setting.unit for group in groups for setting in group.settings}
    units = table_units(vendor, sides(loop)) | {path: unit for path, unit in settled.items() if unit}
    pv_unit = sides(loop)["pv"]
    held = {} if named else held_setpoint(encoding, i, pv_unit)
    rooted = {} if named else settings_before_root(encoding, i)
    sense = sense_of(vendor, getattr(loop, "type", None), units)
    return LoopSheet(
        name=loop.name,
        description=loop.description or "",
        anchor=anchor,
        facts=tuple(facts(vendor, loop, neutral_loop, groups, held)),
        groups=told(groups, rooted, pv_unit),
        blocks=() if named else blocks_of(encoding, i, sides(loop), settled, writers_of(vendor)),
        parameters=parameters_of(image, loop.name, lambda _: sense) if named else (),
        outside=tuple((key, value) for key, value in flat(outside) if not key.startswith((DEVICES, *PLACES))),
        findings=tuple(d for d in findings if loop.name in {d.loop, *d.also} and d.file == checked.document.file),
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
    return [found.loop for found in checked.vendor.load("to_neutral")(checked.config)]


def sense_of(vendor: Vendor, kind: str | None, units: Mapping[str, str] | None = None) -> Sense:
    """What the parameters of a type of block mean: by its table, else by its schema (None: the vendor has one type)."""
    tables = [table for table in vendor.load("registers") if isinstance(table, ParameterTable)]
    own = [table for table in tables if table.title == kind or (kind is None and len(tables) == 1)]
    found = {row.name: row.title for table in own for row in table.rows if row.title}
    for model in models_of(vendor.model):
        if kind in get_args(getattr(model.model_fields.get("type"), "annotation", None)):
            for part in models_of(model):
                found = {**texts_of(part), **found}
    tabled = {row.name: row.unit for table in own for row in table.rows}
    return Sense(found, tabled if units is None else units)


def flat(data: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Nested settings as one row each."""
    for key, value in data.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{key}.")
        else:
            shown = " to ".join(map(text, value)) if isinstance(value, list | tuple) else text(value)
            yield f"{prefix}{key}", shown or "none"
