"""A program of Altus NextoPID: signals, blocks, loops, wires and moves; D200 to D247, D550 and D551."""

from __future__ import annotations

from reference import nextopid_blocks, nextopid_pid
from reference.nextopid_cases import random_case
from reference.nextopid_pid import Pid
from reference.nextopid_tune import FLAGS
from reference.nextopid_wires import NoValueError, names, read, value
from reference.single import F, shown

__all__ = ["COUNT", "FEATURES", "TOLERANCE", "random_case", "run"]

COUNT = 700
TOLERANCE = {}
FEATURES = (
    *("dependent", "independent", "P disabled", "direct", "derivative of PV", "derivative of the error"),
    *("derivative filtered", "dead band", "manual", "tracking", "cascade", "overridden", "windup input"),
    *("increment cut", "rise limited", "fall limited", "PV or set point limited", "error bit", "INT block"),
    *("auto-tuning", "tuned", "accepted", *(flag for flag in FLAGS if flag != "Bad_Mode")),
    *("ControlLowFilter in error", "ControlDelay in error", "ControlLag in error", "ControlDelayLag in error"),
    *("ControlLeadLag in error", "ControlPWM in error", "ControlON_OFF in error", "ControlSplitRange in error"),
    *("delay changed", "lag limited", "lead/lag limited", "lead/lag disabled", "pulses limited", "on-off in manual"),
    *("ControlSelectMax MV1", "ControlSelectMax MV2", "ControlSelectMin MV1", "ControlSelectMin MV2"),
    *(f"split range {mode}" for mode in range(1, 5)),
    *("ring", "slower loop", "move at start", "move at end", "wire without a value", "INT at its end", "TIME"),
)

MAIN = {"MV", "IntegralAction", "OutVar", "PWM", "MV1", "MV2"}
"""Outputs that are shown of every block; others are to be moved to signals."""
AUTOTUNE_MODES = {"P": 0, "PI": 1, "PID": 2}
NOT_PARAMETERS = ("name", "type", "description", "sample_time", "pv", "output")
INT_ENDS = -32768, 32767


def to_int(number, ends=INT_ENDS):
    """The nearest whole number of the range (D206)."""
    low, high = ends
    return F(min(max(round(float(F(number))), low), high))


class Item:
    """A block or a loop with its wires."""

    def __init__(self, given, task, reached):
        self.name, self.kind = given["name"], given["type"]
        self.every = round(given.get("sample_time", task) / task)
        ts = F(given.get("sample_time", task))
        pid = self.kind.startswith("PIDA")
        self.block = Pid(self.kind, ts, reached) if pid else nextopid_blocks.KINDS[self.kind](ts, reached)
        self.whole = set(nextopid_pid.WHOLE) if pid and "INT" in self.kind else set()
        self.wires = {}
        for key, content in flat(given):
            self.give(key, content)

    def give(self, key, content):
        """A parameter as the file has it: a value, or the expression of a wire."""
        if key.endswith(".Mode") and content in AUTOTUNE_MODES:
            content = AUTOTUNE_MODES[content]
        if isinstance(content, str):
            self.wires[key] = read(content)
        else:
            self.assign(key, content)

    def assign(self, key, content):
        """A parameter gets a value."""
        if isinstance(self.block.p[key], bool):
            self.block.p[key] = bool(content)
        elif key in self.whole:
            self.block.p[key] = to_int(content)
        elif key.endswith("NumCycles") or (key in {"Mode", "Period"}):
            self.block.p[key] = to_int(content, (0, 65535))
        else:
            self.block.p[key] = F(content)

    def get(self, key):
        """A parameter or an output."""
        return self.block.out[key] if key in self.block.out else self.block.p[key]

    def reads(self):
        """The names that its wires read."""
        return set().union(*(names(tree) for tree in self.wires.values()))


def flat(given):
    """The parameters of a block, those of its structure by their whole name."""
    for key, content in given.items():
        if isinstance(content, dict) and key not in NOT_PARAMETERS:
            yield from ((f"{key}.{member}", part) for member, part in content.items())
        elif key not in NOT_PARAMETERS:
            yield key, content


def in_order(blocks, loops, reached):
    """Blocks and loops in the order of execution (D204)."""
    left = [*blocks, *loops]
    waits = {
        item.name: {name.partition(".")[0] for name in item.reads()} & {other.name for other in left} - {item.name}
        for item in left
    }
    done = []

    def open_to(item, seen):
        """Everything that an item waits for, directly or through others."""
        for name in waits[item] - seen - {i.name for i in done}:
            seen.add(name)
            open_to(name, seen)
        return seen

    while left:
        free = [item for item in left if not open_to(item.name, set())]
        if not free:
            reached["ring"] += 1
            rings = [i for i in left if all(i.name in open_to(name, set()) for name in open_to(i.name, set()))]
            free = [item for item in rings if item in loops] or rings
            # of the first ring only
        item = free[0]
        left.remove(item)
        done.append(item)
    return done


class Program:
    """The program in its cyclic task."""

    def __init__(self, configuration, reached):
        task = configuration["plc"]["sample_time"]
        self.reached = reached
        self.signals, self.kinds = {}, {}
        for name, first in configuration.get("signals", {}).items():
            self.kinds[name], self.signals[name] = signal(first)
            reached["TIME"] += self.kinds[name] == "TIME"
        blocks = [Item(given, task, reached) for given in configuration.get("blocks", ())]
        self.loops = [Item(given, task, reached) for given in configuration["loops"]]
        self.order = in_order(blocks, self.loops, reached)
        self.items = {item.name: item for item in self.order}
        self.from_outside = [item for item in self.loops if "PV" not in dict(flat_of(configuration, item.name))]
        self.moves = [
            (move.get("at", "end"), read(move["move"]), move["to"], read(move.get("when", True)))
            for move in configuration.get("moves", ())
        ]
        reached["INT block"] += sum(bool(item.whole) for item in self.loops)
        reached["slower loop"] += sum(item.every > 1 for item in self.loops)

    def lookup(self, name):
        """The value of a name now."""
        if name in self.signals:
            return self.signals[name]
        item, _, key = name.partition(".")
        return self.items[item].get(key)

    def write(self, name, content):
        """A signal, or a parameter of a block, gets a value."""
        if name not in self.signals:
            item, _, key = name.partition(".")
            self.items[item].assign(key, content)
        elif self.kinds[name] == "BOOL":
            self.signals[name] = bool(content)
        else:
            self.signals[name] = to_int(content) if self.kinds[name] == "INT" else F(content)

    # --- a cycle ------------------------------------------------------------------------------------------------------

    def happen(self, event):
        """Carries out an event."""
        if "loop" not in event:
            for name, content in event.get("set", {}).items():
                self.write(name, content)
            return
        item = self.items[event["loop"]]
        for key, content in event.get("set", {}).items():
            item.assign("ManualMV" if key == "output" else key, content)
        mode = event.get("mode")
        if mode in {"manual", "auto", "cascade"}:
            item.assign("Manual", mode == "manual")
            if mode != "manual" and "CASC" in item.block.p:
                item.assign("CASC", mode == "cascade")
        if "autotune" in event:
            self.tune(item, event["autotune"])

    def tune(self, item, command):
        """AutoTune is set or reset; ``accept`` copies the gains before (figure 4-6)."""
        out = item.block.out
        if command == "accept":
            if not out["AutoTuneDone"] or out["AutoTuneError"]:
                return
            for name in ("Kp", "Ti_Ki", "Td_Kd"):
                item.assign(name, out[f"AutoTuneResult.{name}"])
            self.reached["accepted"] += 1
        item.assign("AutoTune", command == "start")

    def cycle(self, number, measured):
        """A cycle of the task: moves at the start, the calls, moves at the end (D551)."""
        for item in self.from_outside:
            item.assign("PV", measured[f"{item.name}.PV"])
        self.move("start")
        for item in self.order:
            if number % item.every == 0:
                for key, tree in item.wires.items():
                    self.follow(item, key, tree)
                item.block.call()
        self.move("end")
        return self.shown(number)

    def follow(self, item, key, tree):
        """A wire renews its parameter (D206)."""
        try:
            content = value(tree, self.lookup)
        except NoValueError:
            self.reached["wire without a value"] += 1
            return
        if key in item.whole:
            self.reached["INT at its end"] += not INT_ENDS[0] <= float(content) <= INT_ENDS[1]
        item.assign(key, content)

    def move(self, place):
        """The moves of a place, in the order of the file."""
        for at, tree, target, when in self.moves:
            if at != place:
                continue
            try:
                if value(when, self.lookup):
                    self.write(target, value(tree, self.lookup))
                    self.reached[f"move at {place}"] += 1
            except NoValueError:
                self.reached["wire without a value"] += 1

    def shown(self, number):
        """What the PLC shows; the PV and the set point of a loop that was not called are those of its next call."""
        rows = {name: float(content) for name, content in self.signals.items()}
        for item in self.items.values():
            for key in MAIN & item.block.out.keys():
                rows[f"{item.name}.{key}"] = float(item.block.out[key])
        for item in self.loops:
            if number % item.every == 0:
                rows[f"{item.name}.SP"] = shown(item.block.sp)
                rows[f"{item.name}.PV"] = shown(item.block.p["PV"])
            rows[f"{item.name}.mode"] = item.block.mode
        return rows


def flat_of(configuration, name):
    """The parameters of a loop as the file has them."""
    return next(flat(given) for given in configuration["loops"] if given["name"] == name)


def signal(first):
    """The type of a signal and its first value; a TIME counts in seconds."""
    if isinstance(first, bool):
        return "BOOL", first
    if isinstance(first, str) and first.startswith("INT#"):
        return "INT", F(int(first[4:]))
    if isinstance(first, str):
        number, unit = first.split()
        return "TIME", F(float(number) * {"ms": 0.001, "s": 1, "min": 60}[unit])
    return "REAL", F(first)


def run(configuration, scenario, inputs, reached):
    """The signals of each base step, which is one cycle of the task or several in which nothing is called."""
    program = Program(configuration, reached)
    task = configuration["plc"]["sample_time"]
    rows = []
    for k, measured in enumerate(inputs.rows):
        for event in inputs.due(scenario, k):
            program.happen(event)
        rows.append(program.cycle(round(k * inputs.step / 1e6 / task), measured))
    return rows
