"""DPIDE of the Delta AS (API 0708), from its manual and decisions D250 to D279."""

from __future__ import annotations

from reference.dpide_cases import random_case
from reference.dpide_loop import Loop, typed
from reference.single import F, real, shown

__all__ = ["COUNT", "FEATURES", "TOLERANCE", "random_case", "run"]

COUNT = 600
TOLERANCE = {}
"""Everything agrees to the bit."""
FEATURES = (
    "dependent",
    "independent",
    "derivative of PV",
    "derivative of E",
    "smoothed",
    "reverse",
    "mode 0 holds I_MV",
    "mode 2 works I_MV out",
    "no integral",
    "crossed the set point in the band",
    "left the band",
    "limits swapped",
    "manual",
    "MOUT follows",
    "manual to auto",
    "off",
    "cascade by a device",
    "shared device",
    "MOUT is MV",
    "interrupt task",
    "new CYCLE",
    "stopped",
    "coefficient below 0",
    "result that is no number",
)

SHORTEST, LONGEST = 1, 40_000
"""CYCLE in ms: what is beyond counts as the end (operand table)."""
FOLLOWING = ("SV", "BIAS", "MOUT")
"""Operands that may stand in the device of another loop's MV."""
MS = 1000
"""Microseconds."""


class Plc:
    """The loops, in the order of the file."""

    def __init__(self, configuration, reached):
        self.loops = [Loop(given, reached) for given in configuration["loops"]]
        self.interval = configuration.get("plc", {}).get("interrupt_task")
        self.reached = reached
        self.running = True
        self.start = 0
        """When the PLC began to run, in microseconds."""

    def period(self, loop):
        """The sampling time in microseconds: in an interrupt task its interval, else CYCLE."""
        return (self.interval or min(max(loop["CYCLE"], SHORTEST), LONGEST)) * MS

    # --- events -------------------------------------------------------------------------------------------------------

    def happen(self, event, now):
        """Carries out an event."""
        if "plc" in event:
            self.switch(event["plc"], now)
        elif "loop" in event and ("set" in event or "mode" in event):
            loop = next(loop for loop in self.loops if loop.name == event["loop"])
            for key, value in event.get("set", {}).items():
                self.write(loop, "MOUT" if key == "output" else key, value)
            if "mode" in event:
                self.request(loop, event["mode"])

    def switch(self, to, now):
        """The PLC stops, or runs again (D278)."""
        if to == "stop":
            self.running = False
        elif not self.running:
            self.running, self.start = True, now
            for loop in self.loops:
                loop.due = now
                loop.past = False
                loop.sign, loop.crossed = 0.0, False
        self.reached["stopped"] += to == "stop"

    def write(self, loop, operand, value):
        """Writes an operand and all others in its device (D266)."""
        value = typed(operand, value)
        device = loop.devices.get(operand)
        for other in self.loops:
            for name in other.operands:
                if (other is loop and name == operand) or (device and other.devices.get(name) == device):
                    self.reached["shared device"] += other is not loop or name != operand
                    other.operands[name] = value
            if other.mout_is_mv and other.mode_shown != "off":
                other.mv = other["MOUT"]
            elif other.mout_is_mv:
                other.operands["MOUT"] = other.mv
        self.reached["new CYCLE"] += operand == "CYCLE"

    def request(self, loop, mode):
        """Writes what makes a mode (D275)."""
        self.write(loop, "PID_RUN", mode != "off")
        if mode == "manual":
            self.write(loop, "PID_MAN", True)
        elif mode == "auto":
            self.write(loop, "PID_MAN", False)

    # --- calculations -------------------------------------------------------------------------------------------------

    def scan(self, now, measured):
        """A base step: what is due is calculated, in the order of the file."""
        for loop in self.loops if self.running else ():
            if not loop["PID_RUN"]:
                self.off(loop)
            if now < loop.due:
                continue
            period = self.period(loop)
            while loop.due <= now:
                loop.due += period
            loop.pv = real(measured[f"{loop.name}.PV"])
            if loop["PID_RUN"]:
                self.follow(loop)
                loop.calculate(F(period / 1e6))
        rows = {}
        for loop in self.loops:
            rows |= self.signals(loop)
        return rows

    def off(self, loop):
        """PID_RUN is FALSE: MV is 0, and all else stands still (D273)."""
        loop.set_mv(F(0))
        loop.mode_shown, loop.limited, loop.crossed, loop.sign = "off", False, False, 0.0
        loop.forget()
        self.reached["off"] += 1

    def follow(self, loop):
        """Operands in the device of another loop's MV take that MV (D266)."""
        for operand in FOLLOWING:
            device = loop.devices.get(operand)
            for other in self.loops:
                if device and other is not loop and other.devices.get("MV") == device:
                    loop.operands[operand] = other.mv
                    self.reached["cascade by a device"] += 1

    def signals(self, loop):
        """What the PLC shows."""
        values = {
            "PV": loop.pv,
            "SV": loop["SV"],
            "MV": loop.mv,
            "MOUT": loop["MOUT"],
            "I_MV": loop.i_mv,
            "E": loop.error,
        }
        flags = {"mode": loop.mode_shown, "mv_limited": loop.limited, "in_dead_band": loop.crossed}
        return {f"{loop.name}.{name}": shown(value) for name, value in values.items()} | {
            f"{loop.name}.{name}": value for name, value in flags.items()
        }


def run(configuration, scenario, inputs, reached):
    """The signals of each base step."""
    plc = Plc(configuration, reached)
    reached["interrupt task"] += plc.interval is not None
    rows = []
    for k, measured in enumerate(inputs.rows):
        for event in inputs.due(scenario, k):
            plc.happen(event, k * inputs.step)
        rows.append(plc.scan(k * inputs.step, measured))
    return rows
