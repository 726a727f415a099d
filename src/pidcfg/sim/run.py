"""One scenario from the program-to-run transition to its report.

The kernels advance plants, controllers, metrics and trend from event to event, and Python handles what happens between.
Base steps are counted from the beginning of the pre-roll; ``zero`` is the one at which time starts.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from pidcfg.sim.engine import CHUNK, EngineName, Machine, calls_of, choose, numba_kernels, python_kernels
from pidcfg.sim.events import Agenda
from pidcfg.sim.expect import Outcome, Watch, alarms_off, placed, verdict, watches_of
from pidcfg.sim.faults import faults
from pidcfg.sim.feedback import wrong_actions
from pidcfg.sim.idle import idle_events
from pidcfg.sim.influence import Influence
from pidcfg.sim.journal import Journal
from pidcfg.sim.meters import Onset, time_in_control
from pidcfg.sim.metrics import DEFAULT_BAND, Band, Gauge, begin, loop_metrics
from pidcfg.sim.noise import Noise
from pidcfg.sim.plc import TICKS, Controller, Plc
from pidcfg.sim.prepare import base_step, misses, prepare, too_long, uneven
from pidcfg.sim.report import Note, Range, Report, ScanTime, rounded
from pidcfg.sim.rest import initial_values, rest
from pidcfg.sim.standing.evidence import Evidence
from pidcfg.sim.standing.judge import standing, unused_allowances
from pidcfg.sim.standing.lookout import Lookout
from pidcfg.sim.standing.watch import meters_of
from pidcfg.sim.steady import UnsteadyError, refused, settle, swinging_loops
from pidcfg.sim.trace import Sink, Trend

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.network import Network
    from pidcfg.sim.problems import Problem
    from pidcfg.sim.recording import Recording

Progress = Callable[[float], None]


class UnusableError(Exception):
    """A scenario that cannot run; ``problems`` say why."""

    def __init__(self, problems: list[Problem]) -> None:
        super().__init__("; ".join(p.message for p in problems if p.severity == "error"))
        self.problems = problems


@dataclass(frozen=True, slots=True)
class Settings:
    """How to run, as opposed to what."""

    engine: EngineName = "auto"
    every: int = 1
    """Base steps between two rows of the trend."""
    max_loop_steps: int | None = None
    trend: Sink | None = None
    recording: Recording | None = None
    """Takes the trend for a picture: every base step, whatever ``every`` says."""
    progress: Progress | None = None
    runs: int | None = None
    """Of the call: see `choose`."""
    judged: bool = True
    """Whether standing expectations are judged; a run of a battery is compared and not judged."""


def simulate(scenario: Scenario, new_plc: Callable[[], Plc], controller: Controller, settings: Settings) -> Report:
    """Runs a scenario on a PLC; raises `UnusableError` when it cannot run at all.

    ``new_plc`` makes the PLC at its program-to-run transition; it is called again when the network does not settle and
    the run starts without the pre-roll.
    """
    run = begun(scenario, new_plc, controller, settings)
    for _ in run.course():
        pass
    return run.finish()


def begun(scenario: Scenario, new_plc: Callable[[], Plc], controller: Controller, settings: Settings) -> Run:
    """A run at time 0, as `simulate` has it; `Run.course` goes on from there."""
    run = Run.of(scenario, new_plc, controller, settings)
    if scenario.initial == "steady" and run.plc.running:
        try:
            run.zero = settle(run.machine, settings.max_loop_steps, swinging_loops(scenario, run.net, run.plc))
            run.problems += refused(run.machine)
        except UnsteadyError as error:
            run = Run.of(scenario, new_plc, controller, settings)
            run.problems.append(error.problem)
    return run


@dataclass(slots=True)
class Run:
    """A run on its way from time 0 to its end."""

    scenario: Scenario
    settings: Settings
    plc: Plc
    net: Network
    step: int
    last: int
    engine: Literal["python", "numba"]
    machine: Machine
    journal: Journal
    agenda: Agenda
    watches: dict[int, Watch]
    """What is measured for one expectation alone, by its number."""
    problems: list[Problem]
    notes: list[Note] = field(default_factory=list)
    noise: Noise = field(default_factory=lambda: Noise([]))
    zero: int = 0
    trend: Trend | None = None
    periods: list[int] = field(default_factory=list)
    """Sample rates at the last look."""
    chunk: int = CHUNK
    """Base steps between two looks."""
    lookout: Lookout | None = None

    @classmethod
    def of(cls, scenario: Scenario, new_plc: Callable[[], Plc], controller: Controller, settings: Settings) -> Run:
        """Everything in place, nothing run yet."""
        plc = new_plc()
        net = prepare(scenario, plc)
        step = base_step(scenario, plc)
        last = int(scenario.duration * TICKS) // step
        problems = net.problems + too_long(last, len(plc.loops), settings.max_loop_steps)
        if any(problem.severity == "error" for problem in problems):
            raise UnusableError(problems)
        notes = [Note(0.0, plc.loops[p.loop], f"word without a value: {p.text}") for p in plc.problems]
        for loop, value in scenario.initial.items() if isinstance(scenario.initial, dict) else ():
            idle = plc.set_output(plc.loops.index(loop), value, net.sig)
            notes += [Note(0.0, loop, f"initial output {value}: {idle}")] if idle else []
        rest(net, initial_values(net))
        problems += wrong_actions(net, plc)
        influence = Influence.of(scenario, net, plc, idle_events(scenario, new_plc, net) if settings.judged else [])
        meters = meters_of(scenario, plc, net, last)
        bands = [Band(i, DEFAULT_BAND) for i in range(len(meters))]
        watched = {slot for m in meters for slot in (m.pv, m.sp, m.out)}
        gauges = [Gauge(slot) for slot in net.names.values() if slot not in watched]
        watches = watches_of(scenario, plc, net, step)
        bands += [w for w in watches.values() if isinstance(w, Band)]
        gauges += [w for w in watches.values() if isinstance(w, Gauge)]
        onsets = [w for w in watches.values() if isinstance(w, Onset)]
        work = (last + 1) * len(meters)
        engine = choose(settings.engine, work, controller, calls_of(scenario, net), settings.runs)
        kernels = numba_kernels(controller) if engine == "numba" else python_kernels(controller)
        machine = Machine(net, plc, step, meters, bands, gauges, onsets, list(net.names.values()), kernels)
        journal = Journal(plc, step / TICKS)
        agenda = Agenda(scenario, plc, net, machine, journal, influence, step)
        return cls(scenario, settings, plc, net, step, last, engine, machine, journal, agenda, watches, problems, notes)

    @property
    def dt(self) -> float:
        """The base step in s."""
        return self.step / TICKS

    # --- the run -----------------------------------------------------------------------------------------------------

    def course(self) -> Iterator[int]:
        """Runs from time 0 to the end; yields the next base step at each look, from the beginning of the pre-roll."""
        fast = self.machine.kernels.normals() if self.net.noisy else None
        self.noise = Noise([f"{self.scenario.seed}/{name}" for name in self.net.noisy], fast)
        if self.settings.trend is not None:
            self.trend = Trend(self.settings.trend, list(self.net.names), self.step, self.settings.every)
        if self.settings.recording is not None:
            self.settings.recording.begin(list(self.net.names), self.last + 1, self.dt)
        self.periods = list(self.plc.periods)
        self._look_at_settings(0)
        k = self.agenda.zero = self.zero
        self.lookout = Lookout(self._evidence())
        for stop, action in self.agenda.stops(self.last, self.lookout.stops()):
            if stop > k - self.zero:
                k = yield from self._advance(k, self.zero + stop)
            note = action(stop)
            if note is not None:
                self.notes.append(note)
            self._look_at_settings(stop)
        yield from self._advance(k, self.zero + self.last + 1)

    def finish(self) -> Report:
        """The report of what has run."""
        if self.settings.recording is not None:
            self.settings.recording.end()
        lookout = self.lookout or Lookout(self._evidence())
        lookout.finish()
        return self._report(lookout.evidence)

    def _advance(self, k: int, end: int) -> Generator[int, None, int]:
        """Base steps up to ``end``; the first and the last one stand alone.

        Extremes begin with the first one, and nothing is integrated over the time after the last one.
        """
        bounds = {self.zero + 1, self.zero + self.last}
        while k < end:
            stop = min([end, k + self.chunk, *(b for b in bounds if b > k)])
            final = k == self.zero + self.last
            held = [(m.iae, m.ise, m.itae) for m in self.machine.meters] if final else []
            self._chunk(k, stop)
            self._look_at_settings(stop - self.zero)
            if k == self.zero:
                for meter in self.machine.meters:
                    begin(meter, self.net.sig)
            for meter, integrals in zip(self.machine.meters if final else (), held, strict=True):
                meter.iae, meter.ise, meter.itae = integrals
            k = stop
            yield k
        return k

    def _chunk(self, k: int, stop: int) -> None:
        machine, first = self.machine, k
        recording = self.settings.recording
        every = 1 if recording is not None else self.settings.every if self.trend is not None else 0
        machine.noise = self.noise.rows(stop - k)
        if every:
            machine.trend = array("d", bytes(8 * ((stop - k) // every + 1) * len(machine.shown)))
        while k < stop:
            k = machine.advance(k, stop, self.zero, every, first)
            self.journal.take(machine.log, machine.counts[0])
            if self.trend is not None:
                self.trend.take(machine.trend, machine.counts[1], every)
            if recording is not None:
                recording.take(machine.trend, machine.counts[1])
            machine.counts[:2] = [0, 0]
        if self.settings.progress is not None:
            self.settings.progress((k - self.zero) / (self.last + 1))

    def _look_at_settings(self, k: int) -> None:
        """Reports a sample rate that the base step no longer meets, and records changed levels of alarms."""
        periods, self.periods = self.periods, list(self.plc.periods)
        for name, old, new in zip(self.plc.loops, periods, self.periods, strict=True):
            if new and new != old and misses(new, self.step, self.scenario):
                self.problems.append(uneven(name, new, self.step, f"by {rounded(k * self.dt):g} s: "))
        if self.settings.recording is not None:
            self.settings.recording.look(self.plc, self.net.sig, rounded(k * self.dt))

    # --- the report --------------------------------------------------------------------------------------------------

    def _report(self, evidence: Evidence) -> Report:
        self.journal.close()
        machine, sig = self.machine, self.net.sig
        for i, (meter, report) in enumerate(zip(machine.meters, self.journal.loops, strict=True)):
            values = loop_metrics(meter, machine.bands[i], self.last, self.dt, sig)
            report.metrics = {name: None if v is None else rounded(v) for name, v in values.items()}
            report.time_in_control = rounded(time_in_control(meter, self.last) * self.dt)
        metrics = [report.metrics for report in self.journal.loops]
        signals = self._signals()
        off = alarms_off(self.scenario, self.plc)
        outcome = Outcome(self.plc, metrics, machine.meters, signals, self.dt, self.last, off, self.agenda.modes)
        wanted = enumerate(self.scenario.expect)
        said = ((i, loop.modes[-1].reason) for i, loop in enumerate(self.journal.loops) if loop.modes)
        evidence.reasons = {i: reason for i, reason in said if reason}
        verdicts = standing(evidence) if self.settings.judged else []
        self.problems += unused_allowances(evidence, verdicts)
        invalid = faults(self.scenario, self.plc, self.net, self.step, self.zero)
        return Report(
            scenario=self.scenario.scenario,
            step=self.dt,
            steps=self.last + 1,
            duration=self.last * self.dt,
            engine=self.engine,
            plc_flags={name: self.plc.word_of_flags.format(word) for name, word in self.plc.flags.items()},
            running=self.plc.running,
            loops=dict(zip(self.plc.loops, self.journal.loops, strict=True)),
            signals=signals,
            expectations=[placed(verdict(i, one, self.watches.get(i), outcome), one) for i, one in wanted],
            standing=verdicts,
            events=self.agenda.done,
            notes=sorted([*self.notes, *self.journal.notes(), *invalid], key=lambda note: note.at),
            problems=self.problems,
            settled=rounded(self.zero * self.dt) if self.zero else None,
            scan_time=self._scan_time(),
        )

    def _evidence(self) -> Evidence:
        influence, meters = self.agenda.influence, self.machine.meters
        return Evidence(self.scenario, self.plc, self.net, influence, meters, self.step, self.last)

    def _scan_time(self) -> ScanTime | None:
        scan = self.scenario.plc.scan_time
        return None if scan is None or not self.plc.running else self.plc.scan_time(float(scan))

    def _signals(self) -> dict[str, Range]:
        lows: dict[int, tuple[float, float]] = {g.slot: (g.low, g.high) for g in reversed(self.machine.gauges)}
        for m in self.machine.meters:
            lows |= {m.pv: (m.pv_low, m.pv_high), m.sp: (m.sp_low, m.sp_high), m.out: (m.out_low, m.out_high)}
        sig = self.net.sig
        return {
            name: Range(rounded(lows[slot][0]), rounded(lows[slot][1]), rounded(sig[slot]))
            for name, slot in self.net.names.items()
        }
