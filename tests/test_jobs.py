"""How work is done: by several processes, in several threads, and in calls that grow with the loops."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from pathlib import Path
from threading import local

import pytest
import ruamel.yaml
from click.testing import CliRunner

import certify_rig
import pidcfg
from jobs_rig import doubling, dying, waiting
from pidcfg.cli.console import system_refusal
from pidcfg.cli.main import cli
from pidcfg.conversion.pipeline import convert
from pidcfg.output.arguments import ArgumentError
from pidcfg.schemas.generic import GenericFile
from pidcfg.text import processes, source
from pidcfg.text.processes import FILE_MICROSECONDS, START_MICROSECONDS, WorkerPool
from pidcfg.text.writer import yaml_text
from pidcfg.vendors import VENDORS

EXAMPLES = Path(__file__).parents[1] / "examples"


def alive(number):
    """Whether a process still runs."""
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return Path(f"/proc/{number}/stat").read_text().split()[2] != "Z" if Path("/proc").is_dir() else True


def in_group(place, group):
    """Whether a process by its place in /proc belongs to a group, and runs."""
    try:
        state, _, number = place.read_text().rpartition(")")[2].split()[:3]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return number == str(group) and state != "Z"


def test_results_come_back_in_order_from_other_processes():
    found = list(WorkerPool(2, doubling, (1,)).results(range(12)))
    assert [number for number, _ in found] == [2 * i + 1 for i in range(12)]
    assert os.getpid() not in {place for _, place in found}


def test_processes_are_started_only_where_they_pay():
    few = START_MICROSECONDS // FILE_MICROSECONDS - 1
    here = list(WorkerPool(2, doubling, (0,)).adaptive_results(range(2, few + 2), lambda _: 0.0))
    assert {place for _, place in here} == {os.getpid()}
    mixed = list(WorkerPool(2, doubling, (0,)).adaptive_results(range(6), lambda _: START_MICROSECONDS / 4))
    assert [number for number, _ in mixed] == [0, 2, 4, 6, 8, 10]
    assert [place == os.getpid() for _, place in mixed] == [True] + [False] * 5
    alone = list(WorkerPool(1, doubling, (0,)).adaptive_results(range(2, 5), lambda _: START_MICROSECONDS))
    assert {place for _, place in alone} == {os.getpid()}


def test_a_process_that_is_gone_is_one_clear_error():
    with pytest.raises(ChildProcessError) as caught:
        list(WorkerPool(2, dying).results(range(8)))
    assert system_refusal(caught.value) == "a process ended in the middle of its work; try --jobs 1"
    assert "No child" in system_refusal(ChildProcessError(10, "No child processes"))


def test_who_stops_looking_leaves_no_process():
    results = WorkerPool(2, waiting).results(range(4))
    worker = next(results)
    assert alive(worker)
    results.close()
    assert not alive(worker)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Two scenarios, what one of them runs, a configuration with an error, and processes from the first file on."""
    monkeypatch.setattr(processes, "START_MICROSECONDS", 0)
    monkeypatch.chdir(tmp_path)
    for name in ("dpide/oven", "dl06/flow"):
        scenario = (EXAMPLES / f"{name}.scenario.yaml").read_bytes()
        Path(f"{name[-4:]}.scenario.yaml").write_bytes(scenario)
        Path(f"{name.rpartition('/')[2]}.yaml").write_bytes((EXAMPLES / f"{name}.yaml").read_bytes())
    Path("faulty.yaml").write_text("pidcfg: 1\nvendor: dl06\nloops: [{name: A, modee: auto}]\n")
    return tmp_path


@pytest.mark.parametrize(
    ("words", "most", "code"),
    [
        (("report", ".", "-o", "-"), 3, 1),
        (("simulate", "oven.scenario.yaml", "faulty.yaml", "--format", "gitlab"), 2, 2),
    ],
    ids=("report", "simulate"),
)
def test_the_number_of_processes_changes_no_byte(folder, words, most, code):
    ran = [CliRunner().invoke(cli, [*words, "--jobs", str(jobs + 1)]) for jobs in range(most)]
    assert len({(one.exit_code, one.stdout, one.stderr) for one in ran}) == 1
    assert "faulty" in ran[0].stdout
    assert ran[0].exit_code == code, ran[0].stderr


def test_loops_of_a_conversion_are_judged_alike_by_any_number(monkeypatch):
    monkeypatch.setattr("pidcfg.study.verification.verify.MIN_PARALLEL_LOOPS", 2)
    loop = "output_raises_pv: true, sample_time: 1, pv: {range: [0, 9]}, setpoint: {value: 5}, output: {range: [0, 9]}"
    loops = [f"  - {{name: L{i}, {loop}, tuning: {{gain: {i}, integral_time: 20}}}}\n" for i in (1, 2)]
    source = "pidcfg: 1\nvendor: generic\nloops:\n" + "".join(loops)
    one, two = (pidcfg.convert(source, "click", verify=True, jobs=jobs) for jobs in (1, 2))
    assert len(one.verified) == 2
    assert (one.to_json(), one.verified) == (two.to_json(), two.verified)


def test_sides_of_a_difference_are_judged_alike_by_any_number(folder, monkeypatch):
    monkeypatch.setattr("pidcfg.study.verification.verify.MIN_PARALLEL_LOOPS", 1)
    words = ["diff", "oven.yaml", "flow.yaml", "--verify=report", "--format", "json"]
    text = Path("oven.yaml").read_text("utf-8")
    Path("flow.yaml").write_text(text.replace("gain: ", "gain: 1", 1), "utf-8")
    one, two = (CliRunner().invoke(cli, [*words, "--jobs", str(jobs)]) for jobs in (1, 2))
    assert one.stdout == two.stdout
    assert '"verify"' in one.stdout
    with pytest.raises(ArgumentError, match="`jobs` is 0; write a whole number above 0"):
        pidcfg.diff("oven.yaml", "flow.yaml", jobs=0)


def test_an_input_that_another_process_has_read_is_no_output(folder):
    os.link("flow.yaml", "door.html")
    words = ["report", "oven.scenario.yaml", "flow.scenario.yaml", "--jobs", "2", "-o", "door.html", "--force"]
    result = CliRunner().invoke(cli, words)
    assert "door.html is a file that is read" in result.stderr
    assert Path("door.html").read_bytes() == (EXAMPLES / "dl06/flow.yaml").read_bytes()


def test_there_is_a_variable_for_it(folder, monkeypatch):
    monkeypatch.setenv("PIDCFG_REPORT_JOBS", "0")
    result = CliRunner().invoke(cli, ["report", "oven.yaml", "-o", "-"])
    assert (result.exit_code, "--jobs" in result.output) == (2, True)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no process groups to interrupt")
def test_ctrl_c_ends_all_processes_with_one_word(tmp_path, heeding_interrupts):
    (tmp_path / "loop.yaml").write_text(certify_rig.CONFIG)
    text = certify_rig.SCENARIO.format(vary=certify_rig.GAIN, expect=certify_rig.PASSES)
    (tmp_path / "run.scenario.yaml").write_text(text)
    words = ["certify", "run.scenario.yaml", "--jobs", "2", "--samples", "1000000", "--resume", "kept.state"]
    running = subprocess.Popen(
        [sys.executable, "-m", "pidcfg", *words],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while not (tmp_path / "kept.state").exists() and running.poll() is None:
        time.sleep(0.01)
    os.killpg(running.pid, signal.SIGINT)
    try:
        out, err = running.communicate(timeout=60)
    finally:
        if running.poll() is None:
            os.killpg(running.pid, signal.SIGKILL)
            running.communicate()
    assert (running.returncode, out, err) == (130, "", "\ninterrupted\n")
    for _ in range(1000):  # whoever shares the group ends with the pipe that is closed by now
        if not any(in_group(place, running.pid) for place in Path("/proc").glob("[0-9]*/stat")):
            break
        time.sleep(0.01)
    else:
        pytest.fail("a process is left")


# --- The calls from several threads at once, with the parser in C and with the one in Python --------------------------


ROOT = Path(__file__).parents[1]
FILES = [
    *(path for path in sorted(ROOT.glob("examples/*/*.yaml")) if path.parent.name != "nextopid"),
    *sorted(ROOT.glob("tests/cases/PID0*.yaml")),
    *sorted(ROOT.glob("tests/cases/PID1*.yaml"))[::6],
]


@pytest.fixture(params=[False, True], ids=["c", "python"])
def parsers(request, monkeypatch):
    """New readers, of one kind; threads take turns as often as Python can."""
    monkeypatch.setattr(ruamel.yaml, "YAML", partial(ruamel.yaml.YAML, pure=request.param))
    monkeypatch.setattr(source, "THREAD_DATA", local())
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(interval)


def findings(path):
    """What a check says of a file, comments of the file included."""
    return pidcfg.check(path).to_json()


def test_files_that_are_checked_at_once_have_their_own_findings(parsers):
    alone = [findings(path) for path in FILES]
    assert sum(bool(result["findings"]) for result in alone) > 5
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(findings, FILES)) == alone


def test_a_text_that_breaks_off_leaves_nothing_to_the_next(parsers):
    good = findings(FILES[0])
    for text in ("a: [1, {b: 'c", "a: b: c", "- 1\n\t- 2", "&a [*a", "a: |\n  b\n c"):
        assert not pidcfg.check(text).ok
        assert findings(FILES[0]) == good


# --- Work grows with the number of loops and no faster: Python's calls are counted, never the clock -------------------


LOOP = {
    "mode": "auto",
    "output_raises_pv": True,
    "sample_time": 1,
    "tuning": {"gain": 1.5, "integral_time": 60, "derivative_time": 5},
    "pv": {"range": [0, 100], "unit": "degC"},
    "setpoint": {"value": 50},
    "output": {"range": [0, 100]},
    "alarms": {"pv": {"low": 10, "high": 90}, "hysteresis": 1},
}
FEWEST = {"dl06": 2, "click": 2, "ezlogix": 2}
"""Loops to begin with, where a PLC has not many; it has four times as many."""
BOUND = {"dl06": 1.03}
"""How many times the calls may be that so many more loops would take by the step before, where it is not 1.01: each of
the few loops of a DL06 is compared with the others."""
WORK = {
    "check": lambda text, _: pidcfg.check_text(text, "a.yaml"),
    "encode": lambda text, _: pidcfg.encode(text),
    "diff": lambda text, _: pidcfg.diff(text, text.replace("1.5", "1.6")),
    "convert": lambda text, vendor: pidcfg.convert(text, to="dpide" if vendor != "dpide" else "nextopid"),
    "explain": lambda text, vendor: pidcfg.explain(ASKED[vendor], vendor=vendor, config=text),
}
ASKED = {
    "dl06": "V2005",
    "click": "DS5",
    "ezlogix": "R5",
    "nextopid": "PIDA_REAL.Kp",
    "dpide": "Kc_Kp",
    "generic": "tuning.gain",
}
"""What a page is asked for of, where every loop of the configuration has it if its address is not one loop's."""


@cache
def configuration(vendor, loops):
    """A file of so many loops."""
    data = {"pidcfg": 1, "vendor": "generic", "loops": [{"name": f"L{100 + i}", **LOOP} for i in range(loops)]}
    if vendor != "generic":
        data = convert(GenericFile.model_validate(data), VENDORS["generic"], VENDORS[vendor], {}).data
    return yaml_text(data)


def calls_of(work):
    """The calls that some work takes."""
    events = []
    sys.setprofile(lambda _, event, __: events.append(event))
    try:
        work()
    finally:
        sys.setprofile(None)
    return events.count("call") + events.count("c_call")


@pytest.mark.parametrize("what", WORK)
@pytest.mark.parametrize("vendor", VENDORS)
def test_calls_grow_with_the_loops_and_no_faster(vendor, what):
    texts = [configuration(vendor, FEWEST.get(vendor, 5) * factor) for factor in (1, 2, 4)]
    assert not any(pidcfg.check_text(text).failed for text in texts)
    WORK[what](texts[0], vendor)  # so that everything is loaded
    few, twice, four_times = (calls_of(lambda text=text: WORK[what](text, vendor)) for text in texts)
    assert four_times - twice <= BOUND.get(vendor, 1.01) * 2 * (twice - few)
