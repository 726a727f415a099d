"""EZLogix: chapter 6 of its manual and the decisions D150 to D177, sample by sample."""

from __future__ import annotations

import math
from decimal import Decimal

from reference.engine import first_outputs
from reference.ezlogix_cases import FULL, SETPOINT, random_case
from reference.words import with_set, words, written

COUNT = 500
__all__ = ["COUNT", "FEATURES", "TOLERANCE", "random_case", "run"]

TOLERANCE = {"PV": 1e-12, "SP": 1e-12, "CV": 1e-12, "BIAS": 1e-9}
FEATURES = (
    "direct", "reverse", "position", "velocity", "square root", "deadband", "gain 0", "no integral", "no derivative",
    "anti-windup", "saturated", "CV limit", "SP limit", "manual", "auto", "manual to auto", "pulses", "short pulse",
    "short gap", "cascade", "stop", "goes on while stopped", "error beyond 32767",
)  # fmt: skip

SAMPLE_RATE, _, GAIN, RESET, RATE, DEADBAND, SP_LOW, SP_HIGH, CV_LOW, CV_HIGH, OFFSET = range(11)
CYCLE, MIN_ON, MIN_OFF = 14, 15, 16
MODE, ANTI_WINDUP, ROOT = 0, 1, 2


class Loop:
    """One loop: its registers, its dialog, and what it remembers."""

    def __init__(self, entry, memory, reached):
        self.name, self.memory, self.reached = entry["name"], memory, reached
        self.registers, self.discretes = int(entry["registers"][1:]), int(entry["discretes"][1:])
        self.direct = entry["action"] == "direct"
        self.velocity = entry["algorithm"] == "velocity"
        self.counts = entry["pv"].get("counts", [0, FULL])
        self.range = entry["pv"].get("range", self.counts)
        self.out_range = entry["output"].get("range", [0, FULL])
        self.pv_tag, self.cv_tag = entry["pv"]["tag"], entry["output"]["tag"]
        self.pulsed = "pulse" in entry["output"]
        self.drives = self.pulsed or self.cv_tag.startswith("OR")
        self.begin()
        self.pv = self.error = 0
        self.integral = self.last_error = self.last_value = 0.0
        self.at_low = self.at_high = False
        self.tag = memory if self.cv_tag in memory else {}
        """Where the CV stands: of a cascade in the inner loop's set point register (D177)."""
        self.cut, self.outer = False, None
        self.write_cv(self.tag.get(self.cv_tag, 0))
        self.bias = float(self.r(OFFSET))
        self.cycle_start, self.on_time, self.pulse = None, 0, 0

    def begin(self):
        """At the start, and when the PLC runs again: nothing is known of the past."""
        self.due, self.was_auto = 0, False

    def r(self, offset):
        return self.memory[f"R{self.registers + offset}"]

    def s(self, offset):
        return self.memory[f"S{self.discretes + offset}"]

    def write_setpoint(self, value):
        """Writes the register of the set point, which may be the outer loop's CV (D177)."""
        if value != self.r(SETPOINT):
            self.memory[f"R{self.registers + SETPOINT}"] = value
            if self.outer is not None:
                self.outer.write_cv(value)

    @property
    def cv(self):
        """The control variable."""
        return self.tag[self.cv_tag]

    def write_cv(self, counts):
        """Writes it, by whomever, and shows it unless nothing carries it on (D177, D672)."""
        self.tag[self.cv_tag] = counts
        if not self.cut:
            self.reaching = counts

    @property
    def setpoint(self):
        """The set point in force: the register within its limits (D656)."""
        return max(min(self.r(SETPOINT), self.r(SP_HIGH)), self.r(SP_LOW))

    # --- one sample --------------------------------------------------------------------------------------------------

    def sample(self, measured):
        """Measures, computes, and writes the CV."""
        low, high = self.counts
        if measured is not None:
            bottom, top = (Decimal(str(end)) for end in self.range)
            counts = (measured - float(bottom)) * (high - low) / float(top - bottom) + low  # D679
            self.pv = min(max(round(counts), low), high)
        self.reached["SP limit"] += self.setpoint != self.r(SETPOINT)
        self.write_setpoint(self.setpoint)
        sign = 1 if self.direct else -1
        root = self.s(ROOT)
        value = math.sqrt(self.pv) if root else self.pv
        scale = math.sqrt(high - low) if root else 1
        difference = sign * (value - self.r(SETPOINT))
        self.error = min(max(round(difference * scale), -32767), 32767)
        self.reached["error beyond 32767"] += abs(difference * scale) > 32767.5
        inside = abs(difference) < self.r(DEADBAND)
        error = 0.0 if inside else difference * scale
        value = value * scale
        if self.s(MODE):
            self.calculate(error, sign * value)
        else:
            self.was_auto = False
            self.reached["manual"] += 1
            self.at_low, self.at_high = self.cv == 0, self.cv == FULL
            self.write_cv(self.cv)
        self.saturated = self.cv in {0, FULL}
        self.bias = self.integral + self.r(OFFSET)
        for name, happened in (
            ("direct", self.direct), ("reverse", not self.direct), ("velocity", self.velocity),
            ("position", not self.velocity), ("square root", root), ("deadband", inside),
            ("gain 0", self.r(GAIN) == 0), ("no integral", self.r(RESET) == 0), ("no derivative", self.r(RATE) == 0),
        ):  # fmt: skip
            self.reached[name] += bool(happened and self.s(MODE))

    def calculate(self, error, value):
        """CV = Kp (E + Ts/Ti sum E + Td/Ts dE) + offset, or with the derivative of the PV (``value``, signed as E)."""
        ts = self.r(SAMPLE_RATE) / 100
        gain, reset, rate = self.r(GAIN) / 100, self.r(RESET) / 10, self.r(RATE) / 10
        factor = gain or 1.0
        if not self.was_auto:
            self.reached["manual to auto"] += 1
            self.integral = float(self.cv - self.r(OFFSET))
            self.last_error, self.last_value = error, value
            self.at_low, self.at_high = self.cv == 0, self.cv == FULL
        self.was_auto = True
        self.reached["auto"] += 1
        if reset:
            step = factor * ts / reset * error
            held = self.s(ANTI_WINDUP) and ((self.at_high and step > 0) or (self.at_low and step < 0))
            self.reached["anti-windup"] += bool(held)
            if not held:
                self.integral = min(max(self.integral + step, -(2.0**31)), 2.0**31 - 1)
        else:
            self.integral = 0.0
        change = value - self.last_value if self.velocity else error - self.last_error
        self.last_error, self.last_value = error, value
        result = gain * error + self.integral + factor * rate / ts * change + self.r(OFFSET)
        whole = round(min(max(result, 0), FULL))
        self.at_low, self.at_high = whole == 0, whole == FULL
        self.reached["saturated"] += whole in {0, FULL}
        high, low = min(self.r(CV_HIGH), FULL), min(self.r(CV_LOW), FULL)
        self.write_cv(max(min(whole, high), low))
        self.reached["CV limit"] += self.cv != whole

    # --- the control output ------------------------------------------------------------------------------------------

    def control_output(self, now, middle):
        """Whether the control output is on in the middle of a base step that begins at ``now``; times in s."""
        cycle = self.r(CYCLE) / 10
        if not cycle:
            return 0
        if self.cycle_start is None or middle >= self.cycle_start + cycle:
            self.cycle_start = now if self.cycle_start is None else self.cycle_start + cycle
            on = self.cv / 4096 * cycle
            if on == 0 or on < self.r(MIN_ON) / 10:
                self.reached["short pulse"] += on > 0
                on = 0.0
            elif cycle - on < self.r(MIN_OFF) / 10:
                self.reached["short gap"] += 1
                on = cycle
            self.on_time = on
        self.reached["pulses"] += 1
        return int(self.on_time > 0 and middle - self.cycle_start <= self.on_time)

    # --- what is shown -----------------------------------------------------------------------------------------------

    def shown(self):
        """The signals of the loop."""
        (low, high), (bottom, top) = self.counts, self.range
        sp = self.setpoint * self.setpoint if self.s(ROOT) else self.setpoint
        unit, out = (top - bottom) / (high - low), (self.out_range[1] - self.out_range[0]) / FULL
        signals = {
            "PV": bottom + (self.pv - low) * unit,
            "SP": bottom + (sp - low) * unit,
            "CV": self.out_range[0] + self.reaching * out,
            "ERROR": self.error,
            "BIAS": self.out_range[0] + self.bias * out,
            "mode": "auto" if self.was_auto else "manual",
            "saturation": self.saturated,
        }
        if self.pulsed:
            signals["O"] = self.pulse
        return {f"{self.name}.{name}": value for name, value in signals.items()}


def run(configuration, scenario, inputs, reached):
    """Every sample of a scenario."""
    memory = words(configuration)
    loops = {entry["name"]: Loop(entry, memory, reached) for entry in configuration["loops"]}
    for loop in loops.values():
        at = f"R{loop.registers + SETPOINT}"
        loop.outer = next((other for other in loops.values() if other.cv_tag == at), None)
    for name, value in first_outputs(scenario).items():
        loops[name].write_cv(in_counts(loops[name], value))
    stopped, samples = False, []
    goes_on = configuration.get("plc", {}).get("process_when_stopped", True)
    ticks = inputs.step // 10_000
    for row, measured in enumerate(inputs.rows):
        now = row * ticks
        for event in inputs.due(scenario, row):
            if event.get("plc") == "stop":
                stopped = True
                reached["stop"] += 1
            elif event.get("plc") == "run" and stopped:
                stopped = False
                if not goes_on:
                    for loop in loops.values():
                        loop.begin()
                        loop.due, loop.cycle_start = now, None
            elif "loop" in event:
                configuration = operate(configuration, loops[event["loop"]], event, memory)
            for loop in loops.values():
                loop.cut = stopped and not (goes_on and loop.drives)
        for loop in loops.values():
            if stopped and not goes_on:
                continue
            reached["goes on while stopped"] += stopped
            if loop.r(SAMPLE_RATE) < 5:
                continue
            if now >= loop.due:
                loop.due = now + loop.r(SAMPLE_RATE)
                still = stopped and loop.pv_tag.startswith("R")
                loop.sample(None if still else measured[f"{loop.name}.PV"])
                reached["cascade"] += loop.cv_tag in memory
            if loop.pulsed:
                seconds = inputs.step / 1e6
                loop.pulse = loop.control_output(row * seconds, (row + 0.5) * seconds if row else 0.0)
        samples.append({name: value for loop in loops.values() for name, value in loop.shown().items()})
    return samples


def in_counts(loop, value):
    low, high = loop.out_range
    return min(max(round((value - low) / (high - low) * FULL), 0), FULL)


def operate(configuration, loop, event, memory):
    """An event of the operator; the configuration as it is afterwards."""
    if "mode" in event:
        memory[f"S{loop.discretes + MODE}"] = int(event["mode"] == "auto")
    elif "output" in event.get("set", {}) and not isinstance(event["set"]["output"], dict):
        if not memory[f"S{loop.discretes + MODE}"]:
            loop.write_cv(in_counts(loop, event["set"]["output"]))
    elif "set" in event:
        changed = with_set(configuration, loop.name, event["set"])
        new = written(configuration, changed)
        at = f"R{loop.registers + SETPOINT}"
        new.pop(at, None)
        memory.update(new)
        if not isinstance(event["set"].get("setpoint", {}), dict):
            loop.write_setpoint(words(changed)[at])
        return changed
    return configuration
