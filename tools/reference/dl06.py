"""DL06: chapter 8 of its manual and decisions D30 to D68 and D643 to D683, sample by sample, from its loop table."""

from __future__ import annotations

from reference.dl06_cases import random_case
from reference.dl06_loop import CASCADE, MANUAL, MODES, Loop
from reference.engine import first_outputs
from reference.words import with_set, words, written

__all__ = ["COUNT", "FEATURES", "TOLERANCE", "random_case", "run"]

COUNT = 2000
TOLERANCE = {}
FEATURES = (
    "direct", "reverse", "position", "velocity", "squared", "deadband", "square root", "gain 0", "reset off",
    "derivative", "derivative limited", "derivative of the PV", "freeze", "bias at an end", "output limit", "PV filter",
    "SP limit", "bumpless I", "bumpless II", "manual", "auto", "cascade", "auto refused", "major stays in manual",
    "major to manual", "alarm programming error", "low-low", "low", "high", "high-high", "yellow", "red",
    "rate of change", "held by hysteresis", "alarm words read late", "output words read late", "program",
    "step bias", "12-bit unipolar", "12-bit bipolar", "15-bit unipolar", "15-bit bipolar", "16-bit unipolar",
    "output format", "reset in minutes", "ramp", "soak", "hold", "resume", "jog", "soak deviation", "profile complete",
    "overflow", "form changed", "independent", "tuned", "tuning refused", "tuning stopped", "tuning at the ends",
)  # fmt: skip


class Plc:
    """The loops of a table."""

    def __init__(self, configuration, scenario, reached):
        self.configuration, self.reached = configuration, reached
        self.memory = {int(address[1:], 8): value for address, value in words(configuration).items()}
        plc, options = configuration["plc"], scenario.get("plc", {})
        self.decimals = plc.get("reset_decimals", 1)
        self.on_pv = plc.get("derivative", "error") == "pv"
        self.interlock, self.step_bias = options.get("auto_interlock", True), options.get("step_bias", False)
        self.program = False
        self.loops = {}
        table = self.memory[0o7640]
        for i, entry in enumerate(configuration["loops"]):
            self.loops[entry["name"]] = Loop(self, entry, table + 0o40 * i)
        for name, value in first_outputs(scenario).items():
            self.loops[name].out = value

    def by_output(self, pointer, loop):
        """The loop whose output word a pointer names."""
        return next((x for x in self.loops.values() if x.words.table + 5 == pointer and x is not loop), None)

    def operate(self, event):
        loop = self.loops[event["loop"]]
        if self.program and not loop.independent and "set" not in event:
            loop.goal = None if "mode" in event else loop.goal
        elif "mode" in event:
            loop.wanted = MODES[event["mode"]]
        elif "autotune" in event:
            loop.tuning.request()
        elif "ramp_soak" in event:
            loop.profile.commands.add(event["ramp_soak"])
        elif "set" in event:
            self.write(loop, event["set"])

    def write(self, loop, changes):
        if "output" in changes and not isinstance(changes["output"], dict):
            loop.out = changes["output"]
            loop.m = float(loop.out)
        elif "bias" in changes:
            loop.bias = float(changes["bias"])
        else:
            old_mode = loop.words[0]
            changed = with_set(self.configuration, loop.name, changes)
            new = {int(a[1:], 8): v for a, v in written(self.configuration, changed).items()}
            self.memory.update(new)
            self.configuration = changed
            if "setpoint" in changes and not isinstance(changes["setpoint"], dict):
                loop.sp = float(loop.words.pv_word(2))
                loop.goal_setpoint = loop.words.pv_word(2)
            loop.written(old_mode)
            if (loop.words[0] ^ old_mode) >> 5 & 1:  # another form of the equation (D681)
                loop.past = None
                self.reached["form changed"] += 1
            for offset in new:
                late = offset - loop.words.table
                self.reached["alarm words read late"] += 0o13 <= late <= 0o22 and loop.words[0] == old_mode
                self.reached["output words read late"] += late in {0o30, 0o31, 0o25}
            if loop.mode != CASCADE:
                loop.shown_sp = loop.setpoint()


def run(configuration, scenario, inputs, reached):
    """Every sample of a scenario."""
    plc = Plc(configuration, scenario, reached)
    samples = []
    ticks = inputs.step // 10_000
    for row, measured in enumerate(inputs.rows):
        now = row * ticks
        for event in inputs.due(scenario, row):
            if event.get("plc") == "program":
                plc.program = True
                for loop in plc.loops.values():
                    loop.read_late_words()
                    if not loop.independent:
                        loop.prior = loop.mode if loop.mode != MANUAL else None
                    reached["independent" if loop.independent else "program"] += 1
                for loop in plc.loops.values():
                    if not loop.independent:
                        loop.to_manual()
                        loop.shown_sp = loop.setpoint()
            elif event.get("plc") == "run":
                plc.program = False
                for loop in plc.loops.values():
                    loop.read_all_words()
                    loop.due, loop.first = now, True
            elif "loop" in event:
                plc.operate(event)
        for loop in plc.loops.values():
            if now >= loop.due and (loop.independent or not plc.program):
                loop.due = now + loop.period()
                loop.sample(None if plc.program and not loop.sees_pv else measured[f"{loop.name}.PV"])
        samples.append({name: value for loop in plc.loops.values() for name, value in loop.shown().items()})
    return samples
