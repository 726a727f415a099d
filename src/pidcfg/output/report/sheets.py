"""A checked configuration as loop sheets: facts first, settings, words with their addresses."""

from __future__ import annotations

import re
from dataclasses import field, replace
from decimal import Decimal
from itertools import groupby
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.differences import PLACE_KEYS
from pidcfg.conversion.operation import source_of
from pidcfg.conversion.terms import Leaf, leaves, unit_of
from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.contract import tables_of, units_by_path
from pidcfg.encoders.parameters import Program
from pidcfg.encoders.parameters import content_text as shown_content
from pidcfg.encoders.regmap import Bits, NoRegisterError
from pidcfg.output import report
from pidcfg.output.explanation.lookup import PV_RISES
from pidcfg.output.explanation.page import texts_of
from pidcfg.output.report import (
    UNITS_OF_SIDES,
    Content,
    Fact,
    Group,
    LoopSheet,
    PlcSheet,
    Setting,
    add_shares,
    cell_text,
    cell_value,
    loop_words,
    number_text,
    signal_share_of,
    signal_shares,
)
from pidcfg.schemas.base import Quantity, Rate, unit_text, units_of
from pidcfg.schemas.iec import Wire
from pidcfg.text.diagnostics import path_text, sort_findings
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import parse_path, value_at
from pidcfg.text.signs import to_one_line

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from pydantic import BaseModel

    from pidcfg.encoders.image import Block, Cell, Encoding
    from pidcfg.encoders.parameters import AnyEncoding, Entry
    from pidcfg.encoders.regmap import Point, Word
    from pidcfg.output.explanation.parameters import ParameterBook
    from pidcfg.output.report import RunSheet, SourceFile, Title
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.validate.engine import Checked
    from pidcfg.vendors import Vendor

# --- What a reader of a loop sheet looks for first --------------------------------------------------------------------

FIRST_FACTS = (
    ("Mode", "mode", "", ("mode",)),
    ("PV range", "pv.range", "pv", ("pv.range",)),
    ("Set point", "setpoint.value", "pv", ("setpoint.value", "SP", "SV")),
    ("Output range", "output.range", "output", ("output.range",)),
    ("Sample time", "sample_time", "s", ("sample_time", "sample_rate", "CYCLE")),
)
"""Each with the field of the neutral loop that says it, its unit, and the vendors' own keys, for a loop without one."""
PULSE_PERIOD_KEYS = ("output.pulse.cycle_time", "output.pulse.period", "output.pwm.period", "call.GPWM.cycle")
PULSED_KEYS = ("output.pulse.tag", "output.pwm.bit", "call.GPWM.output")
"""The period of an output's pulses, and what is pulsed, by the vendors' own keys."""
PAIR_LENGTH = 2
FORM_TEXTS = {True: "dependent: Ti and Td are times", False: "independent: Ki and Kd are gains"}
WIRED_TEXT = "the program chooses it: "


def loop_facts(
    vendor: Vendor, loop: object, neutral: Mapping[str, object], groups: Sequence[Group], contents: Mapping[str, str]
) -> Iterator[Fact]:
    """The facts of a loop; ``neutral``: its neutral form or nothing, ``contents``: what registers hold, as text."""
    units = {side: value_at(neutral, (side, "unit")) or "" for side in UNITS_OF_SIDES}
    settings = {setting.path: setting for group in groups for setting in group.settings}
    for title, path, unit, keys in FIRST_FACTS:
        value = value_at(neutral, parse_path(path))
        setting = next((settings[key] for key in keys if key in settings), None)
        place = setting.place if setting is not None else ""
        if path in contents and setting is not None and setting.unit == "counts":
            yield Fact(title, contents[path], place)
        elif isinstance(value, str | int | float | list | tuple | Decimal):
            shown = " to ".join(map(short_text, value)) if isinstance(value, list | tuple) else short_text(value)
            yield Fact(title, f"{shown} {unit_text(unit, units)}".rstrip(), place)
        elif setting is not None:
            yield Fact(title, quantity_text(setting), place)
    if direction := direction_text(vendor, loop):
        key = vendor.load("explainer").direction.key
        yield Fact("Direction", direction, settings[key].place if key in settings else "")
    yield from tuning_facts(vendor, loop, settings)
    yield from pulse_facts(neutral, settings)


def direction_text(vendor: Vendor, loop: object) -> str:
    """Where the PV goes when the output rises, by the loop's own word for its action; empty where nobody knows."""
    key, heating = vendor.load("explainer").direction.key, tables_of(vendor).TUNING_NUMBERS.heating.rpartition(" ")[2]
    value = value_at(loop, parse_path(key))
    if isinstance(value, Wire):
        return f"{WIRED_TEXT}{key} := {value.text}"
    if isinstance(value, bool | str):
        return PV_RISES[str(value).lower() == heating.lower()]
    return ""


def tuning_facts(vendor: Vendor, loop: object, settings: Mapping[str, Setting]) -> Iterator[Fact]:
    """The form of the equation, where a vendor has two, and the three terms."""
    tuning_words = tables_of(vendor).TUNING_NUMBERS
    form, dependent = getattr(tuning_words, "dependent", None), None
    value = None if form is None else value_at(loop, parse_path(form[0]))
    if form is not None and value is not None:
        dependent = value is form[1] if isinstance(value, bool) else None
        words = FORM_TEXTS[dependent] if dependent is not None else f"{WIRED_TEXT}{form[0]} := {cell_text(value)[3:]}"
        yield Fact("Form", words, settings[form[0]].place if form[0] in settings else "")
    for path in map(tuning_words.key, tuning_words.names):
        if path in settings:
            names = path.split("_") if form is not None else [path]
            name = path if dependent is None else names[0 if dependent else -1]
            yield Fact(key_label(name), quantity_text(settings[path]), settings[path].place)


def pulse_facts(neutral: Mapping[str, object], settings: Mapping[str, Setting]) -> Iterator[Fact]:
    """The pulses of an output that a relay switches: period, shortest times, and duty cycle at the output's limits."""
    key = next(
        (key for key in PULSE_PERIOD_KEYS if key in settings and not isinstance(settings[key].value, str | None)), None
    )
    if key is None:
        return
    period = settings[key]
    shortest = [(word, value_at(neutral, ("output", "pulse", f"min_{word}"))) for word in ("on", "off")]
    words = [f"{word} at least {short_text(value)} s" for word, value in shortest if value]
    bit = next((settings[one].value for one in PULSED_KEYS if one in settings), None)
    target = [f"on {cell_text(bit)}"] if bit else []
    yield Fact("Pulses", ", ".join([f"every {quantity_text(period)}", *target, *words]), period.place)
    range_ends = [*map(float, value_at(neutral, parse_path("output.range")) or ())]
    limits = [*map(float, value_at(neutral, parse_path("output.limits")) or range_ends)]
    if len(range_ends) == len(limits) == PAIR_LENGTH and range_ends[0] != range_ends[1]:
        shares = [f"{100 * (limit - range_ends[0]) / (range_ends[1] - range_ends[0]):.3g}" for limit in limits]
        yield Fact("Duty cycle", f"{' to '.join(shares)} %", "")


def stored_setpoint(encoding: Encoding, loop: int, unit: str) -> dict[str, str]:
    """The set point that the register of a loop, by its number, holds, as the shortest value that is stored so."""
    path = "setpoint.value"
    for block, word, raw in loop_words(encoding, loop):
        scale = block.scales.get(str(getattr(word.codec, "scale", "")))
        if word.path == path and scale is not None and scale.range is not None:
            try:
                value = block.table.decode_word(word, raw, block.scales)
            except DecodeError:
                return {}
            return {path: f"{cell_text(value)} {'' if value.counts else unit}".rstrip()}
    return {}


def short_text(value: object) -> str:
    """A value with at most ten digits, never with an exponent: what a sheet shows first must be what the PLC holds."""
    return number_text(float(f"{float(value):.10g}")) if isinstance(value, float | Decimal) else cell_text(value)


def quantity_text(setting: Setting) -> str:
    """A value with its unit."""
    return f"{cell_text(setting.value)} {setting.unit}".rstrip()


def key_label(path: str) -> str:
    """A key as a label: the manual's names stay, others become words."""
    last = path.removesuffix(".value").rpartition(".")[2]
    words = last.replace("_", " ")
    return words[:1].upper() + words[1:] if last.islower() else last


# --- The settings of a configuration in engineering units, from the vendor's model: key, value, unit and meaning ------

HEADING_KEYS = ("pidcfg", "vendor", "name", "description", "loops")
"""Keys that have a place of their own in a report."""
NO_REGISTER_TEXT = "no register"
GENERAL_TITLE = "General"
CHOICE_OF_UNITS = re.compile(" or |, ")
"""Stands in a unit that depends on another setting."""


def table_units(vendor: Vendor, units: Mapping[str, str]) -> dict[str, str]:
    """The units of the vendor's registers and parameters in the words of a loop, as far as they leave no choice."""
    return {
        path: unit_text(unit, units) for path, unit in units_by_path(vendor).items() if not CHOICE_OF_UNITS.search(unit)
    }


def side_units(loop: object) -> dict[str, str]:
    """The units of PV and output; words for those that the loop does not say."""
    return {**UNITS_OF_SIDES, **units_of(loop)}


def setting_of(leaf: Leaf, loop: object, vendor: Vendor, file_value: Any, place: str) -> Setting:
    """A value with everything that a reader wants to know; an address stands as the file writes it."""
    is_address_like = isinstance(leaf.value, int) and not isinstance(leaf.value, bool) and isinstance(file_value, str)
    is_address = is_address_like and not _is_number(file_value.strip("-"))
    value = str(file_value) if is_address else leaf_value(leaf)
    unit = "" if is_address else unit_of(leaf, loop, vendor, side_units(loop))
    return Setting(leaf.text, value, unit, texts_of(type(leaf.model)).get(leaf.key, ""), leaf.is_given, place)


def _is_number(text: str) -> bool:
    return text[:1].isdigit()


def leaf_value(leaf: Leaf) -> Any:
    """The value as a cell."""
    duration = getattr(leaf.value, "duration", leaf.value)
    if duration is None:
        return str(leaf.value)
    if isinstance(leaf.value, Rate):
        return leaf.value.value
    return cell_value(duration)


def place_of(path: str, places: Mapping[str, str]) -> str:
    """Where a setting is kept: in its own register, or with the section that one register holds."""
    while path and path not in places:
        path = path.rpartition(".")[0]
    return places.get(path, "")


def groups_of(model: BaseModel, vendor: Vendor, data: object, places: Mapping[str, str]) -> tuple[Group, ...]:
    """The settings of a model by its sections; ``data``: the same as it stands in the file."""
    sections: dict[str, list[Setting]] = {}
    for leaf in leaves(model):
        if leaf.path[0] not in HEADING_KEYS:
            section, dot, _ = leaf.text.partition(".")
            file_value = value_at(data, leaf.path)
            row = setting_of(leaf, model, vendor, file_value, place_of(leaf.text, places))
            sections.setdefault(section if dot else "", []).append(row)
    texts = texts_of(type(model))
    return tuple(
        Group(key, texts.get(key.partition("[")[0], key).rstrip(".") if key else GENERAL_TITLE, tuple(settings))
        for key, settings in sorted(sections.items(), key=lambda item: bool(item[0]))
    )


# --- The words of a configuration with their addresses: content, engineering value, and the bits of bit words ---------

PLC_TITLE = "the PLC"
BCD_NOTATION = "BCD"
"""How the notation of a codec of decimal digits begins."""
AS_PV_CHOICE = "as the PV"
"""A choice that stands for none of its own: the output takes the PV's format."""


def places_of(encoding: Encoding, loop: int) -> dict[str, str]:
    """Where the registers of a loop, by its number, hold each setting, by its path; a pair of limits has two.

    A key that stands for another, such as ``cascade_from`` for the address of an output, has the register of that.
    """
    places: dict[str, list[str]] = {}
    for block in encoding.blocks:
        for row in block.table.points if _is_of_loop(block, loop) else ():
            if row.path is not None:
                path = path_text((*block.path[2:], row.path)).removesuffix(".0").removesuffix(".1")
                name = encoding.space.name(block.start + row.offset)
                plural = "s" if len(row.bits) > 1 else ""
                numbers = f" bit{plural} {bit_numbers(row)}" if row.bits else ""
                for key in filter(None, (path, row.other_key)):
                    places.setdefault(key, []).append(name + numbers)
    return {path: ", ".join(names) for path, names in places.items()}


def _is_of_loop(block: Block, loop: int | None) -> bool:
    """Whether a block is of a loop by its number (two may have one name), or of none."""
    return block.loop is None if loop is None else block.path[:2] == ("loops", loop)


@frozen
class RegisterSheet:
    """The registers of a configuration, as one loop or the PLC sees them."""

    encoding: Encoding
    units: Mapping[str, str] = field(default_factory=dict)
    setting_units: Mapping[str, str] = field(default_factory=dict)
    """Units by path, which leave no choice."""
    writers: Mapping[str, str] = field(default_factory=dict)
    """Who writes a status register that is not the PLC's alone, by its name."""

    def blocks(self, loop: int | None) -> tuple[report.RegisterBlock, ...]:
        """The blocks of one loop, by its number (None: of the PLC)."""
        blocks: dict[str, list[report.Register]] = {}
        for block in self.encoding.blocks:
            if _is_of_loop(block, loop):
                blocks.setdefault(block.table.title, []).extend(self._block_rows(block))
        return tuple(report.RegisterBlock(title, tuple(rows)) for title, rows in blocks.items() if rows)

    def _block_rows(self, block: Block) -> Iterator[report.Register]:
        """The registers of a block; reserved ones that hold nothing stand together."""
        cells = {cell.number - block.start: cell for cell in block.make_cells(self.encoding.space)}
        memory = self.encoding.image.words
        rows = [(word, memory[block.start + word.offset]) for word in block.table.words if word.offset in cells]
        for reserved, run in groupby(rows, key=lambda row: row[0].access == "reserved" and not row[1]):
            if reserved:
                words = [word for word, _ in run]
                first, last = (cells[words[i].offset] for i in (0, -1))
                address = first.address if first is last else f"{first.address} to {last.address}"
                title = words[0].title
                yield report.Register(address, "", first.kind.hex(0), 0, None, "", title, "reserved")
            else:
                yield from (self._register_row(word, block, cells[word.offset], raw) for word, raw in run)

    def _register_row(self, word: Word, block: Block, cell: Cell, raw: int) -> report.Register:
        bits = tuple(_bit_choice(row, raw) for row in block.table.bits if row.offset == word.offset)
        value, unit = (None, "") if bits or word.access == "status" else self._register_value(word, block, raw)
        if value is not None and not unit and not isinstance(value, str):
            is_open = not word.unit or CHOICE_OF_UNITS.search(word.unit)
            unit = self.setting_units.get(str(word.path), "") if is_open else unit_text(word.unit, self.units)
        meaning, share = word.title, signal_share_of(word, block, raw)
        if share is not None and word.access == "setting":
            value, unit, pv_text = share.percent, share.unit, share.pv_clause(self.units["pv"])
            meaning += f", {pv_text}" if pv_text else ""
        return report.Register(
            address=cell.address,
            name=cell.field,
            hex=cell.kind.hex(raw),
            decimal=cell.kind.show(raw) + 0,
            value=value,
            unit=unit,
            meaning=meaning,
            owner=word.access,
            bits=tuple(bit for bit in bits if bit.owner == "setting" or set(bit.state) != {"0"}),
            writer=self.writers.get(word.name, PLC_TITLE) if word.access == "status" else "",
            has_number=not bits and is_counted(word),
        )

    def _register_value(self, word: Word, block: Block, raw: int) -> tuple[report.Value, str]:
        """What the PLC reads in a register, in engineering units; counts where there is no range."""
        spell = getattr(word.codec, "spell", None)
        if spell is not None:
            return spell(raw, self.encoding.space.name), ""
        try:
            value: object = block.table.decode_word(word, raw, block.scales)
        except DecodeError:
            return "no value", ""
        step, off = getattr(word.codec, "step", None), getattr(word.codec, "off", ())
        if off and step and value / step in off:
            return getattr(word.codec, "off_effect", "off"), ""
        scale = block.scales.get(getattr(word.codec, "scale", ""))
        if isinstance(value, Quantity) and (value.counts or scale is None or scale.range is None):
            return value.value, "counts"
        if isinstance(value, bool):
            return "on" if value else "off", ""
        return (None if word.access == "reserved" else cell_value(value)), ""


def is_counted(word: Word) -> bool:
    """Whether the decimal number of a register says something."""
    notation = str(getattr(word.codec, "notation", ""))
    return not notation.startswith(BCD_NOTATION) and not hasattr(word.codec, "spell")


def add_contents(facts: Iterable[report.Fact], blocks: Sequence[report.RegisterBlock]) -> Iterator[report.Fact]:
    """The facts with what stands in their registers, beside the addresses."""
    contents = report.contents_of(blocks)
    for fact in facts:
        places = [f"{place} {contents[place]}" if place in contents else place for place in fact.place.split(", ")]
        yield replace(fact, place="" if fact.place == NO_REGISTER_TEXT else ", ".join(places))


def _bit_choice(row: Bits, raw: int) -> report.Bit:
    """A choice with its state, most significant bit first."""
    state = "".join(str(raw >> bit & 1) for bit in reversed(row.bits))
    try:
        value = row.decode(raw)
    except DecodeError:
        value = "no value"
    choice = (
        {None: AS_PV_CHOICE if row.access == "setting" else "", False: "off", True: "on"}.get(value)
        if isinstance(value, bool | None)
        else str(value)
    )
    return report.Bit(bit_numbers(row), state, choice or "", row.title, row.access)


def bit_numbers(row: Point) -> str:
    """The bits of a choice, the most significant first, as its state is written."""
    return ", ".join(map(str, reversed(row.bits))) if len(row.bits) < 5 else f"{row.bits[-1]} to {row.bits[0]}"


def parameters_of(
    encoding: AnyEncoding, loop: str | None, book: ParameterBook, units: Mapping[str, str] | None = None
) -> tuple[report.Parameter, ...]:
    """The named parameters of one loop (None: of what is no loop); ``units``: the loop's, else those of the table."""
    program = encoding.image
    if not isinstance(program, Program):
        return ()
    types = book.block_types(program.settings)
    return tuple(_parameter_row(entry, types, book, units) for entry in encoding.entries if entry.loop == loop)


def _parameter_row(
    entry: Entry, types: Mapping[str, str], book: ParameterBook, units: Mapping[str, str] | None
) -> report.Parameter:
    row = book.row_of(entry.address, types)
    meaning, unit = (book.parameter_text(row[1], row[2]), row[2].unit) if row else ("", "")
    if isinstance(entry.raw, Wire):
        text, unit = f":= {entry.raw.text}", ""
    else:
        text = shown_content(entry.type, entry.raw)
        unit = unit_text(unit, UNITS_OF_SIDES) if units is None else units.get(entry.field, "")
        unit = "" if isinstance(entry.raw, bool) else unit
    return report.Parameter(entry.address, entry.type.name, text, unit, meaning, entry.device or "")


# --- A checked configuration as loop sheets ---------------------------------------------------------------------------

KEYS_ELSEWHERE = ("loop", "block", "description", "name")
"""Of what no register holds: keys that a report prints elsewhere."""
DEVICES_PREFIX = "devices."


def plc_sheet(checked: Checked) -> PlcSheet:
    """The sheet of one configuration, without anchors; without a model, its name is all there is."""
    config, vendor, doc = checked.config, checked.vendor, checked.document
    encoding: Any = checked.encoding
    if config is None or vendor is None or encoding is None or not has_image(encoding):
        return PlcSheet(file=doc.file, name="", description="", vendor=vendor.title if vendor else "")
    image = encoding.image
    loops, findings = neutral_loops(checked), sort_by_severity(checked.findings)
    return PlcSheet(
        file=doc.file,
        name=config.name or "",
        description=config.description or "",
        vendor=vendor.title,
        groups=groups_of(config, vendor, doc.data, {}),
        blocks=RegisterSheet(encoding).blocks(None),
        parameters=parameters_of(encoding, None, vendor.load("explainer")),
        unstored=tuple(flat_rows({key: value for key, value in image.plc.items() if key not in KEYS_ELSEWHERE})),
        checklist=checked.checklist,
        loops=tuple(_loop_sheet(checked, i, findings, loops[i]) for i in range(len(config.loops))),
    )


def sort_by_severity(findings: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Findings as a report lists them."""
    return sorted(sort_findings(list(findings)), key=lambda d: -d.severity)


def has_image(encoding: AnyEncoding) -> bool:
    """Whether every word has an address; one outside of the PLC's memory has none."""
    try:
        return encoding.image is not None
    except NoRegisterError:
        return False


def _loop_sheet(
    checked: Checked, i: int, findings: Sequence[Diagnostic], neutral_loop: Mapping[str, object]
) -> LoopSheet:
    vendor, loop = checked.vendor, checked.config.loops[i]
    encoding: Any = checked.encoding
    if vendor is None or encoding is None:
        raise ValueError(f"{checked.document.file} has no image")
    image, data = encoding.image, (checked.document.data or {}).get("loops")
    settings: Mapping[str, object] = next((entry for entry in image.settings if entry.get("loop") == loop.name), {})
    unstored = {key: value for key, value in settings.items() if key not in KEYS_ELSEWHERE}
    places = _places_of_loop(encoding, i, loop.name)
    if encoding.blocks:
        places = {key: NO_REGISTER_TEXT for key, _ in flat_rows(unstored) if key not in PLACE_KEYS} | places
    groups = groups_of(loop, vendor, data[i] if isinstance(data, list) and i < len(data) else None, places)
    setting_units = {setting.path: setting.unit for group in groups for setting in group.settings}
    units = table_units(vendor, side_units(loop)) | {path: unit for path, unit in setting_units.items() if unit}
    pv_unit = side_units(loop)["pv"]
    contents = stored_setpoint(encoding, i, pv_unit)
    shares = signal_shares(encoding, i)
    blocks = RegisterSheet(encoding, side_units(loop), setting_units, vendor.load("explainer").writers).blocks(i)
    return LoopSheet(
        name=loop.name,
        description=loop.description or "",
        facts=tuple(add_contents(loop_facts(vendor, loop, neutral_loop, groups, contents), blocks)),
        groups=add_shares(groups, shares, pv_unit),
        blocks=blocks,
        parameters=parameters_of(encoding, loop.name, vendor.load("explainer"), units),
        unstored=tuple(
            (key, value) for key, value in flat_rows(unstored) if not key.startswith((DEVICES_PREFIX, *PLACE_KEYS))
        ),
        findings=tuple(d for d in findings if loop.name == d.loop),
    )


def _places_of_loop(encoding: Any, number: int, loop: str) -> dict[str, str]:
    """Where the PLC holds each setting of a loop: its registers, or the device of its parameter."""
    devices = {entry.field: entry.device for entry in encoding.entries if entry.loop == loop and entry.device}
    return devices | places_of(encoding, number)


def neutral_loops(checked: Checked) -> list[Mapping[str, object]]:
    """The loops in the neutral form, as far as the configuration says it; empty where it has errors."""
    if checked.failed or checked.vendor is None:
        return [{}] * len(checked.config.loops)
    return [loop.data for loop in source_of(checked.vendor).to_neutral(checked.config)]


def flat_rows(data: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Nested settings as one row each."""
    for key, value in data.items():
        if isinstance(value, dict):
            yield from flat_rows(value, f"{prefix}{key}.")
        else:
            text = " to ".join(map(cell_text, value)) if isinstance(value, list | tuple) else cell_text(value)
            yield f"{prefix}{key}", text or "none"


# --- From the sheets of configurations and runs to the content of a report --------------------------------------------


def compose_report(
    title: Title,
    files: Sequence[SourceFile],
    configurations: Sequence[PlcSheet],
    runs: Sequence[RunSheet],
    findings: Sequence[Diagnostic],
) -> Content:
    """The whole report; ``findings`` are those of all files, whose names are shown in one line."""
    content = Content(
        title=title,
        files=tuple(files),
        plcs=tuple(number_anchors(sheet, f"plc-{i}") for i, sheet in enumerate(configurations, start=1)),
        runs=tuple(replace(run, anchor=f"run-{i}") for i, run in enumerate(runs, start=1)),
        findings=tuple(sort_by_severity(findings)),
    )
    return rename_files(content, to_one_line)


def number_anchors(sheet: PlcSheet, anchor: str) -> PlcSheet:
    """A configuration whose anchors, its loops' too, are those of its place in the report."""
    loops = (replace(loop, anchor=f"{anchor}-loop-{i}") for i, loop in enumerate(sheet.loops, start=1))
    return replace(sheet, anchor=anchor, loops=tuple(loops))


def rename_files(content: Content, name: Callable[[str], str]) -> Content:
    """The same report with other names of its files."""

    def finding(d: Diagnostic) -> Diagnostic:
        return replace(d, file=name(d.file))

    def loop(sheet: LoopSheet) -> LoopSheet:
        return replace(sheet, findings=tuple(map(finding, sheet.findings)))

    return replace(
        content,
        files=tuple(replace(file, name=name(file.name)) for file in content.files),
        plcs=tuple(replace(plc, file=name(plc.file), loops=tuple(map(loop, plc.loops))) for plc in content.plcs),
        runs=tuple(replace(run, file=name(run.file), config=name(run.config)) for run in content.runs),
        findings=tuple(map(finding, content.findings)),
    )
