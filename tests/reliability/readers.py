"""Every reader of pidcfg as a function of bytes, what it may raise, and sound inputs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

VENDORS = ("dl06", "click", "ezlogix", "nextopid", "dpide", "generic")
TARGETS = ("yaml", "configuration", "scenario", "settings", "expression", "sheet", "record", *VENDORS)
Reader = Callable[[bytes], object]


def reader(target: str) -> tuple[Reader, tuple[type[Exception], ...]]:
    """What reads the input of a target, and what it may raise."""
    import click

    from pidcfg import api
    from pidcfg.cli.findings import settings
    from pidcfg.limits import DEFAULT
    from pidcfg.schemas import expressions
    from pidcfg.sheets.read import SheetFaultsError, from_sheet
    from pidcfg.source import read_document
    from pidcfg.tuning.record import identified

    names = {"demand": 0, "FIC-102.PV": 1, "x": 2}

    def configuration(data: bytes) -> None:
        if api.check(data, name="m.yaml").ok:
            assert api.encode(data, "json", name="m.yaml").ok, "what validates does not encode"

    def listing(data: bytes) -> None:
        result = api.decode(data, target, name="m.txt")
        if result.ok:
            api.encode(result.text, "json", name="m.yaml", allow_errors=True)

    readers: dict[str, tuple[Reader, tuple[type[Exception], ...]]] = {
        "yaml": (lambda data: read_document(data, "m.yaml"), ()),
        "configuration": (configuration, ()),
        "scenario": (lambda data: api.check(data, name="m.yaml", files={}), ()),
        "settings": (lambda data: settings._loaded(Path("pidcfg.toml"), "pidcfg.toml", data), (click.ClickException,)),
        "expression": (
            lambda data: expressions.parse(data.decode("utf-8", "replace"), names),
            (expressions.ExpressionError,),
        ),
        "sheet": (lambda data: from_sheet(data, "m.csv", None, DEFAULT), (SheetFaultsError,)),
        "record": (lambda data: identified(data, "m.csv", DEFAULT), (ValueError,)),
    }
    return readers.get(target, (listing, ()))


def seeds(target: str) -> list[bytes]:
    """Sound inputs of a target."""
    from pidcfg.sheets.write import as_csv
    from pidcfg.source import read_document
    from pidcfg.vendors import VENDORS as TABLE
    from reliability import hostile

    if target == "expression":
        return [b"FIC-102.PV + min(demand, 10) - sqrt(4) / (1 + abs(-3))", b"demand * 2", b"0.5 * (x - 1e3)"]
    sound = {kind: data for kind, (data, _) in hostile.sources().items()}
    if target == "sheet":
        documents = [(vendor, read_document(sound[f"{vendor}.yaml"], "m.yaml")) for vendor in VENDORS]
        return [as_csv(document, TABLE[vendor]).encode() for vendor, document in documents]
    wanted = {
        "yaml": [kind for kind in sound if kind.endswith(".yaml")],
        "configuration": [f"{vendor}.yaml" for vendor in VENDORS],
        "scenario": ["a.scenario.yaml"],
        "settings": ["pidcfg.toml"],
        "record": ["record.csv"],
    }
    return [sound[kind] for kind in wanted.get(target, [kind for kind in sound if kind.startswith(f"{target}-")])]
