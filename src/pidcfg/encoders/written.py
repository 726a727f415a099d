"""Who writes which register or parameter while a PLC runs: what a file and a listing may differ in without an edit.

Each vendor's map has a table of rows (``WRITTEN``) with the manual's place. What no row names is the engineer's where
it is a setting, and the PLC's where it is a status or a request. A comparison with a listing leaves out what is
``live``, shows what is ``operated`` apart, and compares what is ``compared``, such as the gains of an auto-tune.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from pidcfg.refs import Basis

D345 = Decision(
    345,
    "a comparison with a listing leaves out what runs",
    "Measurement, output, status, requests, mode, the bias of a loop with an integral, and a set point of a profile "
    "or another loop are left out; another set point is told apart and is no difference; gains and sample time, "
    "which an auto-tune writes, and the bias without an integral are compared.",
    "The first differ in every PLC that runs. The operator has the set point. The last stay what somebody made them.",
)

Kind = Literal["live", "operated", "compared"]
"""The PLC or the process, all the time; the operator or the program; now and then, and it then stays."""


def always(values: Mapping[str, Any]) -> bool:
    """Whatever the loop's other values are."""
    del values
    return True


class Written(NamedTuple):
    """Who else writes a register or parameter, and when, by the loop's values (by the paths of their rows)."""

    name: str
    kind: Kind
    by: str
    basis: Basis
    when: Callable[[Mapping[str, Any]], bool] = always


def writer_of(table: Iterable[Written], name: str, values: Mapping[str, Any]) -> Written | None:
    """The first row of a register or parameter that holds for a loop; None: it is the engineer's alone."""
    return next((row for row in table if row.name == name and row.when(values)), None)
