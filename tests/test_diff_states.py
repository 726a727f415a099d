"""`pidcfg diff` against a PLC whose words show an error, a stop or an auto-tune: the loop is not called the same."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import pidcfg as pidcfg_package
from command import run_text
from pidcfg.cli.formats.conversion import render_differences
from pidcfg.cli.formats.findings import markdown_cell
from pidcfg.conversion.differences import STATE_RULES, TUNE_RUNNING
from pidcfg.encoders.maps import click, ezlogix, nextopid

EXAMPLES = Path(__file__).parents[1] / "examples"
FILES = {
    "dl06": ("dl06/reactor", "TIC-101"),
    "click": ("click/tank", "TANK1"),
    "ezlogix": ("ezlogix/oven", "OVEN1"),
    "dpide": ("dpide/oven", "OVEN"),
    "nextopid": ("nextopid/autotune", "TIC_1"),
}
STATUS = {"dl06": {"mode_and_alarm_status": "V2046", "ramp_soak_errors": "V2075", "error_flags": "V7642"}}
"""Registers by name; of the others the field stands in the listing."""


OF_ERRORS = {row.name: row.title for row in nextopid.BLOCK_TYPES["PIDA_TUNE_REAL"].outputs}
# fmt: off
STATES = [
    # register, content, kind, text
    *(("dl06", "mode_and_alarm_status", 1 << n, "error", text) for n, text in (
        (10, "Alarm value programming error"), (11, "Loop calculation overflow/underflow"), (13, "Auto-tune error"))),
    ("dl06", "mode_and_alarm_status", 1 << 12, "tuning", TUNE_RUNNING),
    *(("dl06", "ramp_soak_errors", 1 << n, "error", text) for n, text in (
        (0, "Starting address out of lower V-memory range"), (1, "Starting address out of upper V-memory range"),
        (4, "Starting address in system V-memory"))),
    *(("dl06", "error_flags", 1 << n, "error", text) for n, text in (
        (0, "The loop table starts outside the lower V-memory range"),
        (1, "The loop table starts outside the upper V-memory range"),
        (2, "The number of loops is greater than 8"), (3, "The loop table extends past V7577"))),
    *(("click", "error_code", code.number, "error", f"error {code.number}: {code.title}") for code in click.CODES[1:]),
    ("click", "error_code", 77, "error", "error 77"),
    ("click", "autotune_request", 1, "tuning", TUNE_RUNNING),
    *(("ezlogix", "autotune_status", n, "tuning", f"{TUNE_RUNNING}: {text}") for n, text in (
        (1, "collecting data"), (2, "calculating"))),
    *(("ezlogix", "autotune_status", c.number, "error", f"autotune error {c.number}: {c.title}")
      for c in ezlogix.CODES if c.number > 4),
    ("dpide", "PID_RUN", False, "stopped", "PID_RUN is FALSE: the algorithm does not run, and MV is 0"),
    *(("nextopid", name, True, "error", f"{name} is TRUE: {title}") for name, title in OF_ERRORS.items()
      if name.startswith("ErrBits.") or name == "AutoTuneError"),
]
SILENT = [
    # what runs, and is told by --live alone
    *(("dl06", "mode_and_alarm_status", 1 << n) for n in range(10)),
    ("dl06", "ramp_soak_flags", 0x0330),
    *(("click", name, 1) for name in ("alarm_low", "alarm_high_high", "alarm_rate_of_change", "auto_request")),
    *(("ezlogix", "autotune_status", n) for n in (3, 4)),
    ("ezlogix", "saturation", 1),
    ("dpide", "PID_MAN", True),
    *(("nextopid", name, True) for name in ("WarnBits.MV_MaxMV", "AutoTuneDone", "Windup_H_OUT")),
]
# fmt: on


def listing(vendor, register, content):
    """The words of an example in its PLC, with one of them changed, and the address of that one."""
    name, loop = FILES[vendor]
    text = next(iter(pidcfg_package.encode(EXAMPLES / f"{name}.yaml", "json").files.values()))
    data = json.loads(text if isinstance(text, str) else text.decode())
    address = STATUS.get(vendor, {}).get(register)
    field = {"field": register, "loop": loop}
    entry = next((w for w in data["words"] if address in {None, w["address"]} and field.items() <= w.items()), None)
    if entry is None:
        entry = {"address": address or f"{loop}.{register}"} | ({"type": "BOOL"} if vendor == "nextopid" else {})
        data["words"].append(entry)
    entry.pop("hex", None)
    entry["value"] = content
    return json.dumps(data), entry["address"]


def compared(tmp_path, vendor, register, content):
    """The file against the listing."""
    (tmp_path / "plc.json").write_text(listing(vendor, register, content)[0])
    return pidcfg_package.diff(EXAMPLES / f"{FILES[vendor][0]}.yaml", tmp_path / "plc.json")


def loops_of(result):
    return {loop["loop"]: loop for loop in result.to_json()["loops"]}


@pytest.mark.parametrize("vendor", FILES)
def test_a_plc_that_runs_as_it_is_set_up_is_the_same(tmp_path, vendor):
    name, loop = FILES[vendor]
    text = next(iter(pidcfg_package.encode(EXAMPLES / f"{name}.yaml", "json").files.values()))
    (tmp_path / "plc.json").write_text(text)
    result = pidcfg_package.diff(EXAMPLES / f"{name}.yaml", tmp_path / "plc.json")

    assert result.same
    assert loop in render_differences("text", result).rpartition("the same: ")[2]


@pytest.mark.parametrize(("vendor", "register", "content", "kind", "text"), STATES)
def test_each_state_is_told_in_every_format_and_is_not_the_same(tmp_path, vendor, register, content, kind, text):
    loop, result = FILES[vendor][1], compared(tmp_path, vendor, register, content)
    written, marked = (render_differences(fmt, result) for fmt in ("text", "markdown"))
    data = loops_of(result)[loop]
    [state] = data["states"]

    assert not result.same
    assert f"\n{loop}\n  {kind:<8}  {text} (" in written
    assert loop not in written.partition("the same: ")[2]
    assert markdown_cell(text) in marked
    assert "No difference" not in marked
    assert (state["kind"], state["text"], data["status"], state["side"]) == (kind, text, "disturbed", None)
    address, word = listing(vendor, register, content)[1], str(content).upper()
    place = (f"{address}.{content.bit_length() - 1}", "1") if vendor == "dl06" else (address, word)
    assert (state["address"], state["word"]) == place
    told = {name for name, entry in loops_of(result).items() if entry["states"]}
    assert told == ({name for name in loops_of(result) if name} if register == "error_flags" else {loop})


@pytest.mark.parametrize(("vendor", "register", "content"), SILENT)
def test_what_comes_and_goes_with_the_process_is_no_state(tmp_path, vendor, register, content):
    result = compared(tmp_path, vendor, register, content)
    data = loops_of(result)[FILES[vendor][1]]

    assert (result.same, data["status"], data["states"]) == (True, "same", [])


def test_an_auto_tune_is_told_whether_its_switch_is_a_setting_or_runs(tmp_path):
    mode, switch = (
        loops_of(compared(tmp_path, vendor, register, content))[FILES[vendor][1]]
        for vendor, register, content in (("dpide", "PID_MODE", 1), ("nextopid", "AutoTune", True))
    )

    assert ([s["kind"] for s in mode["states"]], mode["status"]) == (["tuning"], "disturbed")
    assert ([s["kind"] for s in switch["states"]], switch["status"]) == (["tuning"], "changed")


def test_an_error_of_the_set_up_is_told_of_every_loop(tmp_path):
    found = loops_of(compared(tmp_path, "dl06", "error_flags", 4))

    assert {name: loop["status"] for name, loop in found.items() if name} == dict.fromkeys(
        ("TIC-101", "FIC-102", "LIC-103"), "disturbed"
    )


def test_the_exit_code_is_that_of_a_difference(tmp_path):
    (tmp_path / "plc.json").write_text(listing("click", "error_code", 26)[0])
    args = ("diff", "click/tank.yaml", str(tmp_path / "plc.json"))

    assert run_text(*args, cwd=EXAMPLES).returncode == 0
    assert run_text(*args, "--exit-code", cwd=EXAMPLES).returncode == 1


def test_a_block_beside_the_loops_is_told_where_it_is_in_error(tmp_path):
    text = next(iter(pidcfg_package.encode(EXAMPLES / "nextopid/furnace.yaml", "json").files.values()))
    data = json.loads(text)
    data["words"].append({"address": "FILTER.Error", "type": "BOOL", "value": True})
    (tmp_path / "plc.json").write_text(json.dumps(data))
    result = pidcfg_package.diff(EXAMPLES / "nextopid/furnace.yaml", tmp_path / "plc.json")

    assert [s["text"].partition(":")[0] for s in loops_of(result)["FILTER"]["states"]] == ["Error is TRUE"]
    assert not result.same


def test_what_the_file_asks_for_is_no_trouble(tmp_path):
    text, _ = listing("dpide", "PID_RUN", False)
    stopped = (EXAMPLES / "dpide/oven.yaml").read_text().replace("    SV:", "    PID_RUN: false\n    SV:", 1)
    (tmp_path / "plc.json").write_text(text)
    (tmp_path / "file.yaml").write_text(stopped)
    result = pidcfg_package.diff(tmp_path / "file.yaml", tmp_path / "plc.json")

    assert [(loop.status, loop.states) for loop in result.loops if loop.loop] == [("same", ())]


def test_two_listings_say_of_which_side_a_state_is(tmp_path):
    for name, content in (("monday", 0), ("friday", 26)):
        (tmp_path / f"{name}.json").write_text(listing("click", "error_code", content)[0])
    args = ("monday.json", "friday.json", "--like", str(EXAMPLES / "click/tank.yaml"), "--exit-code")
    result = run_text("diff", *args, cwd=tmp_path, NO_COLOR="1")

    assert result.returncode == 1
    assert "  error     friday.json: error 26: " in result.stdout


@pytest.mark.parametrize(("vendor", "register", "content"), [("click", "error_code", 26), ("dpide", "PID_RUN", False)])
def test_a_state_that_two_listings_share_is_told_of_both(tmp_path, vendor, register, content):
    for name in ("monday", "friday"):
        (tmp_path / f"{name}.json").write_text(listing(vendor, register, content)[0])
    like = EXAMPLES / f"{FILES[vendor][0]}.yaml"
    result = pidcfg_package.diff(tmp_path / "monday.json", tmp_path / "friday.json", like=like)
    (loop,) = (loop for loop in result.loops if loop.loop)
    assert [Path(state.side).name for state in loop.states] == ["monday.json", "friday.json"]


@pytest.mark.parametrize("word", [{"address": "AutoTune", "value": True}, {"address": "TIC_1.Foo", "value": True}])
def test_a_signal_or_another_parameter_is_no_state(tmp_path, word):
    data = json.loads(listing("nextopid", "AutoTuneDone", True)[0])
    data["words"].append({"type": "BOOL", **word})
    (tmp_path / "plc.json").write_text(json.dumps(data))
    result = pidcfg_package.diff(EXAMPLES / "nextopid/autotune.yaml", tmp_path / "plc.json")
    assert [loop.states for loop in result.loops if loop.states] == []


def test_a_state_is_told_between_vendors(tmp_path):
    (tmp_path / "plc.json").write_text(listing("click", "error_code", 26)[0])
    other = pidcfg_package.convert(EXAMPLES / "click/tank.yaml", "dl06")
    (tmp_path / "tank.yaml").write_text(other.text)
    like = EXAMPLES / "click/tank.yaml"
    result = pidcfg_package.diff(tmp_path / "plc.json", tmp_path / "tank.yaml", like=like)

    assert [state["key"] for loop in loops_of(result).values() for state in loop["states"]] == ["error_code"]


def test_every_bit_and_number_of_the_maps_that_tells_of_a_state_is_tried():
    tried = {(vendor, register) for vendor, register, *_ in STATES} | {("dpide", "PID_MODE"), ("nextopid", "AutoTune")}
    named = {(vendor, row.register) for vendor, rows in STATE_RULES.items() for row in rows}

    assert {(v, r.partition(".")[0] + "." if r.startswith("ErrBits.") else r) for v, r in tried} == named - {
        ("nextopid", "Error")
    }
    assert {bit for row in STATE_RULES["dl06"] for bit in row.bits if row.register == "error_flags"} == {0, 1, 2, 3}
