"""Several files, files that cannot be compared, and set-ups that are no values: who is told what of which file."""

import json
from types import SimpleNamespace

import pytest

import pidcfg
from live_rig import CLICK, DL06, Registers, run, words_of
from map_rig import example, filled, words_by

HOLDING, GAIN, POINTER = "holding", 0o2010, 0o2074
BREWERY = CLICK.with_name("brewery.yaml")


@pytest.fixture(scope="module")
def reactor():
    """A DL06 with all of its V-memory below V10000."""
    return {(HOLDING, n): 0 for n in range(0o10000)} | words_of(DL06)


def test_a_file_whose_registers_are_not_there_leaves_the_others_alone(desk):
    with desk.plc(Registers(words_of(CLICK) | {(HOLDING, 105): 501})) as url:
        done = run("compare", CLICK, BREWERY, "--plc", url)
        report = run("compare", CLICK, BREWERY, "--plc", url, "--format", "json")
    assert (done.exit_code, report.exit_code) == (2, 2)
    assert "sample_rate: the PLC holds 0.501 s (DS106 501)" in done.stdout
    assert "1 difference; 1 setting could not be read; 1 file not compared" in done.stderr
    codes = {(d["file"], d["code"]) for d in json.loads(report.stdout)["findings"]}
    assert codes == {(str(CLICK), "PID065"), (str(CLICK), "PID069"), (str(BREWERY), "PID066")}


def test_a_plc_that_is_silent_is_not_asked_for_each_file(desk):
    asked = []

    def silent(request):
        asked.append(request)
        return b""

    with desk.line(silent) as url:
        done = run("compare", CLICK, BREWERY, "--plc", url, "--timeout", "0.05", "--retries", "0", "--format", "json")
    assert done.exit_code == 2
    assert [d["code"] for d in json.loads(done.stdout)["findings"]] == ["PID066", "PID066"]
    assert len(asked) == 1


def test_a_file_that_is_none_is_no_difference(desk, tmp_path):
    with desk.plc(Registers(words_of(CLICK))) as url:
        done = run("compare", tmp_path / "none.yaml", "--plc", url)
        both = run("compare", CLICK, tmp_path / "none.yaml", "--plc", url)
    assert (done.exit_code, both.exit_code) == (2, 2)
    assert done.stderr.endswith("1 file not compared\n")
    assert both.stderr.endswith(": alike as far as read; 1 setting could not be read; 1 file not compared\n")


@pytest.mark.parametrize("start", [0, 0xFFFF, 0o2001])
def test_a_loop_table_that_is_somewhere_else_is_a_difference(desk, reactor, start):
    with desk.plc(Registers(reactor | {(HOLDING, 0o7640): start})) as url:
        result = pidcfg.compare(DL06, url)
    assert any(d.key == "plc.loop_table" and f"{start:04X}" in d.message for d in result.findings)
    assert any(d.message.startswith("the PLC's words make no configuration: ") for d in result.findings)


@pytest.mark.parametrize("start", [0o400, 0o17000, 0o3001, 0xFFFF])
def test_a_table_that_is_not_where_its_pointer_says_is_a_difference_of_the_pointer(desk, reactor, start):
    words = reactor | {(HOLDING, POINTER): start, (HOLDING, GAIN): 0x0310}
    with desk.plc(Registers(words)) as url:
        keys = {d.key for d in pidcfg.compare(DL06, url).findings}
        pulled = pidcfg.pull(url, vendor="dl06")
    assert {"ramp_soak.table", "tuning.gain"} <= keys
    assert pulled.ok


def test_what_is_switched_off_is_no_value_that_makes_no_sense(desk):
    with desk.plc(Registers(words_of(CLICK) | {("coil", 16484): 0, ("coil", 16492): 0})) as url:
        result = pidcfg.compare(CLICK, url)
    said = {d.key: d.message for d in result.findings}
    assert said["bumpless"] == "bumpless: the PLC holds 1 (C109 0), the file says 2 (1)"
    assert "nothing that is a value" not in " ".join(said.values())


def test_an_operated_set_point_is_told_with_its_register(desk):
    with desk.plc(Registers(words_of(CLICK) | {(HOLDING, 28873): 0x430D})) as url:
        (note,) = pidcfg.compare(CLICK, url).notes
    assert note == "TANK1: operated, and no difference: setpoint.value is 141 degF (DF101 141.0), in the file 140"


def test_words_in_the_other_order_are_told(desk):
    words = words_of(CLICK)
    other = {(HOLDING, n ^ 1): raw for (table, n), raw in words.items() if table == HOLDING and n >= 28672}
    with desk.plc(Registers(words | other)) as url:
        result = pidcfg.compare(CLICK, url)
        notes = [result.notes, *(pidcfg.pull(url, like=CLICK, format=name).notes for name in ("yaml", "csv"))]
    assert not result.same
    assert all("the two registers of a number seem to stand in the other order" in told[0] for told in notes)
    with desk.plc(Registers(words)) as url:
        assert not pidcfg.compare(CLICK, url).notes


@pytest.mark.parametrize("vendor", ["dpide", "nextopid"])
def test_parameters_in_the_other_order_are_told(desk, vendor):
    text = filled(example(vendor))
    other = text.replace("low-first", "high-first")
    assert other != text
    with desk.plc(Registers(words_by(example(vendor), text))) as url:
        notes = [pidcfg.compare(example(vendor), url, map=one).notes for one in (text, other)]
    assert ["other order" in " ".join(told) for told in notes] == [False, True]


def test_watching_prints_what_comes_and_goes(desk, monkeypatch):
    state = {"code": None}
    registers = Registers(words_of(CLICK), lambda _: state["code"])
    place, rate = (HOLDING, 105), registers.words[HOLDING, 105]

    def changes(to, code=None):
        registers.words[place], state["code"] = to, code

    steps = iter([(rate + 1,), (rate + 1,), (rate + 1, 4), (rate + 1, 4), (rate,)])

    def sleep(seconds):
        assert seconds == 7.5
        if (step := next(steps, None)) is None:
            raise KeyboardInterrupt
        changes(*step)

    monkeypatch.setattr("pidcfg.cli.commands.plc.time", SimpleNamespace(sleep=sleep))
    with desk.plc(registers) as url:
        done = run("compare", CLICK, "--plc", url, "--watch", "7.5", "--retries", "0")
    said = [line.split(" ", 2)[2] for line in done.stdout.splitlines() if line.startswith("20")]
    assert done.stdout.count("PID069") == 1, "what no register has is said once"
    row = "14:18: sample_rate: the PLC holds 0.501 s (DS106 501), the file says 0.5 s (500)"
    assert [words.partition(": ")[0] for words in said] == [
        "differs",
        url.removeprefix("modbus://"),
        "reached again",
        "no longer",
    ]
    assert row in said[0]
    assert "exception 4 (device failure)" in said[1]
    assert row in said[3]
    assert done.exit_code == 0
    assert done.stderr.endswith("stopped; the last comparison ended with exit code 0\n")
