"""The Modbus map that a configuration names: a file, never a host."""

from __future__ import annotations

from typing import Annotated

from pydantic import PlainValidator, WithJsonSchema

from pidcfg.schemas.base import parse_text
from pidcfg.schemas.numbers import refuse

HOSTS = ("//", "\\\\")
"""How a name begins that is looked for on another machine."""


def parse_map_file(value: object) -> str:
    """The name of a file; what names another machine is refused."""
    name = parse_text(value)
    if "://" in name or name.startswith(HOSTS):
        cure = "name a file beside the configuration; the PLC's address stands on the command line (--plc)"
        refuse("text_type", f"{name!r} is no file of this machine", help=cure)
    if not name.strip():
        refuse("text_type", "the name of the map is empty", help="name a file such as oven-map.csv")
    return name


MapFile = Annotated[str, PlainValidator(parse_map_file), WithJsonSchema({"type": "string"})]
