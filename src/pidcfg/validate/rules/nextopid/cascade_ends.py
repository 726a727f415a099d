"""Masters that are not told the truth: behind another block, and of a slave that is in error."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.refs import NEXTOPID
from pidcfg.schemas.nextopid import LONGEST_SAMPLE
from pidcfg.validate.rule import Findings, warning
from pidcfg.validate.rules.nextopid.cascade_wires import MASTER_INPUTS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.validate.rules.nextopid.context import NextopidContext
    from pidcfg.validate.rules.nextopid.program import BlockView

CASCADE = NEXTOPID.at("chapter 16: Cascade Configurations, Special Connections")
ERRORS = NEXTOPID.at("chapter 2: ErrBits")
NOT_NEGATIVE = ("Td_Kd", "Ti_Ki", "Tfd", "MaxVarMV", "DeadBand")


def far_masters(context: NextopidContext, slave: BlockView) -> Iterator[tuple[BlockView, str]]:
    """The loops whose MV reaches a set point through blocks, each with the block that the slave reads."""
    first = slave.wire("SP_CASC")
    direct = frozenset() if first is None else first.signals
    for start in sorted(direct):
        block = context.owner(start)
        if block is None or block[0].is_pid:
            continue
        waiting, seen = [start], {start}
        while waiting:
            number = waiting.pop()
            master = context.pid_output(number)
            if master is not None and number not in direct and master.number != slave.number:
                yield master, block[0].name
            fresh = sources(context, number) - seen
            seen |= fresh
            waiting += sorted(fresh)


def sources(context: NextopidContext, number: int) -> set[int]:
    """What a value depends on: the wire of an input; for an output all wires of its block, unless that is a loop."""
    parameter = context.owner(number)
    if parameter is None:
        return set()
    view, row = parameter
    inputs = [] if view.is_pid else [inner.name for inner in view.placed.kind.inputs]
    keys = [row.name] if row.access == "input" else inputs
    wires = (view.wire(key) for key in keys)
    return {number for wire in wires if wire is not None for number in wire.signals}


@warning(
    "NX684",
    CASCADE,
    "{master}.MV is the set point of {slave} through {block}, and {missing} of {master} {verb} not wired",
)
def master_behind_a_block_not_connected(context: NextopidContext) -> Findings:
    """A master that reaches its slave through another block does not learn what becomes of it.

    Why: with a selector or a filter between them it is a cascade all the same. While the slave is at a limit, or does
    not follow, the integral of the master runs on, and the way back takes as long.

    Fix: wire TRK_IN to TRK_OUT of the slave, and Windup_H_IN and Windup_L_IN to its windup outputs; behind a selector
    also OVERR and TRK_VAL.
    """
    reported: set[tuple[int, int]] = set()
    for slave in context.pids:
        for master, block in far_masters(context, slave):
            missing = [key for key in MASTER_INPUTS if not master.is_wired(key)]
            if missing and (master.number, slave.number) not in reported:
                reported.add((master.number, slave.number))
                yield master.at(
                    missing[0],
                    master=master.name,
                    slave=slave.name,
                    block=block,
                    missing=", ".join(missing),
                    verb="are" if missing[1:] else "is",
                )


def error_bit(view: BlockView) -> str | None:
    """The first error bit that a controller sets in its first call, as far as its values are known."""
    for bit, low, high in (("MaxMinMV", "MinMV", "MaxMV"), ("MaxMinPV", "MinPV", "MaxPV")):
        ends = view.number_of(low), view.number_of(high)
        if ends[0] is not None and ends[1] is not None and ends[1] <= ends[0]:
            return bit
    gain = view.number_of("Kp")
    if gain is not None and (gain < 0 or (gain == 0 and view.is_on("Indep") is False)):
        return "Kp"
    for key in NOT_NEGATIVE:
        value = view.number_of(key)
        if value is not None and value < 0:
            return key
    return "SampleTime" if view.sample_time > LONGEST_SAMPLE else None


@warning(
    "NX685",
    ERRORS,
    "{slave} is in error from its first call; its TRK_OUT stays FALSE, and {master} believes that it follows",
)
def slave_in_error(context: NextopidContext) -> Findings:
    """The slave of a cascade is not executed, and does not say so to its master.

    Why: a block with an error bit keeps its outputs, and TRK_OUT begins as FALSE, which means that the slave follows.
    The master does not track: its integral runs to a limit, and MV of the slave is 0.

    Fix: correct the parameter of the slave; in the program, let its ErrBits reach the operator.
    """
    for link in context.network.links:
        bit = error_bit(link.slave)
        if bit is not None and link.master.number != link.slave.number:
            yield link.slave.at(
                "SP_CASC", f"{link.slave.name}.ErrBits.{bit}", slave=link.slave.name, master=link.master.name
            )
