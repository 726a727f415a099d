"""One scenario from the program-to-run transition to its report, with the pre-roll of ``initial: steady``."""

from __future__ import annotations

import csv
from array import array
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, fields
from math import gcd, lcm
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol

from pydantic_core import PydanticCustomError

from pidcfg.sim.controllers.plc import TICKS, Controller, Plc
from pidcfg.sim.engine.checks import check_scenario
from pidcfg.sim.engine.choice import CHUNK, EngineName, Machine, calls_of, choose_engine, numba_kernels, python_kernels
from pidcfg.sim.engine.events import Agenda, Journal, idle_events
from pidcfg.sim.engine.expressions import FAULTS, Problem
from pidcfg.sim.engine.influence import Influence, wrong_actions
from pidcfg.sim.engine.kernel import STEADY_COUNTS, STEADY_SHARE, NoiseRows, Span, is_steady
from pidcfg.sim.engine.network import Network, build_network, initial_values, settle_plants
from pidcfg.sim.engine.plants import Noise
from pidcfg.sim.engine.reference import HeldNetwork
from pidcfg.sim.judgement.evidence import Evidence, meters_of
from pidcfg.sim.judgement.expect import MeasuredRun, Watch, alarms_off, place_verdict, verdict, watches_of
from pidcfg.sim.judgement.meters import DEFAULT_BAND, NEVER, Band, Gauge, Onset, loop_metrics, time_in_control
from pidcfg.sim.judgement.report import Note, Range, Report, ScanTime, Standing, ten_digits
from pidcfg.sim.judgement.standing import LoopWatch, judge_standing, loop_verdict, unused_allowances
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import leaves

if TYPE_CHECKING:
    from collections.abc import Collection, Generator, Iterator, Mapping, Sequence

    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.engine.recording import Recording

# --- Expressions of a run that had no value, in words -----------------------------------------------------------------


def fault_notes(scenario: Scenario, plc: Plc, net: Network, step: int, zero: int) -> Iterator[Note]:
    """A note for each expression, with the first time; ``step`` in ticks, time 0 is base step ``zero``."""

    def time_of(k: int) -> float:
        return ten_digits(max(0, k - zero) * step / TICKS)

    plant_names = {at: name for name, at in net.plant_index.items()}
    for i, plant in enumerate(net.plants):
        if plant.fault:
            text = str(net.texts[plant_names[i]][1].input)
            yield _fault_note(time_of(plant.fault_at), plant.fault, f"input of {plant_names[i]}", text)
    for i, channel in enumerate(net.channels):
        if channel.fault:
            key = str(net.channel_paths[i][-1])
            yield _fault_note(time_of(channel.fault_at), channel.fault, key, scenario.connect[key])
    for tick, name, why in plc.faults():
        message = f"the wire of {name} has no value ({why}); it kept the one that it had"
        yield Note(time_of(tick // step), None, message, error=True)


def _fault_note(time: float, fault: int, subject: str, text: str) -> Note:
    return Note(time, None, f"{subject}: {FAULTS[fault]} in {text!r}; the signal kept its last value", error=True)


# --- The trend of a run: one row a base step (or every n-th), written as it comes -------------------------------------


class Sink(Protocol):
    """Where text goes: an open file."""

    def write(self, text: str, /) -> object:
        """Takes a piece of text."""


def time_text(ticks: int) -> str:
    """A time in s, exactly: ``0.2``, ``15``."""
    whole, part = divmod(ticks, TICKS)
    return f"{whole}.{part:06d}".rstrip("0") if part else str(whole)


@dataclass(slots=True)
class Trend:
    """CSV of signals; numbers have ten significant digits, lines end in LF on every system."""

    sink: Sink
    names: Sequence[str]
    step: int
    interval: int = 1
    next_step: int = field(default=0, init=False)
    """The base step of the next values."""

    def __post_init__(self) -> None:
        csv.writer(self.sink, lineterminator="\n").writerow(["time", *self.names])

    def write_rows(self, values: Sequence[float], rows: int, stride: int) -> None:
        """Rows of values, one after the other, ``stride`` base steps from each other; one every n-th is written."""
        width = len(self.names)
        lines = []
        for row in range(rows):
            at = self.next_step + row * stride
            if at % self.interval == 0:
                shown = (f"{value:.10g}" for value in values[row * width : (row + 1) * width])
                lines.append(",".join([time_text(at * self.step), *shown]))
        self.next_step += rows * stride
        if lines:
            self.sink.write("\n".join(lines) + "\n")


# --- Before a run: the PLC's options, the base step, the network, and all problems of a scenario ----------------------


def plc_options(scenario: Scenario, controller: Controller) -> object:
    """What the scenario chooses of the PLC, as the controller takes it; `prepare_network` reports unknown options."""
    known = {f.name for f in fields(controller.Options)}
    choices = {key: value for key, value in scenario.plc.model_dump(exclude_none=True).items() if key in known}
    if "scan_time" in choices:
        choices["scan_time"] = int(choices["scan_time"] * TICKS)
    return controller.Options(**choices)


def base_step(scenario: Scenario, plc: Plc) -> int:
    """The base step in ticks: that of the scenario, the scan time, or the greatest common step of the sample rates."""
    chosen = scenario.step or scenario.plc.scan_time
    if chosen is not None:
        return max(1, int(chosen * TICKS))
    rates = [plc.base_ticks] if plc.running else [config.period for config in plc.configs]
    return gcd(*rates, *event_periods(scenario, plc)) or TICKS


def event_periods(scenario: Scenario, plc: Plc) -> list[int]:
    """Sample rates that events of the scenario set, in ticks."""
    periods = []
    for event in scenario.events:
        if event.loop not in plc.loops or event.set is None or event.at > scenario.duration:
            continue
        loop = plc.loops.index(event.loop)
        for keys, value, _ in leaves(event.set):
            with suppress(PydanticCustomError):  # the check of the scenario reports it
                periods.append(plc.new_period(loop, keys, plc.check_set(loop, keys, value)))
    return periods


def prepare_network(scenario: Scenario, plc: Plc) -> Network:
    """The network of a scenario, with everything that is wrong with the scenario in ``problems``."""
    step = base_step(scenario, plc)
    problems = list(check_scenario(scenario, plc))
    for name, period in zip(plc.loops, plc.periods, strict=True):
        if period and misses_samples(period, step, scenario):
            problems.append(uneven_rate_problem(name, period, step))
    if scenario.plc.number_of_loops is not None and any(plc.error_words.values()):
        words = ", ".join(f"{name} = {plc.error_format.format(word)}" for name, word in plc.error_words.items())
        message = f"with {scenario.plc.number_of_loops} loops the set-up check gives {words}: the loop task is off"
        bits = [
            (name, bit) for name, raw in plc.error_words.items() for bit in range(raw.bit_length()) if raw >> bit & 1
        ]
        effect = ", ".join(f"{name} bit {bit}" for name, bit in bits)
        problems.append(Problem(("plc", "number_of_loops"), message, "set_up", "warning", effect=effect))
    return build_network(scenario, plc, step, problems)


def misses_samples(period: int, step: int, scenario: Scenario) -> bool:
    """Whether samples of this rate come late in steps of this length; any rate fits scans that are shorter."""
    return period < step if scenario.plc.scan_time is not None else period % step != 0


def uneven_rate_problem(loop: str, period: int, step: int, since: str = "") -> Problem:
    """A sample rate that the base step does not meet."""
    relation = "is shorter than" if period < step else "is no multiple of"
    message = f"{since}the sample rate of {loop}, {period / TICKS:g} s, {relation} the step, {step / TICKS:g} s"
    cure = f"its samples come at the next base step; give 'step: {gcd(period, step) / TICKS:g}', which fits them all"
    return Problem(("step",), message, "rounded", "warning", cure, loop=loop)


def length_problems(last: int, loops: int, limit: int | None) -> list[Problem]:
    """The limit on loop-steps, and a scenario without any; ``last``: its last base step."""
    count = (last + 1) * loops
    if limit is not None and count > limit:
        message = f"{count} loop-steps; the limit is {limit}"
        return [Problem(("duration",), message, "limit", help="use a longer step, or the option --no-limit")]
    cure = "lengthen the duration, or give a shorter 'step'"
    short = Problem(("duration",), "the scenario is shorter than its base step", "value", help=cure)
    return [short] if last < 1 else []


# --- The pre-roll of ``initial: steady``: controllers and plants run until every PV is at rest, then time starts ------
#
# A PV is at rest when over one window, the longest time constant, it hardly moves or stays within two counts of its
# mean: a quantised loop on an integrator hunts for ever. Where an output is on or off, or pulses, the PVs never rest:
# there the highest and the lowest PV must come back (D761). Outputs do not count; noise and events are off.

MAX_WINDOWS = 100
"""Windows after which a network counts as one that never settles."""
WINDOW_SAMPLES = 4
"""Samples of the slowest loop that a window spans at least."""
MAX_WINDOW_GROWTH = 10
"""A window grows at most by this factor to hold whole samples of all loops."""
CYCLE_WINDOWS = 4
"""Windows whose extremes are held against those of as many before: a cycle may be longer than the time constant."""
CYCLE_SHARE = 0.02
"""Of the swing, by which the extremes of a cycle may differ from those before."""


class UnsteadyError(Exception):
    """The network does not settle; ``problem`` says which loop moves and how far."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem.message)
        self.problem = problem


def run_to_rest(machine: Machine, max_loop_steps: int | None, swing_loops: Collection[int] = ()) -> int:
    """Runs the pre-roll and returns its base steps; ``swing_loops``: loops that may swing. Raises `UnsteadyError`."""
    plc = machine.plc
    spans: Sequence[Span] = machine.kernels.storage.rows(spans_of(plc))
    steps = window_steps(machine)
    windows_left = (
        MAX_WINDOWS if max_loop_steps is None else min(MAX_WINDOWS, max_loop_steps // (steps * max(len(spans), 1)))
    )
    past_windows: list[list[tuple[float, float]]] = []
    k, moving_loop = 0, 0
    while windows_left > 0:
        k = machine.settle(k, steps, 1 if swing_loops else windows_left, spans)
        windows_left = windows_left - 1 if swing_loops else 0
        unsteady_loops = [i for i, span in enumerate(spans) if not is_steady(span, steps)]
        if swing_loops:
            past_windows.append([(span.low, span.high) for span in spans])
            ends = {i: [window[i] for window in past_windows] for i in swing_loops}
            unsteady_loops = [i for i in unsteady_loops if i not in ends or not swings_alike(ends[i], plc.scales[i])]
        if not unsteady_loops:
            return k
        moving_loop = unsteady_loops[0]
    raise UnsteadyError(_unsteady_problem(machine, k, spans[moving_loop], moving_loop, steps))


def spans_of(plc: Plc) -> list[Span]:
    """What a window looks at: of each loop what its sensor shows."""
    scales = zip(plc.configs, plc.scales, strict=False)  # blocks that are no loops stand behind them
    return [Span(config.in_slot, abs(high - low), counts) for config, (low, high, counts) in scales]


def refused_modes(machine: Machine) -> list[Problem]:
    """A warning for each loop that rests in another mode than it is meant for: what rests is not under control."""
    plc = machine.plc
    modes = [plc.mode(state.status) for state in plc.states[: len(plc.loops)]]
    kind, cure = "no_steady_state", "see the mode changes at 0 s for the reason"
    return [
        Problem(("initial",), f"{loop} rests in {mode}, though {goal} is meant", kind, "warning", cure, loop=loop)
        for loop, mode, goal in zip(plc.loops, modes, plc.initial_modes, strict=True)
        if goal != "manual" and mode == "manual" and "manual" in plc.modes
    ]


def window_steps(machine: Machine) -> int:
    """Base steps of a window: the longest time constant, in whole samples so that all loops sample at time 0."""
    periods = [config.period for config in machine.plc.configs]
    longest = max(machine.net.longest_time(), machine.plc.longest_time)
    min_ticks = max(longest * TICKS, WINDOW_SAMPLES * max(periods, default=0), machine.step)
    common_ticks = lcm(*periods, machine.step)
    if common_ticks > MAX_WINDOW_GROWTH * min_ticks:
        common_ticks = machine.step
    return int(-(-min_ticks // common_ticks)) * common_ticks // machine.step


def swinging_loops(plc: Plc, influence: Influence) -> set[int]:
    """The loops whose outputs are on or off, or pulses, and those whose PVs one of them moves."""
    loops = range(len(plc.loops))
    sources = [i for i in loops if plc.is_on_off(i) or influence.pulse_cycle(i)]
    moved = set[int]().union(*(influence.moved_by_output(i) for i in sources))
    return {i for i in loops if i in sources or plc.configs[i].pv_slot in moved}


def swings_alike(windows: Sequence[tuple[float, float]], scale: tuple[float, float, int]) -> bool:
    """Whether a PV swings between the same extremes: ``windows`` has the lowest and highest of each window."""
    if len(windows) < 2 * CYCLE_WINDOWS:
        return False
    earlier, last = windows[-2 * CYCLE_WINDOWS : -CYCLE_WINDOWS], windows[-CYCLE_WINDOWS:]
    (low_before, high_before), (low_now, high_now) = _window_extremes(earlier), _window_extremes(last)
    low, high, counts = scale
    least = max(STEADY_SHARE, STEADY_COUNTS / counts) * abs(high - low)
    slack = max(CYCLE_SHARE * (high_now - low_now), least)
    return abs(low_now - low_before) <= slack and abs(high_now - high_before) <= slack


def _window_extremes(windows: Sequence[tuple[float, float]]) -> tuple[float, float]:
    return min(low for low, _ in windows), max(high for _, high in windows)


def _unsteady_problem(machine: Machine, k: int, span: Span, loop: int, steps: int) -> Problem:
    dt, name = machine.step / TICKS, machine.plc.loops[loop]
    message = (
        f"no steady state after {k * dt:g} s: the PV of {name} still moves between {span.low:.6g} and {span.high:.6g} "
        f"within {steps * dt:g} s; the run starts from 'initial' of the plants instead"
    )
    cure = "check mode, action and tuning of the loop, and the signs of the plant's gain and load"
    return Problem(("initial",), message, "no_steady_state", help=cure, loop=name)


# --- One scenario from the program-to-run transition to its report ----------------------------------------------------
#
# The kernels advance plants, controllers, metrics and trend from event to event, and Python handles what happens
# between. Base steps are counted from the beginning of the pre-roll; ``zero`` is the one at which time starts.

Progress = Callable[[float], None]


class UnusableError(Exception):
    """A scenario that cannot run; ``problems`` say why."""

    def __init__(self, problems: list[Problem]) -> None:
        super().__init__("; ".join(p.message for p in problems if p.severity == "error"))
        self.problems = problems


@frozen
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
    """Of the call: see `choose_engine`."""
    with_reference: bool = True
    """Whether the same plants run beside it without control."""
    with_verdicts: bool = True
    """Whether standing expectations are judged; a run of a battery is compared and not judged."""
    with_report: bool = True
    """Whether a report is wanted; without it a run has metrics and verdicts alone (`Run.judge`)."""


def simulate(scenario: Scenario, new_plc: Callable[[], Plc], controller: Controller, settings: Settings) -> Report:
    """Runs a scenario on a PLC; raises `UnusableError` when it cannot run at all.

    ``new_plc`` makes the PLC at its program-to-run transition; it is called again when the network does not settle and
    the run starts without the pre-roll.
    """
    run = begin_run(scenario, new_plc, controller, settings)
    for _ in run.steps_to_end():
        pass
    return run.finish()


def begin_run(scenario: Scenario, new_plc: Callable[[], Plc], controller: Controller, settings: Settings) -> Run:
    """A run at time 0, as `simulate` has it; `Run.steps_to_end` goes on from there."""
    return settle_run(lambda: Run.prepare(scenario, new_plc, controller, settings))


def settle_run(new_run: Callable[[], Run]) -> Run:
    """A run after its pre-roll, where it has one; ``new_run`` makes it, anew where the network does not settle."""
    run = new_run()
    if run.scenario.initial == "steady" and run.plc.running:
        swinging = swinging_loops(run.plc, run.agenda.influence)
        try:
            run.start_step = run_to_rest(run.machine, run.settings.max_loop_steps, swinging)
            run.problems += refused_modes(run.machine)
        except UnsteadyError as error:
            run = new_run()
            run.problems.append(error.problem)
    return run


PROGRESS_CHUNK = 2_048
"""Base steps between two looks where somebody is told how far CPython is: he may end the run there."""


class JudgedRun(NamedTuple):
    """What a run has shown."""

    metrics: Sequence[Mapping[str, float | None]]
    """Of each loop."""
    evidence: Evidence
    standing: list[Standing]
    faults: Sequence[Note]
    """Expressions that had no value."""
    signal_range: Callable[[str], Range]
    """How far a signal went."""


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
    noise_end: int = 0
    """The base step from which on there is no noise yet."""
    start_step: int = 0
    trend: Trend | None = None
    periods: list[int] = field(default_factory=list)
    """Sample rates at the last look."""
    chunk_steps: int = CHUNK
    """Base steps between two looks."""
    loop_watch: LoopWatch | None = None
    initial_signals: Sequence[float] = ()
    """The signals before the plants were at rest."""
    old_reference: HeldNetwork | None = None
    """The reference of an earlier run of the same network, which serves again."""

    @classmethod
    def prepare(cls, scenario: Scenario, new_plc: Callable[[], Plc], controller: Controller, settings: Settings) -> Run:
        """Everything in place, nothing run yet."""
        plc = new_plc()
        net = prepare_network(scenario, plc)
        step = base_step(scenario, plc)
        last = int(scenario.duration * TICKS) // step
        problems = net.problems + length_problems(last, len(plc.loops), settings.max_loop_steps)
        if any(problem.severity == "error" for problem in problems):
            raise UnusableError(problems)
        notes = [Note(0.0, plc.loops[p.loop], f"word without a value: {p.text}") for p in plc.problems]
        for loop, value in scenario.initial.items() if isinstance(scenario.initial, dict) else ():
            idle = plc.set_output(plc.loops.index(loop), value, net.signal_values)
            notes += [Note(0.0, loop, f"initial output {value}: {idle}")] if idle else []
        initial_signals = list(net.signal_values)
        settle_plants(net, initial_values(net))
        problems += wrong_actions(net, plc)
        influence = Influence.build(
            scenario, net, plc, idle_events(scenario, new_plc, net) if settings.with_verdicts else []
        )
        meters = meters_of(scenario, plc, net, last)
        bands = [Band(i, DEFAULT_BAND) for i in range(len(meters))]
        watched = {slot for m in meters for slot in (m.pv, m.sp, m.out)}
        gauges = [Gauge(slot) for slot in net.slots.values() if slot not in watched]
        watches = watches_of(scenario, plc, net, step)
        bands += [w for w in watches.values() if isinstance(w, Band)]
        gauges += [w for w in watches.values() if isinstance(w, Gauge)]
        onsets = [w for w in watches.values() if isinstance(w, Onset)]
        work = (last + 1) * len(plc.configs) * (net.parts + 3) // 4  # a step of a plant is a quarter of a loop-step
        engine = choose_engine(settings.engine, work, controller, calls_of(scenario, net), settings.runs)
        kernels = numba_kernels(controller) if engine == "numba" else python_kernels(controller)
        machine = Machine(net, plc, step, meters, bands, gauges, onsets, list(net.slots.values()), kernels)
        placed: list[Watch] = [*machine.bands, *machine.gauges, *machine.onsets]
        placed_by_id = {id(mine): seen for mine, seen in zip([*bands, *gauges, *onsets], placed, strict=True)}
        watches = {i: placed_by_id[id(watch)] for i, watch in watches.items()}
        journal = Journal(plc, step / TICKS)
        agenda = Agenda(scenario, plc, net, machine, journal, influence, step)
        run = cls(scenario, settings, plc, net, step, last, engine, machine, journal, agenda, watches, problems, notes)
        run.initial_signals = initial_signals
        if settings.progress is not None and engine == "python":
            run.chunk_steps = PROGRESS_CHUNK
        return run

    @property
    def dt(self) -> float:
        """The base step in s."""
        return self.step / TICKS

    # --- the run -----------------------------------------------------------------------------------------------------

    def steps_to_end(self) -> Iterator[int]:
        """Runs from time 0 to the end; yields the next base step at each look, from the beginning of the pre-roll."""
        fast = self.machine.kernels.normals() if self.net.noisy_plants else None
        self.noise = Noise([f"{self.scenario.seed}/{name}" for name in self.net.noisy_plants], fast)
        if self.settings.trend is not None:
            self.trend = Trend(self.settings.trend, list(self.net.slots), self.step, self.settings.every)
        if self.settings.recording is not None:
            self.settings.recording.begin(list(self.net.slots), self.last + 1, self.dt)
        self.periods = list(self.plc.periods)
        self._look_at_settings(0)
        k = self.agenda.start_step = self.start_step
        if self.settings.with_verdicts and self.settings.with_reference:
            self.machine.reference = self._begin_reference()
        self.loop_watch = LoopWatch(self._make_evidence())
        for stop, action in self.agenda.stops(self.last, self.loop_watch.stops()):
            if stop > k - self.start_step:
                k = yield from self._advance_to(k, self.start_step + stop)
            note = action(stop)
            if note is not None:
                self.notes.append(note)
            self._look_at_settings(stop)
        yield from self._advance_to(k, self.start_step + self.last + 1)

    def finish(self) -> Report:
        """The report of what has run."""
        if self.settings.recording is not None:
            self.settings.recording.end()
        return self._make_report(self.judge())

    def _begin_reference(self) -> HeldNetwork:
        """The same plants without control, at time 0."""
        storage = self.machine.kernels.storage
        if self.old_reference is None:
            return HeldNetwork.begin(self.scenario, self.net, self.plc, self.agenda.influence, storage)
        self.old_reference.renew(self.scenario, self.plc, storage.copy_into)
        return self.old_reference

    def _advance_to(self, k: int, end: int) -> Generator[int, None, int]:
        """Base steps up to ``end``; the first and the last one stand alone, so that somebody looks after them."""
        bounds = {self.start_step + 1, self.start_step + self.last} if self.settings.with_report else set()
        while k < end:
            stop = min([end, k + self.chunk_steps, *(b for b in bounds if b > k)])
            self._advance_chunk(k, stop)
            self._look_at_settings(stop - self.start_step)
            k = stop
            yield k
        return k

    def _advance_chunk(self, k: int, stop: int) -> None:
        machine = self.machine
        recording = self.settings.recording
        interval = 1 if recording is not None else self.settings.every if self.trend is not None else 0
        if interval:
            machine.trend = array("d", bytes(8 * ((stop - k) // interval + 1) * len(machine.trend_slots)))
        while k < stop:
            k = machine.advance(k, self._draw_noise(k, stop), self.start_step, self.last, interval)
            if self.settings.with_report:
                self.journal.read_log(machine.log, machine.counts[0])
            if self.trend is not None:
                self.trend.write_rows(machine.trend, machine.counts[1], interval)
            if recording is not None:
                recording.add_rows(machine.trend, machine.counts[1])
            machine.counts[0] = machine.counts[1] = 0
        if self.settings.progress is not None:
            self.settings.progress((k - self.start_step) / (self.last + 1))

    def _draw_noise(self, k: int, stop: int) -> int:
        """Draws the noise of many base steps at once; returns up to which one before ``stop`` there is some."""
        if not self.net.noisy_plants:
            return stop
        if k >= self.noise_end:
            count = min(self.chunk_steps, self.start_step + self.last + 1 - k)
            self.machine.noise = NoiseRows(self.noise.draw_rows(count), len(self.net.noisy_plants), k)
            self.noise_end = k + count
        return min(stop, self.noise_end)

    def _look_at_settings(self, k: int) -> None:
        """Reports a sample rate that the base step no longer meets, and records changed levels of alarms."""
        if not self.settings.with_report:
            return
        periods, self.periods = self.periods, list(self.plc.periods)
        for name, old, new in zip(self.plc.loops, periods, self.periods, strict=True):
            if new and new != old and misses_samples(new, self.step, self.scenario):
                self.problems.append(uneven_rate_problem(name, new, self.step, f"by {ten_digits(k * self.dt):g} s: "))
        if self.settings.recording is not None:
            self.settings.recording.note_levels(self.plc, self.net.signal_values, ten_digits(k * self.dt))

    # --- the report --------------------------------------------------------------------------------------------------

    def judge(self) -> JudgedRun:
        """Metrics and verdicts of what has run."""
        loop_watch, machine = self.loop_watch or LoopWatch(self._make_evidence()), self.machine
        loop_watch.finish()
        evidence, signals = loop_watch.evidence, self.net.signal_values
        rows = (
            loop_metrics(meter, machine.bands[i], self.last, self.dt, signals) for i, meter in enumerate(machine.meters)
        )
        metrics = [{name: None if v is None else ten_digits(v) for name, v in row.items()} for row in rows]
        switched_off, signal_range = alarms_off(self.scenario, self.plc), self._range_lookup()
        outcome = MeasuredRun(
            self.plc, metrics, machine.meters, signal_range, self.dt, self.last, switched_off, self.agenda.modes
        )
        expectations = enumerate(self.scenario.expect)
        evidence.verdicts = [
            place_verdict(verdict(i, expectation, self.watches.get(i), outcome), expectation)
            for i, expectation in expectations
        ]
        if machine.reference is not None:
            evidence.benefits = {rival.loop: rival for rival in machine.reference.benefits}
        reasons = ((i, loop.modes[-1].reason) for i, loop in enumerate(self.journal.loops) if loop.modes)
        evidence.reasons = {i: reason for i, reason in reasons if reason}
        verdicts = judge_standing(evidence) if self.settings.with_verdicts else []
        fault_notes_found = list(fault_notes(self.scenario, self.plc, self.net, self.step, self.start_step))
        return JudgedRun(metrics, evidence, verdicts, fault_notes_found, signal_range)

    def _make_report(self, judged: JudgedRun) -> Report:
        self.journal.close()
        machine, evidence, verdicts = self.machine, judged.evidence, judged.standing
        for i, (meter, report) in enumerate(zip(machine.meters, self.journal.loops, strict=True)):
            report.metrics = judged.metrics[i]
            report.until = (
                ten_digits(meter.step_until * self.dt) if meter.has_step and meter.step_until < NEVER else None
            )
            report.time_in_control = ten_digits(time_in_control(meter, self.last) * self.dt)
        for name, report in zip(self.plc.loops, self.journal.loops, strict=True):
            report.unit = self.plc.units.get(name, "")
            report.verdict, report.missing = loop_verdict([v for v in verdicts if v.loop == name])
        self.problems += unused_allowances(evidence, verdicts)
        return Report(
            scenario=self.scenario.scenario,
            step=self.dt,
            steps=self.last + 1,
            duration=self.last * self.dt,
            engine=self.engine,
            plc_flags={name: self.plc.error_format.format(word) for name, word in self.plc.error_words.items()},
            running=self.plc.running,
            loops=dict(zip(self.plc.loops, self.journal.loops, strict=True)),
            signals={name: judged.signal_range(name) for name in self.net.slots},
            expectations=list(evidence.verdicts),
            standing=verdicts,
            events=self.agenda.past_events,
            notes=sorted([*self.notes, *self.journal.notes(), *judged.faults], key=lambda note: note.at),
            problems=self.problems,
            settled=ten_digits(self.start_step * self.dt) if self.start_step else None,
            scan_time=self._scan_time(),
        )

    def _make_evidence(self) -> Evidence:
        influence, meters = self.agenda.influence, self.machine.meters
        return Evidence(self.scenario, self.plc, self.net, influence, meters, self.step, self.last)

    def _scan_time(self) -> ScanTime | None:
        scan = self.scenario.plc.scan_time
        return None if scan is None or not self.plc.running else self.plc.scan_time(float(scan))

    def _range_lookup(self) -> Callable[[str], Range]:
        """What tells how far a signal went."""
        ranges: dict[int, tuple[float, float]] = {g.slot: (g.low, g.high) for g in reversed(self.machine.gauges)}
        for m in self.machine.meters:
            ranges |= {m.pv: (m.pv_low, m.pv_high), m.sp: (m.sp_low, m.sp_high), m.out: (m.out_low, m.out_high)}
        names, signals = self.net.slots, self.net.signal_values

        def signal_range(name: str) -> Range:
            slot = names[name]
            return Range(ten_digits(ranges[slot][0]), ten_digits(ranges[slot][1]), ten_digits(signals[slot]))

        return signal_range
