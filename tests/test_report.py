"""``pidcfg report``: what stands on the sheets, in the tables and in the workbook, and how the command ends."""

from __future__ import annotations

import csv
import datetime as dt
import hashlib
import io
import json
import re
import socket
from pathlib import Path

import pytest
from click.testing import CliRunner

import golden
from pidcfg.cli.main import cli
from pidcfg.output.report import Title
from pidcfg.output.report.formats import Table, css_string, csv_files, report_page, safe_text, tables_of, write_workbook
from pidcfg.output.report.sheets import compose_report, plc_sheet
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document, is_scenario

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "examples"
GOLDEN = HERE / "data" / "report"
CASES = sorted((HERE / "cases").glob("**/*.yaml"))


def run(*args):
    """The command's result; a traceback is a failure of the test."""
    result = CliRunner().invoke(cli, ["report", *map(str, args)])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def sheets(text, name="loops.yaml"):
    """The content of a report on one configuration."""
    checked = check_document(read_document(text.encode(), name))
    return compose_report(Title("T", version="1"), [], [plc_sheet(checked)], [], checked.findings)


def example(name):
    """The content of a report on an example's configuration."""
    return sheets((EXAMPLES / f"{name}.yaml").read_text("utf-8"), f"{name}.yaml")


def settings(content, loop=0):
    """The settings of a loop by their paths."""
    return {s.path: s for group in content.loops[loop][1].groups for s in group.settings}


def facts(sheet):
    """The facts of a loop by their titles."""
    return {fact.title: fact.text for fact in sheet.facts}


def registers(content, loop=0):
    """The registers of a loop by their addresses."""
    return {r.address: r for block in content.loops[loop][1].blocks for r in block.registers}


# --- the sheets ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["dl06/reactor", "click/tank", "ezlogix/oven"])
def test_the_words_are_those_that_encode_writes(name):
    words = json.loads((golden.golden(name, f"{Path(name).name}.json")).read_text("utf-8"))["words"]
    content = example(name)
    found = {
        r.address: r for plc in content.plcs for part in (plc, *plc.loops) for b in part.blocks for r in b.registers
    }
    for word in words:
        if word["address"] in found:
            row = found[word["address"]]
            assert (row.hex, float(row.decimal)) == (word["hex"], float(word["value"])), word
            assert row.name == word["field"] or row.owner == "reserved"
        else:
            assert not word["value"], word
    missing = {word["address"] for word in words} - set(found)
    assert all(any(" to " in address for address in found) for _ in missing)


@pytest.mark.parametrize("name", ["nextopid/heatexchanger", "dpide/oven", "generic/boiler"])
def test_the_parameters_are_those_that_encode_writes(name):
    lines = (golden.golden(name, f"{Path(name).name}.txt")).read_text("utf-8").splitlines()
    content = example(name)
    found = [p for plc in content.plcs for part in (plc, *plc.loops) for p in part.parameters]
    written = {line.split()[0]: " ".join(line.split()[2:]) for line in lines if not line.startswith("#")}
    assert {p.name: p.content for p in found} == written
    assert all(p.meaning for p in found if "." in p.name)


def test_a_setting_has_its_value_unit_place_and_meaning():
    found = settings(example("dl06/reactor"), 1)
    gain, alarm, mode = found["tuning.gain"], found["alarms.pv.high"], found["mode"]
    assert (str(gain.value), gain.unit, gain.place, gain.is_given) == ("2.50", "%/%", "V2050", True)
    assert gain.meaning.startswith("Gain Kc")
    assert (str(alarm.value), alarm.unit, alarm.place) == ("130", "degC", "V2055")
    assert (mode.value, mode.place) == ("auto", "no register")
    assert found["action"].place == "V2040 bit 4"
    assert found["pv.format"].place == "V2041 bits 9, 1, 0"
    assert found["setpoint.limits"].place == "V2066, V2067"
    assert found["setpoint.limits"].value == "20 to 120"
    assert found["ramp_soak.table"].value == "V3000"
    assert found["ramp_soak.steps[1].slope"].unit == "degC/s"
    assert found["ramp_soak.steps[1].slope"].place == "V3005"
    assert found["algorithm"].is_given is False


def test_a_setting_that_stands_for_a_register_has_its_place():
    """`cascade_from` names the loop whose output +32 points at; a transfer is one word of base, slot and channel."""
    found = settings(example("dl06/reactor"), 0)
    assert (found["cascade_from"].value, found["cascade_from"].place) == ("TIC-101", "V2032")
    assert {found[f"pv.transfer.{part}"].place for part in ("base", "slot", "channel")} == {"V2036"}
    assert {found[f"output.transfer.{part}"].place for part in ("base", "slot", "channel")} == {"V2037"}


def test_the_unit_of_a_reset_time_leaves_no_choice():
    content = example("dl06/reactor")
    assert [settings(content, i)["tuning.reset"].unit for i in range(3)] == ["s", "s", "min"]
    assert [registers(content, i)[a].unit for i, a in enumerate(("V2011", "V2051", "V2111"))] == ["s", "s", "min"]


def test_a_word_is_told_in_its_own_unit_and_not_in_that_of_the_file():
    content = example("click/tank")
    told, word = settings(content)["alarms.rate_of_change"], registers(content)["DF120"]
    assert (float(told.value), told.unit) == (120, "degF/min")
    assert (float(word.value), word.unit) == (1, "degF/sample")


def test_raw_counts_are_called_counts():
    content = example("dl06/reactor")
    assert settings(content, 2)["setpoint.value"].unit == "counts"
    raw = (EXAMPLES / "dl06/reactor.yaml").read_text("utf-8").replace('pv: {range: [0, 100], unit: "%"}', "pv: {}")
    found = sheets(raw)
    assert settings(found, 2)["setpoint.value"].unit == "counts"
    assert registers(found, 2)["V2102"].unit == "counts"


@pytest.mark.parametrize(
    ("independent", "units", "names"),
    [(False, ("s", "s"), ("Ti", "Td")), (True, ("%/degC/s", "% per degC/s"), ("Ki", "Kd"))],
)
def test_a_gain_is_not_called_a_time(independent, units, names):
    text = (EXAMPLES / "nextopid/override.yaml").read_text("utf-8")
    content = sheets(text.replace("Td_Kd: 0.0", f"Td_Kd: 0.0\n    Indep: {str(independent).lower()}"))
    found, known = settings(content), facts(content.loops[0][1])
    assert (found["Ti_Ki"].unit, found["Td_Kd"].unit, found["Kp"].unit) == (*units, "%/degC")
    assert known["Form"].startswith("independent" if independent else "dependent")
    assert [known[name].partition(" ")[2] for name in names] == [*units]
    assert {"Ti", "Td", "Ki", "Kd"} & {*known} == {*names}


@pytest.mark.parametrize(("form", "unit"), [("true", "s"), ("false", "%/degC/s")])
def test_the_form_of_the_equation_tells_what_a_number_is_counted_in(form, unit):
    text = (EXAMPLES / "dpide/chiller.yaml").read_text("utf-8").replace("PID_EQ: false", f"PID_EQ: {form}")
    content = sheets(text)
    parameters = {p.name: p for p in content.loops[0][1].parameters}
    assert settings(content)["Ti_Ki"].unit == parameters["TIC-21.Ti_Ki"].unit == unit


def test_what_the_program_chooses_is_not_guessed():
    text = (EXAMPLES / "nextopid/override.yaml").read_text("utf-8")
    wired = text.replace("Td_Kd: 0.0", "Td_Kd: 0.0\n    Indep: FORM\n    Direct: WAY", 1)
    content = sheets(wired.replace("signals:", "signals:\n  FORM: false\n  WAY: false"))
    known = facts(content.loops[0][1])
    assert known["Form"] == "the program chooses it: Indep := FORM"
    assert known["Direction"] == "the program chooses it: Direct := WAY"
    assert settings(content)["Ti_Ki"].unit == ""


def test_a_time_with_a_unit_has_one_unit():
    text = (EXAMPLES / "dpide/chiller.yaml").read_text("utf-8")
    found = settings(sheets(re.sub("CYCLE: [^ #\n]*( s)?", "CYCLE: 2 s", text)))["CYCLE"]
    assert (float(found.value), found.unit) == (2000, "ms")


def test_a_truth_has_no_unit():
    fan = {p.name: p for p in example("nextopid/furnace").loops[1][1].parameters}
    assert (fan["FAN.ManualMV"].content, fan["FAN.ManualMV"].unit) == ("FALSE", "")
    assert fan["FAN.SP"].unit == "degC"


def test_blocks_beside_the_loops_have_units_too():
    text = (EXAMPLES / "nextopid/heatexchanger.yaml").read_text("utf-8")
    fan = "  - {name: FAN, type: ControlON_OFF, SP: 30, DeadBand: 2, MinPV: 0, MaxPV: 60}\n"
    found = {p.name: p for p in sheets(text.replace("blocks:\n", f"blocks:\n{fan}")).plcs[0].parameters}

    assert (found["LL_Inlet.Tlead"].unit, found["LL_Inlet.Tlag"].unit, found["FAN.SP"].unit) == ("s", "s", "PV unit")


def test_the_interval_of_a_task_has_its_unit():
    text = (EXAMPLES / "dpide/chiller.yaml").read_text("utf-8")
    plc = sheets(text.replace("loops:", "plc: {interrupt_task: 500}\nloops:", 1)).plcs[0]
    (interval,) = (s for group in plc.groups for s in group.settings if s.path == "plc.interrupt_task")

    assert (interval.value, interval.unit) == (500, "ms")


def test_the_bits_of_a_bit_word_are_spelled_out():
    word = registers(example("dl06/reactor"), 2)["V2100"]
    bits = {bit.bits: (bit.state, bit.value) for bit in word.bits}
    assert bits["4"] == ("1", "reverse")
    assert bits["3"] == ("1", "II")
    assert word.value is None
    assert len(word.bits) == 13


def test_what_switches_a_term_off_is_told_as_off():
    assert registers(example("dl06/reactor"))["V2012"].value == "off"
    assert registers(example("ezlogix/oven"))["R105"].value == "off"


def test_a_pointer_is_told_as_the_address_it_means():
    assert registers(example("dl06/reactor"))["V2032"].value == "V2045"


RISES, FALLS = "PV rises when the output rises (as in heating)", "PV falls when the output rises (as in cooling)"


def direction_facts(content):
    """The direction on each sheet."""
    return [facts(sheet).get("Direction") for _, sheet in content.loops]


def test_a_loop_tells_its_direction():
    assert direction_facts(example("ezlogix/oven")) == [RISES, FALLS]


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*/*.yaml")), ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_the_direction_is_that_of_the_neutral_form(path):
    document = read_document(path.read_bytes(), path.name)
    if is_scenario(document):
        return
    checked = check_document(document)
    found = direction_facts(sheets(path.read_text("utf-8")))
    assert all(found)
    wanted = [loop.data.get("output_raises_pv") for loop in checked.vendor.load("to_neutral")(checked.config)]
    pairs = [(told, rises) for told, rises in zip(found, wanted, strict=True) if rises is not None]
    assert all(told == (RISES if rises else FALLS) for told, rises in pairs)
    assert pairs or "ON_OFF" in path.read_text("utf-8")


@pytest.mark.parametrize(("direct", "told"), [("true", FALLS), ("false", RISES)])
def test_an_on_off_block_tells_its_direction_and_its_set_point(direct, told):
    text = (EXAMPLES / "nextopid/furnace.yaml").read_text("utf-8")
    known = facts(sheets(text.replace("Direct: true", f"Direct: {direct}")).loops[1][1])
    assert (known["Direction"], known["Set point"]) == (told, "35 degC")


def test_an_error_takes_the_head_from_no_sheet():
    text = (EXAMPLES / "dl06/extruder.yaml").read_text("utf-8")
    sound, wrong = sheets(text), sheets(text.replace("setpoint: {value: 170", "setpoint: {value: 999"))
    assert any(d.severity.label == "error" for d in wrong.findings)
    assert direction_facts(wrong) == direction_facts(sound)
    for i in range(1, len(sound.loops)):
        assert facts(wrong.loops[i][1]) == facts(sound.loops[i][1])
    assert facts(wrong.loops[0][1])["Set point"] == "999 degC"


def test_a_set_point_in_counts_is_told_as_the_value_that_it_means():
    assert facts(example("dl06/reactor").loops[2][1])["Set point"] == "50 %"


def test_alarms_of_a_root_are_shares_of_the_signal_before_it():
    content = example("dl06/flow")
    word, told = registers(content)["V10015"], settings(content)["alarms.pv.high"]
    assert (float(word.value), word.unit) == (87.5, "% of the signal before the root")
    assert word.meaning == "PV high alarm, reached at 112.2 m3/h"
    assert (str(told.value), told.unit) == ("105", "m3/h of a linear PV")
    assert told.meaning.endswith("87.50 % of it, reached at 112.2 m3/h.")
    reached = [registers(content)[f"V100{n}"].meaning.rpartition(" at ")[2] for n in (13, 14, 16)]
    assert reached == ["18.94 m3/h", "30.98 m3/h", "117.5 m3/h"]
    assert registers(content)["V10021"].unit == "% of the signal before the root per sample"
    assert (float(registers(content)["V10022"].value), registers(content)["V10022"].meaning) == (
        1.66,
        "PV alarm hysteresis",
    )
    setpoint = registers(content)["V10002"]
    assert (str(setpoint.value), setpoint.unit) == ("75", "m3/h")


def test_a_loop_without_a_root_keeps_its_unit():
    text = (EXAMPLES / "dl06/flow.yaml").read_text("utf-8").replace("square_root: true", "square_root: false")
    content = sheets(text)
    assert registers(content)["V10015"].unit == settings(content)["alarms.pv.high"].unit == "m3/h"


@pytest.mark.parametrize(
    ("name", "address", "by"),
    [
        ("dl06/flow", "V10003", "the ladder program, or the PLC by auto transfer (+36)"),
        ("dl06/flow", "V10005", "the PLC in Automatic and Cascade; in Manual the operator or the program"),
        ("dl06/flow", "V10006", "the PLC"),
        ("dl06/flow", "V10007", ""),
        ("click/tank", "DF112", "the program"),
        ("click/tank", "DF113", "the PLC"),
    ],
)
def test_who_writes_a_word(name, address, by):
    content = example(name)
    assert registers(content)[address].writer == by
    assert f"(written by {by})" in report_page(content, full=True) or not by


def test_a_format_of_its_own_that_is_not_chosen_is_that_of_the_pv():
    bits = {bit.bits: bit.value for bit in registers(example("dl06/flow"))["V10001"].bits}
    assert bits["13, 12, 11, 10"] == "as the PV"


def test_the_sign_off_asks_for_what_can_be_seen():
    text = report_page(example("dl06/flow"))
    assert "Action seen in Manual" not in text
    assert "In Manual the PV rises" in text


def test_the_run_of_a_root_tells_what_its_numbers_are(tmp_path):
    assert run(EXAMPLES / "dl06/flow.scenario.yaml", "-o", tmp_path / "r.html").exit_code == 0
    text = (tmp_path / "r.html").read_text("utf-8")
    assert "PV and SP are before the root: 67.52 at the end stands for 90.01 m3/h. The metrics, too" in text
    assert run(EXAMPLES / "dl06/oven.scenario.yaml", "-o", tmp_path / "o.html").exit_code == 0
    assert "before the root" not in (tmp_path / "o.html").read_text("utf-8")


def test_two_loops_of_one_name_keep_their_own_words():
    text = (EXAMPLES / "dl06/reactor.yaml").read_text("utf-8").replace("name: LIC-103", "name: TIC-101")
    content = sheets(text)
    assert "V2042" in registers(content, 1)
    assert "V2042" not in registers(content, 2)
    assert "V2102" in registers(content, 2)


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_every_mistake_can_be_reported(path):
    for text in path.read_text("utf-8").split("\n---\n"):
        document = read_document(text.encode(), path.name)
        if document.data is not None and not is_scenario(document):
            checked = check_document(document)
            content = compose_report(Title("T", version="1"), [], [plc_sheet(checked)], [], checked.findings)
            written = csv_files(tables_of(content))["findings.csv"]
            assert all(d.code in written for d in checked.findings)


# --- the tables ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("table", ["settings", "words"])
def test_the_tables_of_an_example(table):
    found = csv_files(tables_of(example("dl06/reactor")))[f"{table}.csv"]
    assert found == (GOLDEN / f"{table}.csv").read_text("utf-8"), "read the difference, then write the file anew"


WIDE = ("\uff1d1+1", "\uff0b1", "\uff0d1", "\uff20SUM(A1)")
"""Spreadsheets of East Asia take wide signs for narrow ones."""


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@SUM(A1)", "\tx", "\rx", "\n=1", "-x", *WIDE])
def test_no_text_is_a_formula_in_csv(text):
    assert safe_text(text) == f"'{text}"


def test_numbers_stay_numbers_in_csv():
    assert [safe_text(value) for value in (-5, -2.5, 1e-9, None, True)] == ["-5", "-2.5", "0.000000001", "", "true"]


def test_csv_files_are_read_back(tmp_path):
    assert run(EXAMPLES / "dl06/reactor.scenario.yaml", "--csv", tmp_path / "tables").exit_code == 0
    files = {path.name for path in (tmp_path / "tables").iterdir()}
    assert {"settings.csv", "words.csv", "findings.csv", "expectations.csv", "files.csv"} <= files
    for path in (tmp_path / "tables").iterdir():
        rows = list(csv.reader(io.StringIO(path.read_text("utf-8-sig"))))
        assert len({len(row) for row in rows}) == 1, path.name
    assert not (tmp_path / "report.html").exists()


def test_the_workbook_in_a_spreadsheet_library(tmp_path):
    text = (EXAMPLES / "click/tank.yaml").read_text("utf-8").replace("description: Water", 'description: "=2+3" #')
    (tmp_path / "tank.yaml").write_text(text.replace("unit: degF", 'unit: "=A1"'), "utf-8")
    assert run(tmp_path / "tank.yaml", "--xlsx", tmp_path / "t.xlsx", "--project", "P").exit_code == 0
    book = pytest.importorskip("openpyxl").load_workbook(tmp_path / "t.xlsx")
    assert book.sheetnames == ["Title", "Findings", "Settings", "Words", "In no register", "Checks", "Input files"]
    assert all(sheet.freeze_panes == "A2" for sheet in book)
    cells = [cell for sheet in book for row in sheet.iter_rows() for cell in row if cell.value is not None]
    assert all(cell.data_type in {"s", "n"} for cell in cells), "text and numbers only: no formula, no error"
    assert any(cell.value == "=A1" and cell.data_type == "s" for cell in cells)
    words = {row[3].value: row for row in book["Words"].iter_rows(min_row=2)}
    assert words["DF101"][7].value == 140
    assert words["DF101"][7].data_type == "n"
    assert words["DF101"][6].value == "0x430C0000"
    assert book.properties.created == dt.datetime(2000, 1, 1)  # noqa: DTZ001 - as the file has it
    assert all(sheet.column_dimensions["A"].width > 5 for sheet in book)


def test_a_control_character_in_a_title_or_cell_is_shown_as_one(tmp_path):
    book = write_workbook([Table("t", "T", ("x",), (("a\x1b[31m",),))], Title("t\x1b", version="1", author="a\x1b"))
    (tmp_path / "t.xlsx").write_bytes(book)
    read = pytest.importorskip("openpyxl").load_workbook(tmp_path / "t.xlsx")
    assert read["T"]["A2"].value == "a\ufffd[31m"
    assert (read.properties.title, read.properties.creator) == ("t\ufffd", "a\ufffd")


def test_a_name_with_a_line_break_is_shown_in_one_line():
    content = sheets((EXAMPLES / "dl06/oven.yaml").read_text("utf-8"), "a\nb.yaml")
    findings = [*content.findings, *(d for plc in content.plcs for loop in plc.loops for d in loop.findings)]
    assert {content.plcs[0].file, *(d.file for d in findings)} == {"a b.yaml"}


# --- the command -----------------------------------------------------------------------------------------------------


def test_the_same_files_give_the_same_bytes_and_nothing_of_the_computer(tmp_path):
    scenario, names = EXAMPLES / "dpide/oven.scenario.yaml", ("report.html", "t.xlsx", "tables/settings.csv")
    for folder in ("a", "b"):
        out = tmp_path / folder
        out.mkdir()
        args = ("-o", out / "report.html", "--xlsx", out / "t.xlsx", "--csv", out / "tables")
        assert run(scenario, *args).exit_code == 0
    for name in names:
        first, second = ((tmp_path / folder / name).read_bytes() for folder in ("a", "b"))
        assert first == second
        for told in (str(EXAMPLES), str(tmp_path), socket.gethostname(), f"{dt.datetime.now(dt.UTC):%Y-%m}"):
            assert told.encode() not in first, f"{told} in {name}"


def test_every_input_has_its_hash(tmp_path):
    assert run(EXAMPLES / "dl06/reactor.scenario.yaml", "--csv", tmp_path).exit_code == 0
    rows = {row["File"]: row for row in csv.DictReader(io.StringIO((tmp_path / "files.csv").read_text("utf-8-sig")))}
    for name, kind in (("reactor.yaml", "configuration"), ("reactor.scenario.yaml", "scenario")):
        data = (EXAMPLES / "dl06" / name).read_bytes()
        assert rows[name]["SHA-256"] == hashlib.sha256(data).hexdigest()
        assert (rows[name]["Kind"], int(rows[name]["Bytes"])) == (kind, len(data))


def test_a_folder_names_each_configuration_once(tmp_path):
    for name in ("oven.yaml", "oven.scenario.yaml"):
        (tmp_path / name).write_bytes((EXAMPLES / "dpide" / name).read_bytes())
    result = run(tmp_path, tmp_path / "oven.yaml", "--csv", tmp_path / "t")
    assert result.exit_code == 0
    assert ": 1 loop, 1 run," in result.stderr
    assert (tmp_path / "t" / "files.csv").read_text("utf-8").count("\n") == 3


def test_a_scenario_may_run_a_memory_listing(tmp_path):
    (tmp_path / "tank.json").write_bytes(golden.golden("click/tank", "tank.json").read_bytes())
    scenario = (
        (EXAMPLES / "click/tank.scenario.yaml").read_text("utf-8").replace("config: tank.yaml", "config: tank.json")
    )
    (tmp_path / "tank.scenario.yaml").write_text(scenario, "utf-8")
    assert run(tmp_path / "tank.scenario.yaml", "--csv", tmp_path / "t").exit_code == 0
    assert "memory listing" in (tmp_path / "t" / "files.csv").read_text("utf-8")
    assert "TANK1,tuning.reset_time,150,s" in (tmp_path / "t" / "settings.csv").read_text("utf-8")


@pytest.mark.parametrize(("options", "code"), [((), 1), (("--exit-zero",), 0)])
def test_errors_are_reported_and_decide_the_exit_code(tmp_path, options, code):
    result = run(EXAMPLES / "mistakes/oven.yaml", "-o", tmp_path / "r.html", *options)
    assert result.exit_code == code
    assert "2 errors" in result.stderr
    assert "DL201" in (tmp_path / "r.html").read_text("utf-8")


def test_a_failed_expectation_decides_the_exit_code(tmp_path):
    for name in ("oven.yaml", "oven.scenario.yaml"):
        text = (EXAMPLES / "dpide" / name).read_text("utf-8").replace("min: 79", "min: 81")
        (tmp_path / name).write_text(text, "utf-8")
    result = run(tmp_path / "oven.scenario.yaml", "-o", tmp_path / "r.html")
    assert result.exit_code == 1
    *_, row, last = result.stderr.splitlines()
    assert row.startswith("  FAILED  OVEN.PV")
    assert last == f"{(tmp_path / 'oven.scenario.yaml').as_posix()}: FAILED: 1 of 3 expectations"
    assert "1 of 3 expectations failed" in (tmp_path / "r.html").read_text("utf-8")


def standing_rows(folder):
    """The verdicts of ``standing.csv`` by loop and kind, but those that simply hold."""
    rows = csv.DictReader(io.StringIO((folder / "standing.csv").read_text("utf-8-sig")))
    return {(row["Loop"], row["Expectation"]): row for row in rows if row["Verdict"] != "passed"}


def test_a_standing_expectation_that_fails_is_on_the_cover_the_run_its_trend_and_in_the_tables(tmp_path):
    for name in ("flow.yaml", "flow.scenario.yaml"):
        text = (EXAMPLES / "dl06" / name).read_text("utf-8").replace("reset: 3.0", "reset: off")
        (tmp_path / name).write_text(text, "utf-8")
    args = ("--csv", tmp_path / "t", "-o", tmp_path / "r.html")
    result = run(tmp_path / "flow.scenario.yaml", *args, "--quiet")
    assert result.exit_code == 1
    written, standing, *unproven, last = result.stderr.splitlines()[-5:]
    assert written == "  FAILED  FIC-301 settling_time (band 5 %) at most 20 s: none"
    assert standing.startswith("  FAILED      FIC-301 error-stands  ends inside its output limits with an error of")
    assert [line.split()[3] for line in unproven] == ["not-settled", "no-better"]
    assert last.endswith("flow.scenario.yaml: FAILED: 1 of 2 expectations, 1 of 11 always checked, 2 not proven")
    row, *others = standing_rows(tmp_path / "t").values()
    assert [other["Verdict"] for other in others] == ["NOT PROVEN", "NOT PROVEN"]
    assert (row["Loop"], row["Expectation"], row["Verdict"], row["Since, s"]) == (
        "FIC-301",
        "error-stands",
        "FAILED",
        "108",
    )
    text = (tmp_path / "r.html").read_text("utf-8")
    assert '<li class="failed"><b>8 of 11</b> always checked hold, 2 not proven</li>' in text
    assert '<code class="kind">error-stands</code></td><td dir="auto">ends inside its output limits' in text
    assert "at 108 s: failed: error-stands: ends inside its output limits with an error of" in text


def test_what_is_allowed_or_not_judged_is_told_with_its_reason_and_fails_nothing(tmp_path):
    scenarios = [EXAMPLES / "dl06/feedpump.scenario.yaml", EXAMPLES / "ezlogix/greenhouse.scenario.yaml"]
    assert run(*scenarios, "--csv", tmp_path, "-o", tmp_path / "r.html").exit_code == 0
    rows = standing_rows(tmp_path)
    assert {key: row["Verdict"] for key, row in rows.items()} == {
        ("FIC-402", "saturated"): "allowed",
        ("FIC-402", "not-settled"): "allowed",
        ("FIC-402", "no-better"): "allowed",
        ("VENT", "saturated"): "not judged",
        ("VENT", "not-settled"): "not judged",
        ("VENT", "no-better"): "not judged",
    }
    assert "(allowed: the recirculation stays shut" in rows["FIC-402", "saturated"]["Found"]
    assert rows["VENT", "saturated"]["Found"] == "HEAT has the PV, with the opposite effect"
    text = (tmp_path / "r.html").read_text("utf-8")
    assert '<li class="passed"><b>36 of 39</b> always checked hold, 3 allowed to fail</li>' in text
    assert '<span class="quiet">3 kinds</span>' in text


def test_a_scenario_that_cannot_run_is_told_on_the_page(tmp_path):
    (tmp_path / "x.yaml").write_text("pidcfg: 1\nscenario: X\nconfig: gone.yaml\nduration: 1\nplants: {}\n", "utf-8")
    assert run(tmp_path / "x.yaml", "-o", tmp_path / "r.html").exit_code == 2
    text = (tmp_path / "r.html").read_text("utf-8")
    assert "could not run" in text
    assert "PID058" in text


def test_strict_counts_warnings(tmp_path):
    args = (EXAMPLES / "dl06/reactor.yaml", "--csv", tmp_path)
    assert run(*args).exit_code == 0
    assert run(*args, "--strict").exit_code == 1


def test_a_file_that_is_not_there_writes_nothing(tmp_path):
    result = run(EXAMPLES / "dl06/reactor.yaml", tmp_path / "gone.yaml", "-o", tmp_path / "r.html")
    assert isinstance(result.exception, SystemExit)
    assert result.exit_code in {1, 2}
    assert "gone.yaml" in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_nothing_that_differs_is_overwritten(tmp_path):
    (tmp_path / "settings.csv").write_text("mine", "utf-8")
    result = run(EXAMPLES / "dl06/reactor.yaml", "--csv", tmp_path, "--xlsx", tmp_path / "t.xlsx")
    assert "exists and differs" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["settings.csv"]
    assert run(EXAMPLES / "dl06/reactor.yaml", "--csv", tmp_path, "--force").exit_code == 0


def test_a_new_folder_goes_again_when_nothing_is_written(tmp_path):
    (tmp_path / "t.xlsx").write_text("mine", "utf-8")
    result = run(EXAMPLES / "dl06/reactor.yaml", "--csv", tmp_path / "new", "--xlsx", tmp_path / "t.xlsx")
    assert "exists and differs" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["t.xlsx"]


@pytest.mark.parametrize(("option", "name"), [("-o", "a.yaml"), ("-o", "a.xlsx"), ("--xlsx", "a.html")])
def test_a_file_is_what_its_name_promises(tmp_path, option, name):
    (tmp_path / "a.yaml").write_bytes((EXAMPLES / "dl06/reactor.yaml").read_bytes())
    result = run(tmp_path / "a.yaml", option, tmp_path / name, "--force")
    assert "write a name that ends in" in result.stderr
    assert result.exit_code == 2
    assert [path.name for path in tmp_path.iterdir()] == ["a.yaml"]


def test_the_page_goes_to_standard_output():
    result = run(EXAMPLES / "dl06/reactor.yaml", "-o", "-", "-q")
    assert result.stdout.startswith("<!DOCTYPE html>")
    assert result.stderr == ""


@pytest.mark.parametrize(("option", "package"), [("-o", "jinja2"), ("--xlsx", "xlsxwriter")])
def test_without_the_extra_there_is_one_clear_error(tmp_path, monkeypatch, option, package):
    monkeypatch.setattr("pidcfg.cli.environment.find_spec", lambda name: None if name == package else object())
    file = tmp_path / ("x.html" if option == "-o" else "x.xlsx")
    result = run(EXAMPLES / "dl06/reactor.yaml", option, file)
    assert result.stderr.startswith(f"Error: {package} is not installed; install pidcfg with its extra `report`")
    assert not file.exists()


def test_the_title_block_holds_what_was_given():
    title = Title("Handover", "P & Q", "C", "M", "D-1", "B", "A", "1 May", "9.9")
    text = report_page(compose_report(title, [], [], [], []))
    for told in ("Handover", "P &amp; Q", "D-1", "1 May", "pidcfg 9.9"):
        assert told in text


def test_a_text_in_a_style_sheet_is_nothing_but_a_text():
    assert css_string('a"b</style>\\é') == '"a\\22 b\\3c \\2f style\\3e \\5c \\e9 "'


def test_a_fault_of_several_loops_stands_on_the_sheet_of_each():
    sheets = [sheet for _, sheet in example("dl06/extruder").loops]
    assert all([d.loop for d in sheet.findings if d.code == "DL211"] == [sheet.name] for sheet in sheets)


def test_a_configuration_with_errors_says_on_every_sheet_that_it_is_not_for_download():
    bad, good = (run(EXAMPLES / name, "-o", "-", "-q").stdout for name in ("mistakes/oven.yaml", "dl06/reactor.yaml"))
    assert bad.count('<p class="stop">Not for download: 2 errors in this configuration.</p>') == 2, "PLC and loop"
    assert "Commissioning of" not in bad
    assert ("Not for download" in good, good.count("Commissioning of")) == (False, 3)


def test_the_facts_of_a_loop_keep_their_digits():
    text = (EXAMPLES / "click/tank.yaml").read_text("utf-8")
    loop = sheets(re.sub(r"setpoint: \{value: [\d.]+", "setpoint: {value: 1234.5678", text), "tank.yaml").loops[0][1]
    assert facts(loop)["Set point"].startswith("1234.567")
