"""The public functions of the package: what they take, what they return, and what they leave alone."""

from __future__ import annotations

import builtins
import dataclasses
import decimal
import gc
import importlib
import importlib.util
import io
import json
import os
import pkgutil
import re
import signal
import subprocess
import sys
import types
from pathlib import Path

import pytest

import pidcfg
from pidcfg.encoders.listing import UnwritableError
from pidcfg.text.reader import DEFAULT, Texts
from pidcfg.vendors import VENDORS
from shell import captured
from shell import pidcfg as shell_pidcfg

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
REACTOR = EXAMPLES / "dl06" / "reactor.yaml"
TANK = EXAMPLES / "click" / "tank.yaml"
TANK_SCENARIO = EXAMPLES / "click" / "tank.scenario.yaml"
FILES = {"line/tank.yaml": TANK.read_bytes(), "line/tank.scenario.yaml": TANK_SCENARIO.read_text("utf-8")}
CHILLER = EXAMPLES / "dpide" / "chiller.scenario.yaml"
FILES["line/chiller.yaml"] = CHILLER.with_name("chiller.yaml").read_bytes()
FILES["line/chiller.scenario.yaml"] = CHILLER.read_text("utf-8").replace(", share: 90 %", "")
CALLS = {
    "load": lambda: pidcfg.load(Path("line/tank.yaml"), files=FILES),
    "check": lambda: pidcfg.check(Path("line/tank.scenario.yaml"), files=FILES),
    "fix": lambda: pidcfg.fix(Path("line/tank.yaml"), files=FILES),
    "encode": lambda: pidcfg.encode(Path("line/tank.yaml"), files=FILES),
    "decode": lambda: pidcfg.decode(pidcfg.encode(Path("line/tank.yaml"), files=FILES).text, "click", files={}),
    "convert": lambda: pidcfg.convert(Path("line/chiller.yaml"), "click", verify=True, files=FILES),
    "diff": lambda: pidcfg.diff(Path("line/tank.yaml"), Path("line/./tank.yaml"), files=FILES),
    "simulate": lambda: pidcfg.simulate(Path("line/tank.scenario.yaml"), engine="python", record=True, files=FILES),
    "certify": lambda: pidcfg.certify(Path("line/chiller.scenario.yaml"), samples=1, record=True, files=FILES),
    "tune": lambda: pidcfg.tune("zn-closed", ultimate_gain=8, ultimate_period=4, vendor="click", files={}),
    "report": lambda: pidcfg.report(Path("line/tank.scenario.yaml"), Path("line/tank.yaml"), files=FILES),
    "plot": lambda: pidcfg.plot(pidcfg.convert(Path("line/chiller.yaml"), "click", verify=True, files=FILES), "html"),
    "gains": lambda: pidcfg.gains(Path("line/tank.scenario.yaml"), files=FILES),
    "change": lambda: pidcfg.change(Path("line/tank.yaml"), {"loops.0.tuning.reset_time": 160}, files=FILES),
    "explain": lambda: pidcfg.explain("DF101", config=Path("line/tank.yaml"), files=FILES),
}
"""A call of every function, none of which needs the disk."""
STEP = "time,output,pv\n" + "".join(
    f"{t},{20 if t < 10 else 40},{50 if t < 12 else 50 + 40 * (1 - 0.8 ** (t - 12)):.6f}\n" for t in range(60)
)


def test_every_exported_function_is_called_here():
    old = {"__version__", "check_file", "check_text", "decode_words"}
    assert set(CALLS) == set(pidcfg.__all__) - old - LIVE - TYPES - TOOLS  # those of a PLC: test_live.py


LIVE = {"pull", "compare", "trend", "serve"}
TOOLS = {"held_words", "ignore_edit", "loops_of", "references", "schema"}
"""What works on results, for editors: test_lsp.py."""
TYPES = {name for module, names in pidcfg.NAMES.items() if module != "api" for name in names} - TOOLS - LIVE


def test_types_are_exported_from_where_they_stand():
    for module, names in pidcfg.NAMES.items():
        for name in names:
            assert getattr(pidcfg, name) is vars(importlib.import_module(f"pidcfg.{module}"))[name]
            assert isinstance(getattr(pidcfg, name), type) == (name in TYPES), name
    assert TYPES <= set(pidcfg.__all__) <= set(dir(pidcfg))
    with pytest.raises(AttributeError, match="no attribute 'Nothing'"):
        _ = pidcfg.Nothing


def functions():
    """Every public function."""
    return [getattr(pidcfg, name) for name in sorted(set(pidcfg.__all__) - TYPES - TOOLS - {"__version__"})]


@pytest.mark.parametrize("function", functions(), ids=lambda function: function.__name__)
def test_what_a_call_returns_and_raises_is_exported(function):
    result = function.__annotations__["return"]
    assert result in TYPES
    told = set(re.findall(r"`(?:pidcfg\.)?(\w+Error)`", function.__doc__ or ""))
    assert {name for name in told if not hasattr(builtins, name)} <= TYPES


def test_no_module_takes_the_name_of_a_function():
    """After ``import pidcfg.x`` the attribute ``x`` is the module."""
    for module in pkgutil.walk_packages(pidcfg.__path__, "pidcfg."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    for function in functions():
        assert isinstance(function, types.FunctionType), function
    assert not {module.name for module in pkgutil.iter_modules(pidcfg.__path__)} & set(pidcfg.__all__)


@pytest.mark.parametrize("name", CALLS)
def test_results_are_frozen_and_plain_data_as_json(name):
    result = CALLS[name]()
    assert dataclasses.is_dataclass(result)
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(result, dataclasses.fields(result)[0].name, None)
    assert result.ok, result.findings
    assert isinstance(result.findings, tuple)
    data = result.to_json()
    assert json.loads(json.dumps(data, allow_nan=False)) == data


@pytest.mark.parametrize("name", CALLS)
def test_calls_leave_everything_else_alone(name, capfd):
    before = (gc.get_threshold(), [signal.getsignal(s) for s in signal.valid_signals()], dict(os.environ), Path.cwd())
    CALLS[name]()
    assert capfd.readouterr() == ("", "")
    after = (gc.get_threshold(), [signal.getsignal(s) for s in signal.valid_signals()], dict(os.environ), Path.cwd())
    assert after == before


@pytest.mark.parametrize("name", CALLS)
def test_with_files_nothing_is_read_from_disk(name, monkeypatch):
    CALLS[name]()  # whatever is imported is imported now

    def refuse(*args, **kwargs):
        raise AssertionError(f"reads {args}")

    with monkeypatch.context() as patch:
        for owner in (builtins, io, os):
            patch.setattr(owner, "open", refuse)
        for method in ("open", "read_bytes", "read_text", "stat", "is_dir", "exists"):
            patch.setattr(Path, method, refuse)
        patch.setattr(os, "stat", refuse)
        CALLS[name]()


def test_calls_need_nothing_of_the_command_line():
    program = f"""
import sys
from pathlib import Path
import pidcfg
assert not any(name.startswith("pidcfg.") for name in sys.modules), "importing pidcfg costs something"
pidcfg.load(Path({str(TANK)!r})), pidcfg.check(Path({str(TANK_SCENARIO)!r}))
pidcfg.convert(Path({str(TANK)!r}), "dl06", verify=True), pidcfg.diff(Path({str(TANK)!r}), Path({str(REACTOR)!r}))
pidcfg.decode(pidcfg.encode(Path({str(TANK)!r})).text, "click"), pidcfg.explain("CK27", config=Path({str(TANK)!r}))
pidcfg.simulate(Path({str(TANK_SCENARIO)!r}), record=True), pidcfg.tune("zn-closed", ultimate_gain=8, ultimate_period=4)
print(sorted(name for name in sys.modules if name in ("click", "rich") or name.startswith("pidcfg.cli")))
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (run.stdout, run.stderr) == ("[]\n", "")


# --- sources ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("source", [REACTOR, REACTOR.read_bytes(), REACTOR.read_text("utf-8")])
def test_a_path_is_a_file_and_a_text_is_a_text(source):
    result = pidcfg.check(source, name="reactor.yaml")
    assert {d.file for d in result.findings} == {"reactor.yaml"}
    assert result.to_json()["summary"] == {"files": 1, "errors": 0, "warnings": 4, "infos": 1}


def test_a_document_is_not_read_again():
    loaded = pidcfg.load(REACTOR)
    assert pidcfg.check(loaded.document).document is loaded.document
    assert pidcfg.check(loaded.document).findings == pidcfg.check(REACTOR).findings


def test_a_text_without_a_name_is_called_text():
    assert {d.file for d in pidcfg.check("pidcfg: 1\nvendor: dl06\n").findings} == {"<text>"}


def test_a_scenario_as_text_finds_its_configuration_beside_its_name(tmp_path, monkeypatch):
    text = TANK_SCENARIO.read_bytes()
    assert not pidcfg.check(text, name=TANK_SCENARIO.as_posix()).to_json()["summary"]["errors"]
    (finding,) = pidcfg.check(text, name="elsewhere/tank.scenario.yaml").findings
    assert finding.message == "cannot read elsewhere/tank.yaml: No such file or directory"
    (finding,) = pidcfg.check(text, name="line/s.yaml", files={"tank.yaml": TANK.read_bytes()}).findings
    assert finding.message == "cannot read line/tank.yaml: No such file or directory"


def test_texts_are_found_by_any_spelling_of_their_name():
    reader = Texts({"./a/b.yaml": "ä"})
    assert reader.resolve("a/c/d.yaml", "../b.yaml") == "a/b.yaml"
    assert reader.read("a/../a/b.yaml", 1) == "ä".encode()[:1]


def test_text_that_is_no_unicode_is_a_finding():
    assert [d.code for d in pidcfg.check("pidcfg: 1\nname: \ud800\n").findings] == ["PID002"]


def test_a_file_that_is_not_there_is_an_error_of_the_system():
    for call in (
        pidcfg.check,
        lambda path: pidcfg.encode(REACTOR, into=path),
        lambda path: pidcfg.decode(path, "dl06"),
        lambda path: pidcfg.diff(REACTOR, path),
        lambda path: pidcfg.tune("zn-open", record=path),
        lambda path: pidcfg.explain("gain", config=path),
    ):
        with pytest.raises(FileNotFoundError):
            call(EXAMPLES / "none.yaml")
    with pytest.raises(FileNotFoundError):
        pidcfg.check(REACTOR, files={})


def test_limits_hold():
    short = dataclasses.replace(DEFAULT, loop_steps=100)
    assert "the limit is 100" in pidcfg.simulate(TANK_SCENARIO, limits=short).findings[0].message
    small = dataclasses.replace(DEFAULT, file_bytes=100)
    assert [d.code for d in pidcfg.check(REACTOR, limits=small).findings] == ["PID013"]
    assert [d.code for d in pidcfg.decode(REACTOR, "dl06", limits=small).findings] == ["PID041"]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: pidcfg.decode("", "nobody"),
            f"`vendor` is 'nobody'; it is one of {', '.join(VENDORS)}",
        ),
        (
            lambda: pidcfg.decode("", "dl06", format="st"),
            "`format` is 'st'; it is one of text, csv, json, modbus, ihex",
        ),
        (lambda: pidcfg.decode([], "dl06"), "`source` and `name` are lists of the same length, and not empty"),
        (
            lambda: pidcfg.decode(pidcfg.encode(REACTOR).text, "dl06", options={"pwm_bit": "none"}),
            "`pwm_bit` is not for AutomationDirect DirectLOGIC DL06",
        ),
        (
            lambda: pidcfg.decode(pidcfg.encode(REACTOR).text, "dl06", options={"loop_table": "R1"}),
            "`loop_table`: 'R1'; write it like V2000",
        ),
        (lambda: pidcfg.encode(REACTOR, "pdf"), "`format` is 'pdf'; it is one of text, csv, json, modbus, ihex, "),
        (
            lambda: pidcfg.encode(REACTOR, "cdv"),
            "AutomationDirect DirectLOGIC DL06 has no format cdv; it has text",
        ),
        (lambda: pidcfg.encode(REACTOR, into=""), "text is not written into another file"),
        (lambda: pidcfg.convert(REACTOR, "nobody"), "`to` is 'nobody'; it is one of dl06, "),
        (
            lambda: pidcfg.diff("", "", names=("a.txt", "b.txt")),
            "neither file says the PLC family; name it with `vendor`",
        ),
        (lambda: pidcfg.simulate("", engine="gpu"), "`engine` is 'gpu'; it is one of auto, python, numba"),
        (lambda: pidcfg.simulate("", every=0), "`every` is 0; write a whole number above 0"),
        (lambda: pidcfg.tune("magic"), "`method` is 'magic'; it is one of synthesis, iae-disturbance, "),
        (lambda: pidcfg.tune("zn-open", "PD"), "`form` is 'PD'; it is one of P, PI, PID"),
        (lambda: pidcfg.tune("zn-open", gain=2), "zn-open needs `time_constant` and `dead_time`"),
        (lambda: pidcfg.tune("zn-open", dead_time=-1), "`dead_time`: -1; write a number above 0"),
        (lambda: pidcfg.tune("zn-open", gain=0), "`gain`: 0; write a number other than 0"),
        (lambda: pidcfg.tune("zn-open", gain=float("nan")), "`gain`: nan; write a number other than 0"),
        (lambda: pidcfg.tune("iae-setpoint", "P"), "iae-setpoint has no rule for P; it has PI and PID"),
        (lambda: pidcfg.tune("zn-open", pv_range=(5, 5)), "`pv_range` 5 to 5 does not ascend"),
        (lambda: pidcfg.tune("zn-open", gain=1, record=STEP), "`gain` and `record` do not go together"),
        (lambda: pidcfg.tune("zn-open", record="a,b"), "<text> holds no samples"),
        (lambda: pidcfg.explain("V7642", vendor="nobody"), "`vendor` is 'nobody'; it is one of dl06, "),
        (lambda: pidcfg.explain("gain", config=REACTOR, vendor="click"), "`config` is of vendor dl06, not click"),
        (lambda: pidcfg.explain("nonsense"), "nothing is known of 'nonsense'"),
    ],
)
def test_a_wrong_argument_names_the_choices(call, message):
    with pytest.raises(ValueError, match=r".") as error:
        call()
    assert str(error.value).startswith(message)


# --- results ---------------------------------------------------------------------------------------------------------


def test_load_tells_what_a_file_is():
    configuration, scenario = pidcfg.load(TANK), pidcfg.load(TANK_SCENARIO)
    assert (configuration.kind, configuration.vendor) == ("configuration", "click")
    assert [loop.name for loop in configuration.model.loops] == ["TANK1"]
    assert configuration.to_json()["data"]["loops"][0]["sample_rate"] == "500 ms"
    assert (scenario.kind, scenario.vendor, scenario.model.config) == ("scenario", None, "tank.yaml")
    broken = pidcfg.load("a: [")
    assert (broken.kind, broken.model, broken.ok, [d.code for d in broken.findings]) == (None, None, False, ["PID001"])
    assert not pidcfg.load("pidcfg: 1\nvendor: s7\n").ok


def test_comments_of_the_file_count_unless_told_otherwise():
    text = REACTOR.read_text("utf-8").replace("bias_freeze: true", "bias_freeze: true  # pidcfg: ignore[DL222] meant")
    assert "ignore" in text
    result = pidcfg.check(text)
    assert [(entry.finding.code, entry.reason) for entry in result.ignored] == [("DL222", "meant")]
    assert "DL222" not in {d.code for d in result.findings}
    assert "DL222" in {d.code for d in pidcfg.check(text, comments=False).findings}


def test_words_of_a_configuration_with_errors():
    mistakes = EXAMPLES / "mistakes" / "oven.yaml"
    refused = pidcfg.encode(mistakes)
    assert (refused.ok, refused.image, dict(refused.files)) == (False, None, {})
    assert {row["severity"] for row in refused.to_json()["findings"]} == {"error"}
    with pytest.raises(ValueError, match="there are 0 files"):
        _ = refused.text
    assert pidcfg.encode(mistakes, allow_errors=True).ok


def test_a_format_with_an_encoding_of_its_own():
    result = pidcfg.encode(TANK, "cdv")
    assert len(result.files) == 1
    assert result.text == result.files[""]
    assert (result.kind.name, result.kind.encoding) == ("cdv", "utf-16-le")


def test_a_file_that_a_format_adds_to():
    oven = EXAMPLES / "ezlogix" / "oven.yaml"
    result = pidcfg.encode(
        TANK, "nickname-csv", into=pidcfg.encode(TANK, "nickname-csv").text.encode(), into_name="p.csv"
    )
    assert result.ok
    wrong = pidcfg.encode(TANK, "nickname-csv", into="no such columns", into_name="p.csv")
    assert (wrong.ok, [(d.code, d.file) for d in wrong.findings][-1]) == (False, ("PID041", "p.csv"))
    assert pidcfg.encode(oven, "tags").ok


def test_what_a_format_cannot_hold_is_a_value_error():
    assert issubclass(UnwritableError, ValueError)


def test_a_listing_that_cannot_be_read_is_a_finding():
    result = pidcfg.decode("V2000 XYZ\n", "dl06", name="upload.txt")
    assert (result.ok, result.data, result.text) == (False, None, "")
    (row,) = result.to_json()["findings"]
    assert (row["code"], row["file"]) == ("PID041", "upload.txt")


def test_an_image_in_several_files():
    whole = pidcfg.encode(REACTOR, "csv").text.splitlines(keepends=True)
    head = [line for line in whole if line.startswith("#")] + [line for line in whole if line.startswith("address")]
    rows = [line for line in whole if line not in head]
    parts = ["".join(head + rows[:9]), "".join([head[-1], *rows[9:]])]
    result = pidcfg.decode(parts, "dl06", name=["one.csv", "two.csv"])
    assert result.data == pidcfg.decode("".join(whole), "dl06").data


def test_a_listing_with_meanings():
    result = pidcfg.decode(pidcfg.encode(REACTOR).text, "dl06", annotate=True)
    assert result.data is None
    assert result.to_json() == {"version": 1, "text": result.text}


def test_a_conversion_says_what_is_missing():
    words = [line for line in pidcfg.encode(REACTOR).text.splitlines() if not line.startswith("#")]
    raw = pidcfg.decode("\n".join(words), "dl06", options={"loop_table": "V2000", "number_of_loops": 3})
    result = pidcfg.convert(raw.text, "click", name="raw.yaml")
    assert not result.ok
    assert result.text == ""
    assert {row["code"] for row in result.to_json()["findings"]} == {"PID042"}


def test_a_comparison_with_a_listing_takes_what_is_missing_from_the_other_side():
    listing = pidcfg.encode(TANK).text
    assert pidcfg.diff(TANK, listing, names=(None, "upload.txt")).same
    broken = pidcfg.diff(TANK, "nothing", names=("tank.yaml", "upload.txt"))
    assert (broken.ok, broken.refused, [d.code for d in broken.findings]) == (False, "upload.txt", ["PID041"])


def test_a_run_keeps_its_signals_and_its_trend():
    trend = io.StringIO()
    result = pidcfg.simulate(TANK_SCENARIO, engine="python", record=True, trend=trend, every=10)
    times, values = result.recording.signal("TANK1.PV")
    assert len(times) == len(values) > 100
    assert trend.getvalue().startswith("time,")
    assert result.report.loops["TANK1"].metrics
    shares = []
    pidcfg.simulate(TANK_SCENARIO, engine="python", progress=shares.append)
    assert shares == sorted(shares)


def test_a_trend_that_is_kept_is_the_csv_as_columns():
    text = io.StringIO()
    pidcfg.simulate(TANK_SCENARIO, engine="python", trend=text, every=10)
    run = pidcfg.simulate(TANK_SCENARIO, engine="python", trend=True, every=10)
    frame = run.to_frame()
    head, *rows = (line.split(",") for line in text.getvalue().splitlines())
    assert list(frame) == head
    assert [list(map(float, row)) for row in rows] == [list(row) for row in zip(*frame.values(), strict=True)]
    frame["time"].clear()
    assert run.to_frame()["time"][:2] == [0.0, float(rows[1][0])]
    for other in (None, False, text):
        with pytest.raises(ValueError, match="the trend was not kept; call simulate with trend=True"):
            pidcfg.simulate(TANK_SCENARIO, engine="python", trend=other).to_frame()


EVIL = "</td></table></iframe><script>alert(1)</script>"


@pytest.mark.parametrize("record", [False, True])
def test_what_a_notebook_shows_of_a_file_is_escaped(record):
    config = TANK.read_text("utf-8").replace("TANK1", f'"{EVIL}"').replace("description: ", f"description: {EVIL} ")
    scenario = TANK_SCENARIO.read_text("utf-8").replace("TANK1", f'"{EVIL}"')
    scenario = re.sub("(?m)^scenario:.*", f"scenario: '{EVIL}'", scenario)
    files = {"a.yaml": config, "a.scenario.yaml": re.sub("(?m)^config:.*", "config: a.yaml", scenario)}
    run = pidcfg.simulate(Path("a.scenario.yaml"), files=files, record=record, engine="python")
    results = (
        run,
        pidcfg.check(Path("a.yaml"), files=files),
        pidcfg.check(EVIL, name=EVIL),
        pidcfg.encode(Path("a.yaml"), files=files, allow_errors=True),
        pidcfg.diff(config, config.replace("proportional_gain: 6", "proportional_gain: 5"), names=(EVIL, "b.yaml")),
        pidcfg.diff(config, EVIL, names=("a.yaml", EVIL)),
    )
    for result in results:
        shown = result._repr_html_()
        assert "<script>alert" not in shown
        assert shown.count("<table>") == shown.count("</table>") >= 1, type(result)
        assert (
            shown.count("<iframe") == shown.count("</iframe>") == (record and result is run and run.report is not None)
        )


def test_a_notebook_shows_verdicts_words_and_differences():
    shown = pidcfg.simulate(TANK_SCENARIO, engine="python", record=True)._repr_html_()
    assert "<b>Heating up, cold make-up water, a broken sensor</b> passed" in shown
    assert "<td>TANK1</td><td>proven</td>" in shown
    assert "<td>passed</td><td>138.4 to 140.3</td>" in shown
    assert shown.count("text-align:left") == shown.count("<table>"), "notebooks put cells of tables to the right"
    assert '<iframe sandbox="allow-scripts"' in shown
    assert "&lt;polyline" in shown
    assert "<td>DF106</td>" in pidcfg.encode(TANK)._repr_html_()
    cascade = pidcfg.encode(EXAMPLES / "nextopid" / "cascade.yaml")
    assert cascade._repr_html_().count("<tr>") == len(cascade.image.cells) + 1
    text = TANK.read_text("utf-8")
    shown = pidcfg.diff(text, text.replace("proportional_gain: 6", "proportional_gain: 5"))._repr_html_()
    assert "<td>tuning.proportional_gain</td><td>6</td><td>5 %/degF</td><td>DF106</td>" in shown
    extruder = EXAMPLES / "dl06" / "extruder.yaml"
    assert "more rows</p>" in pidcfg.encode(extruder)._repr_html_()


def test_a_picture_of_a_result():
    run = pidcfg.simulate(TANK_SCENARIO, engine="python", record=True)
    page = pidcfg.plot(run, "html", title="Tank & <b>")
    assert page.loops == ("TANK1",)
    assert "<title>Tank &amp; &lt;b&gt;</title>" in page.text
    assert page._repr_html_().startswith("<iframe")
    svg = pidcfg.plot(run, "svg", loops=["TANK1"])
    assert "<svg" in svg.text
    assert svg._repr_html_().startswith('<img style="max-width:100%" src="data:image/svg+xml;base64,')
    if importlib.util.find_spec("matplotlib"):
        png = pidcfg.plot(run, "png", loops=["TANK1"])
        assert png.data.startswith(b"\x89PNG")
        with pytest.raises(ValueError, match="a png is no text"):
            _ = png.text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (lambda: (pidcfg.simulate(TANK_SCENARIO), "html"), "`result` has nothing to be drawn: run it with record=True"),
        (lambda: (pidcfg.simulate("scenario: x"), "html"), "it has not run; see `findings`"),
        (lambda: (pidcfg.diff(TANK, TANK), "html"), "run both sides with verify=True"),
        (lambda: (pidcfg.check(TANK), "html"), "plot takes a result of simulate, certify, diff or convert"),
        (lambda: (CALLS["certify"](), "gif"), "`format` is 'gif'; it is one of svg, png, html"),
        (lambda: (CALLS["certify"](), "html", ["X"]), "`loops` has 'X'; there are TIC-21"),
    ],
)
def test_what_cannot_be_drawn_says_what_to_do(arguments, message):
    result, kind, *loops = arguments()
    with pytest.raises(ValueError, match=re.escape(message)):
        pidcfg.plot(result, kind, loops=loops[0] if loops else ())


def test_a_report_is_what_the_command_writes(tmp_path, monkeypatch):
    pytest.importorskip("jinja2")
    monkeypatch.chdir(EXAMPLES / "click")
    words = ["report", "tank.scenario.yaml", "--project", "Line 4", "-o", str(tmp_path / "a.html"), "--quiet"]
    assert captured(shell_pidcfg, words)[0] == 0
    result = pidcfg.report(Path("tank.scenario.yaml"), project="Line 4")
    assert result.page() == (tmp_path / "a.html").read_text("utf-8")
    assert result.ok
    assert "TANK1" in result.sheet()
    assert result.tables["title.csv"].count("Line 4") == 1
    broken = pidcfg.report(EXAMPLES / "mistakes" / "oven.yaml")
    assert not broken.ok
    assert broken.to_json()["verdict"] == "FAILED"
    with pytest.raises(ValueError, match="`sources` is empty"):
        pidcfg.report()


def test_a_scenario_that_cannot_run():
    result = pidcfg.simulate("pidcfg: 1\nscenario: x\nconfig: none.yaml\nduration: 10 s\n", files={})
    assert (result.ok, result.report) == (False, None)
    assert "PID058" in {d.code for d in result.findings}


def test_a_configuration_runs_with_a_drafted_scenario():
    result = pidcfg.simulate(REACTOR)
    assert result.ok
    assert result.to_json()["file"] == REACTOR.as_posix()
    assert {v.kind for v in result.report.standing if not v.is_judged} == {"wrong-action"}, "of the plant's sign"


def test_a_configuration_with_errors_has_no_scenario():
    result = pidcfg.simulate(EXAMPLES / "mistakes" / "oven.yaml")
    assert (result.ok, result.report) == (False, None)
    assert "DL242" in {d.code for d in result.findings}


def test_gains_of_a_recorded_step():
    result = pidcfg.tune("zn-open", record=STEP, name="step.csv")
    assert result.identified.process.gain == pytest.approx(2, rel=0.02)
    assert result.to_json()["identified"]["step_at"] == 10
    assert result.heating


def test_gains_that_a_register_cannot_hold_say_so():
    values = pidcfg.tune(
        "zn-closed", ultimate_gain=1e6, ultimate_period=4, vendor="dl06", pv_range=(0, 1)
    ).vendor.values
    assert any(value.problem for value in values)


def test_what_can_be_asked_for():
    result = pidcfg.explain()
    assert result.ok
    assert {row["example"] for row in result.to_json()["forms"]} > {"DL242", "D46"}
    assert not pidcfg.explain("gain", config="pidcfg: 1\nvendor: dl06\n").ok


# --- the functions of before -----------------------------------------------------------------------------------------


def test_a_file_gives_its_findings_and_its_words():
    checked = pidcfg.check_file(REACTOR)
    assert not checked.failed
    assert checked.encoding.image.words[0o2007] == 0x0020


def test_text_with_a_mistake_gives_a_finding_and_no_exception():
    checked = pidcfg.check_text("pidcfg: 1\nvendor: dl06\nplc: {loop_table: V2008}\nloops: []\n")
    assert [(d.code, d.span.line) for d in checked.findings] == [("PID029", 3)]
    assert checked.encoding is None


def test_words_come_back_as_data():
    words = pidcfg.check_file(REACTOR).encoding.image.words
    assert pidcfg.decode_words("dl06", words).data["loops"][0]["tuning"]["gain"] == 0.8


def test_unknown_names_are_attribute_errors():
    with pytest.raises(AttributeError):
        _ = pidcfg.nothing


def test_the_decimals_of_the_caller_change_no_result_and_stay_as_they_are():
    plain = pidcfg.convert(TANK, "dl06").to_json()
    with decimal.localcontext(decimal.Context(prec=5, rounding=decimal.ROUND_UP)) as context:
        assert pidcfg.convert(TANK, "dl06").to_json() == plain
        assert context.prec == 5
        assert not any(context.flags.values())


def test_a_configuration_without_loops_is_no_crash():
    text = "pidcfg: 1\nvendor: dl06\nplc: {loop_table: V2000, reset_decimals: 1}\nloops: []\n"
    for target in ("click", "ezlogix", "dpide", "generic"):
        assert [d.code for d in pidcfg.convert(text, target).findings if d.severity.label == "error"] == ["PID107"]


BOILER = ROOT / "examples" / "generic" / "boiler.yaml"


@pytest.mark.parametrize("case", ["CK321", "DL276-3"])
def test_words_without_a_meaning_are_a_finding_of_diff_with_another_vendor(case):
    path = ROOT / "tests" / "cases" / f"{case}.yaml"
    assert {d.code for d in pidcfg.diff(path, BOILER).findings} == {"PID042"}
    assert pidcfg.diff(path, path).same, "within a vendor the words themselves are compared"


@pytest.mark.parametrize("source", [3, 10**11, True, ["a"], Path])
def test_what_is_no_source_is_a_type_error(source):
    with pytest.raises(
        TypeError, match=r"^`source` is .*; give a pathlib\.Path, str or bytes, or the document of a result$"
    ):
        pidcfg.check(source)
