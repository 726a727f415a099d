"""``pidcfg certify``: what it counts, what a sample is, how it ends, and that nobody can tell who ran the samples."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from hashlib import sha256
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from click.testing import CliRunner

import pidcfg
from certify_rig import CONFIG, GAIN, PASSES, files, killed_always, killed_once, loaded_of, scenario
from pidcfg.cli.formats.batches import VERBOSE_HINT, batches_text
from pidcfg.cli.main import cli
from pidcfg.output.arguments import ArgumentError
from pidcfg.sim.engine.run import Settings
from pidcfg.study.certification import certify as certify_module
from pidcfg.study.certification import samples as workers
from pidcfg.study.certification.certify import lower_bound, samples_that_show
from pidcfg.study.certification.samples import Batch, draw_number, hash_sources, run_sample, seed_of
from pidcfg.study.certification.tally import json_of
from pidcfg.text import processes
from pidcfg.text.reader import DEFAULT
from pidcfg.text.source import read_document
from pidcfg.vendors import VENDORS
from test_vendors import scenario as vendor_scenario
from test_vendors import starter

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"


def certify(text, samples=60, **settings):
    """The result of a scenario's text."""
    return pidcfg.certify(Path("run.scenario.yaml"), samples=samples, files=files(text), **settings)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the scenario and its configuration."""
    for name, text in files(scenario()).items():
        (tmp_path / name).write_text(text, "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def command(*words, **settings):
    """The command in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "pidcfg", "certify", "run.scenario.yaml", *words],
        capture_output=True,
        text=True,
        check=False,
        env=dict(os.environ),
        **settings,
    )


# --- a sample is a scenario ------------------------------------------------------------------------------------------

VARIED = {
    "dl06": ("tuning.gain", "±20 %"),
    "click": ("tuning.proportional_gain", "±20 %"),
    "ezlogix": ("tuning.proportional_gain", "{uniform: [1.5, 2.5]}"),
    "nextopid": ("Kp", "{normal: [0.8, 0.2], limits: [0.4, 1.2]}"),
    "dpide": ("Kc_Kp", "±20 %"),
    "generic": ("tuning.integral_time", "±20 %"),
}


def assert_samples_are_scenarios(name, text, others, samples):
    """Each sample is, bit for bit, the run of its written-out scenario; and they differ."""
    reader = {name: text, **others}
    document = read_document(text.encode(), name, DEFAULT)
    from pidcfg.study.scenario import load_scenario
    from pidcfg.text.reader import Texts

    loaded = load_scenario(document, Texts(reader))
    varies, problems = loaded.uncertainties(loaded.new_plc())
    assert problems == []
    config = next(text for other, text in reader.items() if other != name).encode()
    kept, batch = workers.Job(name, text, loaded.config, config, 11, "python", DEFAULT).load_batch()
    assert [one.random_stream for one in batch.varies] == [one.random_stream for one in varies]
    reports = []
    for i in range(samples):
        seen, report = run_sample(kept, batch, i, Settings("python"))
        written = batch.scenario_text(i, seen.numbers)
        alone = pidcfg.simulate(written, name=name, files=reader, engine="python").report
        assert alone is not None
        assert report == alone
        assert seen.passed == alone.passed
        reports.append(report)
    finals = [[signal.final for signal in report.signals.values()] for report in reports]
    assert all(one != finals[0] for one in finals[1:])


@pytest.mark.parametrize("vendor", VENDORS.values(), ids=list(VENDORS))
def test_a_sample_is_the_run_of_its_written_out_scenario(vendor):
    text = vendor_scenario(vendor)
    loop = re.search(r"loop: ([\w-]+)", text).group(1)
    key, spread = VARIED[vendor.key]
    plants = "    plant: {gain: ±10 %, time_constant: ±25 %}"
    text += f"vary:\n  plants:\n{plants}\n  loops:\n    {loop}:\n      {key}: {spread}\n"
    assert_samples_are_scenarios("run.scenario.yaml", text, {"starter.yaml": starter(vendor)}, 3)


@pytest.mark.parametrize(
    ("example", "plant", "loop"),
    [
        ("nextopid/cascade", "TIC_2: {gain: ±5 %, dead_time: {uniform: [1, 3]}}", "TIC_1: {Kp: ±10 %}"),
        ("nextopid/override", "", "TIC_1: {Kp: ±10 %}"),
        ("dl06/feedpump", "", "FIC-402: {tuning.gain: ±10 %, tuning.reset: ±10 %}"),
    ],
)
def test_a_sample_of_a_network_or_a_cascade_is_the_run_of_its_scenario(example, plant, loop):
    name = f"{example}.scenario.yaml"
    text = (EXAMPLES / name).read_text("utf-8")
    text = re.sub(r"^duration: .*$", "duration: 120", text, flags=re.MULTILINE)
    text = re.sub(r"(?ms)^(events|expect):.*", "", text)
    plants = f"  plants:\n    {plant}\n" if plant else ""
    text += f"\nvary:\n{plants}  loops:\n    {loop}\n"
    others = {f"{example}.yaml": (EXAMPLES / f"{example}.yaml").read_text("utf-8")}
    assert_samples_are_scenarios(name, text, others, 2)


def test_a_written_out_scenario_has_the_drawn_numbers_and_no_vary():
    vary = "  seed: 9\n  plants:\n    TIC-1: {gain: ±30 %, dead_time: {uniform: [0 s, 3 s]}}\n"
    vary += "  loops:\n    TIC-1: {tuning.integral_time: ±10 %}"
    loaded = loaded_of(scenario(vary))
    varies, problems = loaded.uncertainties(loaded.new_plc())
    assert problems == []
    batch = Batch(loaded.document, varies, 9)
    data = read_document(batch.scenario_text(4, batch.draw_numbers(4)).encode(), "x.yaml", DEFAULT).data
    gain, dead_time, integral = (draw_number(what, 9, 4) for what in varies)
    assert 1.4 <= gain <= 2.6
    assert data["plants"]["TIC-1"] == {"model": "dead_time", "gain": f"{gain:.10g}", "dead_time": f"{dead_time:.10g}"}
    assert data["events"] == [{"at": "0", "loop": "TIC-1", "set": {"tuning.integral_time": f"{integral:.10g} min"}}]
    assert 1.8 <= integral <= 2.2
    assert data["seed"] == str(seed_of(9, 4))
    assert data["scenario"] == "An output that stands (sample 4)"
    assert "vary" not in data
    assert data["expect"] == [{"signal": "TIC-1.PV", "max": "129.9"}]


def test_events_of_the_file_come_after_what_is_drawn():
    text = (
        scenario("  loops:\n    TIC-1: {tuning.gain: ±10 %}")
        + "events:\n  - {at: 0, loop: TIC-1, set: {tuning.gain: 3}}\n"
    )
    loaded = loaded_of(text)
    batch = Batch(loaded.document, loaded.uncertainties(loaded.new_plc())[0], 1)
    first, second = batch.scenario_data(0, batch.draw_numbers(0))["events"]
    assert (list(first["set"]), second["set"]) == (["tuning.gain"], {"tuning.gain": "3"})


def test_plants_as_a_list_and_the_text_of_the_file_stay_as_they_are():
    text = """\
pidcfg: 1
scenario: "A title: with a colon # and more"
config: loop.yaml
duration: 10 s
plants:
  - {name: tank, model: second_order, time_constants: [3, 4], input: "TIC-1.OUT", gain: 2}
connect: {TIC-1.PV: max(tank, 1) * 1}
vary: {plants: {tank: {time_constants.1: ±50 %, noise: {uniform: [1, 2]}}}}
events:
  - {at: 5, loop: TIC-1, set: {tuning: {gain: 3}}}
"""
    loaded = loaded_of(text)
    batch = Batch(loaded.document, loaded.uncertainties(loaded.new_plc())[0], 1)
    numbers = batch.draw_numbers(0)
    data = read_document(batch.scenario_text(0, numbers).encode(), "x.yaml", DEFAULT).data
    assert data["scenario"] == "A title: with a colon # and more (sample 0)"
    assert data["plants"][0]["time_constants"] == ["3", f"{numbers[0]:.10g}"]
    assert data["plants"][0]["noise"] == f"{numbers[1]:.10g}"
    assert data["connect"] == {"TIC-1.PV": "max(tank, 1) * 1"}
    assert data["events"][-1] == {"at": "5", "loop": "TIC-1", "set": {"tuning": {"gain": "3"}}}
    assert batch.make_scenario(0, numbers) == loaded_of(batch.scenario_text(0, numbers)).scenario
    assert loaded.document.data["plants"][0]["time_constants"] == ["3", "4"]


# --- what is counted -------------------------------------------------------------------------------------------------


def test_counts_are_those_of_the_closed_form():
    found = certify(scenario(), samples=80).certification
    loaded = loaded_of(scenario())
    (what,) = loaded.uncertainties(loaded.new_plc())[0]
    gains = [float(what.number_text(draw_number(what, 3, i))) for i in range(80)]
    held = sum(50 * gain <= 129.9 for gain in gains)
    assert 70 < held < 80
    (expectation,) = found.expectations
    assert (expectation.held, expectation.samples, expectation.wanted) == (held, 80, 90)
    assert (found.samples, found.seed, found.all_passed, found.failed_to_run) == (80, 3, held, 0)
    worst = max(gains)
    assert found.worst[0].sample == gains.index(worst)
    assert found.worst[0].margin == pytest.approx((129.9 - 50 * worst) / 129.9, rel=1e-6)
    assert [one.margin for one in found.worst] == sorted(one.margin for one in found.worst)
    (effect,) = found.effects
    assert (effect.label, effect.text, effect.lowest) == ("TIC-1 gain", "±30 %", 100)
    highest = [gain for gain in gains if gain >= 1.4 + 0.8 * 1.2]
    assert effect.highest == pytest.approx(100 * sum(50 * g <= 129.9 for g in highest) / len(highest))


def test_an_expectation_without_share_may_never_fail():
    expect = "  - {signal: TIC-1.PV, max: 129.9}\n  - {signal: TIC-1.PV, min: 60}"
    result = certify(scenario(expect=expect), samples=80)
    first, second = result.certification.expectations
    assert (first.wanted, first.passed, second.passed) == (None, False, True)
    assert first.share > 90
    assert not result.ok


def test_a_bound_below_its_share_fails_though_the_share_is_reached():
    expect = "  - {signal: TIC-1.PV, max: 124, share: 90 %}"
    result = certify(scenario(expect=expect), samples=60)
    (one,) = result.certification.expectations
    assert one.bound < 90 <= one.share
    assert not one.passed
    assert not result.ok
    assert certify(scenario(expect=expect.replace("90 %", "75 %")), samples=60).ok


def test_a_failed_standing_expectation_fails_the_batch():
    config = CONFIG.replace("mode: manual", "mode: auto")
    text = scenario("  plants:\n    TIC-1: {gain: {uniform: [0.2, 2]}}", "  - {signal: TIC-1.PV, min: -1}")
    text = text.replace("duration: 10", "duration: 300")
    text = text.replace("dead_time, gain", "first_order, time_constant: 5, gain")
    result = pidcfg.certify(text, samples=12, name="run.scenario.yaml", files={"loop.yaml": config})
    failing = [one for one in result.certification.standing if not one.passed]
    assert {one.kind for one in failing} == {"saturated", "error-stands", "not-settled"}
    assert {one.kind for one in failing if one.unproven} == {"not-settled"}
    assert 0 < failing[0].held < 12
    assert not result.ok
    assert result.certification.expectations[0].passed
    single = [
        pidcfg.simulate(one.text, name="x.yaml", files={"loop.yaml": config}).report
        for one in result.certification.worst
        if one.failed
    ]
    assert single
    assert not any(report.passed for report in single)


def test_a_sample_that_cannot_run_counts_as_failed_everywhere():
    vary = (
        "  plants:\n    TIC-1: {gain: {normal: [2, 0.1], limits: [2.15, 9]}, load: {normal: [0, 1], limits: [2.4, 9]}}"
    )
    result = certify(scenario(vary=vary, expect="  - {signal: TIC-1.PV, min: 0, share: 5 %}"), samples=60)
    found = result.certification
    assert 0 < found.failed_to_run < 60
    assert "100 numbers, none within 2.4 to 9" in found.reasons[0]
    assert found.expectations[0].held == 60 - found.failed_to_run == found.all_passed
    assert all(one.held == 60 - found.failed_to_run for one in found.standing)
    assert found.worst[0].margin is None
    assert found.worst[0].failed
    assert found.expectations[0].passed
    assert not result.ok


def test_an_error_in_a_run_counts_as_a_sample_that_cannot_run():
    text = scenario("  plants:\n    x: {load: {uniform: [-60, 60]}}", "  - {signal: TIC-1.OUT, min: 0}")
    wired = "  - {name: x, model: dead_time, input: TIC-1.OUT}\nconnect:\n  TIC-1.PV: sqrt(x)"
    text = text.replace("  TIC-1: {model: dead_time, gain: 2}", wired)
    result = certify(text, samples=40)
    found = result.certification
    assert 0 < found.failed_to_run < 20
    assert not result.ok


def test_a_sample_that_does_not_come_to_rest_counts_as_one_that_cannot_run():
    text = scenario(expect="  - {signal: TIC-1.PV, min: -1e9}").replace("model: dead_time", "model: integrator")
    found = certify(text.replace("seed: 3", "seed: 3\ninitial: steady"), samples=3).certification
    assert found.failed_to_run == 3
    assert found.expectations[0].held == 0
    assert certify(text, samples=3).certification.failed_to_run == 0


# --- nobody can tell who ran them ------------------------------------------------------------------------------------


def test_jobs_give_the_same_bytes(folder):
    outputs = {command("--samples", "110", "--format", "json", "--jobs", str(jobs)).stdout for jobs in (1, 2, 3)}
    assert len(outputs) == 1
    assert json.loads(outputs.pop())["samples"] == 110


def test_a_killed_process_costs_nothing_but_time(tmp_path, monkeypatch):
    monkeypatch.setenv("KILLED_ONCE", str(tmp_path / "mark"))
    monkeypatch.setattr(processes, "_run_item", killed_once)
    found = certify(scenario(), samples=40, jobs=2).to_json()
    assert (tmp_path / "mark").exists()
    assert found == certify(scenario(), samples=40).to_json()


def test_where_each_process_ends_the_batch_ends(monkeypatch, folder):
    monkeypatch.setattr(processes, "_run_item", killed_always)
    result = CliRunner().invoke(cli, ["certify", "run.scenario.yaml", "--samples", "40", "--jobs", "2"])
    assert (result.exit_code, result.stdout) == (1, "")  # click's own; `main` makes it 2
    assert "a process ended at samples 0 to 39, perhaps for want of memory" in result.stderr


def test_a_state_continues_with_the_same_result():
    whole = certify(scenario(), samples=150).to_json()
    for first in (1, 64, 100):
        states = []
        certify(scenario(expect="  - {signal: TIC-1.PV, max: 129.9, share: 4 %}"), samples=first)
        text = scenario(expect=PASSES.replace("90", "4"))
        certify(text, samples=first, keep=states.append)
        assert certify(text, samples=150, state=states[-1]).to_json() == certify(text, samples=150).to_json()
    assert whole["samples"] == 150


def test_the_engine_is_chosen_by_the_steps_of_the_whole_batch(monkeypatch):
    asked, choose = [], certify_module.choose_engine
    monkeypatch.setattr(certify_module, "choose_engine", lambda *words: asked.append(words[:2]) or choose(*words))
    certify(scenario(expect=PASSES.replace("90", "4")), samples=3)
    assert asked == [("auto", 3 * (10 + 1))], "10 s in steps of 1 s"


def test_a_state_that_continues_runs_only_new_samples(monkeypatch):
    text, states, ran = scenario(expect=PASSES.replace("90", "4")), [], []
    certify(text, samples=70, keep=states.append)
    assert len(states) == 2
    original = workers.Sampler.run_sample
    monkeypatch.setattr(workers.Sampler, "run_sample", lambda self, i: ran.append(i) or original(self, i))
    certify(text, samples=75, state=states[-1])
    trial = list(range(64))  # whether this machine calculates like the one that began
    assert ran == [*trial, *range(70, 75)]


def test_a_state_of_a_machine_that_calculates_otherwise_is_refused():
    states = []
    certify(scenario(), samples=30, keep=states.append)
    state = json.loads(states[-1].splitlines()[1])
    assert state["trial"][0] == 30
    for trial in ([30, "0" * 64], [29, state["trial"][1]]):
        with pytest.raises(ArgumentError, match="this machine does not calculate alike"):
            certify(scenario(), samples=40, state=signed(json_of(state | {"trial": trial})))


@pytest.fixture(scope="module")
def kept_state():
    """A state after 64 samples."""
    states = []
    certify(scenario(), samples=64, keep=states.append)
    return states[-1]


def signed(body):
    """A state with its checksum."""
    return f"{sha256(body.encode()).hexdigest()}\n{body}\n".encode()


def changed(state, key, value):
    """The body of a state with another value."""
    return json_of(json.loads(state.splitlines()[1]) | {key: value})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda state: state[:-40], "damaged"),
        (lambda state: state.replace(b'"samples":64', b'"samples":65'), "damaged"),
        (lambda _: b"", "damaged"),
        (lambda _: b"\xff\xfe", "no file of --resume"),
        (lambda _: signed("{}"), "damaged"),
        (lambda _: signed("[]"), "damaged"),
        (lambda _: signed("no JSON"), "damaged"),
        (lambda _: signed("[" * 100_000), "damaged"),
        (lambda state: signed(changed(state, "tally", {})), "damaged"),
        (lambda state: signed(changed(state, "tally", None)), "damaged"),
        (lambda state: signed(changed(state, "trial", [1])), "damaged"),
        (lambda state: signed(changed(state, "trial", ["x", ""])), "damaged"),
        (lambda state: signed(changed(state, "ahead", 3)), "damaged"),
        (lambda state: state, "it has 64 samples already, more than 60"),
    ],
)
def test_a_state_that_does_not_fit_is_refused(kept_state, change, message):
    with pytest.raises(ArgumentError, match=message):
        certify(scenario(), samples=60, state=change(kept_state))


@pytest.mark.parametrize("what", ["seed", "scenario", "configuration", "program"])
def test_a_state_of_something_else_is_refused(what, monkeypatch):
    states = []
    certify(scenario(), samples=64, keep=states.append)
    text, config, seed = scenario(), CONFIG, None
    if what == "seed":
        seed = 4
    elif what == "scenario":
        text = scenario().replace("gain: 2}", "gain: 2.0}")
    elif what == "configuration":
        config = CONFIG.replace("gain: 2.5", "gain: 2.6")
    else:
        monkeypatch.setattr("pidcfg.study.certification.tally.hash_sources", lambda: "another")
    with pytest.raises(ArgumentError, match="belongs to another scenario"):
        pidcfg.certify(
            text, name="run.scenario.yaml", samples=70, seed=seed, files={"loop.yaml": config}, state=states[0]
        )


def test_sources_are_a_hash_of_the_package():
    assert re.fullmatch("[0-9a-f]{64}", hash_sources())


def test_a_recording_has_the_signals_of_its_loop():
    job = workers.Job("run.scenario.yaml", scenario(), "loop.yaml", CONFIG.encode(), 3, "python", DEFAULT)
    ((times, signals),) = workers._make_recorder(job)(range(1))
    assert times == [float(i) for i in range(11)]
    assert {name: len(values) for name, values in signals.items()} == {"TIC-1.PV": 11, "TIC-1.SP": 11, "TIC-1.OUT": 11}
    assert {*signals["TIC-1.OUT"]} == {50.0}


def test_sources_are_names_and_contents(tmp_path, monkeypatch):
    (tmp_path / "below").mkdir()
    monkeypatch.setattr("pidcfg.study.certification.samples.PACKAGE", tmp_path)
    hashes = []
    for name, text in (("a.py", "1"), ("a.py", "2"), ("b.py", "2"), ("below/c.py", "3"), ("note.txt", "4")):
        (tmp_path / name).write_text(text, "utf-8")
        hashes.append(hash_sources.__wrapped__())
    assert len({*hashes}) == 4
    assert hashes[3] == hashes[4]
    assert hashes[0] == sha256(b"a.py\x001\x00").hexdigest()


def test_a_killed_batch_resumes_to_the_same_bytes(folder):
    words = ["--samples", "400", "--format", "json", "--jobs", "2"]
    whole = command(*words)
    assert whole.returncode == 0, whole.stderr
    state = folder / "kept.state"
    line = [sys.executable, "-m", "pidcfg", "certify", "run.scenario.yaml", *words, "--resume", state.name]
    running = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=dict(os.environ))
    while not state.exists() and running.poll() is None:
        time.sleep(0.005)
    running.send_signal(signal.SIGKILL)
    running.wait()
    assert 0 < json.loads(state.read_text().splitlines()[1])["tally"]["samples"] < 400
    resumed = command(*words, "--resume", state.name)
    assert resumed.stdout == whole.stdout
    again = command(*words, "--resume", state.name)
    assert again.stdout == whole.stdout
    refused = command("--samples", "390", "--resume", state.name)
    assert (refused.returncode, refused.stdout) == (2, "")
    assert "--resume kept.state: it cannot be continued: it has 400 samples already" in refused.stderr
    assert "begin anew without it" in refused.stderr


# --- the command -----------------------------------------------------------------------------------------------------


def test_text_says_shares_bounds_and_what_matters(folder):
    result = command("--samples", "200", "--jobs", "1")
    assert result.returncode == 0, result.stderr
    assert "200 samples of seed 3; each bound holds by itself, at 95 % confidence" in result.stdout
    assert re.search(r"passed +\d+(\.\d+)? % +9\d\.\d+ % +90 %  TIC-1\.PV at most 129\.9\n", result.stdout)
    assert re.search(r"100 % +\d+\.?\d* %  TIC-1 gain, ±30 %\n", result.stdout)
    assert "passed: 1 of 1 expectations, and all that is always checked" in result.stdout
    assert len(result.stdout.splitlines()) <= 40


def test_a_missed_share_ends_with_1(folder):
    (folder / "run.scenario.yaml").write_text(scenario(expect=PASSES.replace("129.9", "100")), "utf-8")
    result = command("--samples", "40", "--jobs", "1")
    assert result.returncode == 1
    assert "FAILED: 1 of 1 expectations failed" in result.stdout
    assert "90 % are wanted, which no number of samples shows while so many fail\n" in result.stdout
    text = command("--samples", "40", "--jobs", "1", "--format", "junit").stdout
    xml = ET.fromstring(text)  # noqa: S314 - our own
    assert xml.get("failures") == "1"
    (failure,) = xml.iter("failure")
    assert "90 % are wanted" in failure.get("message")


def test_a_share_that_so_few_samples_do_not_prove_says_how_many_would_do(folder):
    text = scenario(expect=PASSES.replace("129.9", "128").replace("90 %", "94 %"))
    (folder / "run.scenario.yaml").write_text(text, "utf-8")
    result = command("--samples", "200", "--jobs", "1")
    assert result.returncode == 1
    found = re.search(
        r"TIC-1\.PV at most 128: ([\d.]+) % of 200 samples, so at least ([\d.]+) %; 94 % are wanted, for which "
        r"about ([\d,]+) samples with such a share would do",
        result.stdout,
    )
    assert found, result.stdout
    share, bound, enough = float(found[1]), float(found[2]), int(found[3].replace(",", ""))
    assert bound < 94 < share
    held = round(share * 2)
    assert lower_bound(held, 200) == pytest.approx(bound / 100, abs=1e-4)
    for samples, shown in ((enough, True), (enough - 1 - enough // 10, False)):
        assert (lower_bound(samples * held // 200, samples) >= 0.94) is shown
    assert re.search(r"NOT PROVEN .* 94 %  TIC-1\.PV at most 128", result.stdout)
    assert "NOT PROVEN: 1 of 1 expectations not proven" in result.stdout
    text = command("--samples", "200", "--jobs", "1", "--format", "junit").stdout
    xml = ET.fromstring(text)  # noqa: S314 - our own
    assert [failure.get("type") for failure in xml.iter("failure")] == ["not-proven"]


@pytest.mark.parametrize("held", [190, 180, 0])
def test_no_number_of_samples_shows_a_share_that_is_not_seen(held):
    assert samples_that_show(0.95, held, 200) is None


def test_too_few_samples_are_refused_before_they_run_with_the_number_needed(folder):
    (folder / "run.scenario.yaml").write_text(scenario(expect=PASSES.replace("90 %", "99.9 %")), "utf-8")
    result = command("--format", "json")
    assert result.returncode == 2
    (finding,) = json.loads(result.stdout)["findings"]
    assert finding["message"] == "2,000 samples cannot show 99.9 % even if none fails; 2,995 are needed"
    assert (finding["code"], finding["path"], finding["line"]) == ("PID053", "expect[0].share", 12)
    assert finding["help"] == "give --samples 2995"


def test_just_enough_samples_are_run():
    assert certify(scenario(), samples=28).certification is None
    assert certify(scenario(), samples=29).certification.samples == 29


def test_a_certificate_of_the_noise_alone_says_so(folder):
    text = scenario().replace(f"vary:\n{GAIN}\n", "").replace("gain: 2}", "gain: 2, noise: 0.01}")
    text = text.replace(", share: 90 %", "")
    assert "noise: 0.01" in text
    (folder / "run.scenario.yaml").write_text(text, "utf-8")
    result = command("--samples", "10", "--jobs", "1")
    assert "Only the noise varies: the plants are those of the file" in result.stdout


def test_a_scenario_in_which_nothing_varies_is_refused():
    text = scenario().replace(f"vary:\n{GAIN}\n", "")
    result = certify(text)
    assert [d.message for d in result.findings] == ["nothing varies: there is no vary and no noise"]
    assert result.findings[0].help == "write what is uncertain, as in 'vary: {plants: {TIC-1: {gain: ±30 %}}}'"
    assert not result.ok
    noisy = certify(text.replace("gain: 2}", "gain: 2, noise: 1}"))
    assert noisy.certification.samples == 60
    assert noisy.certification.worst[0].margin != noisy.certification.worst[1].margin


def test_a_seed_is_that_of_the_call_of_vary_or_of_the_scenario():
    vary = f"  seed: 8\n{GAIN}"
    assert certify(scenario()).certification.seed == 3
    assert certify(scenario(vary=vary)).certification.seed == 8
    assert certify(scenario(vary=vary), seed=5).certification.seed == 5
    found = [certify(scenario(), seed=seed).certification.worst[0].numbers for seed in (5, 6)]
    assert found[0] != found[1]


def test_the_worst_samples_are_written_beside_their_scenario(folder):
    result = command("--samples", "40", "--jobs", "1", "--keep-worst", "2", "--format", "json")
    worst = json.loads(result.stdout)["worst"]
    assert len(worst) == 2
    for one in worst:
        text = (folder / one["file"]).read_text("utf-8")
        assert one["file"] == f"run.sample-{one['sample']}.scenario.yaml"
        report = pidcfg.simulate(Path(one["file"])).report
        assert report is not None
        assert text.startswith(f"# Sample {one['sample']} of pidcfg certify with seed 3, from run.scenario.yaml.\n")
    (folder / worst[0]["file"]).write_text("other", "utf-8")
    again = command("--samples", "40", "--jobs", "1", "--keep-worst", "2")
    assert again.returncode == 2
    assert f"{worst[0]['file']} exists and differs; use --force" in again.stderr
    assert not list(folder.glob("*.scenario.yaml.*"))
    listed = json.loads(command("--samples", "40", "--jobs", "1", "--format", "json").stdout)["worst"]
    assert [one["file"] for one in listed] == [None] * 3


def test_the_fan_is_drawn_of_the_same_samples_on_any_number_of_processes(folder):
    for jobs in ("1", "2"):
        result = command("--samples", "40", "--jobs", jobs, "--plot", f"fan{jobs}.svg")
        assert result.returncode == 0, result.stderr
    drawings = [(folder / f"fan{jobs}.svg").read_bytes() for jobs in (1, 2)]
    assert drawings[0] == drawings[1]
    assert b'class="band"' in drawings[0]
    fan = certify(scenario(), samples=40, record=True).fan
    assert fan.samples == 40
    assert fan.times == [float(i) for i in range(11)]
    finals = [levels[-1] for levels in fan.quantiles["TIC-1.PV"]]
    assert finals == sorted(finals)
    loaded = loaded_of(scenario())
    (what,) = loaded.uncertainties(loaded.new_plc())[0]
    values = sorted(50 * float(what.number_text(draw_number(what, 3, i))) for i in range(40))
    assert finals == pytest.approx([values[1], values[9], values[19], values[29], values[37]])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--samples", "0"), "x>=1"),
        (("--resume", "run.scenario.yaml"), "run.scenario.yaml is a file that is read"),
        (("--resume", "none/x.state"), "there is no folder none; make it first"),
        (("--plot-loop", "TIC-1"), "--plot-loop needs --plot"),
        (("--plot", "-", "--format", "json"), "would both go to standard output"),
        (("run2.scenario.yaml", "--resume", "x.state"), "--resume takes one scenario, not 2"),
    ],
)
def test_a_wrong_command_line_is_refused(folder, words, message):
    (folder / "run2.scenario.yaml").write_text(scenario(), "utf-8")
    result = command("--jobs", "1", *words)
    assert (result.returncode, result.stdout) == (2, "")
    assert message in result.stderr


@pytest.mark.parametrize(
    ("argument", "message"),
    [({"samples": 0}, "`samples` is 0"), ({"jobs": 0}, "`jobs` is 0"), ({"keep_worst": 101}, "at most 100 are kept")],
)
def test_a_wrong_argument_is_refused(argument, message):
    with pytest.raises(ArgumentError, match=message):
        pidcfg.certify(scenario(), **argument)


def test_progress_goes_from_0_to_1():
    shares = []
    certify(scenario(), samples=40, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1


def test_a_configuration_with_errors_of_which_nothing_is_expected_fails():
    config = CONFIG.replace("gain: 2.5", "gain: -2.5")
    text = scenario(expect="").replace("expect:\n", "")
    result = pidcfg.certify(text, name="run.scenario.yaml", samples=5, files={"loop.yaml": config})
    assert any(d.file == "loop.yaml" for d in result.findings)
    assert result.certification.passed
    assert not result.ok


@pytest.mark.parametrize(("samples", "passed"), [(60, False), (120, True)])
def test_the_text_fits_on_a_screen_and_verbose_adds_metrics_and_numbers(samples, passed):
    result = pidcfg.certify(EXAMPLES / "dpide" / "chiller.scenario.yaml", samples=samples)
    assert result.passed is passed
    found = result.certification
    short, whole = (batches_text([result.outcome], {}, tables=tables) for tables in (False, True))
    assert sum(-(-max(len(line), 1) // 80) for line in short.splitlines()) <= 34
    for one in found.expectations:
        assert f"%     {'all' if one.wanted is None else f'{one.wanted:g} %':>4}  {one.text}".split()[1] in short
        assert one.text in short
        assert f"{one.held} of {one.samples}  {one.text}" in whole
    assert f"all {len(found.standing)} that are always checked" in short
    for text in (*(f"{e.label}, {e.text}" for e in found.effects), *(f"sample {w.sample}" for w in found.worst)):
        assert text in short
        assert text in whole
    assert ("Metrics" in short, "Metrics" in whole) == (False, True)
    assert not re.search(r"\de[+-]", whole)
    numbers = [f"TIC-21 gain {one.numbers['TIC-21 gain']:.4g}, " for one in found.worst]
    assert all(number in whole for number in numbers)
    assert all((number in short) is not passed for number in numbers)
    assert VERBOSE_HINT in short
    assert VERBOSE_HINT not in whole


def test_what_varies_without_mattering_is_counted_in_the_short_text():
    plants = ", ".join(f"{key}: ±20 %" for key in ("gain", "time_constant", "dead_time"))
    text = (EXAMPLES / "dpide" / "chiller.scenario.yaml").read_text("utf-8")
    text = re.sub(r"(?m)^    TIC-21: \{gain: ±30.*$", f"    TIC-21: {{{plants}}}", text)
    text = re.sub(r"(?m)^    TIC-21: \{Kc_Kp: .*$", "    TIC-21: {Kc_Kp: ±10 %, Ti_Ki: ±10 %, Td_Kd: ±10 %}", text)
    result = pidcfg.certify(text, name=str(EXAMPLES / "dpide" / "run.scenario.yaml"), samples=40)
    short, whole = (batches_text([result.outcome], {}, tables=tables) for tables in (False, True))
    effects = [f"{one.label}, {one.text}" for one in result.certification.effects]
    assert [effect in short for effect in effects] == [True] * 5 + [False]
    assert "  1 more vary and matter less\n" in short
    assert all(effect in whole for effect in effects)


def test_a_configuration_in_the_place_of_a_scenario(monkeypatch):
    monkeypatch.chdir(EXAMPLES / "dpide")
    result = CliRunner().invoke(cli, ["certify", "chiller.yaml"])
    assert result.exit_code == 2
    assert "chiller.yaml is a configuration, and certify runs scenarios with vary" in result.stderr
    assert "pidcfg init --scenario chiller.yaml" in result.stderr


def test_a_picture_in_no_folder_is_refused_before_the_run(folder):
    refused = command("--samples", "1000000", "--plot", "nowhere/fan.svg")
    assert (refused.returncode, refused.stdout) == (2, "")
    assert "nowhere/fan.svg: there is no folder nowhere; make it first" in refused.stderr
