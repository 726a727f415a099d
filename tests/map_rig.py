"""Modbus maps that users state: templates with their registers filled in, and what a PLC then holds."""

from itertools import count
from pathlib import Path

import pidcfg
from pidcfg.live.serving import VirtualPlc
from pidcfg.study.scenario import load_scenario
from pidcfg.text.reader import DEFAULT, reader_of
from pidcfg.validate.engine import document_of
from pidcfg.validate.map_files import MapFile, numbering_of
from pidcfg.vendors import VENDORS

ROOT = Path(__file__).parents[1]
EXAMPLES = {"ezlogix": "oven", "dpide": "oven", "nextopid": "cascade"}
BANKS = ("R1,", "S1,", "IR1,", "OR1,", "D0,", "M0,")
"""Rows that count for the registers behind them, too."""
OFFERED = "# "


def example(vendor, name=None):
    """A configuration of the examples."""
    return ROOT / f"examples/{vendor}/{name or EXAMPLES[vendor]}.yaml"


def filled(path, order="low-first", *, bits=False):
    """The template of a configuration with registers, those that are only offered too.

    ``bits``: switches stand in registers.
    """
    numbers, places, lines = {"holding": count(700, 2), "coil": count(30)}, {}, []
    switches = count(9000 * 16)
    for line in pidcfg.encode(path, "modbus-map").text.splitlines():
        row = line.removeprefix(OFFERED)
        symbol, *rest = row.split(",")
        if len(rest) < 3 or row.startswith("symbol") or " " in symbol:
            continue
        table, _, kind, *_ = rest
        if kind == "bool" and bits:
            first = next(switches) if not row.startswith(BANKS) else 9000 * 16
            lines.append(f"{symbol},holding,{first // 16}.{first % 16},bool")
            continue
        start = {"R1,": 0, "S1,": 0, "IR1,": 3000, "OR1,": 4000, "D0,": 1000, "M0,": 500}.get(f"{symbol},")
        register = places.setdefault((symbol, table), next(numbers[table]) if start is None else start)
        lines.append(f"{symbol},{table},{register},{kind}" + (f",{order}" if "32" in kind else ""))
    return "\n".join(["symbol,table,register,type,order", *lines, ""])


def numbered(path, text):
    """The cells of a configuration with their places by a map."""
    result = pidcfg.encode(path)
    numbering = numbering_of(VENDORS[result.vendor], MapFile(text, "map.csv"), result.image)
    if hasattr(numbering, "cells"):
        return list(numbering.cells(result.image))
    return [(cell, numbering.place(cell.number)) for cell in result.image.cells]


def words_by(path, text):
    """The registers of an encoded configuration, by table and number."""
    words = {}
    for cell, place in numbered(path, text):
        for k in range(place.width):
            where = (place.table, place.register + k)
            if place.bit is None:
                words[where] = cell.raw >> place.shift(k) & 0xFFFF
            else:
                words[where] = words.get(where, 0) | cell.raw << place.bit
    return words


def virtual(vendor, text, events="", name=None):
    """The virtual PLC of an example behind a map, not yet at rest; ``events`` come before those of its scenario."""
    scenario = example(vendor, name).with_suffix(".scenario.yaml")
    source = scenario.read_text("utf-8").replace("initial: steady\n", "").replace("events:\n", f"events:\n{events}")
    loaded = load_scenario(document_of(source, scenario.as_posix(), None, DEFAULT), reader_of(None))
    return VirtualPlc(loaded, numbering_of(loaded.vendor, MapFile(text, "map.csv"), loaded.image))
