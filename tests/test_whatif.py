"""What stands behind the sliders of a what-if page, and the command that writes one, without a browser."""

from __future__ import annotations

import ast
import json
import re
import zipfile
from itertools import pairwise
from pathlib import Path

import pytest

import pidcfg
from command import run_text
from pidcfg.output.browser import session as calls
from pidcfg.output.browser.page import RUNTIME_FILE, WHATIF_EXCLUDES, RuntimeFileError, read_runtime
from pidcfg.output.browser.session import Session, UnusableError
from whatif_rig import make_runtime

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
ONE_A_VENDOR = ("dl06/flow", "click/brewery", "ezlogix/dosing", "nextopid/ratio", "dpide/chiller", "generic/boiler")
"""The quickest example of each vendor."""


def files_of(name):
    """The files beside a scenario, by their names."""
    folder = (EXAMPLES / name).parent
    return {path.name: path.read_text("utf-8") for path in [*folder.glob("*.yaml"), *folder.glob("*.json")]}


def session(name, **changes):
    """A session of an example; ``changes``: other files."""
    return Session(f"{Path(name).name}.scenario.yaml", files_of(name) | changes)


def knobs(one, group):
    """The knobs of a group by their names."""
    return {knob["id"]: knob for knob in one.describe()["knobs"] if knob["group"] == group}


@pytest.mark.parametrize("name", ONE_A_VENDOR)
def test_every_position_of_a_slider_is_what_the_register_holds(name):
    one = session(name)
    found = knobs(one, "number")
    assert found
    for knob in found.values():
        places = knob["positions"]
        assert knob["value"] in places
        assert places == sorted(set(places))
        assert len(places) > 20
        assert [one.snap_values({knob["id"]: place})[knob["id"]] for place in places] == places
        if knob["step"] is not None:
            assert {round(place / knob["step"], 6) % 1 for place in places} == {0.0}
    json.dumps(one.describe(), allow_nan=False)


@pytest.mark.parametrize("name", ONE_A_VENDOR)
def test_a_move_has_the_words_of_encode_and_the_end_of_simulate(name):
    one = session(name)
    before = {cell.address: cell.raw for cell in pidcfg.encode(one.filed_doc).image.cells}
    knob = next(iter(knobs(one, "number").values()))
    said = one.move({knob["id"]: knob["positions"][-3]})
    assert said["ran"]
    after = pidcfg.encode(said["yaml"])
    differing = [cell.address for cell in after.image.cells if before[cell.address] != cell.raw]
    assert [row["address"] for row in said["words"]] == differing
    assert len(differing) == 1
    run = pidcfg.simulate(
        one.files[one.name], name=one.name, files={**one.files, one.config: said["yaml"]}, record=True, engine="python"
    )
    for loop, report in run.report.loops.items():
        assert one.current[0].report.loops[loop].metrics == report.metrics
    for signal in run.recording.names:
        assert one.current[0].recording.signal(signal) == run.recording.signal(signal)


@pytest.mark.parametrize("name", ONE_A_VENDOR)
def test_back_as_filed_nothing_is_left_of_a_move(name):
    one = session(name)
    knob = next(iter(knobs(one, "number").values()))
    one.move({knob["id"]: knob["positions"][-3]})
    said = one.move({knob["id"]: knob["value"]})
    assert (said["words"], said["yaml"]) == ([], one.files[one.config])
    assert all(row["before"] == row["now"] for row in said["metrics"].values())
    assert not any(row["new"] for row in said["findings"])


def test_the_words_are_written_as_a_listing_has_them():
    one = session("dl06/flow")
    said = one.move({"number:loops.0.tuning.gain": 0.754})
    assert said["values"] == {"number:loops.0.tuning.gain": 0.75}
    assert [(row["address"], row["before"], row["after"]) for row in said["words"]] == [("V10010", "0060", "0075")]
    assert "gain: 0.75" in said["yaml"]
    one = session("click/brewery")
    said = one.move({"number:loops.0.tuning.proportional_gain": 2.5})
    assert [(row["address"], row["before"], row["after"]) for row in said["words"]] == [("DF106", "9", "2.5")]


def test_events_and_plants_are_turned_in_the_scenario_alone():
    one = session("click/brewery")
    events = knobs(one, "event")
    assert {knob["label"] for knob in events.values()} == {"setpoint from 30 min", "load from 20 min"}
    said = one.move({"event:events.0.set.setpoint": 70, "plant:KETTLE:gain": 200, "plant:KETTLE:time": 70})
    assert said["values"]["plant:KETTLE:gain"] == 130
    assert said["yaml"] == one.files[one.config]
    text = one.current[2].text
    assert "{setpoint: 70}" in text
    assert "gain: 1.365, load: 18, time_constant: 630, dead_time: 12" in text
    undone = text.replace("{setpoint: 70}", "{setpoint: 66}").replace("gain: 1.365", "gain: 1.05")
    assert undone.replace("time_constant: 630", "time_constant: 900") == one.files[one.name]


def test_units_and_plants_in_a_list_are_turned_too():
    one = session("dpide/dyeing")
    one.move({"plant:VAT:time": 110})
    assert "time_constant: 55 min" in one.current[2].text
    one = session("ezlogix/dosing")
    one.move({"plant:0:gain": 110, "plant:0:dead": 90})
    assert "gain: 0.55, time_constant: 3, dead_time: 0.36" in one.current[2].text


def test_new_findings_come_first_and_are_told():
    one = session("dl06/reactor")
    said = one.move({"number:loops.1.tuning.gain": 25})
    assert [(row["code"], row["new"]) for row in said["findings"]][:1] == [("PID057", True)]
    assert {row["new"] for row in said["findings"][1:]} == {False}


def test_numbers_that_loops_share_stay_where_they_are():
    one = session("dl06/extruder")
    shown = one.describe()
    locked = {loop["name"]: loop["locked"] for loop in shown["loops"]}
    assert "shares its numbers with other loops" in locked["TIC-Z1"]
    assert locked["TIC-DIE"] == ""
    assert {knob["loop"] for knob in knobs(one, "number").values()} == {
        name for name, reason in locked.items() if not reason
    }


def test_another_configuration_is_what_the_page_begins_from():
    text = (EXAMPLES / "dl06" / "flow.yaml").read_text("utf-8").replace("gain: 0.60", "gain: 0.30")
    one = Session("flow.scenario.yaml", files_of("dl06/flow") | {"other.yaml": text}, "other.yaml")
    assert one.describe()["sides"] == ["other.yaml", "flow.yaml"]
    assert [(row["before"], row["after"]) for row in one.state_data()["words"]] == [("0030", "0060")]
    metrics = one.state_data()["metrics"]["FIC-301"]
    assert metrics["before"]["iae"] > metrics["now"]["iae"]
    assert "before: <bdi>other.yaml</bdi>" in one.picture("FIC-301")


def test_a_run_that_is_ended_changes_nothing():
    one = session("dl06/flow")
    now, shares = one.current, []

    def stop(share):
        shares.append(share)
        if len(shares) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        one.move({"number:loops.0.tuning.gain": 0.9}, stop)
    assert one.current is now
    assert 0 < shares[0] < shares[1] < 0.9


def test_a_run_that_tells_how_far_it_is_has_the_same_results():
    path = EXAMPLES / "dl06" / "reactor.scenario.yaml"
    shares = []
    told = pidcfg.simulate(path, record=True, engine="python", progress=shares.append)
    assert max(after - before for before, after in pairwise(shares)) < 0.3  # of a run of 9,001 base steps
    assert told.to_json() == pidcfg.simulate(path, record=True, engine="python").to_json()


def test_ms_follows_the_gain():
    one = session("click/brewery")
    one.move({"number:loops.0.tuning.proportional_gain": 40})
    rows = one.margins()
    assert rows["KETTLE"]["now"]["ms"] > 1.5 * rows["KETTLE"]["before"]["ms"]
    assert rows["GLYCOL"]["now"] == rows["GLYCOL"]["before"]


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"s.yaml": "pidcfg: 1\nvendor: dl06\n"}, "s.yaml: the file is no scenario"),
        ({"s.yaml": "a: ["}, "s.yaml: "),
        ({"s.yaml": "pidcfg: 1\nscenario: x\nconfig: no.yaml\nduration: 9\n"}, "s.yaml:3:9: cannot read no.yaml"),
        ({"s.yaml": "pidcfg: 1\nscenario: x\nconfig: up.csv\nduration: 9\n"}, "up.csv is a memory listing"),
    ],
)
def test_files_that_cannot_run_are_refused_in_a_line(files, message):
    with pytest.raises(UnusableError) as error:
        Session("s.yaml", files)
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)


def test_the_worker_s_calls_take_and_give_plain_data():
    given = {"scenario": "flow.scenario.yaml", "files": files_of("dl06/flow"), "against": None}
    begun = calls.begin(given)
    answers = (
        begun,
        calls.move({"knobs": {"number:loops.0.tuning.gain": 0.9}, "loop": begun["first"]}),
        calls.picture({"loop": begun["first"]}),
        calls.margins({}),
    )
    for answer in answers:
        assert json.loads(json.dumps(answer, allow_nan=False)) == answer


# --- the file of Python for the browser, and the command -------------------------------------------------------------


@pytest.fixture
def runtime(tmp_path):
    """A file of Python for the browser that has none in it."""
    return make_runtime(tmp_path / RUNTIME_FILE)


def whatif(*arguments, **options):
    """The command, with what it prints as text."""
    return run_text("whatif", *map(str, arguments), **options)


def test_the_page_holds_the_files_and_names_no_folder(runtime, tmp_path):
    done = whatif(EXAMPLES / "dl06" / "flow.scenario.yaml", "-o", tmp_path / "w.html", "--runtime", runtime)
    assert done.returncode == 0, done.stderr
    assert re.search(r"w\.html: \d+\.\d MB; open it with a double click", done.stderr)
    text = (tmp_path / "w.html").read_text("utf-8")
    files = json.loads(re.search(r'id="files">(.*?)</script>', text)[1])
    assert files["scenario"] == "flow.scenario.yaml"
    assert set(files["files"]) == {"flow.scenario.yaml", "flow.yaml"}
    assert str(EXAMPLES) not in text
    assert "Pyodide 1.2.3, Python 3.4.5" in text
    assert "default-src 'none'" in text
    assert "connect-src 'none'" in text
    assert (
        whatif(EXAMPLES / "dl06" / "flow.scenario.yaml", "-o", tmp_path / "w.html", "--runtime", runtime).returncode
        == 0
    )
    (tmp_path / "w.html").write_text("mine", "utf-8")
    done = whatif(EXAMPLES / "dl06" / "flow.scenario.yaml", "-o", tmp_path / "w.html", "--runtime", runtime)
    assert (done.returncode, (tmp_path / "w.html").read_text("utf-8")) == (2, "mine")


def test_nothing_in_a_file_becomes_html(runtime, tmp_path):
    evil = "</script><script>window.pwned=1</script><img src=x onerror=alert(1)>"
    for name in ("flow.yaml", "flow.scenario.yaml"):
        text = (EXAMPLES / "dl06" / name).read_text("utf-8")
        text = re.sub(r"(?m)^(scenario:).*", lambda match: f"{match[1]} '{evil}'", text)
        text = re.sub(r"(?m)^(    description:).*", lambda match: f"{match[1]} '{evil}'", text)
        (tmp_path / name).write_text(text + f"# {evil}\n", "utf-8")
    done = whatif(tmp_path / "flow.scenario.yaml", "-o", tmp_path / "w.html", "--runtime", runtime)
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "w.html").read_text("utf-8")
    assert "<img" not in text
    assert "<script>window" not in text
    assert json.loads(re.search(r'id="files">(.*?)</script>', text)[1])["files"]["flow.yaml"].endswith(f"# {evil}\n")


def test_without_python_for_the_browser_one_line_says_what_to_do(tmp_path):
    done = whatif(
        EXAMPLES / "dl06" / "flow.scenario.yaml", "-o", tmp_path / "w.html", PIDCFG_CACHE_DIR=str(tmp_path / "cache")
    )
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert "there is no Python for the browser in" in line
    assert "'python tasks.py whatif-runtime'" in line


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"no zip", "is no file of Python for the browser"),
        ({"manifest.json": b"{}"}, "is of another version of pidcfg"),
        ({"manifest.json": b'{"format": 1, "versions": {}}'}, "is no file of Python for the browser"),
        ({"other": b""}, "is no file of Python for the browser"),
    ],
)
def test_another_file_is_refused(content, message, tmp_path):
    path = tmp_path / "r.zip"
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        with zipfile.ZipFile(path, "w") as archive:
            for name, data in content.items():
                archive.writestr(name, data)
    with pytest.raises(RuntimeFileError, match=message):
        read_runtime(path)


def test_nothing_that_pidcfg_imports_is_left_out_of_the_library():
    """Imports of what the page carries, wherever they stand; those of modules that are loaded by name alone too."""
    source = (ROOT / "tools" / "whatif" / "compile.py").read_text("utf-8")
    lines = "".join(line for line in source.splitlines(keepends=True) if line.startswith("LEFT_OUT"))
    names = {}
    exec(lines, names)  # noqa: S102 - our own lines
    left_out = {name.removesuffix(".py").replace("/", ".").rstrip(".") for name in names["LEFT_OUT"]}
    assert "unittest" in left_out
    asked = set()
    for path in sorted((ROOT / "src" / "pidcfg").rglob("*.py")):
        if not path.relative_to(ROOT / "src").as_posix().startswith(WHATIF_EXCLUDES):
            for node in ast.walk(ast.parse(path.read_bytes())):
                asked |= {alias.name for alias in node.names} if isinstance(node, ast.Import) else set()
                asked |= {str(node.module)} if isinstance(node, ast.ImportFrom) else set()
    missing = {name for name in asked if name in left_out or name.partition(".")[0] in left_out}
    assert {name.partition(".")[0] for name in missing} == {"multiprocessing"}  # other processes: there are none


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("flow.scenario.yaml", "-o", "w.pdf"), "write a name that ends in .html or .htm"),
        (("none.yaml", "-o", "w.html"), "cannot read none.yaml: No such file or directory"),
        (("flow.yaml", "-o", "w.html"), "flow.yaml: the file is no scenario"),
        (("flow.scenario.yaml", "-o", "w.html", "--against", "none.yaml"), "cannot read none.yaml"),
        (("flow.scenario.yaml", "-o", "w.html", "--against", "golden/flow.txt"), "golden/flow.txt is no configuration"),
        (("flow.scenario.yaml", "-o", "w.html", "--against", "../click/tank.yaml"), "is no declared name (PID051)"),
    ],
)
def test_what_cannot_be_used_is_told_in_a_line(arguments, message, runtime):
    done = whatif(*arguments, "--runtime", runtime, cwd=EXAMPLES / "dl06")
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
