"""Scenarios on a controller that is easy to compute by hand: proportional, without counts, words or limits."""

from __future__ import annotations

import io
from dataclasses import dataclass, field

from pidcfg.schemas.base import Quantity
from pidcfg.schemas.numbers import parse_number
from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.controllers.plc import Plc as BasePlc
from pidcfg.sim.costs import Cost
from pidcfg.sim.engine.run import Settings, prepare_network, simulate
from pidcfg.sim.judgement.report import ScanTime
from pidcfg.text.source import read_document

ALARM, FLAG, TUNING = 8, 16, 32
MODES = {"manual": 1, "auto": 2}
SIGNALS = ("", "PV", "SP", "OUT", "BIAS")


@dataclass(slots=True)
class Config:
    period: int = 1_000_000
    in_slot: int = 0
    pv_slot: int = 1
    sp_slot: int = 2
    out_slot: int = 3
    bias_slot: int = 4


@dataclass(slots=True)
class State:
    status: int = MODES["manual"]
    aux_status: int = 0
    notice: int = 0
    due: int = 0
    sp: float = 0.0
    gain: float = 2.0
    limit: float = 1e9
    """The alarm is on while the PV is above."""


def scan(tick, configs, states, _aux, signal_values):
    """OUT = gain (SP - PV) + bias in auto; the set point is limited to 100, a gain of 0 is refused."""
    for i in range(len(configs)):
        c, s = configs[i], states[i]
        if tick < s.due:
            continue
        s.due += c.period
        pv = signal_values[c.in_slot]
        signal_values[c.pv_slot] = pv
        signal_values[c.sp_slot] = min(s.sp, 100.0)
        s.status = (s.status & ~ALARM) | (ALARM if pv > s.limit else 0)
        if s.status & MODES["auto"]:
            signal_values[c.out_slot] = s.gain * (signal_values[c.sp_slot] - pv) + signal_values[c.bias_slot]


@dataclass(slots=True)
class Plc(BasePlc):
    """A PLC with the loops A and B."""

    loops: list[str]
    configs: list[Config]
    states: list[State]
    aux: list[float] = field(default_factory=list)
    signal_values: list[float] = field(default_factory=list)
    signals: list[str] = field(default_factory=list)
    scales: list[tuple[float, float, int]] = field(default_factory=list)
    initial_modes: list[str] = field(default_factory=list)
    error_words: dict[str, int] = field(default_factory=lambda: {"V1": 0})
    running: bool = True
    base_ticks: int = 1_000_000
    out_name: str = "OUT"
    pulses: tuple[str, ...] = ()
    output_raises_pv: tuple[bool, ...] = (True,) * 8
    error_format: str = "0x{:04X}"
    modes: dict[str, int] = field(default_factory=lambda: dict(MODES))
    alarm_bits: dict[str, int] = field(default_factory=lambda: {"high": ALARM})
    flag_bits: dict[str, int] = field(default_factory=lambda: {"odd": FLAG})
    aux_bits: dict[str, int] = field(default_factory=lambda: {"complete": 1})
    tuned_names: tuple[str, ...] = ("gain",)
    commands: dict[str, tuple[str, ...]] = field(
        default_factory=lambda: {
            "ramp_soak": ("start", "hold", "resume", "jog"),
            "autotune": ("start",),
            "plc": ("program", "run"),
        }
    )
    options: tuple[str, ...] = ("number_of_loops", "auto_interlock", "scan_time")
    problems: tuple[str, ...] = ()
    calls: list[tuple] = field(default_factory=list)

    def mode(self, status):
        return "auto" if status & MODES["auto"] else "manual"

    def requested_mode(self, notice):
        return "auto" if notice == 1 else None

    def describe(self, notice):
        return {0: ("", ""), 1: ("refused: because", ""), 2: ("to manual: because", ""), 3: ("", "by the way")}[notice]

    @property
    def periods(self):
        return [c.period for c in self.configs]

    def new_period(self, _loop, path, value):
        return int(value * 1_000_000) if path == ("sample_rate",) else 0

    def scan_time(self, without_loops):
        return ScanTime(without_loops, without_loops, without_loops)

    def set_output(self, loop, value, signal_values):
        signal_values[self.configs[loop].out_slot] = float(value.value)

    def check_set(self, _loop, path, value):
        number = value if isinstance(value, Quantity) else parse_number(value)
        assert path[0] in {"setpoint", "gain", "limit", "output", "sample_rate"}, path
        return number

    def set(self, loop, path, value, signal_values):
        name = {"setpoint": "sp"}.get(path[0], path[0])
        if name == "sample_rate":
            self.configs[loop].period = self.new_period(loop, path, value)
            return None
        setattr(self.states[loop], name, float(value))
        if name == "sp":
            signal_values[self.configs[loop].sp_slot] = float(value)
        return "is read later" if name == "limit" else None

    def request(self, loop, mode):
        s = self.states[loop]
        if mode == "auto" and s.gain == 0:
            s.notice = 1
        else:
            s.status = (s.status & ~3) | MODES[mode]

    def ramp_soak(self, loop, command):
        self.calls.append(("ramp_soak", loop, command))
        self.states[loop].aux_status = 1

    def autotune(self, loop, command):
        self.calls.append(("autotune", loop, command))
        self.states[loop].status |= FLAG

    def tuning_result(self, loop):
        if not self.states[loop].status & FLAG:
            return None
        return {"done": True, "error": False, "status": "done", "results": {"gain": 2.5}}

    def integrates(self, _loop, _sig):
        return False

    def output_limits(self, _loop, _sig):
        return -1e6, 1e6

    def program(self, _sig):
        self.calls.append(("program",))
        self.request(0, "manual")

    def run(self, tick):
        self.calls.append(("run", tick))
        self.states[0].notice = 2


class Controller:
    """The vendor's module."""

    scan = staticmethod(scan)
    COST = Cost(7, 20)
    INLINED = ()

    @dataclass
    class Options:
        number_of_loops: int | None = None
        auto_interlock: bool = True
        scan_time: int = 0

    Config, State = Config, State

    @staticmethod
    def load(**given):
        """Two loops in Auto at a set point of 50, sampled every second, unless ``given`` otherwise."""
        configs = [Config(1_000_000, *range(5 * i, 5 * i + 5)) for i in range(2)]
        plc = Plc(["A", "B"], configs, [State(), State()])
        plc.signal_values = [0.0] * 10
        plc.signals = [f"{loop}.{name}" if name else "" for loop in plc.loops for name in SIGNALS]
        plc.scales = [(0.0, 100.0, 1000)] * 2
        plc.initial_modes = ["auto", "auto"]
        for s in plc.states:
            s.status, s.sp = MODES["auto"], 50.0
        for name, value in given.items():
            setattr(plc, name, value)
        return plc


def scenario(text, **given):
    """A scenario from YAML; duration 10 s unless given."""
    head = {"pidcfg": 1, "scenario": "test", "config": "none.yaml", "duration": 10, **given}
    lines = [f"{key}: {value}" for key, value in head.items()]
    document = read_document(("\n".join(lines) + "\n" + text).encode(), "test.yaml")
    assert not document.problems, document.problems
    return Scenario.model_validate(document.data)


def run(text, plc=None, engine="python", every=1, limit=None, **given):
    """The report and the trend of a scenario."""
    trend = io.StringIO()
    plcs = iter([plc] if plc else [])
    settings = Settings(engine, every, limit, trend)
    report = simulate(scenario(text, **given), lambda: next(plcs, None) or Controller.load(), Controller, settings)
    return report, trend.getvalue()


def rows(trend):
    """The trend as columns of numbers by name."""
    head, *lines = (line.split(",") for line in trend.splitlines())
    return {name: [float(line[i]) for line in lines] for i, name in enumerate(head)}


def problems(text, **given):
    """What is wrong with a scenario: path and message."""
    return [
        (".".join(map(str, p.path)), p.message)
        for p in prepare_network(scenario(text, **given), Controller.load()).problems
    ]
