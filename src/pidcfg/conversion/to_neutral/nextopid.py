"""NextoPID configurations as neutral loops: what the blocks are set to, and what of the network has a twin."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.conversion.arithmetic import ZERO, dependent, product, quotient
from pidcfg.conversion.builder import Teller
from pidcfg.conversion.to_neutral.nextopid_loop import Reader
from pidcfg.conversion.to_neutral.nextopid_network import blocks_and_signals
from pidcfg.conversion.to_neutral.nextopid_wires import Network
from pidcfg.schemas.nextopid import SHORTEST_INTEGRAL, PidaReal

if TYPE_CHECKING:
    from pidcfg.conversion.ledger import Neutral
    from pidcfg.schemas.nextopid import NextopidFile

NOTHING_LOST = {
    "type": "the neutral form has one kind of PID; field units of an INT block are those of its MinPV and MaxPV",
    "PV": "the process's; what calculates it is reported",
    "SP_CASC": "0 while cascade mode is off and nothing gives it",
    "TRK_VAL": "reported where TRK_IN or OVERR can be on",
    "TRK_IN": "connections of a cascade go with it; others are reported",
    "Windup_H_IN": "connections of a cascade go with it; others are reported",
    "Windup_L_IN": "connections of a cascade go with it; others are reported",
    "OVERR": "reported when it can be on",
    "AutoTune": "reported when it can be on",
    "DerivEr": "of no effect without a derivative",
}
"""Fields that may come without a line in the report, and why."""
HELD = "while the error is smaller, MV is held here"
NEEDED = {
    "Direct": "the direction",
    "Indep": "the form",
    "DisableP": "the proportional term",
    "Kp": "the gain",
    "Ti_Ki": "the integral term",
    "Td_Kd": "the derivative term",
    "MinMV": "the limits of the output",
    "MaxMV": "the limits of the output",
    "MinPV": "the scale of the PV",
    "MaxPV": "the scale of the PV",
}
"""What a loop cannot be converted without."""


def to_neutral(config: NextopidFile) -> list[Neutral]:
    """The neutral loops of a configuration."""
    network = Network(config)
    tellers = [Controller(network, i, Teller(("loops", i - network.first_loop))).told() for i in network.loops]
    if not any(teller.neutral.missing for teller in tellers):
        blocks_and_signals(network, tellers)
    return [teller.neutral for teller in tellers]


class Controller(Reader):
    """The parameters of a PID block."""

    def told(self) -> Teller:
        """The neutral loop, and what became of each parameter."""
        if not isinstance(self.item, PidaReal) or not self._complete():
            self._refuse()
            return self.t
        t, item = self.t, self.item
        t.keep("name", item.name, "name", item.name)
        if item.description is not None:
            t.keep("description", item.description, "description", item.description)
        time = item.sample_time
        where = "plc.sample_time" if time is None else "sample_time"
        self.time = self.network.config.plc.sample_time if time is None else time
        t.keep(where, self.time, "sample_time", self.time)
        self.keep("Direct", "output_raises_pv", not self.is_on("Direct"))
        self._equation()
        self._pv()
        self._modes()
        self._output()
        if self.given("DeadBand"):
            self.number_or_lost("DeadBand", "deadband", "hold MV in the program while the error is small", said=HELD)
        self._special()
        return t

    def _complete(self) -> bool:
        known = all(self.of(key).value is not None for key in NEEDED)
        return known and all(
            self.of(low).value < self.of(high).value for low, high in (("MinPV", "MaxPV"), ("MinMV", "MaxMV"))
        )

    def _refuse(self) -> None:
        name = self.item.name
        if not isinstance(self.item, PidaReal):
            message = f"{name} switches on and off, which is no PID: move it from loops to blocks, and it is left out"
            self.t.miss("type", message)
            return
        for key, what in NEEDED.items():
            own = self.of(key)
            if own.value is None:
                message = f"{key} of {name} is wired to {own.wire}, and nobody knows its value: write {what} itself"
                self.t.miss(key, message)
        if not self.t.neutral.missing:
            self.t.miss("MaxPV", f"{name}: write MinPV below MaxPV, and MinMV below MaxMV")

    def _equation(self) -> None:
        t, indep, acts = self.t, self.is_on("Indep"), not self.is_on("DisableP")
        gain, integral, derivative = (max(self.of(key).value, ZERO) for key in ("Kp", "Ti_Ki", "Td_Kd"))
        note = ""
        if indep:
            gain, integral, derivative, acts = dependent(gain, integral, derivative)
        elif integral < SHORTEST_INTEGRAL:
            note = "below 0.001 s: no integral" if integral else ""
            integral = ZERO
        tuning = {
            "gain": gain,
            "integral_time": integral,
            "derivative_time": derivative,
            "proportional": acts,
            "derivative_on": "error" if self.is_on("DerivEr") else "pv",
        }
        t.neutral.loop["tuning"] = tuning
        self.say("Kp", "tuning.gain", *(("tuning.proportional",) if indep else ()))
        self.say("Ti_Ki", "tuning.integral_time", note=note)
        self.say("Td_Kd", "tuning.derivative_time")
        if self.given("Indep"):
            self.say("Indep", "tuning.gain")
        if self.given("DisableP"):
            self.say("DisableP", "tuning.proportional", note="of no effect with Indep TRUE" if indep else "")
        if derivative:
            self.say("DerivEr", "tuning.derivative_on")
        if self.given("Tfd"):
            self.number_or_lost("Tfd", "tuning.derivative_filter", "filter the derivative in the program")

    def _pv(self) -> None:
        t, pv = self.t, self.item.pv
        t.neutral.loop["pv"] = {"range": [self.of("MinPV").value, self.of("MaxPV").value]}
        self.say("MinPV", "pv.range.0")
        self.say("MaxPV", "pv.range.1")
        if pv.unit is not None:
            t.keep("pv.unit", pv.unit, "pv.unit", pv.unit)
        own, source = self.network.twins[self.number], self.network.source(self.number, "PV")
        if own.low_filter is not None:
            time = self.network.value(own.low_filter, "Tc")
            place = f"blocks.{self.network.items[own.low_filter].item.name}.Tc"
            t.keep(place, time.wire or time.value, "pv.filter", time.value, assumed=bool(time.wire))
            behind = self.network.source(own.low_filter, "InVar")
            expression = self.network.value(own.low_filter, "InVar").wire
            if expression and not self._plain(behind):
                t.lose(f"{place.removesuffix('Tc')}InVar", expression, f"work the PV out in the program: {expression}")
        elif self.of("PV").wire and not self._plain(source):
            self.lose("PV", "work it out in the program and give it to the controller")

    def _plain(self, source: str) -> bool:
        """Whether a name is a signal, or what another loop reads as its PV."""
        return source in self.network.config.signals or source.endswith(".PV")

    def _modes(self) -> None:
        """Mode and set point."""
        t, own, casc = self.t, self.network.twins[self.number], self.is_on("CASC")
        held = self.is_on("TRK_IN")
        manual = self.is_on("Manual") or held
        linked = own.master is not None
        t.neutral.loop["mode"] = "manual" if manual else "cascade" if casc and linked else "auto"
        t.neutral.loop.setdefault("setpoint", {})
        self.switch("Manual", "mode")
        self.switch("CASC", "mode" if linked else "setpoint.value", "manual comes first" if manual else "")
        if own.master is not None:
            master = self.network.items[own.master].item.name
            t.keep("SP_CASC", self.of("SP_CASC").wire, "setpoint.source", master)
        elif casc and self._plain_or_literal("SP_CASC"):
            self.keep("SP_CASC", "setpoint.value", self.of("SP_CASC").value)
            self.lose("SP", "cascade mode is on, so SP_CASC is the set point: switch between the two in the program")
            return
        elif casc:
            self.lose("SP_CASC", "the set point while CASC is TRUE: work it out in the program")
        elif self.given("SP_CASC"):
            self.lose("SP_CASC", "a second set point, in force while CASC is TRUE: switch it in the program")
        if self.of("SP").value is None:
            self.lose("SP", "work out the set point in the program")
        else:
            self.keep("SP", "setpoint.value", self.of("SP").value)

    def _plain_or_literal(self, key: str) -> bool:
        """Whether a parameter is a number, or a signal that stands for one."""
        wired = bool(self.of(key).wire)
        return not wired or self.network.source(self.number, key) in self.network.config.signals

    def _output(self) -> None:
        t, item, own = self.t, self.item, self.network.twins[self.number]
        low, high = self.of("MinMV").value, self.of("MaxMV").value
        self.t.neutral.loop["output"] = {"limits": [low, high]}
        self.say("MinMV", "output.limits.0")
        self.say("MaxMV", "output.limits.1")
        given = item.output.range
        scale = own.scale or given or (low, high)
        if given is not None and list(scale) == list(given):
            t.keep("output.range", list(given), "output.range", list(given))
        else:
            note = "no output.range is given: MinMV and MaxMV are taken for 0 % and 100 %"
            if own.scale is not None:
                note = f"0 % and 100 % of {own.reader}"
            t.keep(
                "output.range", None if given is None else list(given), "output.range", list(scale), note, assumed=True
            )
        if item.output.unit is not None:
            t.keep("output.unit", item.output.unit, "output.unit", item.output.unit)
        if own.pwm is not None:
            place, period = (
                f"blocks.{self.network.items[own.pwm].item.name}.Period",
                self.network.value(own.pwm, "Period"),
            )
            time = product(Decimal(period.value), self.network.config.plc.sample_time)
            t.keep(place, period.wire or period.value, "output.pulse.period", time, assumed=bool(period.wire))
        self._terms()

    def _terms(self) -> None:
        """What else makes the output."""
        if self.of("BIAS").wire and self.network.wires[self.number, "BIAS"].signals:
            self.lose("BIAS", "a feed-forward: add it to the output in the program")
        elif self.given("BIAS"):
            self.keep("BIAS", "output.bias", self.of("BIAS").value)
        if self.is_on("TRK_IN") and self.of("TRK_VAL").value is not None:
            self.t.neutral.loop["output"]["manual"] = self.of("TRK_VAL").value
            if self.given("ManualMV"):
                self.lose("ManualMV", "TRK_IN is on, so TRK_VAL is the output: write it in the program")
        elif self.of("ManualMV").value is None:
            self.lose("ManualMV", "work out the output in manual in the program")
        elif self.given("ManualMV") or self.is_on("Manual"):
            self.keep("ManualMV", "output.manual", self.of("ManualMV").value)
        if self.given("MaxVarMV"):
            self.number_or_lost(
                "MaxVarMV",
                "output.max_rate",
                "limit the change of MV in the program",
                quotient(Decimal(1), self.time),
                "per cycle here",
            )

    def _special(self) -> None:
        """Connections of cascades and overrides, and the auto-tuning."""
        own = {self.network.items[j].item.name for j in self.network.twins[self.number].slaves}
        cascade = {f"{name}.{key}" for name in own for key in ("TRK_OUT", "Windup_H_OUT", "Windup_L_OUT")}
        tracks = self.network.source(self.number, "TRK_IN") in cascade
        for key in ("TRK_IN", "Windup_H_IN", "Windup_L_IN", "OVERR"):
            if self.given(key) and self.network.source(self.number, key) not in cascade:
                self.lose(key, SPECIAL[key])
        if self.given("TRK_VAL") and not tracks and (self.given("TRK_IN") or self.given("OVERR")):
            self.lose("TRK_VAL", "where the output comes from meanwhile")
        if getattr(self.item, "AutoTune", False):
            self.lose("AutoTune", "start the auto-tuning as the target does it")
        if getattr(self.item, "AutoTuneParam", None) is not None:
            for key, value in self.item.AutoTuneParam.model_dump().items():
                self.t.lose(f"AutoTuneParam.{key}", value, "set up the auto-tuning of the target")


SPECIAL = {
    "TRK_IN": "put the loop into manual in the program, with TRK_VAL as its output",
    "Windup_H_IN": "hold the integral in the program",
    "Windup_L_IN": "hold the integral in the program",
    "OVERR": "select between the controllers in the program, and let the other one's integral follow",
}
"""What to program in place of a connection."""
