"""CLICK: help topic CL246 and the decisions D110 to D128, sample by sample, every result in single precision."""

from __future__ import annotations

from ctypes import c_float

from reference.click_cases import random_case
from reference.click_tune import Tuning
from reference.engine import first_outputs
from reference.words import with_set, words, written

__all__ = ["COUNT", "FEATURES", "TOLERANCE", "random_case", "run"]

COUNT = 500
TOLERANCE = {}
FEATURES = (
    "direct", "reverse", "squared", "deadband", "derivative", "derivative filtered", "derivative limit 0",
    "derivative limit 100", "freeze", "bias at a limit", "CO limit", "PV filter", "SP limit", "bumpless 1",
    "bumpless 2", "manual", "auto", "error 23", "error 30", "pv_low_low", "pv_low", "pv_high",
    "pv_high_high", "deviation_high", "deviation_high_high", "rate_of_change", "held by hysteresis", "pulses", "stop",
    "tuned", "tuning refused", "tuning stopped", "tuning cancelled",
)  # fmt: skip

SP_LOW_ON, SP_HIGH_ON, SQUARED, BAND_ON, LIMIT_ON, FREEZE, BUMPLESS_2, REVERSE = 0, 1, 2, 3, 4, 5, 8, 9
FILTER_ON, ALARMS_ON, DEVIATION_ON, RATE_ON = 11, 12, 13, 14
RATE, GAIN_LIMIT, PERIOD, FILTER = 5, 6, 7, 8
SP, SP_LOW, SP_HIGH, BAND, BIAS, P, RESET, D, CO, CO_LOW, CO_HIGH, RAW, PV = range(13)
LOW_LOW, LOW, HIGH, HIGH_HIGH, DEVIATION, DEVIATION_2, CHANGE, HYSTERESIS, TUNE = range(13, 22)
DEVIATIONS = {"deviation_high": DEVIATION, "deviation_high_high": DEVIATION_2}


def f(value):
    """A number in single precision."""
    return c_float(value).value


class Loop:
    """One loop: its registers and what it remembers."""

    def __init__(self, entry, memory, reached):
        self.name, self.memory, self.reached = entry["name"], memory, reached
        self.places = {bank: int(entry[key][len(bank) :]) for bank, key in BANKS.items()}
        self.pulsed = "pwm" in entry.get("output", {})
        self.goal = entry.get("mode", "manual")
        self.goal_setpoint = self.df(SP) if "value" in entry.get("setpoint", {}) else None
        self.begin(0)
        self.shown_pv = self.df(PV)
        self.setpoint = self.df(SP)
        self.period_start, self.on_time, self.pulse = None, 0.0, 0
        self.alarms = dict.fromkeys(ALARMS, False)
        self.wanted, self.tune = None, False
        self.tuning = Tuning(self)

    def begin(self, now):
        """The change from STOP to RUN."""
        self.due, self.auto, self.first, self.reached_goal = now, False, True, False
        self.period_start = None
        self.error = self.slope = 0.0
        self.fresh = False

    def co(self):
        return self.df(CO)

    def write_co(self, value):
        self.write(CO, value)

    def reverse(self):
        return bool(self.c(REVERSE))

    def c(self, offset):
        return self.memory[f"C{self.places['C'] + offset}"]

    def ds(self, offset):
        return self.memory[f"DS{self.places['DS'] + offset}"]

    def df(self, offset):
        return f(self.memory[f"DF{self.places['DF'] + offset}"])

    def write(self, offset, value):
        self.memory[f"DF{self.places['DF'] + offset}"] = value

    def number(self):
        """The lowest active error."""
        checks = (
            (10, not 100 <= self.ds(RATE) <= 30000),
            (11, not 0 <= self.ds(GAIN_LIMIT) <= 100),
            (12, not 1 <= self.ds(PERIOD) <= 600),
            (13, not 1 <= self.ds(FILTER) <= 100),
            (23, self.c(SP_LOW_ON) and self.c(SP_HIGH_ON) and self.df(SP_LOW) > self.df(SP_HIGH)),
            (26, not f(0.01) <= self.df(P) <= 10000),
            (27, not f(0.01) <= self.df(RESET) <= 6000),
            (28, not 0 <= self.df(D) <= 6000),
            (30, self.df(CO_LOW) < 0),
            (200, not 1 <= self.df(TUNE) <= 10),
        )
        return next((number for number, active in checks if active), 0)

    # --- one sample --------------------------------------------------------------------------------------------------

    def sample(self, measured):
        """Measures, looks for errors and requests, computes, and looks at the alarms."""
        raw = f(measured)
        before = self.df(PV)
        if self.c(FILTER_ON) and not self.first:
            share = f(min(max(self.ds(FILTER), 1), 100) / 100)
            self.write(PV, f(before + f(share * f(raw - before))))
            self.reached["PV filter"] += 1
        else:
            self.write(PV, raw)
        self.write(RAW, raw)
        self.write_goal()
        error_number = self.number()
        if error_number:
            self.reached[f"error {error_number}"] += 1
            self.tuning.stop()
            self.auto = False
        self.requests(error_number)
        self.limit_setpoint()
        if self.tuning.on:
            self.tuning.sample(self.df(SP), self.df(PV))
        if self.auto:
            self.calculate()
        self.reached["auto" if self.auto else "manual"] += 1
        self.look_at_alarms(before)
        self.first = False

    def write_goal(self):
        """The configured set point, one sample after the configured mode was reached (D45)."""
        if self.reached_goal:
            if self.goal_setpoint is not None:
                self.write(SP, self.goal_setpoint)
            self.reached_goal, self.goal_setpoint = False, None

    def requests(self, error_number):
        """A mode that was requested, and the configured one until it was reached."""
        wanted, self.wanted = self.wanted or self.goal, None
        if wanted == "manual":
            self.tuning.stop()
            self.auto = False
        elif wanted == "auto" and self.tuning.on:
            pass
        elif wanted == "auto" and error_number:
            self.reached["auto refused"] += 1
            return
        elif wanted == "auto" and not self.auto:
            self.auto = True
            self.write(BIAS, self.df(CO))
            if not self.c(BUMPLESS_2):
                self.write(SP, self.df(PV))
            self.reached["bumpless 2" if self.c(BUMPLESS_2) else "bumpless 1"] += 1
            self.limit_setpoint()
            self.error, self.slope = self.counted_error(), 0.0
        if wanted is not None and wanted == self.goal:
            self.goal, self.reached_goal = None, True
        if self.tune:
            self.tuning.begin()
        self.tune = False

    def limit_setpoint(self):
        """An enabled limit overwrites the set point; of crossed limits the low one wins (D126)."""
        before = self.df(SP)
        if self.c(SP_HIGH_ON) and self.df(SP) > self.df(SP_HIGH):
            self.write(SP, self.df(SP_HIGH))
        if self.c(SP_LOW_ON) and self.df(SP) < self.df(SP_LOW):
            self.write(SP, self.df(SP_LOW))
        self.reached["SP limit"] += self.df(SP) != before

    def counted_error(self):
        """SP - PV, squared with its sign."""
        error = f(self.df(SP) - self.df(PV))
        return f(error * abs(error)) if self.c(SQUARED) else error

    def calculate(self):
        """CO = bias + Kp (e + Td/Ts de), after bias := bias + Kp Ts/Ti e."""
        ts = f(min(max(self.ds(RATE), 100), 30000) / 1000)
        kp = -self.df(P) if self.c(REVERSE) else self.df(P)
        low, high = self.df(CO_LOW), self.df(CO_HIGH)
        error = self.counted_error()
        if self.fresh:
            self.fresh, self.error, self.slope = False, error, 0.0
        change, self.error = f(error - self.error), error
        if self.c(BAND_ON) and self.df(BAND) > 0 and abs(error) <= self.df(BAND):
            self.reached["deadband"] += 1
            self.slope = 0.0
            self.integrate(0.0, low, high)
            result = self.df(BIAS)
        else:
            slope = self.derivative(change, ts)
            self.integrate(f(f(kp * f(ts / self.df(RESET))) * error), low, high)
            result = f(self.df(BIAS) + f(kp * f(error + f(f(self.df(D) / ts) * slope))))
        limited = max(min(result, high), low)
        self.reached["CO limit"] += limited != result
        self.write(CO, limited)
        self.reached["reverse" if self.c(REVERSE) else "direct"] += 1
        self.reached["squared"] += self.c(SQUARED)

    def derivative(self, change, ts):
        """The change of the error through the derivative gain limit (D114)."""
        limit = self.ds(GAIN_LIMIT)
        self.reached["derivative"] += self.df(D) > 0
        if not self.c(LIMIT_ON) or limit == 100:
            self.slope = change
            self.reached["derivative limit 100"] += bool(self.c(LIMIT_ON))
        elif limit == 0:
            self.slope = change
            self.reached["derivative limit 0"] += 1
            return 0.0
        else:
            share = f(ts / f(ts + f(self.df(D) / f(limit))))
            self.slope = f(self.slope + f(share * f(change - self.slope)))
            self.reached["derivative filtered"] += 1
        return self.slope

    def integrate(self, step, low, high):
        """The bias, within the limits of the output; with freeze not while the output was at one of them (D112)."""
        frozen = self.c(FREEZE) and not low < self.df(CO) < high
        self.reached["freeze"] += frozen
        bias = self.df(BIAS) if frozen else f(self.df(BIAS) + step)
        self.write(BIAS, max(min(bias, high), low))
        self.reached["bias at a limit"] += self.df(BIAS) != bias

    def look_at_alarms(self, before):
        """Alarms of the PV, of its deviation, and of its change in a sample."""
        pv, band = self.df(PV), self.df(HYSTERESIS)
        for name, (offset, rises) in PV_ALARMS.items():
            limit = self.df(offset)
            beyond = pv > limit if rises else pv < limit
            back = f(limit - pv if rises else pv - limit) >= band
            self.switch(name, ALARMS_ON, beyond=beyond, back=back)
        away = abs(f(self.df(SP) - pv))
        for name, offset in DEVIATIONS.items():
            limit = self.df(offset)
            self.switch(name, DEVIATION_ON, beyond=away > limit, back=f(limit - away) >= band)
        fast = not self.first and abs(f(pv - before)) > self.df(CHANGE)
        self.switch("rate_of_change", RATE_ON, beyond=fast, back=not fast)

    def switch(self, name, enable, *, beyond, back):
        """An alarm goes on beyond its limit and off when the PV is back by the hysteresis."""
        held = self.alarms[name] and not beyond and not back
        self.alarms[name] = bool(self.c(enable) and (beyond or held))
        self.reached["held by hysteresis"] += bool(held and self.c(enable))
        self.reached[name] += self.alarms[name]

    # --- pulses ------------------------------------------------------------------------------------------------------

    def pwm(self, now, middle):
        """Whether the pulse is on in the middle of a base step that begins at ``now``; times in microseconds."""
        period = min(max(self.ds(PERIOD), 1), 600) * 1_000_000
        if self.period_start is None or middle >= self.period_start + period:
            self.period_start = now if self.period_start is None else self.period_start + period
            self.on_time = min(max(self.df(CO) / 100, 0.0), 1.0) * period
        self.reached["pulses"] += 1
        return int(middle - self.period_start < self.on_time)

    def shown(self, *, stopped):
        """The signals of the loop."""
        signals = {
            "PV": self.df(PV),
            "SP": self.df(SP),
            "CO": 0.0 if stopped else self.df(CO),
            "BIAS": self.df(BIAS),
            "ERROR": self.number(),
            "mode": "autotune" if self.tuning.on else "auto" if self.auto else "manual",
            **self.alarms,
        }
        if self.pulsed:
            signals["PWM"] = 0 if stopped else self.pulse
        return {f"{self.name}.{name}": value for name, value in signals.items()}


BANKS = {"C": "bits", "DS": "integers", "DF": "floats"}
PV_ALARMS = {
    "pv_low_low": (LOW_LOW, False), "pv_low": (LOW, False), "pv_high": (HIGH, True), "pv_high_high": (HIGH_HIGH, True)
}  # fmt: skip
ALARMS = (*PV_ALARMS, *DEVIATIONS, "rate_of_change")


def run(configuration, scenario, inputs, reached):
    """Every sample of a scenario."""
    memory = words(configuration)
    loops = {entry["name"]: Loop(entry, memory, reached) for entry in configuration["loops"]}
    for name, value in first_outputs(scenario).items():
        loops[name].write(CO, f(value))
    stopped, samples = False, []
    for row, measured in enumerate(inputs.rows):
        now = row * inputs.step
        for event in inputs.due(scenario, row):
            if event.get("plc") == "stop":
                stopped = True
                reached["stop"] += 1
                for loop in loops.values():
                    loop.tuning.stop()
                    loop.auto, loop.goal, loop.wanted, loop.reached_goal = False, None, None, False
            elif event.get("plc") == "run" and stopped:
                stopped = False
                for loop in loops.values():
                    loop.begin(now)
            elif event.get("autotune") == "start":
                loops[event["loop"]].tune = not stopped
            elif event.get("autotune") == "cancel":
                loops[event["loop"]].tune = False
                loops[event["loop"]].tuning.cancel()
            elif "loop" in event and ("mode" not in event or not stopped):
                configuration = operate(configuration, loops[event["loop"]], event, memory)
        for loop in loops.values():
            if stopped:
                continue
            if now >= loop.due:
                loop.due = now + min(max(loop.ds(RATE), 100), 30000) * 1000
                loop.sample(measured[f"{loop.name}.PV"])
            if loop.pulsed:
                loop.pulse = loop.pwm(now, now + inputs.step // 2 if row else 0)
        samples.append({name: value for loop in loops.values() for name, value in loop.shown(stopped=stopped).items()})
    return samples


def operate(configuration, loop, event, memory):
    """An event of the operator; the configuration as it is afterwards."""
    if "mode" in event:
        loop.wanted = event["mode"]
        loop.reached_goal = False
        if loop.goal is not None:
            loop.goal = event["mode"]
    elif "set" in event:
        changes = event["set"]
        if "output" in changes and not isinstance(changes["output"], dict):
            if not loop.auto:
                loop.write(CO, f(changes["output"]))
        elif "bias" in changes:
            loop.write(BIAS, f(changes["bias"]))
        else:
            changed = with_set(configuration, loop.name, changes)
            memory.update(written(configuration, changed))
            if changes.get("setpoint", None) is not None and not isinstance(changes["setpoint"], dict):
                loop.write(SP, f(changes["setpoint"]))
                if loop.goal is not None or loop.reached_goal:
                    loop.goal_setpoint = f(changes["setpoint"])
            for names, enable in ((PV_ALARMS, ALARMS_ON), (DEVIATIONS, DEVIATION_ON), (("rate_of_change",), RATE_ON)):
                loop.alarms |= {name: False for name in names if not loop.c(enable)}
            loop.auto = loop.auto and not loop.number()
            return changed
    return configuration
