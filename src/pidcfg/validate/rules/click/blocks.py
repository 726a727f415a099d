"""The blocks of registers: where they end, what they share, and how many loops there may be."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.click import LOOPS, SPACE
from pidcfg.refs import CLICK, Decision
from pidcfg.validate.ideas import blocks
from pidcfg.validate.ideas.duplicates import in_words, sharing
from pidcfg.validate.rule import Findings, error, per_loop

if TYPE_CHECKING:
    from pidcfg.validate.rules.click.context import ClickContext, LoopView

AREAS = CLICK.at("C, DS and DF memory areas")
PWM = CLICK.at("PWM Control")

D130 = Decision(
    130,
    "the banks end at C2000, DS4500 and DF500, and eight loops are the most",
    "A block that reaches past the last register of its bank is an error, and so is a ninth loop.",
    "The topic prints how long the blocks are; how large the banks are, and how many loops there may be, are the PLC's "
    "own figures.",
)
LAST = {bank.prefix: bank.last for bank in SPACE.banks}


@per_loop
@error(
    "CK301",
    D130,
    "{block} would occupy {extent}, but the bank ends at {prefix}{last}: it may begin at {prefix}{latest} at "
    "the latest",
)
def block_beyond_bank(view: LoopView) -> Findings:
    """A block of registers reaches past the end of its bank.

    Why: a loop needs 40 consecutive C bits, 15 consecutive DS registers and 25 consecutive DF registers. What lies past
    the last register does not exist: the programming software refuses the loop, and a writer of the image fails.

    Fix: let the block begin no later than C1961, DS4486 or DF476.
    """
    return blocks.block_beyond_bank(view, LAST)


@error("CK302", AREAS, "{block} {extent} of {loop} overlaps {other_extent} of {other}")
def blocks_overlap(context: ClickContext) -> Findings:
    """Two loops share registers.

    Why: each loop writes its own output, error number and alarm bits into its block, and reads its tuning from there.
    Two loops in one block change each other's gains and set points.

    Fix: leave 40 C bits, 15 DS registers and 25 DF registers to every loop. Steps of 100 in all three banks are easy to
    remember.
    """
    return blocks.blocks_overlap(context.loops)


@error("CK303", D130, "{count} loops are listed; a CLICK PLC calculates at most {limit}")
def too_many_loops(context: ClickContext) -> Findings:
    """The file has more loops than the PLC.

    Why: the programming software offers eight loops; nothing calculates a ninth one.

    Fix: move the loop to another PLC, and to a file of its own.
    """
    return blocks.too_many_loops(context.loops, LOOPS)


@error("CK304", PWM, "{bit} is also the PWM output of {others}: two loops would switch it")
def pwm_output_shared(context: ClickContext) -> Findings:
    """Two loops pulse the same discrete output.

    Why: both write the bit, and what the actuator sees is neither loop's output.

    Fix: give each loop a discrete output of its own.
    """
    pulsed = ((view.loop.output.pwm.bit, view) for view in context.loops if view.loop.output.pwm is not None)
    for bit, view, others in sharing(pulsed):
        yield view.at("output", "pwm", "bit", bit=bit, others=in_words(others)).shared_with(*others)
