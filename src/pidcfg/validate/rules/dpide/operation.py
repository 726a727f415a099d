"""How a DPIDE instruction is called and runs: devices, sampling time, modes, set point and output."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.dpide.image import D256, symbol_name, unusable_reason
from pidcfg.encoders.maps.dpide import AUTOTUNE_OPERANDS, REMARKS, ROWS, TABLE
from pidcfg.schemas.dpide import D250, D600, LAST_REGISTER, MAX_CYCLE, MIN_CYCLE, DeviceRange, device_range
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.references import DPIDE, Decision
from pidcfg.validate.rule import Findings, checklist, error, info, per_loop, warning
from pidcfg.validate.shared_checks import (
    D955,
    crossed_set_points,
    find_shared_keys,
    list_names,
    number_text,
    number_with_unit,
    outside_limits_findings,
    pairs_with_same_key,
    report_at_both,
)

if TYPE_CHECKING:
    from collections.abc import Iterator
    from decimal import Decimal

    from pidcfg.validate.rules.dpide.tuning import DpideContext, LoopView

# --- What stands around the instruction in the program: pulses, timers, and the bits that they need -------------------

PULSES = DPIDE.cite("Example 3")
TIMER = DPIDE.cite("Example 4")


@per_loop
@warning("DP791", PULSES, "MV goes from {low} to {high}, and GPWM's cycle is {cycle} ms: {effect}")
def pulses_beyond_cycle(view: LoopView) -> Findings:
    """The limits of MV are not those of the pulses.

    Why: behind GPWM MV is the time on in each cycle. A cycle that is shorter than MV_MAX has the output on for good
    long before MV is at its limit, and a longer one never has it on for good; below 0 there is no pulse.

    Fix: write the cycle as MV_MAX, and 0 as MV_MIN.
    """
    gpwm, limits = view.loop.call.GPWM, view.limits
    if gpwm is None or limits is None or (limits[0] >= 0 and limits[1] == gpwm.cycle):
        return
    low, high, effect = number_with_unit(limits[0], None), view.mv_text(limits[1]), _pulse_effect(limits, gpwm.cycle)
    yield view.report("call", "GPWM", "cycle", low=low, high=high, cycle=gpwm.cycle, effect=effect)


def _pulse_effect(limits: tuple[Decimal, Decimal], cycle: int) -> str:
    """What the output does."""
    if limits[1] > cycle:
        return f"from {cycle} on the output is never off"
    return "the output is never on for good" if limits[1] < cycle else "below 0 it makes no pulse"


@error("DP792", D600, "GPWM writes its pulses to {bit}, the place of {other}")
def pulses_collide(context: DpideContext) -> Findings:
    """The bit of the pulses is that of an operand, of EN, or of another loop's pulses.

    Why: the bit goes on and off in every cycle, and with it the loop that it starts or enables; two GPWM in one bit
    leave the one that is executed last.

    Fix: give the pulses a bit of their own.
    """
    for view in context.loops:
        gpwm = view.loop.call.GPWM
        if gpwm is None:
            continue
        bit = device_range("GPWM", gpwm.output)
        for other in context.loops:
            others = {} if other is view or other.loop.call.GPWM is None else {"GPWM": other.loop.call.GPWM.output}
            enable = {} if other.loop.call.EN is None else {"EN": other.loop.call.EN}
            devices = {"I_MV": other.loop.device, **other.loop.devices.by_operand(), **enable, **others}
            for name in [name for name, device in devices.items() if device_range(name, device).overlaps(bit)]:
                finding = view.report("call", "GPWM", "output", bit=bit, other=f"{other.name}.{name}")
                if other is view:
                    yield finding
                elif name == "GPWM":  # the other loop says the same of this one
                    yield finding.with_other_loops(other.name)
                else:
                    yield from report_at_both(
                        view, finding, other, other.report("name", bit=bit, other=f"{other.name}.{name}")
                    )


@error("DP793", TIMER, "{timer} also calls {other} every {other_cycle} ms, and CYCLE is {cycle} ms here")
def timer_with_two_times(context: DpideContext) -> Findings:
    """One timer calls loops with different CYCLE.

    Why: a timer runs for one time. Two TMRH with one timer disturb each other, and neither loop is called when it
    should be; `pidcfg encode --format st` refuses the file.

    Fix: give each CYCLE a timer of its own.
    """
    timed = [view for view in context.loops if view.loop.call.timer is not None]
    for first, second in combinations(timed, 2):
        one, two = first.loop, second.loop
        if one.call.timer == two.call.timer and one.CYCLE != two.CYCLE:
            for view, other in ((first, second), (second, first)):
                yield view.report(
                    "call",
                    "timer",
                    timer=view.loop.call.timer,
                    other=other.name,
                    other_cycle=other.loop.CYCLE,
                    cycle=view.loop.CYCLE,
                ).with_other_loops(other.name)


# --- Devices of operands: the blocks of I_MV, and what shares a register ----------------------------------------------

D258 = Decision(
    258,
    "operands may share a device when they can hold the same",
    "Inputs of one type and value may stand in one device, and the MV of one loop in the SV, BIAS or MOUT of another. "
    "What an instruction writes is in no other operand's device beyond that: MV, the MOUT that follows it (MOUT_AUTO "
    "TRUE or with a device), and what an autotune writes (PID_MODE 1 or with a device). A MOUT in the device of its "
    "own MV is that MV. Devices that overlap in part, hold different types or values, or are written by two loops, are "
    "an error.",
    "One start bit for several loops, and a cascade by one register, are what devices are for. The gains that one "
    "loop's autotune finds are another loop's only by mistake.",
)


class OperandDevice(NamedTuple):
    """An operand of a loop and the devices that it takes."""

    view: LoopView
    operand: str
    extent: DeviceRange

    @property
    def name(self) -> str:
        """What a message calls it."""
        return f"{self.view.name}.{self.operand}"

    @property
    def path(self) -> tuple[str, ...]:
        """Where its device stands below the loop."""
        return ("device",) if self.operand == "I_MV" else ("devices", self.operand)


def operands_with_device(context: DpideContext) -> list[OperandDevice]:
    """Every operand with a device, in the order of the file."""
    return [
        OperandDevice(view, operand, device_range(operand, device))
        for view in context.loops
        for operand, device in {"I_MV": view.loop.device, **view.loop.devices.by_operand()}.items()
    ]


def overlapping_operands(context: DpideContext) -> Iterator[tuple[OperandDevice, OperandDevice]]:
    """Pairs of operands that share a device."""
    items = operands_with_device(context)
    rows = sorted(range(len(items)), key=lambda i: (items[i].extent.bank, items[i].extent.first))
    overlaps: list[tuple[int, int]] = []
    active: list[int] = []
    for i in rows:
        extent = items[i].extent
        active = [j for j in active if items[j].extent.bank == extent.bank and items[j].extent.last >= extent.first]
        overlaps += [(min(i, j), max(i, j)) for j in active if items[j].extent.overlaps(extent)]
        active.append(i)
    return ((items[i], items[j]) for i, j in sorted(overlaps))


@error(
    "DP701", D250, "{operand} would take {place}, but D{last} is the last one: it may begin at D{latest} at the latest"
)
def device_beyond_bank(context: DpideContext) -> Findings:
    """An operand reaches past the last D register.

    Why: I_MV takes 30 registers, a number two. What lies past the last register does not exist, and the software
    refuses the program.

    Fix: let it begin lower.
    """
    for item in operands_with_device(context):
        extent = item.extent
        if extent.bank == "D" and extent.last > LAST_REGISTER:
            yield item.view.report(
                *item.path,
                operand=item.operand,
                place=extent,
                last=LAST_REGISTER,
                latest=LAST_REGISTER - (extent.last - extent.first),
            )


@error("DP702", REMARKS, "{mine} at {place} overlaps {other} at {other_place}")
def integral_block_overlaps(context: DpideContext) -> Findings:
    """Another operand, or another loop, uses registers of an I_MV block.

    Why: the instruction keeps its integral, the previous error and the previous PV in the 30 registers from I_MV on,
    and writes them each cycle. Two loops in one block run away with each other's integral; a set point in the block is
    overwritten.

    Fix: leave 30 registers to every I_MV.
    """
    for first, second in overlapping_operands(context):
        if "I_MV" in {first.operand, second.operand}:
            yield from _operand_findings(first, second)


@error("DP703", D258, "{mine} at {place} and {other} at {other_place} {reason}")
def devices_collide(context: DpideContext) -> Findings:
    """Two operands share devices and cannot hold the same.

    Why: a number takes two registers, so D100 and D101 are not free of each other; and one register holds one value,
    whichever operand it is meant for. The PLC writes MV, the MOUT that follows MV, and after an autotune PID_MODE and
    the coefficients: what else stands there is lost. A loop whose SV stands where its PV does never has an error.

    Fix: give each operand devices of its own. Operands may share a device on purpose where type and value are the same,
    or where the MV of one loop is the SV, BIAS or MOUT of another.
    """
    for first, second in overlapping_operands(context):
        reason = None if "I_MV" in {first.operand, second.operand} else conflict_reason(first, second)
        if reason is not None:
            yield from _operand_findings(first, second, reason=reason)


def _operand_findings(first: OperandDevice, second: OperandDevice, **values: str) -> Findings:
    """A finding at the operand of each loop; of operands of one loop at the second."""
    pairs = [(second, first)] if first.view is second.view else [(second, first), (first, second)]
    for item, other in pairs:
        finding = item.view.report(
            *item.path, mine=item.name, place=item.extent, other=other.name, other_place=other.extent
        ).with_values(**values)
        yield finding if len(pairs) == 1 else finding.with_other_loops(other.view.name)


def conflict_reason(first: OperandDevice, second: OperandDevice) -> str | None:
    """Why two operands cannot share their devices; None: they can."""
    if first.extent != second.extent:
        return "overlap in part"
    if ROWS[first.operand].type is not ROWS[second.operand].type:
        return "are of different types"
    if any(item.operand == "MOUT" and item.view.mout_is_mv for item in (first, second)):
        # a conflict with the loop's own MV is reported at that MV
        return None
    outputs = [item for item in (first, second) if is_written(item)]
    if outputs:
        return _conflict_with_output(first, second, outputs)
    if first.view is second.view and "PV" in {first.operand, second.operand}:
        return "would be one number, and the PV is measured"
    contents = [item.view.contents.get(item.operand) for item in (first, second)]
    return "hold different values" if None not in contents and contents[0] != contents[1] else None


def is_written(item: OperandDevice) -> bool:
    """Whether the instruction itself writes, or may come to write, an operand."""
    if item.operand == "MOUT":
        return item.view.loop.MOUT_AUTO or item.view.has_device("MOUT_AUTO")
    tunes = item.view.loop.PID_MODE == 1 or item.view.has_device("PID_MODE")
    return item.operand == "MV" or (tunes and item.operand in AUTOTUNE_OPERANDS)


def _conflict_with_output(first: OperandDevice, second: OperandDevice, outputs: list[OperandDevice]) -> str | None:
    """An MV may drive another loop."""
    same_loop = first.view is second.view
    if len(outputs) > 1:
        return "are both written"
    output, reader = outputs[0], second if outputs[0] is first else first
    drives = output.operand == "MV" and reader.operand in {"SV", "BIAS", "MOUT"} and not same_loop
    return None if drives else f"would be an operand that {output.operand} overwrites"


# --- Names: what the symbols of ISPSoft make of them ------------------------------------------------------------------


@per_loop
@info("DP771", D256, "no symbols for ISPSoft can be made of the name: {reason}")
def name_without_symbols(view: LoopView) -> Findings:
    """The name of a loop gives no symbols.

    Why: a symbol has at most 34 letters, digits and underscores and does not begin with a digit.
    `pidcfg encode --format symbols` refuses the file; every other format works.

    Fix: rename the loop with at most 28 characters, beginning with a letter, if the symbol table is wanted.
    """
    reason = unusable_reason(view.name)
    if reason is not None:
        yield view.report("name", reason=reason)


@info("DP772", D256, "its symbols would be those of {others}, such as {symbol}")
def symbols_collide(context: DpideContext) -> Findings:
    """Two loops have the same symbols.

    Why: blanks and signs become underscores, and ISPSoft does not tell capital from small letters; `A-1` and `a_1` are
    one. `pidcfg encode --format symbols` refuses the file.

    Fix: rename one of them, if the symbol table is wanted.
    """
    usable = [view for view in context.loops if unusable_reason(view.name) is None]
    for _, view, names in find_shared_keys((symbol_name(view.name, "SV").casefold(), view) for view in usable):
        others = [name for name in names if name != view.name]
        if others:
            finding = view.report("name", others=list_names(others), symbol=symbol_name(view.name, "SV"))
            yield finding.with_other_loops(*others)


# --- A heating and a cooling loop of one PV ---------------------------------------------------------------------------


@warning(
    "DP783", D955, "{heating} raises {device} to {high}, {cooling} lowers it to {low}: between them both MV are on"
)
def set_points_crossed(context: DpideContext) -> Findings:
    """A heating and a cooling loop on one PV have crossed set points.

    Why: the loop with PID_DIR TRUE raises the PV to its SV, the one with FALSE lowers it to its own. With the first
    above the second, both run to their limits and work against each other.

    Fix: put the SV of the loop with PID_DIR FALSE above that of the other, with a gap between them.
    """
    views = [view for view in context.loops if view.gives("PID_DIR")]
    pairs = ((one, other) for one, other, _ in pairs_with_same_key(views, lambda view: view.loop.devices.PV))
    for heating, cooling in crossed_set_points(
        pairs, lambda view: view.loop.PID_DIR, lambda view: None if view.has_device("SV") else view.number("SV")
    ):
        first, second = sorted((heating, cooling), key=lambda view: view.index)
        values = {"high": heating.pv_text(heating.loop.SV), "low": cooling.pv_text(cooling.loop.SV)}
        names = {"heating": heating.name, "cooling": cooling.name, "device": first.loop.devices.PV}
        at_first, at_second = (view.report("SV") for view in (first, second))
        yield from report_at_both(first, at_first, second, at_second, **values, **names)


# --- The sampling time: its limits, and the interrupt task that replaces it -------------------------------------------

D262 = Decision(
    262,
    "a CYCLE below 10 ms is a warning in a cyclic task",
    "The warning says that a bare number is ms. An interrupt task may be as fast as it likes.",
    "The instruction is only calculated when it is scanned, and a scan takes some ms; `CYCLE: 1` is likelier a second "
    "than a millisecond.",
)
SHORT_CYCLE = 10


@per_loop
@warning("DP731", TABLE, "CYCLE is {cycle} ms; the PLC counts it as {used} ms")
def cycle_out_of_range(view: LoopView) -> Findings:
    """The sampling time is outside 1 to 40000 ms.

    Why: the PLC takes the nearest end of the range. Integral and derivative are right for that time, not for the one in
    the file.

    Fix: write a time from 1 ms to 40000 ms. A bare number is ms.
    """
    cycle = view.loop.CYCLE
    used = min(max(cycle, MIN_CYCLE), MAX_CYCLE)
    if used != cycle and view.operand_values("CYCLE") and view.interrupt_task is None:
        yield view.report("CYCLE", cycle=cycle, used=used)


@per_loop
@warning(
    "DP732",
    REMARKS,
    "CYCLE is {cycle} ms, but the interrupt task calls the instruction every {interval} ms, which counts",
)
def cycle_overridden(view: LoopView) -> Findings:
    """The interval of the interrupt task is another one than CYCLE.

    Why: in a timed interrupt task the PLC takes its interval as the sampling time and does not look at CYCLE.

    Fix: write the interval as CYCLE too, so that both tell the same; or leave out `plc.interrupt_task` where the
    instruction stands in a cyclic task.
    """
    if view.interrupt_task is not None and view.interrupt_task != view.loop.CYCLE:
        yield view.report("CYCLE", cycle=view.loop.CYCLE, interval=view.interrupt_task)


@per_loop
@warning("DP733", D262, "CYCLE is {cycle} ms, about as short as a scan: was {cycle} s meant?")
def cycle_shorter_than_scan(view: LoopView) -> Findings:
    """The sampling time is shorter than the PLC can keep.

    Why: the instruction is calculated when it is scanned, so not more often than once a scan. Integral and derivative
    are worked out for the shorter time.

    Fix: write a time well above that of a scan, such as `1 s`; or call the instruction in a timed interrupt task and
    say so in `plc.interrupt_task`.
    """
    if MIN_CYCLE <= view.loop.CYCLE < SHORT_CYCLE and view.interrupt_task is None:
        yield view.report("CYCLE", cycle=view.loop.CYCLE)


# --- Running, manual and autotune: what PID_RUN, PID_MODE and PID_MAN do together -------------------------------------

MODES = range(3)
AUTOTUNE_MODE, BACK_CALCULATED_MODE = 1, 2
D259 = Decision(
    259,
    "an operand without a device is a number in the program",
    "PID_MODE 1 without `devices.PID_MODE` is an error, tuned coefficients without devices a warning; PID_RUN "
    "FALSE and PID_MAN TRUE without devices are warnings.",
    "A number in the program cannot change: neither the autotune's end nor an operator can write it.",
)


@per_loop
@error("DP704", TABLE, "PID_MODE is {mode}; there are 0 (automatic), 1 (autotune) and 2 (automatic, with I_MV)")
def unknown_mode(view: LoopView) -> Findings:
    """PID_MODE is none of the three modes.

    Why: the manual does not say what the instruction does with another number.

    Fix: write 0, 1 or 2.
    """
    if view.operand_values("PID_MODE") and view.loop.PID_MODE not in MODES:
        yield view.report("PID_MODE", mode=view.loop.PID_MODE)


@per_loop
@error("DP705", TABLE, "PID_MODE 1 needs a device, where the PLC writes 0 after tuning")
def autotune_as_a_number(view: LoopView) -> Findings:
    """The autotune is chosen by a number in the program.

    Why: when it is done, the PLC sets PID_MODE to 0. It cannot write a number of the program: the software refuses it,
    or the loop tunes for ever.

    Fix: give PID_MODE a device that nothing else uses, as in `devices: {PID_MODE: D104}`.
    """
    if view.loop.PID_MODE == AUTOTUNE_MODE and not view.has_device("PID_MODE"):
        yield view.report("PID_MODE")


@per_loop
@warning("DP706", D259, "the autotune writes {names}, which {have} no device")
def tuned_coefficients_without_devices(view: LoopView) -> Findings:
    """The autotune is chosen, but what it finds has no place to go.

    Why: it writes Kc_Kp, Ti_Ki, Td_Kd and Tf. As numbers in the program they stay what they are; in registers that are
    not latched they are gone after a loss of power.

    Fix: give the four operands devices, in a latched range.
    """
    bare = [name for name in AUTOTUNE_OPERANDS[1:] if not view.has_device(name)]
    if view.loop.PID_MODE == AUTOTUNE_MODE and bare:
        yield view.report("PID_MODE", names=", ".join(bare), have="has" if len(bare) == 1 else "have")


@per_loop
@checklist("DP707", TABLE, "PID_MODE 1: the loop tunes as soon as it runs, and swings MV between {low} and {high}")
def tunes_at_once(view: LoopView) -> Findings:
    """The file starts an autotune.

    Why: the instruction switches the output to find out how the process answers, without a ramp. That is right for an
    oven, and wrong for a motor.

    Fix: see that the plant may be moved at that moment. Otherwise write 0.
    """
    if view.loop.PID_MODE == AUTOTUNE_MODE and view.loop.PID_RUN and view.limits is not None:
        low, high = view.limits
        yield view.report("PID_MODE", low=view.mv_text(low), high=view.mv_text(high))


@per_loop
@warning("DP708", D259, "PID_RUN is FALSE and has no device: MV stays 0")
def never_runs(view: LoopView) -> Findings:
    """The algorithm is switched off, and nothing can switch it on.

    Why: with PID_RUN FALSE the instruction writes 0 into MV in every scan.

    Fix: leave PID_RUN out, which is TRUE, or give it a bit that nothing else uses, as in `devices: {PID_RUN: M10}`.
    """
    if not view.loop.PID_RUN and not view.has_device("PID_RUN"):
        yield view.report("PID_RUN")


@per_loop
@warning("DP709", D259, "PID_MAN is TRUE and has no device: the loop stays in manual, MV is {mout}")
def always_in_manual(view: LoopView) -> Findings:
    """The loop is in manual, and nothing can take it out.

    Why: MV is MOUT within the limits; the PV has no effect at all.

    Fix: write `PID_MAN: false`, or give it a bit that nothing else uses, as in `devices: {PID_MAN: M11}`.
    """
    if view.loop.PID_MAN and view.loop.PID_MODE != AUTOTUNE_MODE and not view.has_device("PID_MAN"):
        low, high = view.limits or (view.loop.MOUT, view.loop.MOUT)
        yield view.report("PID_MAN", mout=decimal_text(min(max(view.loop.MOUT, low), high)))


@per_loop
@warning("DP710", DPIDE.cite("PID_MAN"), "PID_MAN TRUE has no effect while PID_MODE is 1: the autotune drives MV")
def manual_during_autotune(view: LoopView) -> Findings:
    """Manual and the autotune are chosen together.

    Why: somebody may rely on manual to hold the output. The autotune does not look at PID_MAN.

    Fix: write `PID_MODE: 0` to hold the output, or `PID_MAN: false` to tune.
    """
    if view.loop.PID_MAN and view.loop.PID_MODE == AUTOTUNE_MODE:
        yield view.report("PID_MAN")


def may_be_manual(view: LoopView) -> bool:
    """Whether somebody can put the loop in manual."""
    return view.loop.PID_MAN or view.has_device("PID_MAN")


@per_loop
@info(
    "DP718",
    DPIDE.cite("PID_MODE"),
    "Ti_Ki is {value}: when PID_MAN becomes FALSE, MV jumps from MOUT to the gain times the error and BIAS",
)
def bump_after_manual(view: LoopView) -> Findings:
    """The change from manual to automatic bumps.

    Why: with an integral I_MV takes over the MV of manual, so that MV goes on from there. Without one nothing can.

    Fix: give a Ti_Ki, or bring MOUT to where the algorithm begins before the change.
    """
    if view.loop.Ti_Ki <= 0 and may_be_manual(view) and not view.has_device("Ti_Ki"):
        yield view.report("Ti_Ki", value=decimal_text(view.loop.Ti_Ki))


@per_loop
@info("DP719", DPIDE.cite("MOUT_AUTO"), "MOUT_AUTO is FALSE: when PID_MAN becomes TRUE, MV jumps to MOUT")
def bump_into_manual(view: LoopView) -> Findings:
    """The change from automatic to manual bumps.

    Why: MOUT is whatever was written last. With MOUT_AUTO TRUE, or in the device of MV, it follows MV, and manual
    begins where automatic ended.

    Fix: write `MOUT_AUTO: true`, unless MOUT is meant as a fixed output.
    """
    follows = view.loop.MOUT_AUTO or view.has_device("MOUT_AUTO") or view.mout_is_mv
    if view.has_device("PID_MAN") and not follows:
        yield view.report("MOUT_AUTO")


# --- Set point and process value --------------------------------------------------------------------------------------


@per_loop
@warning("DP751", TABLE, "SV {sv} is outside the PV's range of {low} to {high}")
def set_point_outside_range(view: LoopView) -> Findings:
    """The target value cannot be measured.

    Why: the PV never reaches it, so the integral drives MV to a limit and stays there.

    Fix: correct SV, or `pv.range`; both must be in the same unit.
    """
    span, target = view.loop.pv.range, view.number("SV")
    yield from outside_limits_findings(
        view, "SV", value=target, limits=span, quote=view.pv_text, units=("high",), field="sv"
    )


@per_loop
@warning("DP752", D259, "PV is {pv} and has no device: nothing is measured")
def process_value_as_a_number(view: LoopView) -> Findings:
    """The process value is a number in the program.

    Why: it never changes, so the integral drives MV to a limit. A heater runs away.

    Fix: leave PV out, or give it the device where the measured value stands: `devices: {PV: D100}`.
    """
    if view.operand_values("PV") and not view.has_device("PV"):
        yield view.report("PV", pv=view.pv_text(view.operand_values("PV")[0]))


# --- The output: its limits, what manual and feed forward make of them, and the 0 of a loop that is stopped -----------


@per_loop
@warning(
    "DP741", TABLE, "MV_MAX {highest} is below MV_MIN {lowest}: the PLC swaps them, MV goes from {highest} to {lowest}"
)
def limits_swapped(view: LoopView) -> Findings:
    """The highest MV is below the lowest.

    Why: the PLC exchanges the two, so the loop runs; it does not turn the direction round.

    Fix: exchange them in the file. For cooling write `PID_DIR: false`.
    """
    limits = view.operand_values("MV_MIN", "MV_MAX")
    if limits and limits[1] < limits[0]:
        yield view.report("MV_MAX", highest=number_text(limits[1]), lowest=number_text(limits[0]))


@per_loop
@error("DP742", TABLE, "MV_MAX and MV_MIN are both {limit}: MV cannot move")
def limits_equal(view: LoopView) -> Findings:
    """The highest MV is the lowest.

    Why: MV is that number, whatever the PV does.

    Fix: write the limits of the actuator.
    """
    limits = view.operand_values("MV_MIN", "MV_MAX")
    if limits and limits[0] == limits[1]:
        yield view.report("MV_MAX", limit=view.mv_text(limits[0]))


@per_loop
@warning("DP743", TABLE, "MOUT {mout} is outside {low} to {high}: in manual MV is {used}")
def manual_output_outside_limits(view: LoopView) -> Findings:
    """The output of manual is outside the limits.

    Why: the limits hold in manual too; MV is the nearest of them.

    Fix: write a MOUT inside the limits.
    """
    mout, limits = view.number("MOUT"), view.limits
    is_given = view.loop.PID_MAN or (view.gives("MOUT") and not view.loop.MOUT_AUTO)
    if is_given and mout is not None and limits is not None:
        place = "MOUT" if view.gives("MOUT") else "PID_MAN"
        used = view.mv_text(min(max(mout, limits[0]), limits[1]))
        yield from outside_limits_findings(
            view, place, value=mout, limits=limits, quote=view.mv_text, units=(), field="mout", used=used
        )


@per_loop
@warning(
    "DP744",
    DPIDE.cite("The PID algorithm"),
    "BIAS {bias} is outside {low} to {high}: with PV at SV the output stands at its limit",
)
def feed_forward_outside_limits(view: LoopView) -> Findings:
    """The feed forward alone drives the output to a limit.

    Why: BIAS is added to the three terms. Beyond a limit they must first undo the rest of it before MV moves at all,
    and with PID_MODE 0 the integral stands still meanwhile. With PID_MODE 2 and an integral I_MV takes it up at once,
    and nothing is said.

    Fix: write a BIAS inside the limits.
    """
    taken_up = view.loop.PID_MODE == BACK_CALCULATED_MODE and view.coefficient("Ti_Ki") > 0
    bias = view.number("BIAS") if view.gives("BIAS") and not taken_up else None
    yield from outside_limits_findings(
        view, "BIAS", value=bias, limits=view.limits, quote=view.mv_text, units=(), field="bias"
    )


@per_loop
@warning("DP745", TABLE, "{operand} {limit} is outside the output's range of {low} to {high}")
def limits_beyond_output(view: LoopView) -> Findings:
    """A limit of MV lies beyond what the output can do.

    Why: the actuator stands at its end while MV goes on. The integral goes on with it, and needs as long to come back.

    Fix: write the ends of the output as MV_MIN and MV_MAX, or correct `output.range`.
    """
    for key in ("MV_MAX", "MV_MIN"):
        limit, span = view.number(key), view.loop.output.range
        yield from outside_limits_findings(
            view, key, value=limit, limits=span, quote=view.mv_text, units=("high",), field="limit", operand=key
        )


@per_loop
@checklist("DP746", TABLE, "MV is 0 while PID_RUN is FALSE, which is outside its limits {low} to {high}")
def stop_outside_limits(view: LoopView) -> Findings:
    """A loop that is stopped writes an output that lies outside its limits.

    Why: with PID_RUN FALSE the instruction resets MV to 0 and does not look at the limits. Where 0 is not off, the
    actuator moves.

    Fix: see that 0 is safe. Otherwise switch the instruction's EN off to hold MV, or let the program write the
    output while the loop is stopped.
    """
    if view.limits is not None and not view.limits[0] <= 0 <= view.limits[1]:
        low, high = view.limits
        yield view.report("MV_MIN" if low > 0 else "MV_MAX", low=number_text(low), high=view.mv_text(high))
