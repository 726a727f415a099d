"""What the DPIDE rules look at; terms that are off, the derivative, the dead band, and the direction."""

from __future__ import annotations

from decimal import Decimal
from functools import cached_property

from pidcfg.encoders.codecs import EncodeError
from pidcfg.encoders.maps.dpide import D255, LOOPS, REMARKS, TABLE
from pidcfg.encoders.parameters import Content, ProgramEncoding, store_content
from pidcfg.schemas.dpide import MAX_CYCLE, MIN_CYCLE, DpideFile, Loop
from pidcfg.schemas.iec import TimeNumber
from pidcfg.text.diagnostics import Severity
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Path
from pidcfg.text.references import DPIDE, Decision
from pidcfg.validate.rule import Findings, checklist, error, info, per_loop, warning
from pidcfg.validate.shared_checks import Context, View, number_text, number_with_unit


@frozen
class LoopView(View[Loop]):
    """A loop, its place in the file, and what its operands hold."""

    interrupt_task: int | None

    @cached_property
    def contents(self) -> dict[str, Content]:
        """Content by operand; one that its value does not fit is missing (another rule reports it)."""
        contents: dict[str, Content] = {}
        for row, value in LOOPS.values_of(self.loop):
            try:
                contents[row.name] = store_content(row.type, value)
            except EncodeError:
                continue
        return contents

    def operand_values(self, *operands: str) -> list[Decimal]:
        """The numbers of several operands; empty as soon as one does not fit."""
        values = [Decimal(repr(self.contents[name])) for name in operands if name in self.contents]
        return values if len(values) == len(operands) else []

    def number(self, operand: str) -> Decimal | None:
        """The number of an operand; None where it does not fit."""
        return next(iter(self.operand_values(operand)), None)

    def coefficient(self, operand: str) -> Decimal:
        """A coefficient as the PLC uses it: below 0 it counts as 0."""
        return max(Decimal(0), self.number(operand) or Decimal(0))

    @cached_property
    def cycle(self) -> Decimal:
        """The sampling time in s that the PLC uses."""
        ms = self.interrupt_task or min(max(self.loop.CYCLE, MIN_CYCLE), MAX_CYCLE)
        return Decimal(ms) / 1000

    @cached_property
    def times(self) -> tuple[Decimal, Decimal] | None:
        """Integral and derivative time in s in either form, 0 for a term that is off; None without a gain."""
        gain, integral, derivative = (self.coefficient(name) for name in ("Kc_Kp", "Ti_Ki", "Td_Kd"))
        if self.loop.PID_EQ:
            return integral, derivative
        if not gain:
            return None
        return (gain / integral if integral else Decimal(0)), derivative / gain

    @cached_property
    def limits(self) -> tuple[Decimal, Decimal] | None:
        """Lowest and highest MV, in order as the PLC uses them; None where they do not fit or leave no room."""
        limits = sorted(self.operand_values("MV_MIN", "MV_MAX"))
        return (limits[0], limits[1]) if limits and limits[0] < limits[1] else None

    def gives(self, key: str) -> bool:
        """Whether the file has this key."""
        return key in self.loop.model_fields_set

    def has_device(self, operand: str) -> bool:
        """Whether the operand has a device, so that its value is only the first one."""
        return operand in self.loop.devices.by_operand()

    @property
    def mout_is_mv(self) -> bool:
        """Whether MOUT stands in the device of the loop's own MV, so that both are one value."""
        return self.has_device("MV") and self.loop.devices.MOUT == self.loop.devices.MV

    def pv_text(self, value: Decimal) -> str:
        """A number of the PV with its unit."""
        return number_with_unit(value, self.loop.pv.unit)

    def mv_text(self, value: Decimal) -> str:
        """A number of the output with its unit."""
        return number_with_unit(value, self.loop.output.unit)


@frozen
class DpideContext(Context[DpideFile, ProgramEncoding]):
    """A configuration with its encoding, and its loops one by one."""

    @cached_property
    def loops(self) -> tuple[LoopView, ...]:
        """The loops in the order of the file."""
        return tuple(LoopView(i, loop, self.config.plc.interrupt_task) for i, loop in enumerate(self.config.loops))

    @property
    def explained_paths(self) -> frozenset[Path]:
        """Places that a rule of DPIDE's own explains better: a direction that is not given."""
        return frozenset(("loops", view.index, "PID_DIR") for view in self.loops if not view.gives("PID_DIR"))


# --- Coefficients: terms that are off, and numbers that belong to the other form --------------------------------------

FORMULAS = DPIDE.cite("The PID algorithm")
DIAGRAM = DPIDE.cite("PID Block Diagram")
COEFFICIENTS = ("Kc_Kp", "Ti_Ki", "Td_Kd", "Tf")
EFFECTS = {
    "Kc_Kp": "no proportional term",
    "Ti_Ki": "no integral term",
    "Td_Kd": "no derivative term",
    "Tf": "no smoothing",
}


def has_all_terms_zero(view: LoopView) -> bool:
    """Whether the dependent form multiplies everything by 0."""
    return view.loop.PID_EQ and bool(view.operand_values("Kc_Kp")) and not view.coefficient("Kc_Kp")


def has_no_term(view: LoopView) -> bool:
    """Whether all gains of the independent form are 0."""
    fits = bool(view.operand_values("Kc_Kp", "Ti_Ki", "Td_Kd"))
    return not view.loop.PID_EQ and fits and not any(view.coefficient(name) for name in COEFFICIENTS[:3])


def tunes_itself(view: LoopView) -> bool:
    """Whether the autotune replaces the coefficients before they are used."""
    return view.loop.PID_MODE == 1


@per_loop
@error("DP711", DIAGRAM, "Kc_Kp is {gain}, which counts as 0 and switches off all three terms of the dependent form")
def dead_controller(view: LoopView) -> Findings:
    """The gain of the dependent form is 0 or below.

    Why: Kc multiplies the integral and the derivative too (PID_EQ TRUE). MV is BIAS and nothing else, whatever the PV
    does.

    Fix: write a gain above 0. For an integral alone take the independent form (PID_EQ FALSE), where the gains are free
    of each other. For cooling write `PID_DIR: false`, not a negative gain.
    """
    if has_all_terms_zero(view) and not tunes_itself(view):
        yield view.report("Kc_Kp", gain=number_text(view.loop.Kc_Kp))


@per_loop
@error("DP712", DIAGRAM, "Kc_Kp, Ti_Ki and Td_Kd all count as 0: MV is BIAS alone")
def no_term(view: LoopView) -> Findings:
    """All three gains of the independent form are 0 or below.

    Why: there is no control; the PV has no effect on MV.

    Fix: write gains above 0. For cooling write `PID_DIR: false`, not negative gains.
    """
    if has_no_term(view) and not tunes_itself(view):
        yield view.report("Kc_Kp")


@per_loop
@warning("DP713", TABLE, "{operand} is {value}, which counts as 0: {effect}")
def negative_coefficient(view: LoopView) -> Findings:
    """A coefficient is below 0.

    Why: the PLC takes it as 0. It does not turn the direction round.

    Fix: write 0 or a number above it. For cooling write `PID_DIR: false`.
    """
    for name in COEFFICIENTS:
        value = getattr(view.loop, name)
        if value < 0 and not (name == "Kc_Kp" and (has_all_terms_zero(view) or has_no_term(view))):
            yield view.report(name, operand=name, value=number_text(value), effect=EFFECTS[name])


@per_loop
@checklist("DP714", TABLE, "Ti_Ki is 0: without an integral the PV stays beside SV, unless BIAS is just right")
def no_integral(view: LoopView) -> Findings:
    """There is no integral term.

    Why: MV is BIAS where PV is SV; any other load needs an error that stays.

    Fix: see that a steady error is acceptable. Otherwise write Ti or Ki.
    """
    if view.operand_values("Ti_Ki") == [0] and not (
        has_all_terms_zero(view) or has_no_term(view) or tunes_itself(view)
    ):
        yield view.report("Ti_Ki")


@per_loop
@error("DP715", TABLE, "{operand} has a unit of time, but with PID_EQ FALSE it is {gain}")
def time_as_a_gain(view: LoopView) -> Findings:
    """A time stands where the independent form wants a gain.

    Why: an integral time of 180 s would become a gain of 180 per second: the integral runs from one end to the other
    within a cycle. A derivative time of 20 s becomes a gain Kd of 20, whatever Kp is; since the manual gives Td_Kd in s
    for both forms, that is a warning alone.

    Fix: write `PID_EQ: true`, or the gain as a bare number: Ki is Kp divided by the integral time in s, Kd is Kp times
    the derivative time in s.
    """
    if view.loop.PID_EQ:
        return
    if isinstance(view.loop.Ti_Ki, TimeNumber):
        yield view.report("Ti_Ki", operand="Ti_Ki", gain="the gain Ki in 1/s")
    if isinstance(view.loop.Td_Kd, TimeNumber):
        gain = "the gain Kd: Kp times the derivative time in s"
        yield view.report("Td_Kd", severity=Severity.WARNING, operand="Td_Kd", gain=gain)


@per_loop
@warning(
    "DP716", FORMULAS, "the integral time is {time} s, shorter than the sampling time of {cycle} s: was {other} meant?"
)
def integral_faster_than_cycle(view: LoopView) -> Findings:
    """The integral acts faster than the instruction is calculated.

    Why: in each cycle the integral adds more than the whole proportional term, and the loop swings between its limits.
    Mostly Ti and Ki were mixed up: Ti_Ki is a time in s with PID_EQ TRUE, and a gain in 1/s with PID_EQ FALSE, where
    the time is Kp divided by Ki.

    Fix: check PID_EQ, then write Ti or Ki.
    """
    if view.times is None or (isinstance(view.loop.Ti_Ki, TimeNumber) and not view.loop.PID_EQ):
        return
    time = view.times[0]
    if 0 < time < view.cycle:
        other = "a gain Ki (PID_EQ FALSE)" if view.loop.PID_EQ else "a time Ti (PID_EQ TRUE)"
        yield view.report("Ti_Ki", time=number_text(time), cycle=number_text(view.cycle), other=other)


@per_loop
@checklist("DP717", TABLE, "Kc_Kp is {gain}: the independent form works without a proportional term")
def no_proportional(view: LoopView) -> Findings:
    """There is no proportional term, but another one.

    Why: an integral alone is slow, and swings with most processes.

    Fix: see that no proportional term is meant. Otherwise write Kp.
    """
    alone = not view.loop.PID_EQ and view.operand_values("Kc_Kp") == [0] and not has_no_term(view)
    if alone and not tunes_itself(view):
        yield view.report("Kc_Kp", gain=number_text(view.loop.Kc_Kp))


# --- The derivative: what it makes of noise and of a new set point ----------------------------------------------------

D260 = Decision(
    260,
    "a derivative of more than 20 cycles needs smoothing",
    "Without Tf, a derivative time of more than 20 sampling times is a warning.",
    "A step of the PV of one unit is then a step of the output of more than 20 times the proportional gain for one "
    "cycle; controllers that limit the derivative limit it to 8 to 20 times.",
)
MAX_DERIVATIVE_RATIO = Decimal(20)


def derivative_of(view: LoopView) -> Decimal:
    """The coefficient of the derivative as it acts: 0 also where the whole controller is dead."""
    return Decimal(0) if has_all_terms_zero(view) or tunes_itself(view) else view.coefficient("Td_Kd")


@per_loop
@warning(
    "DP721",
    D260,
    "the derivative time of {time} s is {ratio} sampling times of {cycle} s and Tf is 0: noise of the PV is "
    "multiplied by that",
)
def derivative_unsmoothed(view: LoopView) -> Findings:
    """A large derivative without smoothing at a short cycle.

    Why: the derivative divides the change from cycle to cycle by the sampling time. One digit of noise becomes a large
    pulse of MV.

    Fix: write Tf, a tenth to a fifth of the derivative time; or lengthen CYCLE.
    """
    if view.times is None or tunes_itself(view) or view.coefficient("Tf"):
        return
    ratio = view.times[1] / view.cycle
    if ratio > MAX_DERIVATIVE_RATIO:
        yield view.report(
            "Td_Kd", time=number_text(view.times[1]), ratio=number_text(ratio), cycle=number_text(view.cycle)
        )


@per_loop
@warning("DP722", FORMULAS, "the derivative time of {derivative} s is longer than the integral time of {integral} s")
def derivative_above_integral(view: LoopView) -> Findings:
    """The derivative time is longer than the integral time.

    Why: such a loop swings; by the usual rules the derivative time is a quarter of the integral time. Mostly the two
    were exchanged, or a gain was written where a time is wanted. In the independent form the times are Kp/Ki and Kd/Kp.

    Fix: exchange them, or check PID_EQ.
    """
    integral, derivative = view.times or (Decimal(0), Decimal(0))
    if 0 < integral < derivative and not tunes_itself(view):
        yield view.report("Td_Kd", derivative=number_text(derivative), integral=number_text(integral))


@per_loop
@warning(
    "DP723", TABLE, "Tf of {tf} s is longer than the derivative time of {time} s: little of the derivative is left"
)
def derivative_smoothed_away(view: LoopView) -> Findings:
    """The smoothing is slower than the derivative.

    Why: the derivative comes so late that it damps nothing; the loop behaves as without it.

    Fix: write Tf as a tenth to a fifth of the derivative time.
    """
    time, smoothing = (view.times or (Decimal(0), Decimal(0)))[1], view.coefficient("Tf")
    if 0 < time < smoothing and not tunes_itself(view):
        yield view.report("Tf", tf=number_text(smoothing), time=number_text(time))


@per_loop
@info("DP724", TABLE, "Tf has no effect: there is no derivative to smooth")
def smoothing_without_derivative(view: LoopView) -> Findings:
    """Tf is given without a derivative.

    Why: it smooths the derivative only, not the PV.

    Fix: leave it out; filter the PV in the program if it is noisy.
    """
    if (
        view.coefficient("Tf")
        and view.operand_values("Td_Kd")
        and not view.coefficient("Td_Kd")
        and not tunes_itself(view)
    ):
        yield view.report("Tf")


@per_loop
@info("DP725", FORMULAS, "PID_DE FALSE: the derivative is of the error, so a new SV kicks MV")
def set_point_kick(view: LoopView) -> Findings:
    """The derivative follows the set point.

    Why: with PID_DE FALSE a step of SV is a step of the error; its derivative is a pulse of MV of the gain times the
    derivative time divided by the sampling time.

    Fix: write `PID_DE: true`, unless SV only ever moves slowly.
    """
    if not view.loop.PID_DE and derivative_of(view):
        yield view.report("PID_DE") if view.gives("PID_DE") else view.report("Td_Kd")


# --- The dead band with zero crossing ---------------------------------------------------------------------------------


@per_loop
@info("DP761", TABLE, "ERR_DBW is {value}; its absolute value counts")
def negative_dead_band(view: LoopView) -> Findings:
    """The dead band is below 0.

    Why: the PLC takes the absolute value, so it is not switched off.

    Fix: write 0 to switch it off, else the number without its sign.
    """
    if view.loop.ERR_DBW < 0:
        yield view.report("ERR_DBW", value=number_text(view.loop.ERR_DBW))


@per_loop
@warning(
    "DP762",
    REMARKS,
    "ERR_DBW {value} around SV covers the PV's whole range {low} to {high}: after the first crossing of SV the "
    "error counts as 0 for ever",
)
def dead_band_covers_range(view: LoopView) -> Findings:
    """The PV cannot leave the dead band.

    Why: once the PV has crossed SV, the error counts as 0 until the PV is out of the band. If the whole range lies
    inside, the loop never controls again.

    Fix: write a band that is small against the range; mind the unit.
    """
    span, values = view.loop.pv.range, view.operand_values("ERR_DBW", "SV")
    if span is not None and values and abs(values[0]) >= max(values[1] - span[0], span[1] - values[1]):
        yield view.report(
            "ERR_DBW", value=number_text(abs(values[0])), low=number_text(span[0]), high=view.pv_text(span[1])
        )


@per_loop
@checklist("DP763", REMARKS, "when PV leaves the dead band of {value}, the error jumps from 0 to that, and {effect}")
def dead_band_kick(view: LoopView) -> Findings:
    """A dead band makes the output jump at its edge.

    Why: inside the band the error counts as 0 after PV has crossed SV. At its edge the full error comes back within one
    cycle, and MV jumps by the band times the gain. The previous error was 0, so a derivative of the error is a pulse.

    Fix: see that the actuator bears it. Otherwise write a smaller band, and `PID_DE: true` for the derivative.
    """
    if any(view.operand_values("ERR_DBW")):
        kicks = not view.loop.PID_DE and derivative_of(view) > 0
        effect = "the derivative kicks MV" if kicks else "MV jumps with it"
        yield view.report("ERR_DBW", value=view.pv_text(abs(view.operand_values("ERR_DBW")[0])), effect=effect)


# --- Direction and form: choices that decide everything, and that nothing else tells ----------------------------------

DEFAULT_TEXTS = {
    "PID_DIR": ("FALSE: E = PV - SV, MV rises while PV is above SV, as for cooling", "heating needs TRUE"),
    "PID_EQ": ("FALSE: Ti_Ki is a gain in 1/s", "an integral time needs TRUE"),
}


@per_loop
@warning("DP781", D255, "{operand} is not given, so it is {meaning}; {other}")
def choice_not_given(view: LoopView) -> Findings:
    """The direction, or the form of the equation, is left to its default.

    Why: the wrong direction is a heater that runs away; with the wrong form an integral time counts as a gain. Neither
    can be seen in any other operand.

    Fix: write PID_DIR and PID_EQ, also where they are false.
    """
    for operand, (meaning, other) in DEFAULT_TEXTS.items():
        if not view.gives(operand):
            yield view.report(operand, operand=operand, meaning=meaning, other=other)
