"""Compiled kernels: the same source through numba gives the same bits, over random loops with every feature."""

import errno
import os
import random
import runpy
import struct
import subprocess
import sys
from array import array
from collections.abc import MutableSequence, Sequence
from dataclasses import asdict, astuple, dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Generic, NamedTuple, TypeVar

import pytest

pytest.importorskip("numba")
import numpy as np

from benchmarks.production import SETPOINTS, STEP, VENDORS, configuration, limit_cycle, loaded, ours, scenario
from benchmarks.twin import Twin, compiler
from compile_rig import advance, vector
from pidcfg.sim.controllers.dl06 import equation as bits
from pidcfg.sim.controllers.dl06 import scan as dl06
from pidcfg.sim.controllers.dl06.autotune import POINTS, REQUESTED
from pidcfg.sim.controllers.dl06.equation import Config, State, calculate_gains
from pidcfg.sim.controllers.dl06.scan import INLINED, scan
from pidcfg.sim.controllers.kernels import clamp, round_half_even, single
from pidcfg.sim.controllers.nextopid import scan as nextopid
from pidcfg.sim.controllers.nextopid import terms as slots
from pidcfg.sim.engine import choice as engine
from pidcfg.sim.engine import run
from pidcfg.sim.engine.compile import NUMBA_OPTIONS as COMPILE_OPTIONS
from pidcfg.sim.engine.compile import (
    NotKeptWarning,
    Rows,
    call_on_arrays,
    compile_functions,
    fingerprint,
    is_cached,
    reachable_kernels,
    record_array,
    record_type,
    warn_not_kept,
)
from pidcfg.sim.engine.recording import Recording

CONFIGURATIONS = 320
SEGMENTS, STEPS = 4, 120
BASE = 50_000
TABLE = 32
FORMATS = ((0.0, 4095.0), (-4095.0, 4095.0), (0.0, 32767.0), (-32767.0, 32767.0), (0.0, 65535.0))


def drive(first, last, configs, states, aux, signals, noise):  # noqa: PLR0917 - numba takes flat arrays
    """Base steps of first-order plants with noise, and the controllers (kernel)."""
    n = len(configs)
    for k in range(first, last):
        for i in range(n):
            at = 5 * n + i
            signals[at] = signals[at] + 0.03 * (0.9 * signals[5 * i + 3] - signals[at])
            signals[5 * i] = signals[at] + noise[(k * n + i) % len(noise)]
        scan(k * BASE, configs, states, aux, signals)
    return last


def random_config(rng, i, n):
    low, high = rng.choice(FORMATS)
    c = Config(period=rng.choice([50_000, 100_000, 500_000, 3_000_000]))
    c.slow = int(c.period > 2_000_000 and rng.random() < 0.7)
    c.in_slot, c.pv_slot, c.sp_slot, c.out_slot, c.bias_slot = (5 * i + k for k in range(5))
    c.pv_min, c.pv_max, c.pv_span = low, high, high - low
    c.out_min, c.out_max, c.out_span = low, high, high - low
    c.pv_low = c.out_low = -20.0
    c.pv_width = c.out_width = 240.0
    c.filter = rng.choice([1.0, 0.1, 0.5])
    c.square_root = int(rng.random() < 0.2)
    c.span = c.pv_span**0.5 if c.square_root else c.pv_span
    c.squared, c.deadband = int(rng.random() < 0.3), rng.choice([0.0, 0.0, 0.01])
    c.shapes_error = int(c.square_root or c.squared or c.deadband > 0.0)
    c.velocity, c.reverse, c.bias_freeze, c.derivative_on_pv = (int(rng.random() < 0.3) for _ in range(4))
    c.step_bias, c.gain_limit_on, c.gain_limit = (
        int(rng.random() < 0.2),
        int(rng.random() < 0.4),
        rng.choice([0.0, 5.0, 20.0]),
    )
    c.is_special = int(c.velocity or c.shapes_error or c.derivative_on_pv or c.step_bias)
    c.bumpless = rng.choice([1, 2])
    if rng.random() < 0.5:
        c.sp_min, c.sp_max = low + 0.1 * c.span, low + 0.9 * c.span
    if rng.random() < 0.5:
        c.output_low_limit, c.output_high_limit = low + 0.05 * c.out_span, low + 0.95 * c.out_span
    else:
        c.output_low_limit, c.output_high_limit = low, high
    c.major = rng.randrange(n) if n > 1 and rng.random() < 0.4 else -1
    c.major = -1 if c.major == i else c.major
    random_alarms(rng, c)
    c.interlock, c.rs_enabled, c.rs_table = int(rng.random() < 0.3), int(rng.random() < 0.8), i * TABLE
    c.rs_fault = int(rng.random() < 0.1)
    c.tune_open, c.tune_pi = int(rng.random() < 0.5), int(rng.random() < 0.5)
    c.tune_buffer = n * TABLE + i * POINTS
    return c


def random_alarms(rng, c):
    at = sorted(c.pv_min + c.pv_span * rng.random() for _ in range(4))
    if rng.random() < 0.6:
        c.low_low, c.low, c.high, c.high_high = (round_half_even(x) for x in at)
    if rng.random() < 0.6:
        c.yellow, c.red = round_half_even(0.02 * c.pv_span), round_half_even(0.1 * c.pv_span)
    if rng.random() < 0.5:
        c.rate_of_change = round_half_even(0.005 * c.pv_span)
    c.hysteresis = rng.choice([0.0, 1.0, 40.0])


def random_state(rng, c):
    s = State(period=c.period, gain=rng.choice([0.0, 0.5, 3.0]), reset=rng.choice([0.0, 2.0, 60.0]))
    s.rate = rng.choice([0.0, 0.0, 2.0])
    s.sp = round_half_even(clamp(c.pv_min + c.span * rng.random(), c.pv_min, c.pv_max))
    s.out = round_half_even(c.out_min + c.out_span * rng.random())
    s.goal_sp, s.goal_has_sp = s.sp, 1
    calculate_gains(c, s)
    return s


def random_event(rng, c, s):
    """What an operator may do between two segments."""
    kind = rng.randrange(7)
    if kind == 0:
        s.request, s.pending = rng.choice([1, 2, 4]), s.pending | bits.REQUEST
    elif kind == 1:
        s.goal, s.pending = rng.choice([2, 4]), s.pending | bits.GOAL
    elif kind == 2:
        s.rs_command, s.pending = rng.choice([1, 2, 4, 8]), s.pending | bits.SOAK
    elif kind == 3:
        s.tune_phase, s.pending = REQUESTED, s.pending | bits.TUNE
    elif kind == 4:
        s.pending ^= rng.choice([bits.STOPPED, bits.PROGRAM, bits.PROGRAM | bits.PV_STALE | bits.OUTPUT_CUT])
    elif kind == 5:
        s.sp = round_half_even(c.pv_min + c.span * rng.random())
    else:
        s.bias = c.out_min + c.out_span * rng.random()


def random_plc(rng):
    n = rng.randint(1, 4)
    configs = [random_config(rng, i, n) for i in range(n)]
    states = [random_state(rng, c) for c in configs]
    aux = [0.0] * (n * (TABLE + POINTS))
    for i, c in enumerate(configs):
        for j in range(8):
            pair = [c.pv_min + c.span * rng.random(), rng.choice([0.0, 20.0, 99.99]), rng.choice([0.0, 6.0]), 40.0]
            aux[i * TABLE + 4 * j : i * TABLE + 4 * j + 4] = pair
    signals = [rng.uniform(0.0, 100.0) for _ in range(6 * n)]
    level = rng.choice([0.0, 0.3])
    return configs, states, aux, signals, [rng.gauss(0.0, level) for _ in range(97)]


@pytest.fixture(scope="module")
def fast():
    return compile_functions([drive], inlined_kernels=INLINED)[drive]


def test_random_loops_run_to_the_same_bits_compiled_and_not(fast):
    rng = random.Random(20)
    seen = 0
    tuned, soaked = set(), 0
    for _ in range(CONFIGURATIONS):
        configs, states, aux, signals, noise = random_plc(rng)
        for segment in range(SEGMENTS):
            for c, s in zip(configs, states, strict=True):
                random_event(rng, c, s)
            head = segment * STEPS, (segment + 1) * STEPS
            advance(drive, fast, head, (configs, states, aux, signals), noise)
            for c, s in zip(configs, states, strict=True):
                seen |= s.status
                soaked |= s.aux_status
                tuned |= {c.tune_open} if s.tune_done else set()
    assert seen & 0x1BFF == 0x1BFF, "some mode, alarm or flag never came up"
    assert soaked & 0x70 == 0x70
    assert tuned == {0, 1}, "no auto-tune came to its end"


@dataclass(slots=True)
class Point:
    x: float
    n: int


def test_records_carry_every_field_there_and_back():
    points = Rows.from_objects([Point(0.1, 3), Point(-2.5, -(2**60))])
    points.array["x"] += 1.0

    assert record_type(Point) == np.dtype([("x", np.float64), ("n", np.int64)])
    assert list(map(astuple, points)) == [(1.1, 3), (-1.5, -(2**60))]
    assert len(record_array([], Point)) == 0


Item = TypeVar("Item")


class Group(NamedTuple, Generic[Item]):
    by: int
    points: MutableSequence[Item]
    only_read: Sequence[float]
    written: MutableSequence[float]
    whole: MutableSequence[int]
    none: MutableSequence[Point]


def moves(start: int, group: Group[Item], more: MutableSequence[float]) -> int:
    """Writes all that it gets (kernel)."""
    by, points, only_read, written, whole, none = group
    for i in range(len(points)):
        points[i].n += by
    written[0] = more[0] = 7.5 * only_read[0]
    whole[0] += 1
    return start + len(none)


def test_a_compiled_kernel_is_called_with_what_lies_in_arrays_and_groups_of_it_and_writes_there():
    points, numbers = Rows.from_objects([Point(0.5, 1), Point(0.0, 2**60)]), array("d", [1.0])
    group = Group(2, points, array("d", [1.0]), numbers, array("q", [3]), [])
    more = array("d", [0.0, 1.0])

    assert call_on_arrays(compile_functions([moves])[moves], moves, {Item: Point})(5, group, more) == 5
    assert [astuple(point) for point in points] == [(0.5, 3), (0.0, 2**60 + 2)]
    assert (numbers.tolist(), group.whole.tolist(), group.none, more.tolist()) == ([7.5], [4], [], [7.5, 1.0])


def one(x):
    return x + 1


def two(x):
    return x + 2


def calls(x):
    return 10 * one(x)


def test_everything_that_is_called_is_found():
    assert reachable_kernels([calls], {}) == [calls, one]
    assert reachable_kernels([calls], {one: two}) == [calls, two]
    assert {dl06.sample, clamp} <= set(reachable_kernels([scan], {}))


def test_the_cache_key_follows_callees_and_constants(monkeypatch):
    key = fingerprint([calls, one], {})

    assert fingerprint([calls, one], {}) == key
    assert fingerprint([calls, two], {one: two}) != key
    before = fingerprint(reachable_kernels([scan], {}), {})
    monkeypatch.setattr(dl06, "MAX_OUTPUT_COUNTS", 1000.0)
    assert fingerprint(reachable_kernels([scan], {}), {}) != before


def test_the_cache_key_follows_constants_of_modules(monkeypatch):
    """A slot of NextoPID's memory is named through its module, and is a number in the compiled code."""
    kernels = reachable_kernels([nextopid.scan], {})
    before = fingerprint(kernels, {})
    monkeypatch.setattr(slots, "LEAD_LAG", 99)
    assert fingerprint(kernels, {}) != before


def test_the_cache_key_follows_how_it_is_compiled(monkeypatch):
    keys = {fingerprint([one], {}), fingerprint([one], {}, [clamp])}
    monkeypatch.setitem(COMPILE_OPTIONS, "error_model", "python")
    assert len(keys | {fingerprint([one], {})}) == 3


@pytest.fixture
def kernels(monkeypatch, tmp_path):
    """The folder of compiled kernels, empty."""
    monkeypatch.setenv("PIDCFG_CACHE_DIR", str(tmp_path))
    warn_not_kept.cache_clear()
    return tmp_path / "kernels"


def files(kernels):
    return sorted(path for path in kernels.rglob("*") if path.is_file())


def test_kept_tells_whether_the_kernels_that_are_called_lie_in_the_cache(kernels):
    both = [calls, two]
    assert not is_cached([calls], both, {})
    assert compile_functions(both)[calls](1) == 20

    assert is_cached([calls], both, {})
    assert not is_cached(both, both, {}), "one that was not called is yet to be compiled"
    assert not is_cached([calls], both, {one: two})
    assert not is_cached([two], [two], {})
    assert len(files(kernels)) == 1, "what it calls needs no file of its own"


def test_kernels_of_an_installation_somewhere_else_are_the_same(kernels, tmp_path):
    """Not where the source lies counts, but what is compiled."""
    (tmp_path / "one.py").write_text(text := "def f(x):\n    return 3 * x\n")
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "one.py").write_text(text)
    compiled_here, found_there = (
        runpy.run_path(str(folder / "one.py"), run_name="one")["f"] for folder in (tmp_path, tmp_path / "there")
    )
    assert compile_functions([compiled_here])[compiled_here](2) == 6
    assert is_cached([found_there], [found_there], {})


def test_another_kind_of_argument_is_compiled_anew(kernels):
    assert compile_functions([calls])[calls](1) == 20
    assert compile_functions([calls])[calls](1.5) == 25.0
    assert compile_functions([calls])[calls](1) == 20


def cut(good, other):
    return good[:-100]


def empty(good, other):
    return b""


def changed(good, other):
    return good[:200] + bytes([good[200] ^ 1]) + good[201:]


def exchanged(good, other):
    return other


def planted(good, other):
    """What ran when numba read its own files: a pickle that calls something."""
    return b"cos\nmkdir\n(S'/tmp/pidcfg-was-here'\ntR."


@pytest.mark.parametrize("spoil", [cut, empty, changed, exchanged, planted])
def test_a_damaged_kernel_is_compiled_anew_and_healed(kernels, monkeypatch, spoil):
    compile_functions([two])[two](1)
    (other,) = files(kernels)
    compile_functions([calls])[calls](1)
    (path,) = set(files(kernels)) - {other}
    path.write_bytes(spoil(path.read_bytes(), other.read_bytes()))
    read = []
    monkeypatch.setattr("pidcfg.sim.engine.compile.pickle", SimpleNamespace(loads=read.append))

    assert not is_cached([calls], [calls], {})
    assert compile_functions([calls])[calls](1) == 20
    assert read == [], "nothing of it reached numba"
    assert is_cached([calls], [calls], {})
    monkeypatch.undo()


@pytest.mark.parametrize("text", ["disable_jit: [", "cpu_name: nonsense", "disable_jit: 1"])
def test_a_settings_file_of_numba_in_the_working_folder_is_not_read(tmp_path, text):
    (tmp_path / ".numba_config.yaml").write_text(text)
    code = "import yaml; from pidcfg.sim.engine import compile; n = compile.numba.config; n.reload_config(); "
    code += "import sys; print(n.DISABLE_JIT, n.CPU_NAME, sys.modules['yaml'] is yaml)"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("0 None True\n", "")


def refuse(*_):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_full_disk_does_not_end_a_run(kernels, monkeypatch):
    monkeypatch.setattr(Path, "replace", refuse)
    built = compile_functions([calls, two])
    with pytest.warns(NotKeptWarning, match="not kept, the next run compiles anew: No space left on device"):
        assert built[calls](1) == 20
    assert built[two](1) == 3, "and it is said once"
    assert files(kernels) == []


@pytest.mark.skipif(sys.platform == "win32", reason="permissions of POSIX")
def test_a_folder_of_somebody_else_gives_and_gets_nothing(kernels, monkeypatch):
    compile_functions([calls])[calls](1)
    kernels.chmod(0o777)
    monkeypatch.setattr("pidcfg.sim.engine.compile.pickle", SimpleNamespace(loads=refuse))
    before = [path.read_bytes() for path in files(kernels)]

    assert not is_cached([calls], [calls], {})
    with pytest.warns(NotKeptWarning, match=f"others may write to {kernels}"):
        assert compile_functions([calls])[calls](1) == 20
    assert [path.read_bytes() for path in files(kernels)] == before


def test_where_nothing_can_be_kept_kernels_run(monkeypatch, tmp_path):
    warn_not_kept.cache_clear()
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("PIDCFG_CACHE_DIR", str(blocked))

    assert not is_cached([one], [one], {})
    with pytest.warns(NotKeptWarning):
        assert compile_functions([one])[one](1) == 2


def singles(values, out):
    """Rounds every value (kernel)."""
    for i in range(len(values)):
        out[i] = single(values[i])


def test_single_precision_is_the_same_in_both_and_numpys():
    rng = random.Random(11)
    values = [rng.uniform(-1, 1) * 2.0 ** rng.randint(-160, 140) for _ in range(20_000)]
    values += [1 + 2.0**-24, 1 + 3 * 2.0**-24, 2.0**-150, 3 * 2.0**-150, 1e300, -1e300, 0.0, -0.0, 16777217.0]
    native = vector([0.0] * len(values))
    compile_functions([singles])[singles](vector(values), native)

    ours = [struct.pack("<d", single(x)) for x in values]
    with np.errstate(over="ignore"):
        assert ours == [struct.pack("<d", float(np.float32(x))) for x in values]
    assert ours == [struct.pack("<d", x) for x in native.tolist()]


# --- Whole runs in CPython and compiled: the same report and the same bits of every signal, over random scenarios -----


SCENARIOS = 4
MODELS = (
    "model: first_order, time_constant: {t}",
    "model: first_order, time_constant: {t}, dead_time: {d}",
    "model: second_order, time_constants: [{t}, 3], dead_time: {d}",
    "model: integrator, load: -0.4",
    "model: lead_lag, lead: 2, lag: {t}",
    "model: second_order, time_constant: {t}, damping: 0.3, dead_time: {d}, limits: [0, 70]",
    "model: integrator, load: 0.2, input: 1 - 0.1 * sqrt(abs({own})), dead_time: {d}",
    "model: valve, rate_limit: 2, dead_time: {d}",
)


class Signals(Recording):
    """Every value of every signal, as it is."""

    def add_rows(self, rows_of_values, rows):
        self.values.setdefault("all", []).append(rows_of_values[: rows * self._width].tobytes())

    def end(self):
        pass


def random_scenario(rng, vendor, loops, steps):
    text = f"pidcfg: 1\nscenario: random\nconfig: c.yaml\nduration: {steps * STEP:g}\nstep: {STEP}\n"
    text += f"seed: {rng.randrange(10**6)}\nplants:\n"
    for i in range(loops):
        plant = rng.choice(MODELS).format(t=rng.choice([2, 20]), d=rng.choice([0.5, 3.2, 0.1]), own=f"T{i + 1}.PV")
        gain = rng.choice([0.05, 0.5, 1])
        noise = rng.choice(["", f", noise: {rng.choice([0.1, 2])}"])
        text += f"  T{i + 1}: {{{plant}, gain: {gain}, initial: {rng.choice([3, 30])}{noise}}}\n"
    events = []
    for _ in range(rng.randint(2, 6)):
        at, loop = rng.randrange(steps) * STEP, f"T{rng.randint(1, loops)}"
        key = SETPOINTS.get(vendor, "setpoint.value")
        kinds = (
            f"loop: {loop}, set: {{{key}: {rng.choice([20, 55, 92])}}}",
            f"loop: {loop}, set: {{{key}: {rng.randint(5, 95)}}}",
            f"loop: {loop}, disturb: {{gain: {rng.choice([0.2, 2])}}}",
            f"loop: {loop}, disturb: {{noise: {rng.choice([0, 1])}}}",
            f"loop: {loop}, pv: {rng.choice([0, 99])}, for: 20",
        )
        events.append(f"  - {{at: {at:g}, {rng.choice(kinds)}}}\n")
    return text + "events:\n" + "".join(events)


def outcome(case, name, *, judged=True):
    signals = Signals()
    report = asdict(ours(case, name, recording=signals, judged=judged))
    return report.pop("engine"), report, signals.levels, b"".join(signals.values["all"])


def check(case):
    """Holds one engine to the other; returns the report and the number of signals' bytes."""
    (plain, *ours_plain), (fast, *ours_fast) = (outcome(case, name) for name in ("python", "numba"))
    assert (plain, fast) == ("python", "numba")
    assert repr(ours_plain[:2]) == repr(ours_fast[:2])
    assert ours_plain[2] == ours_fast[2]
    return ours_plain[0], len(ours_plain[2])


@pytest.mark.parametrize("vendor", VENDORS)
def test_random_runs_leave_the_same_bits_compiled_and_not(vendor, monkeypatch):
    pytest.importorskip("numba")
    monkeypatch.setattr(engine, "LOG_ROWS", 1)  # a full log returns to Python again and again
    rng = random.Random(vendor)
    moved = 0
    for _ in range(SCENARIOS):
        loops, steps = rng.randint(1, 3), rng.randint(150, 500)
        case = loaded(configuration(vendor, loops), random_scenario(rng, vendor, loops, steps))
        report, size = check(case)
        moved += sum(loop["metrics"]["iae"] is not None for loop in report["loops"].values())
        assert size == 8 * (steps + 1) * len(report["signals"])
    assert moved, "no loop came into control"


def test_a_loop_whose_alarms_come_and_go_leaves_the_same_bits_and_the_same_log():
    pytest.importorskip("numba")
    report, _ = check(loaded(*limit_cycle(1500)))

    assert len(report["loops"]["T1"]["alarms"]) > 20


@pytest.mark.skipif(compiler() is None, reason="no compiler of C")
@pytest.mark.parametrize("loops", [1, 8])
def test_a_dl06_by_hand_in_c_leaves_the_same_bits(tmp_path, loops):
    case, by_hand = loaded(configuration("dl06", loops), scenario("dl06", loops, 2_000, noise=True)), []
    seconds = Twin(tmp_path).run(lambda: by_hand.append(outcome(case, "numba", judged=False)))
    assert seconds > 0, "C has run"
    assert repr(by_hand) == repr([outcome(case, "numba", judged=False)])


class ChosenError(Exception):
    """Which engine a run would have taken."""


@pytest.mark.parametrize("drawn", [False, True])
@pytest.mark.parametrize("steady", [False, True])
@pytest.mark.parametrize("vendor", VENDORS)
def test_auto_asks_for_the_compiled_kernels_that_a_run_calls_and_for_no_others(monkeypatch, vendor, steady, drawn):
    compiler = pytest.importorskip("pidcfg.sim.engine.compile", reason="the extra fast")

    def choose(*arguments):
        raise ChosenError(true(*arguments))

    def kept(wanted, *_):
        asked.update(f.__name__ for f in wanted)
        return missing not in {f.__name__ for f in wanted}

    true = run.choose_engine
    monkeypatch.setattr(run, "choose_engine", choose)
    monkeypatch.setattr(compiler, "is_cached", kept)
    monkeypatch.setattr(engine, "holds_entries", "kernels".__eq__)
    monkeypatch.setattr(engine, "LOADING_TIME", 0)
    monkeypatch.setattr(engine, "KEPT_KERNELS", {})
    text = f"pidcfg: 1\nscenario: s\nconfig: c.yaml\nduration: 9\nstep: {STEP}\n" + "initial: steady\n" * steady
    text += "plants: {T1: {model: first_order, gain: 0.5, time_constant: 2" + ", noise: 1" * drawn + "}}\n"
    case = loaded(configuration(vendor, 1), text)
    called = {"advance", *["settle"] * steady, *["draw_normals"] * drawn}
    for missing in ("", *called):
        asked = set()
        engine._in_cache.cache_clear()
        with pytest.raises(ChosenError, match="python" if missing else "numba"):
            ours(case, "auto")
        assert asked == called or (missing and asked < called)
    asked = set()
    engine._in_cache.cache_clear()
    monkeypatch.setattr(engine, "holds_entries", lambda _: False)
    with pytest.raises(ChosenError, match="python"):
        ours(case, "auto")
    assert not asked, "where nothing is kept, no compiler is asked"
    engine._in_cache.cache_clear()
