"""Rules for every vendor: gains and output limits that look as if they were meant for another scale."""

from __future__ import annotations

from decimal import Decimal
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeAlias

from pidcfg.schemas.base import Quantity
from pidcfg.schemas.numbers import EXACT_CONTEXT
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import value_at
from pidcfg.text.references import Decision
from pidcfg.validate.rule import Findings, finding, warning
from pidcfg.validate.rules.common import beyond_limits
from pidcfg.validate.shared_checks import number_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from pidcfg.encoders.image import Encoding
    from pidcfg.validate.shared_checks import Context

AnyContext: TypeAlias = "Context[Any, Encoding]"
Ends = tuple[Decimal, Decimal]

D953 = Decision(
    953,
    "a gain that acts like a switch",
    "A gain by which an error of 1.25 % of the PV's range or less drives the output through its whole range is a "
    "warning. CLICK has a rule of its own at 1 % of the process range (D134).",
    "The words of a DL06 and an EZLogix end at 99.99, so that no gain of theirs reaches 1 %; who types 9999 means an "
    "end of the word, not a proportional band of 1 %.",
)
D954 = Decision(
    954,
    "output limits that equal the PV's range",
    "Limits of the output that are the two numbers of the PV's range, on another scale of which they leave less than "
    "half, are a warning.",
    "A public problem: a CLICK with a PV of 0 to 6 had CO limits of 0 and 6 % and did nothing in Auto "
    "(industrialmonitordirect.com, click-plc-pid-scaling-fixing-0-6-range-vs-0-100-output). Limits that leave half of "
    "the output or more may equal a range by chance.",
)
CV_FULL = 4095
"""Counts of an EZLogix's control value at 100 %."""
LEAST = Decimal("0.01")
SWITCH = Decimal("0.0125")
"""Of the PV's range: the error that is driven through the whole output."""

# --- Where each vendor has its scales, and what an error makes of the output ------------------------------------------


def _pair(loop: Any, *keys: str) -> Ends | None:
    """Two numbers under one key or two; None where they are not given, are counts, or an expression."""
    held = [value_at(loop, key.split(".")) for key in keys]
    ends = [
        end.value if isinstance(end, Quantity) and not end.counts else end
        for end in (held[0] if len(keys) == 1 else held) or ()
    ]
    return (ends[0], ends[1]) if len(ends) == 2 and all(isinstance(end, Decimal) for end in ends) else None


@frozen
class Scales:
    """The keys of a vendor: of the gain, the PV's range, the output's limits and its range."""

    gain: str
    pv: tuple[str, ...] = ("pv.range",)
    limits: tuple[str, ...] = ("output.limits",)
    plain: Callable[[Any], bool] = lambda _: True
    """Whether the proportional term is the gain times the error."""
    whole: Ends | None = None
    """The output's range, where it is the same for all loops."""

    def output(self, loop: Any) -> Ends | None:
        """What 0 % and 100 % of the output are; None: the file does not say."""
        return self.whole or _pair(loop, "output.range")

    def share(self, loop: Any) -> Decimal | None:
        """Output ranges that an error of the whole PV range makes; None: the file does not say, or not by a gain."""
        gain, pv, output = (
            value_at(loop, self.gain.split(".")),
            _pair(loop, *self.pv),
            self.output(loop) or _pair(loop, *self.limits),
        )
        if (
            not isinstance(gain, Decimal)
            or pv is None
            or output is None
            or output[0] == output[1]
            or not self.plain(loop)
        ):
            return None
        return abs(EXACT_CONTEXT.divide(EXACT_CONTEXT.multiply(gain, pv[1] - pv[0]), output[1] - output[0]))


class Shares(Scales):
    """Those of a DL06, whose gain is ranges per range, whatever the units are."""

    def share(self, loop: Any) -> Decimal | None:
        """The gain itself."""
        return Decimal(value_at(loop, self.gain.split("."))) if self.plain(loop) else None


class Counts(Scales):
    """Those of an EZLogix, whose gain is in counts of the CV per count of the PV."""

    def share(self, loop: Any) -> Decimal | None:
        """The gain times the PV's counts, as a share of the CV's."""
        low, high = loop.pv.counts or (0, CV_FULL)
        gain: Decimal = loop.tuning.proportional_gain
        return gain * (high - low) / CV_FULL if self.plain(loop) else None


SCALES: Mapping[str, Scales] = {
    "dl06": Shares("tuning.gain", plain=lambda loop: loop.error.curve == "linear"),
    "click": Scales("", whole=(Decimal(0), Decimal(100))),
    "ezlogix": Counts("tuning.proportional_gain", plain=lambda loop: not loop.pv.square_root),
    "nextopid": Scales(
        "Kp", ("MinPV", "MaxPV"), ("MinMV", "MaxMV"), lambda loop: loop.DisableP is False or loop.Indep is True
    ),
    "dpide": Scales("Kc_Kp", limits=("MV_MIN", "MV_MAX")),
    "generic": Scales("tuning.gain", plain=lambda loop: loop.tuning.proportional and not loop.pv.square_root),
}


def _loops(context: AnyContext) -> Iterator[tuple[int, Any, Scales]]:
    """The loops with gains, their places and keys; of a NextoPID what its parameters hold in the first scan."""
    scales = SCALES[context.config.vendor]
    key = scales.limits[0].partition(".")[0]
    for i, loop in enumerate(context.config.loops):
        if hasattr(loop, key):
            view = next((view for view in getattr(context, "pids", ()) if view.item is loop), None)
            yield i, loop if view is None else _first_values(view, scales), scales


def _first_values(view: Any, scales: Scales) -> Any:
    """A NextoPID loop with the numbers that its wires and expressions have when the program starts."""
    numbers = {key: view.number_of(key) for key in (scales.gain, *scales.pv, *scales.limits)}
    output = value_at(view.item, ("output",))
    return SimpleNamespace(**numbers, DisableP=view.is_on("DisableP"), Indep=view.is_on("Indep"), output=output)


@warning("PID111", D953, "{field} {gain}: an error of {error} % of the PV's range drives the output from end to end")
def gain_like_a_switch(context: AnyContext) -> Findings:
    """The gain is so high that the smallest error saturates the output.

    Why: sensors and converters are hardly better than 1 % of their range. The output is at one end or the other, as
    that of a thermostat, and what the noise of the PV makes of it wears the actuator out.

    Fix: lower the gain: 100 / gain is the proportional band in % where both ranges are alike. See that it was not
    carried over from a PLC that counts it in other units, and that 9999 was not typed for 1.00.
    """
    misfits = {path[:2] for path, _ in context.encoding.misfits}
    refused = {path for path, _, _ in beyond_limits(context.config, ())} | context.explained
    for i, loop, scales in _loops(context):
        keys = scales.gain.split(".")
        share = scales.share(loop) if scales.gain else None
        if (
            share is not None
            and share * SWITCH >= 1
            and ("loops", i, *keys) not in refused
            and ("loops", i) not in misfits
        ):
            gain = number_text(value_at(loop, keys))
            yield finding("loops", i, *keys, field=keys[-1], gain=gain, error=_percent(100 / share))


def _percent(value: Decimal) -> str:
    """A small number of percent, without an exponent."""
    return "less than 0.01" if value < LEAST else f"{float(value):.3g}"


@warning("PID112", D954, "the output stays between {low} and {high}, the two numbers of the PV's range, of {scale}")
def output_limits_are_the_pv_range(context: AnyContext) -> Findings:
    """The limits of the output are the two numbers of the PV's range, and leave less than half of the output.

    Why: limits are on the output's scale. A loop with a PV of 0 to 6 bar and an output of 0 to 100 % that may give 0 to
    6 % does as good as nothing in Auto, though Manual moves the actuator.

    Fix: write the limits in the unit of the output, such as 0 to 100 %.
    """
    for i, loop, scales in _loops(context):
        limits, pv, output = _pair(loop, *scales.limits), _pair(loop, *scales.pv), scales.output(loop)
        if limits is None or output is None or limits != pv or limits[0] >= limits[1]:
            continue
        if 2 * (limits[1] - limits[0]) < output[1] - output[0]:
            texts = [number_text(end) for end in (*limits, *output)]
            path = scales.limits[-1].split(".")
            yield finding("loops", i, *path, low=texts[0], high=texts[1], scale=f"{texts[2]} to {texts[3]}")
