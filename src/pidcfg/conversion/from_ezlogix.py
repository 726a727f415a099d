"""EZLogix loops as neutral ones, and what they do when they are switched."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.builder import (
    HUNDRED,
    ONE,
    ZERO,
    NeutralBuilder,
    Same,
    Span,
    apply_table,
    outputs_in_inner_units,
    product,
    quotient,
    round_computed,
    same_fields,
    width,
)
from pidcfg.conversion.operation import Hand, Operation, Stopped, Transfer, VendorSettings, Windup, Zero
from pidcfg.encoders.codecs import is_raw
from pidcfg.encoders.ezlogix.image import scales_of
from pidcfg.encoders.maps.ezlogix import R_BLOCK
from pidcfg.schemas.ezlogix import CV_FULL, REGISTERS
from pidcfg.schemas.numbers import EXACT_CONTEXT, plain_number
from pidcfg.text.paths import is_given
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.conversion.builder import Table
    from pidcfg.conversion.ledger import NeutralLoop
    from pidcfg.encoders.codecs import Scale
    from pidcfg.schemas.base import Quantity
    from pidcfg.schemas.ezlogix import EzlogixFile, Loop

# --- EZLogix loops as neutral ones: counts become engineering units, and the controller's action the process's --------

D289 = Decision(
    289,
    "gain 0 is a gain of one count per count without the proportional term",
    "Gain 0 becomes no proportional action, with one count of the CV per count of the PV before the other two; a loop "
    "without a proportional action gets gain 0, and its gain goes into the times.",
    "By the manual's text 0 removes the proportional term alone; its formula then leaves Ts/Ti and Td/Ts of an error "
    "in counts.",
)
D290 = Decision(
    290,
    "a CV tag that is a set point register is a cascade",
    "It becomes the source of that loop's set point, and a set point's source becomes the CV tag of the other loop, "
    "where both scales are 0 to 4095 counts. Without the square root in the loop that follows.",
    "Both are one register, in counts.",
)
RAISES = {"reverse": True, "direct": False}
"""Whether the PV rises with the output, by the word for the controller's action: reverse is heating."""
ACTS_ON = {"position": "error", "velocity": "pv"}
"""What the derivative acts on, by the algorithm."""
PER_CENT: Span = (ZERO, HUNDRED)
"""The output's range when the file gives none."""
FULL_COUNTS = Decimal(CV_FULL)
SETPOINT = R_BLOCK.offset("setpoint")
PLACE_REASON = "a place in this PLC, which means nothing elsewhere"
NOTHING_LOST = {
    **dict.fromkeys(("registers", "discretes", "pv.tag", "output.tag", "output.pulse.tag"), PLACE_REASON),
    "pv.counts": "values are engineering units",
    "pv.square_root": "off: the PV is taken as it is",
    "autotune.type": "as every loop has it: the default",
    "autotune.timeout": "as every loop has it: the default",
    "output.offset": "at the low end of the output it adds nothing",
    "plc.process_when_stopped": "see operation.stopped where the target does something else",
    "plc.tag_names": "names in this PLC's project",
    "plc.map": "where this PLC's registers are",
}
"""Fields that may come without a line of their own, and why nothing is lost with them."""


@dataclass(slots=True)
class ScaledLoop:
    """A loop with its scales in engineering units."""

    loop: Loop
    sp: Scale
    cv: Scale
    pv_range: Span
    cv_range: Span

    def setpoint(self, value: Quantity) -> Decimal:
        """A value on the PV's scale."""
        return position(value, self.sp, self.pv_range)

    def output(self, value: Quantity) -> Decimal:
        """A value on the output's scale."""
        return position(value, self.cv, self.cv_range)

    @property
    def unit_gain(self) -> Decimal:
        """Output units per PV unit that are one count of the CV per count of the PV."""
        counts = product(Decimal(self.sp.format.span), width(self.cv_range))
        return quotient(counts, product(FULL_COUNTS, width(self.pv_range)))


def position(value: Quantity, scale: Scale, span: Span) -> Decimal:
    """A value on a scale, in engineering units of ``span``."""
    if not is_raw(value, scale):
        return value.value
    share = quotient(product(value.value - scale.zero, width(span)), scale.full)
    return round_computed(EXACT_CONTEXT.add(span[0], share))


def distance(value: Quantity, scale: Scale, span: Span) -> Decimal:
    """A difference on a scale, in engineering units of ``span``."""
    if not is_raw(value, scale):
        return value.value
    return round_computed(quotient(product(value.value, width(span)), scale.full))


def to_neutral(config: EzlogixFile) -> list[NeutralLoop]:
    """The loops in neutral form, with what became of every field."""
    sources = {loop.output.tag: loop for loop in config.loops}
    loops = []
    for i, loop in enumerate(config.loops):
        b = NeutralBuilder(i)
        apply_table(b, loop, loop, HEAD)
        if loop.pv.range is None:
            low, high = loop.pv.counts or (0, CV_FULL)
            ends = f"the engineering values at {low} and {high} counts of the PV"
            b.require("pv.range", f"add pv.range: [low, high], {ends}")
        else:
            scales = scales_of(loop.pv, loop.output, root=loop.pv.square_root)
            s = ScaledLoop(loop, scales["sp"], scales["output"], loop.pv.range, loop.output.range or PER_CENT)
            apply_table(b, loop, s, FIELDS)
        outer = sources.get(f"{REGISTERS.prefix}{loop.registers + SETPOINT}")
        if outer is not None:
            _cascade(b, loop, outer)
        loops.append(b.loop)
    return outputs_in_inner_units(loops)


def _cascade(b: NeutralBuilder, loop: Loop, outer: Loop) -> None:
    """The set point register is another loop's CV tag (D290)."""
    tag = outer.output.tag
    if loop.pv.square_root or (loop.pv.counts or (0, CV_FULL)) != (0, CV_FULL):
        b.drop("registers", tag, f"{outer.name} writes its CV into the set point, in counts: program it with its scale")
        return
    b.put("registers", tag, "setpoint.source", outer.name, f"the CV tag of {outer.name} is the set point")
    if loop.mode == "auto":
        b.set("mode", "cascade")


def _gain(b: NeutralBuilder, s: ScaledLoop) -> None:
    tuning = s.loop.tuning
    gain = round_computed(product(tuning.proportional_gain or ONE, s.unit_gain))
    b.put("tuning.proportional_gain", tuning.proportional_gain, "tuning.gain", gain)
    if not tuning.proportional_gain:
        b.put(
            "tuning.proportional_gain",
            tuning.proportional_gain,
            "tuning.proportional",
            became=False,
            note="0 removes the proportional term; before the others stands 1 count per count",
        )


def _deadband(b: NeutralBuilder, s: ScaledLoop) -> None:
    b.put("deadband", _shown(s.loop.deadband), "deadband", distance(s.loop.deadband, s.sp, s.pv_range))


def _setpoint(b: NeutralBuilder, s: ScaledLoop) -> None:
    setpoint = s.loop.setpoint
    if setpoint.value is not None:
        b.put("setpoint.value", _shown(setpoint.value), "setpoint.value", s.setpoint(setpoint.value))
    if setpoint.limits is None:
        return
    shown, ends = [_shown(end) for end in setpoint.limits], [s.setpoint(end) for end in setpoint.limits]
    if ends[0] < ends[1]:
        b.put("setpoint.limits", shown, "setpoint.limits", ends)
    elif ends[0] == ends[1]:
        b.drop("setpoint.limits", shown, "both are one value: hold the set point in the program")
    else:
        b.require("setpoint.limits", f"the set point limits {shown[0]} and {shown[1]} do not ascend")


def _output(b: NeutralBuilder, s: ScaledLoop) -> None:
    output, span = s.loop.output, list(s.cv_range)
    if output.range is None:
        b.put("output.range", None, "output.range", span, "no output.range: 0 to 100 % is assumed", assumed=True)
    else:
        b.put("output.range", span, "output.range", span)
    unit = "%" if output.unit is None and output.range is None else output.unit
    if unit is not None:
        b.put("output.unit", output.unit, "output.unit", unit, assumed=output.unit is None)
    if is_given(s.loop, ("output", "limits")):
        shown, ends = [_shown(end) for end in output.limits], [s.output(end) for end in output.limits]
        if ends[0] >= ends[1]:
            b.require("output.limits", f"the CV limits {shown[0]} and {shown[1]} do not ascend")
        else:
            b.put("output.limits", shown, "output.limits", ends)
    offset = s.output(output.offset)
    if offset != span[0] or (span[0] and not s.loop.tuning.integral_time):
        b.put("output.offset", _shown(output.offset), "output.bias", offset)


def _autotune(b: NeutralBuilder, s: ScaledLoop) -> None:
    b.drop_choices("autotune", s.loop.autotune, "choose it when the new controller is tuned")


def _shown(value: Quantity) -> int | float | str:
    """A quantity as the file writes it."""
    return f"{value.value} counts" if value.counts else plain_number(value.value)


HEAD = (
    *same_fields("name", "description", "mode"),
    Same("action", "output_raises_pv", RAISES),
    Same("sample_rate", "sample_time"),
)
FIELDS: Table[NeutralBuilder, ScaledLoop] = (
    _gain,
    *same_fields("tuning.integral_time", "tuning.derivative_time"),
    Same("algorithm", "tuning.derivative_on", ACTS_ON),
    *same_fields("pv.range", "pv.unit"),
    Same("pv.square_root", skip_falsy=True),
    _deadband,
    _setpoint,
    _output,
    Same("output.pulse.cycle_time", "output.pulse.period"),
    *same_fields("output.pulse.min_on", "output.pulse.min_off", "anti_windup"),
    _autotune,
)
"""Every field in the order of the report."""

# --- EZLogix loops: the mode is a bit that stays; a change to auto makes the integral of the CV (PID Loop Mode) -------


def _pv_counts_options(config: EzlogixFile, source_places: Sequence[int]) -> dict[str, Any]:
    """How the PVs are counted."""
    return {"pv_counts": [config.loops[i].pv.counts or (0, CV_FULL) for i in source_places]}


OWN_SETTINGS = VendorSettings(
    ("registers", "discretes", "pv.tag", "output.tag", "output.pulse.tag"),
    {"/plc.process_when_stopped": ""},
    _pv_counts_options,
    hand=Hand.FREE,
    zero=Zero.OF_RANGE,
)
"""Its registers and tags, and whether its loops go on while the PLC is stopped, of which no option speaks."""


def operations(config: EzlogixFile) -> list[Operation]:
    """Of each loop (D165, D167, D170); anti-windup looks at 0 and 4095 counts, not at the CV limits."""
    asked = Stopped.GOES_ON if "process_when_stopped" in config.plc.model_fields_set else Stopped.AS_GIVEN
    stopped = asked if config.plc.process_when_stopped else Stopped.STANDS
    return [
        Operation(
            hand=OWN_SETTINGS.hand,
            zero=OWN_SETTINGS.zero,
            limits_master=True,
            transfer=Transfer.ON_TOP,
            windup=Windup.CONDITIONAL_AT_ENDS if loop.anti_windup else Windup.ENDLESS,
            smoothing=None,
            stopped=stopped,
        )
        for loop in config.loops
    ]
