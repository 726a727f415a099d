"""Small sound inputs of every reader: of configurations the starters, of tables some rows."""

from __future__ import annotations

import hashlib
import io
import re
import zipfile
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

VENDORS = ("dl06", "click", "ezlogix", "nextopid", "dpide", "generic")
Seeds = list[bytes]
EXPRESSIONS = [b"FIC-102.PV + min(demand, 10) - sqrt(4) / (1 + abs(-3))", b"demand * 2", b"0.5 * (x - 1e3)"]
QUESTIONS = [b"V2000", b"TIC-101.gain", b"E42", b"0x1F", b"DL242", b"D30", b"TIC_1.Direct", b"holding,0"]
ADDRESSES = [
    b"modbus://10.0.0.5:502?unit=1",
    b"modbus+rtu:///dev/ttyS0?baud=9600&parity=odd",
    b"modbus://[::1]",
    b"127.0.0.1:1502",
]
RECORD = b"time,out,pv\n" + b"".join(
    f"{t},{0 if t < 10 else 20},{50 if t < 14 else 50 + 30 * (1 - 0.9 ** (t - 14)):.2f}\n".encode()
    for t in range(0, 120, 2)
)
SHEET = "xl/worksheets/sheet1.xml"


def seeds(target: str) -> Seeds:
    """Small sound inputs of a target."""
    if target.endswith("-words"):
        return [b"\0" * 5, bytes(range(50))]
    if target in SEEDS:
        return SEEDS[target]()
    return [text for vendor in having(target) for text in texts(vendor, target)]


@cache
def starters() -> dict[str, bytes]:
    """A small configuration of each vendor, without comments."""
    from importlib.resources import files

    from pidcfg.vendors import VENDORS as TABLE

    whole = {vendor: files("pidcfg").joinpath(TABLE[vendor].starter).read_text("utf-8") for vendor in VENDORS}
    return {vendor: re.sub(r"(?m)^ *#.*\n|  +#.*$", "", text).encode() for vendor, text in whole.items()}


@cache
def encoded(vendor: str, name: str) -> Any:
    from pidcfg import api

    return api.encode(starters()[vendor], name, name="m.yaml", allow_errors=True)


def having(name: str) -> list[str]:
    """The vendors that read a format."""
    from pidcfg.vendors import VENDORS as TABLE

    return [vendor for vendor in VENDORS if name in TABLE[vendor].load("formats")]


def texts(vendor: str, name: str) -> list[bytes]:
    """The files of a starter in a format."""
    return [text.encode() for text in encoded(vendor, name).files.values()]


def _dumps() -> Seeds:
    """The first cells of each bank of a CLICK's data dump."""
    rows = {"C": "1,0,1,0", "DS": "1,5,-3,100", "DF": "1,2.5,-0.125,1e+10"}
    sections = (f"<{bank}=START>\nAddress,1,2,3,\n{bank}{row},\n</{bank}=END>\n" for bank, row in rows.items())
    return ["".join(sections).encode()]


def _sheets() -> Seeds:
    from pidcfg.output.sheets import as_csv
    from pidcfg.text.source import read_document
    from pidcfg.vendors import VENDORS as TABLE

    documents = [(vendor, read_document(text, "m.yaml")) for vendor, text in starters().items()]
    return [as_csv(document, TABLE[vendor]).encode() for vendor, document in documents]


@cache
def parts() -> dict[str, bytes]:
    """The parts of a small workbook."""
    import openpyxl

    book = openpyxl.Workbook()
    for row in (["vendor", "dl06"], ["name", "mode", "tuning.gain"], ["A", "auto", 1], ["B", "=1+1", True]):
        book.active.append(row)
    stream = io.BytesIO()
    book.save(stream)
    with zipfile.ZipFile(stream) as package:
        return {entry.filename: package.read(entry) for entry in package.infolist()}


def packed(parts: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as package:
        for name, data in parts.items():
            package.writestr(name, data)
    return stream.getvalue()


def _maps() -> Seeds:
    from pidcfg.encoders.modbus_map import FORMAT_NAME, fill_rows

    whole = [texts(vendor, FORMAT_NAME)[0].decode() for vendor in ("ezlogix", "nextopid", "dpide")]
    rows = [[row for row in text.splitlines() if not row.startswith("#")] for text in whole]
    return ["\n".join([head, *fill_rows(body)]).encode() for head, *body in rows]


def _states() -> Seeds:
    from pidcfg.study.certification.tally import Tally, json_of

    tally = Tally.empty((1, 1, 1, 1))
    state = {
        "key": "k",
        "tally": tally.to_json(),
        "trial": [0, hashlib.sha256().hexdigest()],
        "ahead": [tally.to_json()],
    }
    return [json_of(state).encode()]


def _baselines() -> Seeds:
    from pidcfg.validate.baseline import Entry, baseline_text

    return [baseline_text([Entry(*["x"] * len(Entry._fields))]).encode()]


def _hostile(kind: str) -> Seeds:
    from reliability import hostile

    return [hostile.sources()[kind][0]]


SEEDS: dict[str, Callable[[], Seeds]] = {
    "yaml": lambda: [*starters().values(), *_hostile("a.scenario.yaml")],
    "configuration": lambda: [*starters().values()],
    "scenario": lambda: _hostile("a.scenario.yaml"),
    "settings": lambda: _hostile("pidcfg.toml"),
    "baseline": _baselines,
    "expression": lambda: EXPRESSIONS,
    "question": lambda: QUESTIONS,
    "address": lambda: ADDRESSES,
    "sheet": _sheets,
    "workbook": lambda: [parts()[SHEET], packed(parts())],
    "data-dump": _dumps,
    "record": lambda: [RECORD],
    "step": lambda: [RECORD],
    "map": _maps,
    "nicknames": lambda: texts("click", "nickname-csv"),
    "state": _states,
}
