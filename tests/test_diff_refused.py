"""`pidcfg.diff` with a listing of which something is refused: nothing else is hidden by it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import diff_words
import pidcfg
from diff_words import EXAMPLES, FILES, REFUSALS, refused, with_word
from pidcfg.cli.formats.conversion import differences_text as as_text
from pidcfg.cli.main import main
from pidcfg.vendors import format_of
from shell import captured
from shell import pidcfg as command

SECOND = {
    "dl06": (("V2051", 0x0900), ("tuning.reset", 180, 90)),
    "click": (("DF107", 0x41C80000), ("tuning.reset_time", 150, 25)),
    "ezlogix": (("R103", 900), ("tuning.proportional_gain", 8, 9)),
    "dpide": (("OVEN.PID_DIR", False), ("PID_DIR", True, False)),
    "nextopid": (("TIC_1.Kp", 400.0), ("Kp", 4, 400)),
    "generic": (("FIC-1.output_raises_pv", False), ("output_raises_pv", True, False)),
}
"""A second change beside what is refused, and how it is told."""


def checked_file(vendor):
    """The example of a vendor."""
    return pidcfg.check_file(EXAMPLES / vendor / f"{FILES[vendor]}.yaml")


def listing_of(vendor, refusal=None, *words, name="text"):
    """The listing of an example with what is refused, and with other words by their addresses."""
    checked = checked_file(vendor)
    image = checked.encoding.image
    image = image if refusal is None else refused(image, *refusal)
    for address, raw in words:
        (number,) = (cell.number for cell in image.cells if cell.address == address)
        image = with_word(image, number, raw)
    return format_of(checked.vendor, name).write(image, ())


def differences(result):
    """All differences."""
    return [d for loop in result.loops for d in loop.differences]


@pytest.mark.parametrize(("vendor", "title"), [(vendor, title) for vendor in FILES for title in REFUSALS[vendor]])
def test_what_is_refused_is_told_and_hides_no_other_change(vendor, title):
    refusal, document = REFUSALS[vendor][title], checked_file(vendor).document
    (word, told) = SECOND[vendor]
    alone = pidcfg.diff(document, listing_of(vendor, refusal), names=(None, "upload.txt"))
    assert not alone.same
    faults = [d for d in differences(alone) if d.note.startswith("no value: ")]
    assert faults == differences(alone)
    both = pidcfg.diff(document, listing_of(vendor, refusal, word), names=(None, "upload.txt"))
    (second,) = [d for d in differences(both) if d not in faults]
    assert (second.key, second.before, second.after) == told
    assert not second.other_word_only


@pytest.mark.parametrize("vendor", FILES)
def test_every_word_changed_beside_what_is_refused_is_told(vendor):
    scores = diff_words.score_of(vendor, 29 if vendor in {"dl06", "click", "ezlogix"} else 9, ("text",))
    assert sum(changes for changes, _ in scores.values()) > len(scores)
    assert {key: dict(unseen) for key, (_, unseen) in scores.items() if unseen} == {}


@pytest.mark.parametrize("turned", [False, True])
def test_two_listings_of_which_one_is_refused(turned):
    texts = [listing_of("generic"), listing_of("generic", REFUSALS["generic"]["a range that descends"])]
    result = pidcfg.diff(*(reversed(texts) if turned else texts), names=("a.txt", "b.txt"), vendor="generic")
    (row,) = differences(result)
    assert (row.key, row.note) == ("pv.range.1", "no value: the range [0, -150.5] does not ascend")


def test_two_listings_that_are_both_refused_are_compared_by_their_words_and_settings():
    refusal = REFUSALS["dpide"]["a range that descends"]
    old = listing_of("dpide", refusal)
    new = listing_of("dpide", ("pv.range", [500, 0]), ("OVEN.PID_DIR", False))
    result = pidcfg.diff(old, new, names=("a.txt", "b.txt"), vendor="dpide")
    assert [(d.key, d.before, d.after) for d in differences(result)] == [
        ("OVEN.PID_DIR", True, False),
        ("OVEN.pv.range.0", 400, 500),
    ]


def test_a_listing_that_gives_no_configuration_differs_and_what_nothing_places_is_told():
    text = listing_of("dpide", None, ("OVEN.Kc_Kp", 30.0))
    lines = [line for line in text.splitlines() if not line.startswith("OVEN.CYCLE ")]
    lines.insert(-1, '# loop: {"loop": "KILN", "device": "D700"}')
    lines.append("KILN.SV REAL 5.0")
    result = pidcfg.diff(checked_file("dpide").document, "\n".join(lines), names=(None, "upload.txt"))
    told = {(loop.loop, d.key): (d.before, d.after) for loop in result.loops for d in loop.differences}
    assert told["", "configuration"] == (None, "none")
    assert told["", "KILN.device"] == (None, "D700")
    assert told["signals", "KILN.SV"] == (None, 5)
    assert told["OVEN", "Kc_Kp"] == (40, 30)
    assert result.notes[0].startswith("upload.txt: compared word by word at the places of the other side: ")


@pytest.mark.parametrize("new", ["KILN", "OVEN"])
def test_a_loop_that_is_added_or_renamed_is_told_whatever_is_refused_of_it(new):
    document, bad = checked_file("dpide").document, listing_of("dpide", REFUSALS["dpide"]["a range that descends"])
    renamed = pidcfg.diff(document, bad.replace("OVEN", new), names=(None, "upload.txt"))
    assert [(loop.loop, [d.key for d in loop.differences]) for loop in renamed.loops] == [
        (new, ["pv.range.0", "pv.range.1"])
    ]
    more = "\n".join(line for line in bad.splitlines() if "OVEN" in line)
    added = pidcfg.diff(document, f"{listing_of('dpide')}{more.replace('OVEN', 'KILN')}", names=(None, "upload.txt"))
    assert [(loop.loop, loop.status) for loop in added.loops] == [("OVEN", "same"), ("KILN", "added")]


def test_a_parameter_of_no_loop_is_a_difference():
    text = listing_of("generic") + "TIC-9.tuning.gain LREAL 2.0\n"
    result = pidcfg.diff(checked_file("generic").document, text, names=(None, "upload.txt"))
    assert [(d.key, d.after) for d in differences(result)] == [("TIC-9.tuning.gain", 2)]


# --- the loops of a DL06 ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wire", ["TIC_1;SP", "TIC_9.SP", "TIC_1.SP +", ""])
def test_a_feed_forward_that_cannot_be_read_is_a_difference(wire):
    config = EXAMPLES / "nextopid/heatexchanger.yaml"
    words = (config.parent / "golden/heatexchanger.csv").read_text("utf-8")
    spoiled = words.replace("TIC_1.BIAS,REAL,,(TIC_1.SP -", f"TIC_1.BIAS,REAL,,({wire} -")
    assert spoiled != words
    (loop,) = pidcfg.diff(config.read_text("utf-8"), spoiled, names=("a.yaml", "b.csv")).loops
    assert "BIAS" in {row.key for row in loop.differences}


def test_a_loop_that_the_plc_no_longer_runs_is_told():
    result = pidcfg.diff(checked_file("dl06").document, listing_of("dl06", None, ("V7641", 2)), names=(None, "a.txt"))
    rows = {loop.loop: [(d.risk, d.before, d.after, d.note) for d in loop.differences] for loop in result.loops}
    assert rows == {
        "FIC-102": [],
        "TIC-101": [],
        "LIC-103": [("high", "calculated", "not calculated", "the PLC no longer runs this loop")],
        "": [("high", 3, 2, "how many loops the PLC calculates, from the first on")],
    }
    assert "high      plc.number_of_loops: 3 → 2 (V7641 0003 → 0002)" in as_text(result)


def test_loops_that_the_plc_takes_from_other_words_are_told():
    text = listing_of("dl06", None, ("V7640", 0o2020))
    result = pidcfg.diff(checked_file("dl06").document, text, names=(None, "a.txt"))
    assert [(loop.loop, loop.moved) for loop in result.loops][:2] == [
        ("FIC-102", ("V2000", "V2020")),
        ("TIC-101", ("V2040", "V2060")),
    ]
    (row,) = [d for d in differences(result) if d.address == "V7640"]
    assert (row.risk, row.word_before, row.word_after) == ("high", "0400", "0410")


@pytest.mark.parametrize("setup", [(), (("V7640", 0o2020),)])
def test_words_are_told_as_what_they_mean_whether_or_not_the_listing_gives_a_configuration(setup):
    """A gain, a transfer in two words, a reset time in its unit and a set point on its scale; the file's own beside."""
    words = ("V2050", 0x0310), ("V2076", 0x0103), ("V2051", 0x0900), ("V2102", 0x0900), ("V2105", 0x0005)
    result = pidcfg.diff(checked_file("dl06").document, listing_of("dl06", None, *words, *setup), names=(None, "a.txt"))
    rows = [*differences(result), *(d for loop in result.loops for d in loop.operated)]
    assert {(d.key, d.before, d.after, d.unit, d.address) for d in rows if d.address[:4] != "V764" and d.address} == {
        ("tuning.gain", 2.5, 3.1, "%/%", "V2050"),
        ("pv.transfer", "base 0, slot 1, channel 2", "base 0, slot 1, channel 3", "", "V2076"),
        ("tuning.reset", 180, 90, "s", "V2051"),
        ("setpoint.value", "2048 counts", "56.26 %", "", "V2102"),
    }


def test_a_listing_without_set_up_says_nothing_of_which_loops_run():
    lines = [line for line in listing_of("dl06").splitlines() if not line.startswith("V764")]
    assert pidcfg.diff(checked_file("dl06").document, "\n".join(lines), names=(None, "a.txt")).same


# --- what runs -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("vendor", "word", "key"),
    [
        ("dl06", ("V2102", 0x0900), "setpoint.value"),
        ("click", ("DF101", 0x41C80000), "setpoint.value"),
        ("ezlogix", ("R102", 17), "setpoint.value"),
        ("dpide", ("OVEN.SV", 17.0), "SV"),
        ("dpide", ("OVEN.I_MV", 1234.5), "I_MV"),
        ("nextopid", ("TIC_1.ManualMV", 17.0), "ManualMV"),
        ("generic", ("FIC-1.mode", "manual"), "mode"),
    ],
)
def test_with_live_everything_counts(vendor, word, key):
    document, text = checked_file(vendor).document, listing_of(vendor, None, word)
    assert pidcfg.diff(document, text, names=(None, "upload.txt")).same
    result = pidcfg.diff(document, text, names=(None, "upload.txt"), live=True)
    assert [(d.key, "written by" in d.note) for d in differences(result)] == [(key, True)]


def test_a_stop_is_a_state_and_with_live_a_difference_too():
    document, text = checked_file("dpide").document, listing_of("dpide", None, ("OVEN.PID_RUN", False))
    for live in (False, True):
        result = pidcfg.diff(document, text, names=(None, "upload.txt"), live=live)
        (loop,) = (loop for loop in result.loops if loop.loop == "OVEN")
        assert [state.key for state in loop.states] == ["PID_RUN"]
        assert [d.key for d in differences(result)] == ["PID_RUN"] * live
        assert not loop.operated


@pytest.mark.parametrize("live", [False, True])
def test_a_set_point_that_cannot_be_is_a_difference(live):
    text = listing_of("dl06", None, ("V2102", 0x2800))
    result = pidcfg.diff(checked_file("dl06").document, text, names=(None, "upload.txt"), live=live)
    (row,) = differences(result)
    assert (row.key, row.after) == ("setpoint.value", None)
    assert row.note.startswith("no value: ")


def test_the_limit_of_an_alarm_that_is_off_is_no_new_alarm():
    text = Path(EXAMPLES / "click/tank.yaml").read_text("utf-8")
    (line,) = (line for line in text.splitlines() if "rate_of_change:" in line)
    off = text.replace(line, line.partition("rate_of_change")[0] + "rate_of_change_enabled: false")
    listing = listing_of("click", None, *off_alarm(42.5))
    result = pidcfg.diff(off, listing, names=(None, "upload.txt"))
    (row,) = [d for d in differences(result) if d.key.startswith("alarms.rate")]
    assert (row.after, row.risk, row.note) == (42.5, "low", "the alarm is off on both sides")


def off_alarm(value):
    """The words of the tank's alarm of the rate of change: off, with a limit."""
    image = checked_file("click").encoding.image
    rows = {cell.field: cell.address for cell in image.cells}
    return (rows["rate_alarm_enable"], 0), (rows["rate_of_change"], 0x422A0000)


@pytest.mark.parametrize(
    ("text", "cure"),
    [("no listing\n", "ihex)\n"), ("V2000 0001 1\n", "(--like FILE), or decode it with what it lacks: pidcfg decode ")],
)
def test_the_cure_of_a_listing_that_cannot_be_read_is_none_that_fails_too(tmp_path, capsys, monkeypatch, text, cure):
    upload = tmp_path / "upload.txt"
    upload.write_text(text, "utf-8")
    other = str(EXAMPLES / "click/tank.yaml")
    monkeypatch.setattr("sys.argv", ["pidcfg", "diff", other, str(upload), "--vendor", "dl06"])
    with pytest.raises(SystemExit):
        main()
    assert cure in capsys.readouterr().err


LOOPS = re.compile("^loops:.*", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("name", ["nextopid/ratio", "dl06/reactor"])
def test_a_file_that_has_lost_its_loops_differs(name):
    text = (EXAMPLES / f"{name}.yaml").read_text("utf-8")
    without = LOOPS.sub("loops: []", text)
    for sides in ((text, without), (without, text)):
        result = pidcfg.diff(*sides)
        assert result.ok and not result.same  # noqa: PT018
    assert pidcfg.diff(without, without).same


@pytest.mark.parametrize("turned", [False, True])
def test_a_number_of_a_setting_that_no_computer_holds_is_refused_with_its_place(tmp_path, turned):
    text = re.sub(
        r'"range": \[0, 30\]', '"range": [0, 1e400]', str(pidcfg.encode(EXAMPLES / "dpide/chiller.yaml").text)
    )
    assert "1e400" in text
    line = next(i for i, row in enumerate(text.splitlines(), 1) if "1e400" in row)
    listing = tmp_path / "l.txt"
    listing.write_text(text, "utf-8")
    sides = [str(listing), str(EXAMPLES / "dpide/chiller.yaml")]
    code, said, _ = captured(command, ["diff", *(reversed(sides) if turned else sides), "--vendor", "dpide"])
    assert code == 2
    assert f"l.txt:{line}: 1e400 is too large for a number" in said
