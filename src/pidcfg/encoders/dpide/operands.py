"""The operand table: a row an operand with device, value and unit, for people who enter a DPIDE instruction.

It is read back, also when a person wrote it: a row's value may be empty, the loop may stand in a column of its own, and
devices are taken from their column.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.control_characters import printable
from pidcfg.encoders.listing import Listing, ListingError, comments, csv_text, load_json
from pidcfg.encoders.maps.dpide import DPIDE_TABLE, LOOPS, OUTSIDE, ROWS
from pidcfg.encoders.parameter_files import RISKY, content_of, read_csv, read_json
from pidcfg.encoders.parameters import shown
from pidcfg.encoders.tables import table_rows
from pidcfg.schemas.base import parse_name
from pidcfg.schemas.dpide_devices import parse_flag_device, parse_register
from pidcfg.schemas.iec import BOOL

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.parameters import Entry, Parameter, Program

COLUMNS = ("operand", "type", "device", "value", "unit", "description", "loop")
SAME_TYPE = {"DINT": "DWORD"}
"""Types that the manual names as well."""


def write_operands(image: Program, checklist: tuple[str, ...] = ()) -> str:
    """All operands of every loop, also those without a value, with the checklist above them."""
    rows: list[tuple[str, ...]] = []
    for settings in image.settings:
        entries = {cell.field: cell for cell in image.cells if cell.loop == settings["loop"]}
        rows += (_row(row, entries, settings) for row in DPIDE_TABLE.rows)
    return csv_text(COLUMNS, rows, comments(image, checklist))


def _row(row: Parameter, entries: Mapping[str, Entry], settings: Mapping[str, Any]) -> tuple[str, ...]:
    entry = entries.get(row.name)
    value = "" if entry is None or row.name == "I_MV" else shown(row.type, entry.raw)  # type: ignore[arg-type]
    device = device_of(settings, row.name) or ""
    unit = unit_of(row, settings, dependent=bool(entries["PID_EQ"].raw))
    return row.name, row.type.name, device, value, unit, row.title, settings["loop"]


def device_of(settings: Mapping[str, Any], operand: str) -> str | None:
    """The device of an operand, as the settings have it."""
    device = settings.get("device") if operand == "I_MV" else (settings.get("devices") or {}).get(operand)
    return None if device is None else str(device)


def unit_of(row: Parameter, settings: Mapping[str, Any], *, dependent: bool) -> str:
    """The unit of an operand: the PV's, the output's, or that of a time or an integral gain."""
    if row.name == "Ti_Ki":
        return "s" if dependent else "1/s"
    unit = settings.get(row.unit, {}).get("unit") or "" if row.unit in {"pv", "output"} else row.unit
    text = printable(" ".join(str(unit).split()))
    return f"({text})" if text.startswith(RISKY) else text


def read_operands(text: str) -> Listing:
    """Rows by their header; the loop may be missing where the operand's name has it (``OVEN.SV``)."""
    listing = Listing()
    devices: dict[str, dict[str, str]] = {}
    for number, row in table_rows(text, listing, required=("operand", "value")):
        loop, operand = _named(row)
        kind = ROWS.get(operand)
        if kind is None or not _is_name(loop):
            raise ListingError(
                f"{row['operand'][:60]!r} is not an operand of a loop; the table has columns operand and loop", number
            )
        if row.get("type") and row["type"] not in {kind.type.name, SAME_TYPE.get(kind.type.name)}:
            raise ListingError(f"{loop}.{operand} is {kind.type.name}, not {row['type'][:20]!r}", number)
        if row["value"]:
            name = f"{loop}.{operand}"
            listing.add(name, content_of(row["value"], kind.type, name, number), name, number)
        elif operand not in OUTSIDE:
            raise ListingError(f"{loop}.{operand} has no value", number)
        _take_device(devices.setdefault(loop, {}), operand, row.get("device", ""), number)
    _take_devices(listing, devices)
    return listing


def _named(row: Mapping[str, str]) -> tuple[str, str]:
    """Loop and operand; a loop in its own column may stand before the operand as well."""
    loop = row.get("loop", "")
    return (loop, row["operand"].removeprefix(f"{loop}.")) if loop else LOOPS.split(row["operand"])


def _is_name(loop: str) -> bool:
    try:
        return parse_name(loop) == loop
    except ValueError:
        return False


def _take_device(devices: dict[str, str], operand: str, device: str, line: int) -> None:
    if not device:
        return
    try:
        (parse_flag_device if ROWS[operand].type is BOOL else parse_register)(device)
    except ValueError as error:
        raise ListingError(f"{operand}: {error}", line) from None
    devices[operand] = device


def _take_devices(listing: Listing, devices: Mapping[str, Mapping[str, str]]) -> None:
    """Devices of the rows into the settings; where both say one, they must agree."""
    settings: list[dict[str, Any]] = [dict(entry) for entry in listing.settings or ({"loop": loop} for loop in devices)]
    for entry in settings:
        if not isinstance(entry.get("devices", {}), dict):
            continue
        for operand, device in devices.get(str(entry.get("loop")), {}).items():
            setting = device_of(entry, operand)
            if setting not in {None, device}:
                raise ListingError(f"{entry['loop']}.{operand} stands at {device}, but the settings say {setting}")
            if operand == "I_MV":
                entry["device"] = device
            else:
                entry["devices"] = {**entry.get("devices", {}), operand: device}
    listing.settings = tuple(settings)


def read_csv_devices(text: str) -> Listing:
    """The plain CSV listing, with the devices of its column."""
    listing = read_csv(text)
    _take_column(
        listing, ((row["name"], row.get("device", ""), n) for n, row in table_rows(text, Listing(), ("name",)))
    )
    return listing


def read_json_devices(text: str) -> Listing:
    """The JSON listing, with the devices of its entries."""
    listing = read_json(text)
    entries = load_json(text)["words"]
    _take_column(listing, ((entry["address"], entry.get("device") or "", 1) for entry in entries))
    return listing


def _take_column(listing: Listing, rows: Iterator[tuple[str, object, int]]) -> None:
    devices: dict[str, dict[str, str]] = {}
    for name, device, line in rows:
        loop, operand = LOOPS.split(name)
        if loop:
            if not isinstance(device, str):
                raise ListingError(f"{name}: the device is not a text", line)
            _take_device(devices.setdefault(loop, {}), operand, device, line)
    _take_devices(listing, devices)
