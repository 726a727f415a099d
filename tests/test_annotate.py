"""`decode --annotate`: a meaning beside every word of every listing."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

import golden
from pidcfg.cli.commands.decode import command

EXAMPLES = golden.EXAMPLES
LISTINGS = [
    (example.partition("/")[0], f"{Path(example).name}.{end}")
    for example, kinds in golden.IMAGES.items()
    for kind, end in kinds.items()
    if kind not in {"cdv", "symbols", "tags", "operands"}
]
PARTIAL = [("click", "tank.cdv"), ("dpide", "oven.symbols.csv"), ("ezlogix", "oven.tags.csv")]


def annotate(path, vendor, *options):
    """The command in this process."""
    return CliRunner().invoke(command, [str(path), "--vendor", vendor, "--annotate", *options])


@pytest.mark.parametrize(("vendor", "file"), LISTINGS)
def test_every_word_of_the_examples_has_a_meaning(vendor, file):
    result = annotate(EXAMPLES / vendor / "golden" / file, vendor)
    if file.endswith((".modbus.csv", ".hex", ".nicknames.csv")) and vendor == "click":
        result = annotate(
            EXAMPLES / vendor / "golden" / file, vendor, "--bits", "C101", "--integers", "DS101", "--floats", "DF101"
        )
    assert result.exit_code == 0, result.stderr
    head, *lines = result.stdout.splitlines()
    at = head.index("meaning")
    assert max(map(len, lines)) <= max(120, at + 40)
    words = [line for line in lines if not line.startswith(" ")]
    assert words
    assert all(len(line) > at and line[at] != " " for line in words)
    assert not [line for line in words if "belongs to no loop" in line]
    assert not [line for line in words if "no value" in line]


@pytest.mark.parametrize(("vendor", "file"), PARTIAL)
def test_files_that_hold_a_part_of_the_words_are_read_too(vendor, file):
    result = annotate(EXAMPLES / vendor / "golden" / file, vendor)
    assert result.exit_code == 0 or "error PID041" in result.stderr
    assert "Traceback" not in result.output


REACTOR = (EXAMPLES / "dl06/golden/reactor.txt").read_text("utf-8")


def lines_of(tmp_path, text, vendor="dl06", *options):
    """The annotated lines by address."""
    path = tmp_path / "listing.txt"
    path.write_text(text, "utf-8")
    result = annotate(path, vendor, *options)
    assert result.exit_code == 0, result.stderr
    found, last = {}, ""
    for line in result.stdout.splitlines()[1:]:
        last = last if line.startswith(" ") else line.split()[0]
        found[last] = f"{found.get(last, '')} {line.strip()}".strip()
    return found


def test_values_are_in_engineering_units(tmp_path):
    found = lines_of(tmp_path, REACTOR)
    assert found["V2002"] == "V2002    0666   1638  FIC-102  setpoint                Set point (SP): 20 m3/h"
    assert found["V2007"].endswith("Sample rate: 0.2 s")
    assert found["V2032"].endswith("Remote SP V-memory address pointer: V2045")
    assert found["V7640"].endswith("Loop parameter table pointer: V2000, room for 8 loops")
    assert "action direct" in found["V2000"]
    assert "PV alarm monitor (bit 12)" in found["V2000"]


def test_words_that_are_no_values_say_why_and_the_others_are_told(tmp_path):
    text = REACTOR.replace("V2007   0020     32", "V2007   0A20   2592").replace(
        "V7641   0003      3", "V7641   00FF    255"
    )
    found = lines_of(tmp_path, text.replace("V2001   0008      8", "V2001   C008  49160"))
    assert found["V2007"].endswith(
        "Sample rate: no value, 0x0A20 has a digit above 9; it is 2592 (typed in decimal? 25.92 would be 2592)"
    )
    assert found["V7641"].endswith("Number of loops: FF, no BCD number: no loop runs; bit 2 of V7642 goes on")
    assert "0xC008 has a combination of bits (14, 15) that means nothing" in found["V2001"]
    assert found["V2010"].endswith("Gain (proportional): 0.8 %/%")


def test_a_profile_that_points_into_the_loop_table_hides_no_loop(tmp_path):
    text = REACTOR.replace("V2034   0000      0", "V2034   0420   1056")
    assert text != REACTOR
    found = lines_of(tmp_path, text)
    assert found["V2034"].endswith("Ramp/soak table starting address: V2040")
    assert found["V2050"].endswith("Gain (proportional): 2.5 %/%")


def test_words_without_a_loop_say_so(tmp_path):
    found = lines_of(tmp_path, "V2006 0402\nV5000 1234\n")
    assert found["V2006"].endswith("is not said: give --loop-table V2000 --number-of-loops 1")
    found = lines_of(tmp_path, "V2006 0402\nV7640 0400\n")
    assert found["V2006"].endswith("is not said: give --number-of-loops 1")
    found = lines_of(tmp_path, "R101 0026\nS104 1\n", "ezlogix")
    assert {line.partition("-  ")[2].strip("- ") for line in found.values()} == {
        "where the loops begin is not said: give --registers R101 --discretes S101"
    }
    found = lines_of(tmp_path, "R101 0026\nR999 1\nS104 1\n", "ezlogix", "--registers", "R101")
    assert found["R999"].endswith("belongs to no loop")
    assert found["S104"].endswith("give --discretes S101")
    found = lines_of(tmp_path, "DF101 00000026\n", "click")
    assert found["DF101"].endswith("give --bits C101 --integers DS101 --floats DF101")
    found = lines_of(tmp_path, "V2006 0402\nV5000 1234\n", "dl06", "--loop-table", "V2000", "--number-of-loops", "1")
    assert found["V5000"].endswith("belongs to no loop")
    assert "on: Automatic mode (bit 1), Alarm value programming error (bit 10)" in found["V2006"]


def test_status_words_of_other_vendors(tmp_path):
    click = lines_of(
        tmp_path,
        "DS101 001B\nDF107 42F00000\nC110 1\n",
        "click",
        "--bits",
        "C101",
        "--integers",
        "DS101",
        "--floats",
        "DF101",
    )
    assert click["DS101"].endswith("reset time (DFn+06) is not within 0.01 to 6000 s")
    assert click["DF107"].endswith("Integral or reset time (I): 120 s")
    assert click["C110"].endswith("reverse (inferred, not printed: compare the PID window, D100)")
    ez = lines_of(
        tmp_path, "R113 0005\nR104 0578\nR112 FFFF\n", "ezlogix", "--registers", "R101", "--discretes", "S101"
    )
    assert ez["R113"].endswith("Autotune Status: the CV could not be incremented")
    assert ez["R104"].endswith("Integral (Reset) Time: 140 s")
    assert ez["R112"].endswith("Error: -1 counts of the PV")


def test_loops_that_go_on_behind_the_last_register_are_no_obstacle(tmp_path):
    lines = lines_of(tmp_path, "V7640 FFFF\nV7641 0001\nV177777 0001\n")
    assert lines["V7640"].endswith("(The loop table starts outside the upper V-memory range)")
    assert lines["V7641"].endswith("Number of loops: 1")
    assert "LOOP-1  mode_setting_1" in lines["V177777"]


def test_unreadable_listings_are_refused_as_ever(tmp_path):
    path = tmp_path / "x.txt"
    path.write_text("V2008 1400\n", "utf-8")
    result = annotate(path, "dl06")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "'V2008' is not an address" in result.stderr


def test_a_word_behind_the_last_register_says_so(tmp_path):
    path = tmp_path / "far.hex"
    path.write_text(":020000040002F8\n:020000000102FB\n:00000001FF\n", "utf-8")
    result = annotate(path, "dl06")
    assert result.exit_code == 0
    assert result.stdout.endswith("lies behind the last register\n")


def test_the_result_goes_to_a_file(tmp_path):
    out = tmp_path / "out.txt"
    assert annotate(EXAMPLES / "dl06/golden/reactor.txt", "dl06", "-o", str(out)).exit_code == 0
    assert out.read_text("utf-8").startswith("address")


def test_words_about_the_pv_before_the_root_are_no_flow(tmp_path):
    text = (EXAMPLES / "dl06/golden/flow.txt").read_text("utf-8")
    found = lines_of(tmp_path, text.replace("V10003  0000      0", "V10003  0640   1600"))
    assert found["V10002"].endswith("Set point (SP): 75 m3/h")
    assert found["V10003"].endswith("(PV): 39.07 % of the signal before the root (75.01 m3/h)")
    assert found["V10014"].endswith("PV low alarm: 6.667 % of the signal before the root (30.98 m3/h)")
    assert found["V10022"].endswith("PV alarm hysteresis: 1.661 % of the signal before the root")
    reactor = lines_of(tmp_path, REACTOR)
    assert not [line for line in reactor.values() if "before the root" in line]


def test_a_reset_time_has_one_decimal_or_two(tmp_path):
    found = lines_of(tmp_path, REACTOR)
    assert found["V2051"].endswith("Reset (integral) time: 180 s (18 s if the word has two decimals: D01)")
    stated = lines_of(tmp_path, REACTOR, "dl06", "--reset-decimals", "2")
    assert stated["V2051"].endswith("Reset (integral) time: 18 s")


def test_the_direction_of_a_block_is_told_in_words():
    result = annotate(EXAMPLES / "nextopid/golden/furnace.txt", "nextopid")
    lines = {line.split()[0]: line for line in result.stdout.splitlines()}
    assert lines["TIC_1.Direct"].endswith("FALSE  BOOL  reverse: MV falls when PV rises (heating)")
    assert lines["FAN.Direct"].endswith("TRUE  BOOL  direct: MV rises when PV rises (cooling)")
    assert lines["TIC_1.Manual"].endswith("Manual mode: false")
    assert not [line for line in lines.values() if "TRUE:" in line]


def test_the_error_of_a_root_is_counts_of_the_root(tmp_path):
    text = "R112 FFF0\nS103 1\n"
    options = ("--registers", "R101", "--discretes", "S101")
    assert lines_of(tmp_path, text, "ezlogix", *options)["R112"].endswith("-16 counts of the root of the PV")
    plain = text.replace("S103 1", "S103 0")
    assert lines_of(tmp_path, plain, "ezlogix", *options)["R112"].endswith("-16 counts of the PV")
