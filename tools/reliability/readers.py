"""Every reader of pidcfg as a function of bytes, with what it may raise.

Listings are read format by format, apart from what their words mean; meanings get words, not texts: five bytes are the
number of a word and its content, so that everything that is tried reaches the decoder.
"""

from __future__ import annotations

import hashlib
import json
import struct
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from reliability.small import SHEET, VENDORS, encoded, having, packed, parts, texts

TEXTS = (
    *("yaml", "configuration", "scenario", "settings", "baseline", "expression", "question", "address"),
    *("sheet", "workbook", "record", "step", "map", "nicknames", "state"),
)
FORMATS = (
    *("text", "csv", "json", "modbus", "ihex", "nickname-csv", "cdv", "data-dump", "tags", "st", "plcopen"),
    *("operands", "symbols"),
)
TARGETS = (*TEXTS, *FORMATS, *(f"{vendor}-words" for vendor in VENDORS))
Reader = Callable[[bytes], object]
NAMES = {"demand": 0, "FIC-102.PV": 1, "x": 2}
CONTENT = struct.Struct("<BI")
"""The number of a word, and what it holds: a whole number, a 32-bit real, a switch, or one of the texts."""
CONTENTS = ("", "T#0ms", "T#1s", "TRUE", "auto", "x.y", "A + B", "1e400")


def reader(target: str) -> tuple[Reader, tuple[type[Exception], ...]]:
    """What reads the input of a target, and what it may raise."""
    if target.endswith("-words"):
        return _words(target.removesuffix("-words"))
    return _format(target) if target in FORMATS else globals()[f"_{target}"]()


# --- configurations, scenarios, settings -----------------------------------------------------------------------------


def _yaml() -> tuple[Reader, tuple[type[Exception], ...]]:
    from pidcfg.text.source import read_document

    return lambda data: read_document(data, "m.yaml"), ()


def _configuration() -> tuple[Reader, tuple[type[Exception], ...]]:
    from pidcfg import api

    def read(data: bytes) -> None:
        if api.check(data, name="m.yaml").ok:
            assert api.encode(data, "json", name="m.yaml").ok, "what validates does not encode"

    return read, ()


def _scenario() -> tuple[Reader, tuple[type[Exception], ...]]:
    from pidcfg import api
    from reliability import hostile

    files = {"base.yaml": (hostile.EXAMPLES / hostile.CONFIGURATIONS["dl06"]).read_bytes()}
    return lambda data: api.check(data, name="m.yaml", files=files), ()


def _settings() -> tuple[Reader, tuple[type[Exception], ...]]:
    import click

    from pidcfg.cli import settings

    return lambda data: settings._load_settings(Path("pidcfg.toml"), "pidcfg.toml", data), (click.ClickException,)


def _baseline() -> tuple[Reader, tuple[type[Exception], ...]]:
    from pidcfg.validate.baseline import BaselineError, baseline_text, parse_baseline

    def read(data: bytes) -> None:
        one = parse_baseline(data.decode("utf-8", "replace"))
        two = parse_baseline(baseline_text(one))
        assert Counter(one) == Counter(two), "a baseline is written otherwise"

    return read, (BaselineError,)


def _expression() -> tuple[Reader, tuple[type[Exception], ...]]:
    from pidcfg.schemas import expressions

    return lambda data: expressions.parse(data.decode("utf-8", "replace"), NAMES), (expressions.ExpressionError,)


def _question() -> tuple[Reader, tuple[type[Exception], ...]]:
    from pidcfg import api

    return lambda data: api.explain(data.decode("utf-8", "replace"), vendor="dl06"), (ValueError,)


def _address() -> tuple[Reader, tuple[type[Exception], ...]]:
    from pidcfg.live.link import AddressError, parse_address, parse_listen

    def read(data: bytes) -> None:
        text = data.decode("utf-8", "replace")
        (parse_address if "://" in text else parse_listen)(text)

    return read, (AddressError,)


# --- tables ----------------------------------------------------------------------------------------------------------


def _sheet() -> tuple[Reader, tuple[type[Exception], ...]]:
    from pidcfg.output.sheet_reader import SheetFaultsError, read_configuration
    from pidcfg.text.reader import DEFAULT

    return lambda data: read_configuration(data, "m.csv", None, DEFAULT), (SheetFaultsError,)


def _workbook() -> tuple[Reader, tuple[type[Exception], ...]]:
    """The XML of the first sheet in a sound workbook, or a whole one."""
    from pidcfg.output.sheet_reader import WORKBOOK_SIGN

    read, declared = _sheet()
    sound = parts()
    return lambda data: read(data if data.startswith(WORKBOOK_SIGN) else packed({**sound, SHEET: data})), declared


def _record() -> tuple[Reader, tuple[type[Exception], ...]]:
    from pidcfg.text.reader import DEFAULT
    from pidcfg.tuning.identify import read_record
    from pidcfg.tuning.sheet import UnreadableRecordError

    return lambda data: read_record(data, "m.csv", DEFAULT), (UnreadableRecordError,)


def _step() -> tuple[Reader, tuple[type[Exception], ...]]:
    from pidcfg.text.reader import DEFAULT
    from pidcfg.tuning.identify import identify_record
    from pidcfg.tuning.sheet import UnreadableRecordError

    return lambda data: identify_record(data, "m.csv", DEFAULT), (UnreadableRecordError,)


def _map() -> tuple[Reader, tuple[type[Exception], ...]]:
    from pidcfg.encoders.modbus_map import UnusableMapError
    from pidcfg.text.reader import DEFAULT
    from pidcfg.validate.map_files import map_of_data, numbering_of
    from pidcfg.vendors import VENDORS as TABLE

    images = [(TABLE[vendor], encoded(vendor, "json").image) for vendor in ("ezlogix", "nextopid", "dpide")]

    def read(data: bytes) -> None:
        stated, refused = map_of_data(data, "m.csv", DEFAULT), 0
        for vendor, image in images:
            try:
                numbering_of(vendor, stated, image)
            except UnusableMapError:
                refused += 1

    return read, (UnusableMapError,)


def _nicknames() -> tuple[Reader, tuple[type[Exception], ...]]:
    """A file of the user's that a CLICK's nicknames go into."""
    from pidcfg.encoders.click.nicknames import merge_nicknames
    from pidcfg.encoders.listing import ListingError

    image = encoded("click", "json").image
    return lambda data: merge_nicknames(image, data.decode("utf-8", "replace")), (ListingError,)


def _state() -> tuple[Reader, tuple[type[Exception], ...]]:
    """The body of a state of ``--resume`` with its key and a right checksum."""
    from pidcfg.study.certification.tally import StateError, read_state

    class Job:
        """Of which no sample can run."""

        def loaded(self) -> None:
            raise StateError

    def read_body(data: bytes) -> None:
        body = data.decode("utf-8", "replace").strip("\n")
        read_state(f"{hashlib.sha256(body.encode()).hexdigest()}\n{body}\n".encode(), "k", Job(), 0)  # type: ignore[arg-type]

    return read_body, (StateError,)


# --- listings --------------------------------------------------------------------------------------------------------


def _format(name: str) -> tuple[Reader, tuple[type[Exception], ...]]:
    from pidcfg.encoders.decoding import read_listing
    from pidcfg.encoders.listing import ListingError
    from pidcfg.text.reader import DEFAULT
    from pidcfg.vendors import VENDORS as TABLE

    vendors = [TABLE[vendor] for vendor in having(name)]

    def read(data: bytes) -> None:
        refused = []
        for vendor in vendors:
            try:
                read_listing(data, vendor, DEFAULT, name)
            except ListingError as error:
                refused.append(error)

    return read, ()


def _words(vendor: str) -> tuple[Reader, tuple[type[Exception], ...]]:
    """The words of a starter with others in their places."""
    from pidcfg.encoders.decoding import decode_listing, read_listing
    from pidcfg.encoders.listing import ListingError
    from pidcfg.text.reader import DEFAULT
    from pidcfg.vendors import VENDORS as TABLE

    document = json.loads(texts(vendor, "json")[0])
    valued = [number for number, word in enumerate(document["words"]) if "value" in word]
    contents = (
        *CONTENTS,
        *sorted({value for word in document["words"] if isinstance(value := word.get("value"), str)}),
    )

    def read(data: bytes) -> None:
        words = list(document["words"])
        for number, content in CONTENT.iter_unpack(data[: len(data) // CONTENT.size * CONTENT.size]):
            at = valued[number % len(valued)]
            words[at] = {key: value for key, value in words[at].items() if key != "hex"}
            words[at]["value"] = _content(words[at]["value"], content, contents)
        text = json.dumps({**document, "words": words}).encode()
        decode_listing(read_listing(text, TABLE[vendor], DEFAULT, "json"), TABLE[vendor], {})

    return read, (ListingError,)


def _content(old: object, content: int, contents: tuple[str, ...]) -> object:
    """A content of the type that a word has."""
    if isinstance(old, bool):
        return bool(content & 1)
    if isinstance(old, float):
        real = struct.unpack("<f", content.to_bytes(4, "little"))[0]
        return real if abs(real) < float("inf") else 0.0
    if isinstance(old, int):
        return content & 0xFFFF
    return contents[content % len(contents)]
