"""What people type at a panel, and what pidcfg itself prints, asked of `explain`: never the wrong register."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from pidcfg import api
from pidcfg.cli.commands.explain import command
from pidcfg.encoders.listing import reference
from pidcfg.output.explanation import QuestionError, wording
from pidcfg.output.explanation.book import book_of
from pidcfg.output.explanation.page import Question
from pidcfg.validate.catalog import find_rules
from pidcfg.vendors import VENDORS

TESTS = Path(__file__).parent
EXAMPLES = TESTS.parent / "examples"
PLCS = [key for key in VENDORS if key != "generic"]
MANUAL = "A loop stays in Manual"
OUTPUT = "The output stays at 0"
WINDUP = "Windup"
PV = "The PV is lost"
DIRECTION = "The wrong direction"
OFFSET = "An offset stays"
SWINGS = "The loop oscillates"
BUMP = "Bump"
CASCADE = "A cascade does not engage"
SETPOINT = "The set point changes by itself"
RAMP = "A ramp/soak profile does not start"
PULSES = "Time proportioning"
TUNING = "The auto-tune does not start"
MODBUS = "Modbus references"
DEVIATION = "Yellow and red"
NOISE = "Noise"
DOWNLOAD = "Values are 0 or old after a download"
DECIMALS = "A number reads ten"

QUESTIONS = {
    "heats when it should cool": {DIRECTION},
    "cools instead of heating": {DIRECTION},
    "Wirksinn falsch": {DIRECTION},
    "output does not go above 50": {OUTPUT},
    "Ausgang geht nicht über 50 %": {OUTPUT},
    "PV reads 4095": {PV},
    "CLICK Fehler 27": {"click PID error 27"},
    # as typed: what is answered, a register as "vendor name", what people see by the beginning of its title
    "bit 10 of V7356": {"dl06 V7356.10"},
    "V2006 bit 10": {"dl06 V2006.10"},
    "V2006.10": {"dl06 V2006.10"},
    "V2006:10": {"dl06 V2006.10"},
    "B7642.3": {"dl06 V7642.3"},
    "B2006.10": {"dl06 V2006.10"},
    "bit 3 of V7642": {"dl06 V7642.3"},
    "Bit 3 von V7642": {"dl06 V7642.3"},
    "what is bit 13 of +06": {"dl06 +06.13"},
    "addr+33 bit 4": {"dl06 +33.4"},
    "V 7642": {"dl06 V7642"},
    "alarm programming error": {"dl06 mode_and_alarm_status.10"},
    "C117": {"click C117"},
    "Cn16": {"click Cn+16"},
    "40001": {"dl06 V0", "click DS1"},
    "400001": {"dl06 V0", "click DS1"},
    "41025": {"dl06 V2000", "click DS1025"},
    "44001": {"dl06 V7640", "click DS4001"},
    "428673": {"dl06 V70000", "click DF1"},
    "428674": {"dl06 V70001", "click DF1"},
    "016385": {"click C1"},
    "4xxxxx": {MODBUS},
    "30001": {MODBUS},
    "modbus address": {MODBUS},
    "+04": {"dl06 +04", "click Cn+04", "click DSn+04", "click DFn+04", "ezlogix Base+4"},
    "+06.10": {"dl06 +06.10"},
    "error 27": {"click PID error 27"},
    "Fehler 26": {"click PID error 26"},
    "autotune status 8": {"ezlogix autotune status 8"},
    "loop stuck in manual": {MANUAL},
    "will not go to auto": {MANUAL},
    "Regler bleibt in Hand": {MANUAL},
    "kein Automatik möglich": {MANUAL},
    "loop goes back to manual": {MANUAL},
    "output stays 0": {OUTPUT},
    "output stuck at 100 %": {OUTPUT},
    "Ausgang steht auf 0": {OUTPUT},
    "Ofen wird nicht warm": {OUTPUT},
    "windup": {WINDUP},
    "anti windup": {"ezlogix anti_windup", "generic anti_windup", WINDUP},
    "feedforward": {"Feedforward"},
    "Störgrößenaufschaltung": {"Feedforward"},
    "time proportioning": {PULSES},
    "SSR": {PULSES},
    "relay chatters": {PULSES},
    "yellow alarm": {DEVIATION},
    "roter Alarm": {DEVIATION},
    "alarm does not come": {"An alarm does not come"},
    "heating": {DIRECTION},
    "Heizung": {DIRECTION},
    "loop runs away": {DIRECTION},
    "offset": {"nextopid Offset", "ezlogix cv_offset", OFFSET},
    "never reaches set point": {OFFSET},
    "bleibende Regelabweichung": {OFFSET},
    "oscillates": {SWINGS},
    "Regler schwingt": {SWINGS},
    "temperature overshoots": {SWINGS},
    "loop is sluggish": {"The loop is sluggish"},
    "sensor lost": {PV},
    "Fühlerbruch": {PV},
    "PV is frozen": {PV},
    "output jumps when switching to auto": {BUMP},
    "Stoßfrei umschalten": {BUMP},
    "cascade will not engage": {CASCADE},
    "Kaskade": {CASCADE},
    "derivative kick": {"Derivative kick"},
    "D term has no effect": {"Derivative without effect"},
    "noise": {NOISE},
    "Rauschen": {NOISE},
    "dead band": {"Deadband"},
    "auto-tune fails": {TUNING},
    "Selbstoptimierung startet nicht": {TUNING},
    "set point jumps": {SETPOINT},
    "Sollwert springt": {SETPOINT},
    "ramp soak does not start": {RAMP},
    "no loop runs": {"No loop runs at all"},
    "values lost after power failure": {DOWNLOAD},
    "gain wrong factor 10": {DECIMALS},
    "Abtastzeit": {"The sample time"},
    "flow wrong square root": {"Square root"},
    "split range": {"Heating and cooling"},
    "how to tune": {"How the loop is tuned"},
    "valve does not move": {"The actuator does not follow"},
    "cannot change output": {"The output cannot be changed"},
    "proportional gain": {"ezlogix proportional_gain", "dl06 gain", "click proportional_gain"},
    "The loop seems unstable and impossible to tune, no matter what gains I use": {SWINGS},
    "my heater is stuck on full power": {OUTPUT},
    "PLC error 200 on the panel": {"click PID error 200"},
    "what is wrong when V7642 bit 0 is on?": {"dl06 V7642.0"},
    "PID_MODE 2": {"dpide PID_MODE"},
    "AutoTuneDone": {"nextopid AutoTuneDone"},
    "where is the set point register": {
        *("dl06 setpoint", "click setpoint", "ezlogix setpoint"),
        *("generic setpoint.value", "generic setpoint.limits.0", "generic setpoint.limits.1"),
    },
    "PV auto transfer": {"dl06 pv_transfer"},
    "derivative gain limit": {"dl06 derivative_gain_limit", "dl06 mode_setting_1.9", "click derivative_gain_limit"},
}


def answers(question):
    """What is answered to a question, as the table has it."""
    return {
        page.title if page.kind == wording.SYMPTOM_KIND else f"{page.vendor or page.kind} {page.name}"
        for page in api.explain(question).pages
    }


@pytest.mark.parametrize(("question", "wanted"), QUESTIONS.items(), ids=QUESTIONS)
def test_what_is_typed_at_a_panel_leads_to_what_is_meant_and_nothing_else(question, wanted):
    found = {next((title for title in wanted if answer.startswith(title)), answer) for answer in answers(question)}
    assert found >= {one for one in wanted if " " not in one or one.split(" ")[0] not in VENDORS}
    assert found <= wanted
    assert found


def test_the_table_is_long_enough():
    assert len(QUESTIONS) >= 47 + 30


@pytest.mark.parametrize(
    "question",
    ["V2006 bit 10", "bit 10 of V7356", "output stays 0", "yellow alarm", "set point jumps", "sensor lost", "error 10"],
)
def test_a_question_needs_no_quotes(question):
    assert api.explain(*question.split()).pages == api.explain(question).pages


def test_a_message_cut_short_leads_to_every_rule_that_begins_so():
    codes = {page.name for page in api.explain("the loop table starts at V7350, outside V1200-V7340").pages}
    assert codes == {"DL201", "DL202"}
    assert {page.name for page in api.explain("error: reset 4 s is stored as 0040").pages} == {"DL211"}


@pytest.mark.parametrize(
    ("question", "vendor", "key"),
    [
        ("P gain", "ezlogix", "tuning.proportional_gain"),
        ("P gain", "click", "tuning.proportional_gain"),
        ("I time", "ezlogix", "tuning.integral_time"),
        ("D time", "ezlogix", "tuning.derivative_time"),
    ],
)
def test_the_three_terms_are_known_by_their_letters(question, vendor, key):
    assert [page.key for page in api.explain(question, vendor=vendor).pages] == [key]


def test_a_member_of_errbits_is_known_by_its_number():
    assert api.explain("ErrBits.3").pages == api.explain("ErrBits=0x0008").pages


def test_an_output_of_a_configured_loop_is_explained():
    cascade = EXAMPLES / "nextopid" / "cascade.yaml"
    (page,) = api.explain("TIC_1.TRK_OUT", config=cascade).pages
    assert page.name == "TRK_OUT"


def test_a_vendor_in_the_question_keeps_the_others_out():
    assert {page.vendor for page in api.explain("ezlogix error 5").pages} == {"ezlogix"}
    assert api.explain("DL06", "V7642=0008").pages == api.explain("V7642=0008", vendor="dl06").pages
    assert api.explain("DS108=27", "click").pages == api.explain("DS108=27", vendor="click").pages
    assert api.explain("dpide", "MV_MAX").pages == api.explain("MV_MAX", vendor="dpide").pages
    assert api.explain("generic", "tuning.gain").pages == api.explain("tuning.gain", vendor="generic").pages


def test_several_things_stay_several():
    assert [page.name for page in api.explain("CK27", "V7642").pages] == ["PID error 27", "V7642"]
    with pytest.raises(QuestionError, match="nothing is known of 'gian'"):
        api.explain("V7642", "gian")


@pytest.mark.parametrize(
    ("question", "vendors"),
    [("click windup", ["click"]), ("dl06 will not go to auto", ["dl06"]), ("Delta oscillates", ["dpide"])],
)
def test_a_vendor_in_the_words_is_the_one_that_is_asked(question, vendors):
    assert [page.vendor for page in api.explain(question).pages] == vendors


@pytest.mark.parametrize("question", ["nothing at all", "weather forecast", "password", "29", "C2O", "xyz 12", "the"])
def test_what_is_nobodys_stays_unknown_and_nothing_is_guessed(question):
    with pytest.raises(QuestionError) as error:
        api.explain(question)
    assert "did you mean" not in str(error.value)


@pytest.mark.parametrize(
    ("question", "meant"),
    [
        ("gian", "gain"),
        ("alarm programing error", "alarm value programming error"),
        ("ErrBts", "ErrBits"),
        ("set ponit", "setpoint"),
    ],
)
def test_a_slip_of_the_pen_is_told_from_another_word(question, meant):
    with pytest.raises(QuestionError, match=f"did you mean {meant}"):
        api.explain(question)


@pytest.mark.parametrize("question", ["feedforwrd", "yelow", "set point jmps", "antiwindp", "heatng", "+4x", "B76423"])
def test_no_suggestion_is_a_register_that_means_something_else(question):
    with pytest.raises(QuestionError) as error:
        api.explain(question)
    meant = re.search(r"did you mean (.*)\?", str(error.value))
    assert meant is None or wording.words_of(meant[1])[0][:3] == wording.words_of(question)[0][:3]


def test_words_of_too_many_registers_are_listed_not_explained():
    with pytest.raises(QuestionError, match=r"'alarm' is in \d\d names; say which"):
        api.explain("alarm")


# --- addresses that nobody has placed, and Modbus references ---------------------------------------------------------


def test_an_address_says_what_it_is_where_loops_usually_begin():
    (page,) = api.explain("C157").pages
    assert page.notes[0] == (
        "if the loops begin at C101, one behind the other, it is Cn+16 of loop 2, Auto mode start request"
    )
    (page,) = api.explain("V2046.10").pages
    assert [point.label for point in page.points] == ["+00.10", "+01.10", "+06.10", "+33.10"]
    assert page.notes[0].endswith("it is +06.10 of loop 2, Alarm value programming error")
    assert not [note for note in api.explain("C90").pages[0].notes if note.startswith("if the loops")]
    (page,) = api.explain("C217", config=EXAMPLES / "click/brewery.yaml").pages
    assert (page.title, page.loop) == ("Auto mode start request", "GLYCOL")


@pytest.mark.parametrize("vendor", ["dl06", "click"])
@given(data=st.data())
def test_a_modbus_reference_leads_back_to_its_address(vendor, data):
    space, numbering = book_of(vendor).space, VENDORS[vendor].load("numbering")
    bank = data.draw(st.sampled_from(space.banks))
    number = space.number_of(bank.prefix, data.draw(st.integers(bank.first, bank.last)))
    place = numbering.place(number)
    text = reference(place.table, place.register)
    if place.table == "coil":
        text = text.zfill(6)
    found = [page.name for page in api.explain(text, vendor=vendor).pages]
    assert found == [space.name(number)]


# --- the tables ------------------------------------------------------------------------------------------------------

ROWS = [*wording.symptoms(), *(t.subject for t in wording.templates() if not isinstance(t.subject, str))]


def test_every_symptom_says_what_to_look_at_with_every_plc():
    for row in wording.symptoms():
        assert [*row.causes] == PLCS, row.title
        assert row.meaning.endswith("."), row.title


def test_every_register_and_rule_that_a_row_names_is_there():
    known = find_rules()
    for row in ROWS:
        for vendor, causes in row.causes.items():
            for cause in causes:
                assert all(book_of(vendor).find(Question(name, name)) for name in cause.registers), (
                    row.title,
                    cause.registers,
                )
                assert {rule[:3] if rule.startswith("PID") else rule[:2] for rule in cause.rules} <= {
                    "PID",
                    VENDORS[vendor].prefix,
                }
                assert set(cause.rules) <= set(known), (row.title, cause.rules)
                assert 0 < len(cause.advice) <= 170, cause.advice
    table = tomllib.loads(wording.MESSAGES_FILE.read_text("utf-8"))
    assert set(table["rules"]) <= set(known)


@pytest.mark.parametrize("row", wording.symptoms(), ids=lambda row: row.title[:30])
def test_every_name_of_a_symptom_leads_to_it(row):
    for name in row.names:
        assert row in wording.symptoms_in(name), name


def test_what_is_true_of_every_plc_is_said_once():
    output = CliRunner().invoke(command, ["windup"]).output
    assert output.count("The integral goes on") == 1
    assert [output.count(VENDORS[key].title) for key in PLCS] == [1] * len(PLCS)
    assert CliRunner().invoke(command, ["windup", "--vendor", "click"]).output.count("found by") == 1


# --- what pidcfg itself says -----------------------------------------------------------------------------------------

CASE = re.compile(r"([A-Z]{2,3}[0-9]{3})\S*?:[0-9]+:[0-9]+ \w+: (.*)")
TYPED = re.compile(r"(?:\S+:[0-9]+(?::[0-9]+)?: )?(?:error|warning|info) ([A-Z]{2,3}[0-9]{3}):? (.*)")
MOST = 3
"""Rules of several vendors that say the same."""
LOSS = re.compile(r"note=('[^']*'|\"[^\"]*\")")


def lines_of(*patterns):
    """Every line of some files below the tests and the examples."""
    for pattern in patterns:
        for path in sorted(TESTS.parent.glob(pattern)):
            yield from path.read_text("utf-8", errors="replace").splitlines()


def coded():
    """Messages with the code of their rule: those of the case files, of typical mistakes, and of conversions."""
    found = {}
    for line in lines_of("tests/cases/messages.txt"):
        if match := CASE.match(line):
            found[match[2]] = match[1]
    for line in lines_of("tests/typical/*.txt", "tests/data/formats/*.txt"):
        if match := TYPED.match(line):
            found[match[2]] = match[1]
    for line in lines_of("tests/data/configurations/*.txt"):
        if match := re.match(r"[-+]?([A-Z]{2,3}[0-9]{3}): (.*)", line):
            found[match[2]] = match[1]
    return found


def checklists():
    """Lines of checklists, and notes of runs, in the golden files of the examples."""
    for line in lines_of("examples/*/golden/*"):
        if "check after the download: " in line:
            yield line.partition("check after the download: ")[2].removesuffix(" *)")
    for path in EXAMPLES.glob("*/golden/*.json"):
        yield from json.loads(path.read_text("utf-8")).get("checklist", ())
        for note in json.loads(path.read_text("utf-8")).get("notes", ()):
            yield note["text"]


def uncoded():
    """Complaints about the command line, and notes of runs, listings and conversions."""
    yield from (line for line in lines_of("tests/typical/*.txt") if line.startswith("Error: "))
    for line in lines_of("tests/data/runs/*"):
        if match := re.match(r"\.notes\[[0-9]+\]\.text: (.*)", line):
            yield match[1]
    for line in lines_of("tests/data/configurations/*-to-*.txt"):
        yield from (match[1][1:-1] for match in LOSS.finditer(line))
    for line in lines_of("tests/data/listings/*"):
        if match := re.match(r"[0-9]+:[0-9]+: (.*)", line):
            yield match[1]


def test_every_message_without_its_code_leads_to_its_rule():
    found = coded()
    assert len(found) > 900
    wrong = {
        text: (code, names)
        for text, code in found.items()
        if code
        not in (names := [m if isinstance(m, str) else m.title for m in wording.message_subjects(text, list(VENDORS))])
        or len(names) > MOST
    }
    assert not wrong


def test_every_message_with_its_code_and_place_leads_to_its_rule():
    for text, code in list(coded().items())[::20]:
        pages = api.explain(f"oven.yaml:3:14: error {code} {text}").pages
        assert code in [page.name for page in pages], text


def test_the_message_of_every_rule_leads_to_it():
    for code, rule in find_rules().items():
        if len(wording.PLACEHOLDER.sub("", rule.message)) >= wording.MIN_LETTERS:
            assert code in wording.message_subjects(rule.message, list(VENDORS)), rule.message


def test_every_other_line_that_is_printed_is_known():
    lines = {line for line in (*checklists(), *uncoded()) if " " in line}
    assert len(lines) > 900
    assert [
        line for line in lines if not wording.message_subjects(line, list(VENDORS)) and not wording.symptoms_in(line)
    ] == []
    names = re.compile("|".join(VENDORS), re.IGNORECASE)
    for line in {*sorted(lines)[::40], *filter(names.search, lines)}:
        assert api.explain(line).pages, line
