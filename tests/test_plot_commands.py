"""``--plot`` of simulate, convert and diff: what reaches files and the terminal, and what is refused."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

import command
from pidcfg.cli.main import main
from pidcfg.sim.engine.recording import MAX_POINTS, Recording
from pidcfg.sim.engine.run import Settings
from pidcfg.study.outcome import charts_of, simulate_document
from pidcfg.text.source import read_document

EXAMPLES = Path(__file__).parents[1] / "examples"
SVG = "{http://www.w3.org/2000/svg}"
OVEN = """
pidcfg: 1
scenario: A short profile
config: oven.yaml
duration: 20 min
plants:
  TIC-201: {model: first_order, gain: 11, load: 25, time_constant: 600, dead_time: 2, initial: 25}
events:
  - {at: 60, loop: TIC-201, ramp_soak: start}
  - {at: 1100, loop: TIC-201, pv: 1200, for: 40}
  - {at: 1150, loop: TIC-201, mode: manual}
expect:
  - {loop: TIC-201, mode: auto, at: 1160}
  - {signal: TIC-201.PV, max: 500}
  - {signal: TIC-201.OUT, min: -1}
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An oven with a ramp/soak profile, as the working folder."""
    text = (EXAMPLES / "dl06/oven.yaml").read_text("utf-8").replace("slope: 0.20, soak: 10", "slope: 1, soak: 5")
    (tmp_path / "oven.yaml").write_text(text, "utf-8")
    (tmp_path / "oven.scenario.yaml").write_text(OVEN, "utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    return tmp_path


@pytest.fixture
def pidcfg(monkeypatch, capsys):
    """The command in this process: its exit code, stdout and stderr."""

    def run(*args):
        monkeypatch.setattr("sys.argv", ["pidcfg", *map(str, args)])
        with pytest.raises(SystemExit) as end:
            main()
        return int(end.value.code or 0), *capsys.readouterr()

    return run


def said(path):
    """The texts of an SVG."""
    return [element.text for element in ET.parse(path).iter(f"{SVG}text")]  # noqa: S314 - our own


def outcome(name="oven.scenario.yaml", **settings):
    """A run with its recording."""
    doc = read_document(Path(name).read_bytes(), name)
    return simulate_document(doc, Settings(**settings), record=True)


# --- simulate --------------------------------------------------------------------------------------------------------


def test_a_run_is_drawn_with_units_modes_alarms_steps_events_and_failures(folder, pidcfg):
    code, _, err = pidcfg("simulate", "oven.scenario.yaml", "--plot", "a.svg", "--plot", "b.png", "--plot", "c.html")
    assert (code, err) == (1, "")
    texts = said("a.svg")
    assert {"A short profile", "PV, SP (degC)", "OUT (%)", "time (min)", "mode", "auto", "ramp/soak"} <= {*texts}
    assert {"2 soak", "PV high-high", "deviation red"} <= {*texts}
    assert "1 at 1 min: ramp/soak start" in texts
    assert "4 at 19.33 min: failed: TIC-201 mode is auto at 1160 s (manual)" in texts
    assert any(text.startswith("failed: TIC-201.PV at most 500") for text in texts)
    assert Path("b.png").read_bytes().startswith(b"\x89PNG")
    assert "oven.scenario.yaml runs oven.yaml" in Path("c.html").read_text("utf-8")


def test_the_strips_tell_the_times(folder):
    (chart,) = charts_of(outcome())
    bars = {strip.title: [(bar.label, bar.begin, bar.end) for bar in strip.bars] for strip in chart.strips}
    assert bars["mode"] == [("auto", 0, 1150), ("manual", 1150, 1200)]
    (ramp, begin, turn), (soak, same, end) = bars["ramp/soak"][:2]
    assert (ramp, soak) == ("1 ramp", "2 soak")
    assert 60 <= begin <= 61
    assert turn == same == pytest.approx(begin + 175, abs=2)
    assert end == pytest.approx(turn + 300, abs=2)
    assert bars["ramp/soak"][-1][2] == chart.end == 1200
    ((_, on, off),) = bars["PV high-high"]
    assert 1100 <= on <= 1105
    assert 1140 <= off <= 1146


def test_what_is_on_at_the_end_lasts_to_the_end(folder):
    scenario = Path("oven.scenario.yaml")
    scenario.write_text(OVEN.replace("for: 40", "for: 400"), "utf-8")
    (chart,) = charts_of(outcome())
    assert next(strip for strip in chart.strips if strip.title == "PV high-high").bars[-1].end == 1200


@pytest.mark.parametrize(
    ("name", "stands"),
    [
        ("dl06/flow", "67.52 at the end stands for 90.01 m3/h"),
        ("ezlogix/dosing", "31.76 at the end stands for 39.85 m3/h"),
    ],
)
def test_signals_before_a_root_are_called_so(pidcfg, tmp_path, name, stands):
    code, _, _ = pidcfg("simulate", EXAMPLES / f"{name}.scenario.yaml", "--plot", tmp_path / "a.svg")
    texts = said(tmp_path / "a.svg")
    assert code == 0
    assert "PV, SP before the root" in texts
    assert f"PV and SP are before the root: {stands}" in texts
    assert "PV, SP (m3/h)" not in texts


@pytest.mark.parametrize(
    ("source", "target", "apart"), [("dl06", "generic", 0.1), ("dl06", "ezlogix", 3), ("generic", "dl06", 0.1)]
)
def test_both_sides_of_a_root_are_the_flow(folder, pidcfg, source, target, apart):  # an EZLogix has no filter of the PV
    names = {"dl06": EXAMPLES / "dl06/flow.yaml", "generic": "neutral.yaml"}
    assert pidcfg("convert", names["dl06"], "--to", "generic", "--allow-loss", "-o", "neutral.yaml", "-q")[0] in {0, 1}
    args = ("--allow-loss", "-o", "made.yaml", "--verify", "--report-output", "json=report.json", "-q")
    pidcfg("convert", names[source], "--to", target, *args)
    (found,) = json.loads(Path("report.json").read_text("utf-8"))["verify"]
    assert found["pv_percent"] < apart


def test_the_neutral_form_tells_the_flow_itself(folder, pidcfg):
    pidcfg("convert", EXAMPLES / "dl06/flow.yaml", "--to", "generic", "--allow-loss", "-o", "neutral.yaml", "-q")
    scenario = (EXAMPLES / "dl06/flow.scenario.yaml").read_text("utf-8").replace("flow.yaml", "neutral.yaml")
    Path("n.scenario.yaml").write_text(scenario, "utf-8")
    (chart,) = charts_of(outcome("n.scenario.yaml"))
    assert (chart.panels[0].title, chart.panels[0].unit, chart.notes) == ("PV, SP", "m3/h", ())


def test_autotune_is_a_strip(folder):
    Path("oven.scenario.yaml").write_text(OVEN.replace("ramp_soak: start", "autotune: start"), "utf-8")
    config = Path("oven.yaml")
    config.write_text(config.read_text("utf-8").replace("method: open", "method: closed"), "utf-8")
    (chart,) = charts_of(outcome())
    (bar,) = next(strip for strip in chart.strips if strip.title == "auto-tune running").bars
    assert 60 <= bar.begin < bar.end


def test_the_picture_and_the_csv_are_of_the_same_run(folder, pidcfg):
    pidcfg("simulate", "oven.scenario.yaml", "--csv", "alone.csv", "--every", "7")
    pidcfg("simulate", "oven.scenario.yaml", "--csv", "both.csv", "--every", "7", "--plot", "a.svg")
    assert Path("both.csv").read_bytes() == Path("alone.csv").read_bytes()
    assert Path("a.svg").exists()


@given(st.lists(st.integers(-2, 2), min_size=1, max_size=60), st.integers(1, 9), st.integers(1, 60))
def test_a_recording_keeps_first_lowest_highest_and_last_of_each_group(values, size, piece):
    recording = Recording()
    recording.begin(["a"], 5, 1.0)
    recording.group_size = size
    for first in range(0, len(values), piece):
        rows = values[first : first + piece]
        recording.add_rows(rows, len(rows))
    recording.end()
    wanted = []
    for first in range(0, len(values), size):
        group = values[first : first + size]
        places = {0, group.index(min(group)), group.index(max(group)), len(group) - 1}
        wanted += [(first + place, group[place]) for place in sorted(places)]
    assert list(zip(*recording.signal("a"), strict=True)) == wanted


def test_the_recording_is_the_trend_with_all_its_extremes(folder, pidcfg):
    pidcfg("simulate", "oven.scenario.yaml", "--csv", "trend.csv")
    rows = list(csv.reader(Path("trend.csv").read_text("utf-8").splitlines()))
    trend = {name: [float(row[i]) for row in rows[1:]] for i, name in enumerate(rows[0])}
    recording = outcome().recording
    times, values = recording.signal("TIC-201.PV")
    assert len(times) <= MAX_POINTS
    at = dict(zip(trend["time"], trend["TIC-201.PV"], strict=True))
    assert all(value == pytest.approx(at[time], rel=1e-9) for time, value in zip(times, values, strict=True))
    assert (times[0], times[-1]) == (trend["time"][0], trend["time"][-1])
    assert (min(values), max(values)) == pytest.approx((min(at.values()), max(at.values())))


def test_no_spike_of_one_sample_is_lost_and_points_are_bounded():
    recording = Recording()
    recording.begin(["a", "b"], 1_000_000, 0.1)
    for chunk in range(0, 1_000_000, 16_384):
        count = min(16_384, 1_000_000 - chunk)
        rows = [0.0] * (2 * count)
        for spike, value in ((123_457, 5.0), (999_998, -7.0)):
            if chunk <= spike < chunk + count:
                rows[2 * (spike - chunk) + 1] = value
        recording.add_rows(rows, count)
    recording.end()
    times, values = recording.signal("b")
    assert len(values) <= MAX_POINTS
    assert (min(values), max(values)) == (-7.0, 5.0)
    assert times[values.index(5.0)] == pytest.approx(12345.7)
    assert times == sorted(set(times))
    assert times[-1] == pytest.approx(99999.9)
    assert set(recording.signal("a")[1]) == {0.0}


def test_a_short_run_is_recorded_whole():
    recording = Recording(frozenset({"b"}))
    recording.begin(["a", "b"], 5, 0.5)
    recording.add_rows([0, 1, 0, 2, 0, 3], 3)
    recording.add_rows([0, 4, 0, 5], 2)
    recording.end()
    assert recording.signal("b") == ([0, 0.5, 1.0, 1.5, 2.0], [1, 2, 3, 4, 5])
    assert recording.names == ["b"]


def test_several_scenarios_share_a_picture_and_each_chart_says_of_which(folder, pidcfg):
    Path("two.scenario.yaml").write_text(OVEN.replace("A short profile", "Again"), "utf-8")
    pidcfg("simulate", "oven.scenario.yaml", "two.scenario.yaml", "--plot", "a.svg")
    texts = said("a.svg")
    assert "2 scenarios" in texts
    assert sum(text.startswith("A short profile: TIC-201") for text in texts) == 1
    assert sum(text.startswith("Again: TIC-201") for text in texts) == 1


def test_the_terminal_shows_the_run_after_the_report(folder, pidcfg):
    code, out, _ = pidcfg("simulate", "oven.scenario.yaml", "--plot", "-")
    assert code == 1
    report, _, picture = out.partition("\nTIC-201: Chamber temperature")
    assert "FAILED  TIC-201" in report
    assert "│" in picture
    assert "ramp/soak" in picture
    assert max(map(len, picture.splitlines())) <= 80


@pytest.mark.parametrize("code_page", ["cp437", "cp1252", "ascii"])
def test_old_terminals_get_plain_signs(folder, code_page):
    result = command.run("simulate", "oven.scenario.yaml", "--plot", "-", PYTHONIOENCODING=code_page)
    text = result.stdout.decode(code_page)
    assert (result.returncode, result.stderr) == (1, b"")
    assert "ooo" in text
    assert "auto=====" in text
    assert "?" not in text


def test_only_a_png_needs_a_library(folder, pidcfg, monkeypatch):
    monkeypatch.setattr("pidcfg.cli.environment.find_spec", lambda _name: None)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    code, out, _ = pidcfg("simulate", "oven.scenario.yaml", "--plot", "-")
    assert code == 1
    assert "ramp/soak" in out
    code, out, err = pidcfg("simulate", "oven.scenario.yaml", "--plot", "a.svg", "--plot", "a.png")
    assert (code, out) == (2, "")
    assert err.startswith("Error: matplotlib is not installed; install pidcfg with its extra `png`")
    assert not list(folder.glob("a.*"))
    assert pidcfg("simulate", "oven.scenario.yaml", "--plot", "a.svg", "--plot", "a.html")[0] == 1
    assert len(list(folder.glob("a.*"))) == 2


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["--plot", "a.pdf"], "'a.pdf'; write a name that ends in .svg, .png or .html, or - for the terminal"),
        (["--plot", "trend"], "'trend'; write a name that ends in"),
        (["--plot", "a.svg", "--plot", "a.svg"], "'a.svg' stands there twice"),
        (["--plot", "-", "--format", "json"], "--plot - and --format json would both go to standard output"),
        (["--plot", "a.svg", "--plot-loop", "TIC-1"], "--plot-loop TIC-1: no such loop; there are TIC-201"),
        (["--plot-loop", "TIC-201"], "--plot-loop needs --plot"),
    ],
)
def test_what_cannot_be_drawn_is_refused(folder, pidcfg, args, message):
    code, out, err = pidcfg("simulate", "oven.scenario.yaml", *args)
    assert (code, out) == (2, "")
    assert message in err
    assert not list(folder.glob("*.svg"))


def test_a_file_that_differs_is_kept_and_then_nothing_is_written(folder, pidcfg):
    Path("a.svg").write_text("mine", "utf-8")
    code, out, err = pidcfg("simulate", "oven.scenario.yaml", "--csv", "t.csv", "--plot", "a.svg", "--plot", "b.svg")
    assert (code, err) == (2, "Error: a.svg exists and differs; use --force to overwrite it\n")
    assert out.startswith("A short profile"), "a file that differs costs no result"
    assert sorted(path.name for path in folder.iterdir()) == ["a.svg", "oven.scenario.yaml", "oven.yaml"]
    Path("a.svg").unlink()
    Path("t.csv").write_text("mine", "utf-8")
    code, _, err = pidcfg("simulate", "oven.scenario.yaml", "--csv", "t.csv", "--plot", "a.svg")
    assert (code, err) == (2, "Error: t.csv exists and differs; use --force to overwrite it\n")
    assert not Path("a.svg").exists()
    code, _, _ = pidcfg("simulate", "oven.scenario.yaml", "--csv", "t.csv", "--plot", "a.svg", "--force")
    assert code == 1
    assert Path("a.svg").exists()


def test_a_scenario_that_cannot_run_leaves_no_picture(folder, pidcfg):
    Path("oven.scenario.yaml").write_text(OVEN.replace("oven.yaml", "absent.yaml"), "utf-8")
    code, out, _ = pidcfg("simulate", "oven.scenario.yaml", "--plot", "a.svg")
    assert code == 2
    assert "cannot run" in out
    assert not Path("a.svg").exists()


def test_json_stays_the_same_with_a_picture(folder, pidcfg):
    _, alone, _ = pidcfg("simulate", "oven.scenario.yaml", "--format", "json")
    _, beside, _ = pidcfg("simulate", "oven.scenario.yaml", "--format", "json", "--plot", "a.svg")
    assert json.loads(alone) == json.loads(beside)


UNITS = {
    "dl06/flow": ("PV, SP before the root", "OUT"),
    "click/booster": ("PV, SP", "CO"),
    "ezlogix/oven": ("PV, SP", "CV"),
    "nextopid/ratio": ("PV, SP", "MV"),
    "dpide/chiller": ("PV, SV", "MV"),
    "generic/boiler": ("PV, SP", "OUT"),
}


@pytest.mark.parametrize(("example", "titles"), UNITS.items(), ids=list(UNITS))
def test_every_vendors_loops_have_axes_with_units(example, titles, tmp_path):
    scenario = EXAMPLES / f"{example}.scenario.yaml"
    lines = scenario.read_text("utf-8").replace("config: ", f"config: {scenario.parent.as_posix()}/").splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("duration:"))
    lines[start] = "duration: 30"
    kept = [line for line in lines if "{at:" not in line and "expect" not in line]
    cut = next(
        (i for i, line in enumerate(kept) if line.startswith(("  - {signal", "  - {loop", "events:"))), len(kept)
    )
    (tmp_path / "x.yaml").write_text("\n".join(kept[:cut]) + "\n", "utf-8")
    found = outcome((tmp_path / "x.yaml").as_posix())
    charts = charts_of(found)
    assert charts, [d.message for d in found.findings]
    for chart in charts:
        assert tuple(panel.title for panel in chart.panels) == titles
        assert all(panel.unit for panel in chart.panels if "before" not in panel.title), chart.loop
        assert all(line.values for panel in chart.panels for line in panel.lines)


# --- convert and diff ------------------------------------------------------------------------------------------------


@pytest.fixture
def boiler(tmp_path, monkeypatch):
    """A small configuration, as the working folder."""
    (tmp_path / "a.yaml").write_text(
        "pidcfg: 1\nvendor: generic\nloops:\n"
        "  - {name: TIC-1, sample_time: 1, output_raises_pv: true, tuning: {gain: 2, integral_time: 20}, "
        'pv: {range: [0, 100], unit: degC}, output: {range: [0, 100], unit: "%"}, setpoint: {value: 50}}\n',
        "utf-8",
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    return tmp_path


def test_convert_draws_both_sides_and_verifies(boiler, pidcfg):
    code, _, err = pidcfg("convert", "a.yaml", "--to", "dl06", "-o", "b.yaml", "--allow-loss", "--plot", "v.svg")
    assert code == 0
    assert "both sides on the same plants" in err
    assert "TIC-1: alike" in err
    assert "b.yaml: written\nv.svg: written\n" in err
    texts = said("v.svg")
    assert {"before: a.yaml (generic)", "after: b.yaml (dl06)", "PV, SP (degC)", "OUT (%)"} <= {*texts}
    assert texts.count("TIC-1") == 1


def test_convert_is_quiet_when_asked_to(boiler, pidcfg):
    """Only what refuses the result is said, then with its reason."""
    line = ("convert", "a.yaml", "--to", "dl06", "-o", "b.yaml", "-q", "--allow-loss")
    assert pidcfg(*line, "--plot", "v.svg") == (0, "", "")
    code, _, err = pidcfg(*line, "--max-deviation", "0")
    assert code == 1
    assert "both sides on the same plants" in err
    assert "a PV is further apart than 0 % of its range: nothing was written" in err


def test_convert_writes_no_picture_when_it_writes_nothing(boiler, pidcfg):
    Path("b.yaml").write_text("mine", "utf-8")
    code, _, err = pidcfg("convert", "a.yaml", "--to", "dl06", "-o", "b.yaml", "--allow-loss", "--plot", "v.svg", "-q")
    assert code == 2
    assert "b.yaml exists and differs" in err
    assert not Path("v.svg").exists()
    code, _, err = pidcfg("convert", "a.yaml", "--to", "dl06", "--plot", "-")
    assert code == 2
    assert "--verify draws in the terminal; name a file" in err


def test_diff_draws_both_sides_of_the_loops_that_both_have(boiler, pidcfg):
    text = Path("a.yaml").read_text("utf-8")
    Path("b.yaml").write_text(
        text.replace("gain: 2", "gain: 3") + text.splitlines()[-1].replace("TIC-1", "TIC-9") + "\n"
    )
    code, out, err = pidcfg("diff", "a.yaml", "b.yaml", "--plot", "d.svg", "--plot", "-")
    assert code == 0
    assert err == "note: not compared: TIC-9 is on one side only\n"
    assert "tuning.gain" in out
    assert "○ a.yaml (generic)   × b.yaml (generic)   ◉ both" in out
    texts = said("d.svg")
    assert {"a.yaml and b.yaml", "before: a.yaml (generic)", "after: b.yaml (generic)", "TIC-1"} <= {*texts}
    assert "TIC-9" not in texts


def test_diff_says_why_it_draws_nothing(boiler, pidcfg):
    text = Path("a.yaml").read_text("utf-8")
    Path("b.yaml").write_text(text.replace("degC", "degF"), "utf-8")
    code, _, err = pidcfg("diff", "a.yaml", "b.yaml", "--plot", "d.svg")
    assert code == 0
    assert "not compared: the PV of TIC-1 is in degC and in degF" in err
    assert "not compared: no loop of both sides can be run on the same plant" in err
    assert not Path("d.svg").exists()
    code, out, err = pidcfg("diff", "a.yaml", "b.yaml", "--plot", "-", "--format", "markdown")
    assert (code, out) == (2, "")
    assert "name a file" in err
