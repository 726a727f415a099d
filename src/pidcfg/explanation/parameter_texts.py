"""What is said of a named parameter: its title, its unit, its contents, who writes it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.encoders.parameters import Content, Entry, Parameter, ParameterTable
    from pidcfg.schemas.iec import IecType


class Placed(NamedTuple):
    """A parameter of a configuration: its name in the program, the row, and what the file says of it."""

    table: ParameterTable
    row: Parameter
    entry: Entry | None
    units: Mapping[str, str]


WRITERS = {"input": "you or the program: it is an input", "output": "the PLC: it is an output, only to be read"}
TRUTHS = {"true": True, "false": False, "on": True, "off": False, "1": True, "0": False}


def no_units(loop: Any) -> Mapping[str, str]:  # noqa: ARG001 - the signature of a vendor's own
    """For vendors whose settings tell the units."""
    return {}


def no_remark(row: Parameter, raw: Content) -> str:  # noqa: ARG001 - the signature of a vendor's own
    """For vendors whose contents speak for themselves."""
    return ""


def unit_in(unit: str, units: Mapping[str, str]) -> str:
    """A unit in the loop's own units; none where it depends on something else."""
    parts = [units.get(part, part) for part in unit.split("/")]
    return "" if "," in unit or parts in (["pv"], ["output"]) else "/".join(parts)


def contents_of(kind: IecType) -> str:
    """What a parameter of a type holds."""
    if kind.kind == "bool":
        return "TRUE and FALSE"
    if kind.kind == "word":
        return ", ".join(kind.words)
    return f"{kind.name} ({kind.low} to {kind.high})" if kind.kind == "whole" else f"{kind.name}, a finite number"


def title_of(row: Parameter, text: str) -> str:
    """What a parameter is, in short; of one that tells first what TRUE is, only that it is a switch."""
    return "a switch" if row.type.kind == "bool" and text.startswith(("TRUE", "FALSE")) else first_sentence(text)


def first_sentence(text: str) -> str:
    """A text up to where it goes into details."""
    for at in range(1, len(text) - 1):
        if text[at : at + 2] in {"; ", ". ", ": "} and text.count("(", 0, at) == text.count(")", 0, at):
            return text[:at]
    return text.removesuffix(".")
