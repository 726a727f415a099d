"""Values that come through a wire: the limits that a number in the file is held against, for them too."""

from __future__ import annotations

from decimal import ROUND_HALF_EVEN, Decimal

from pidcfg.diagnostics import Severity
from pidcfg.refs import NEXTOPID
from pidcfg.schemas.iec import INT
from pidcfg.schemas.limits import limits_at
from pidcfg.validate.rule import Findings, error
from pidcfg.validate.rules.nextopid.context import D208, NextopidContext
from pidcfg.validate.views import number_text

LOW, HIGH = Decimal(INT.low), Decimal(INT.high)
INTEGERS = NEXTOPID.at("chapter 3: PIDA_INT")


@error("NX613", D208, "{key} is {value}; it must be {allowed}")
def wired_value_out_of_range(context: NextopidContext) -> Findings:
    """A parameter is wired to a value that the manual does not allow for it.

    Why: the block stops with an error bit as soon as the program starts. A number that stands in the file itself is
    found by the rule for every vendor (PID101).

    Fix: give the signal another first value, or limit it on its way.
    """
    for view in context.views:
        for row, _ in view.placed.given():
            limits = limits_at(view.placed.kind.model, row.name)
            value = view.number_of(row.name) if limits and view.is_wired(row.name) else None
            if limits is not None and value is not None and not limits.holds(value):
                allowed = f"{limits.low} or more" if limits.high is None else f"{limits.low} to {limits.high}"
                yield view.at(row.name, limits.effect, key=row.name, value=view.shown(row.name), allowed=allowed)


@error("NX614", INTEGERS, "{key} is an INT and wired to {value}: {problem}")
def wired_value_does_not_fit_int(context: NextopidContext) -> Findings:
    """A REAL signal is wired to an INT parameter that cannot hold its value.

    Why: INT holds whole numbers from -32768 to 32767. The virtual PLC takes the nearest one of them; in a PLC that
    does not, decimals may be cut off, and what is too large comes out as another number, of either sign.

    Fix: give the signal in the units of the INT controller, or use the REAL one.
    """
    for view in context.views:
        for row, _ in view.placed.given():
            value = view.number_of(row.name) if row.type is INT and view.is_wired(row.name) else None
            taken = None if value is None else min(max(value, LOW), HIGH).to_integral_value(ROUND_HALF_EVEN)
            if value is None or taken is None or value == taken:
                continue
            fits = LOW <= value <= HIGH
            problem = f"{'its decimals are lost' if fits else 'it does not fit'}, {number_text(taken)} is taken"
            yield view.at(
                row.name,
                severity=Severity.WARNING if fits else None,
                key=row.name,
                value=view.shown(row.name),
                problem=problem,
            )
