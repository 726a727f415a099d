"""The EZLogix tag list: what is in it, how it joins a list of the user's, and the way back."""

from __future__ import annotations

import csv
import json
import random
from contextlib import suppress

import pytest
from hypothesis import HealthCheck, given, settings
from pydantic import ValidationError

from command import run
from ezlogix_strategies import configurations
from pidcfg.encoders.ezlogix.files import COLUMNS, FORMATS, make_tags
from pidcfg.encoders.ezlogix.image import decode, encode
from pidcfg.encoders.listing import ListingError, UnwritableError, detect_kind
from pidcfg.encoders.maps.ezlogix import PULSE_REGISTERS, SPACE, TABLES, VARIABLES
from pidcfg.schemas.ezlogix import EzlogixFile

TAGS = FORMATS["tags"]
SLOW = settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much]
)
LOOP = {
    "name": "OVEN1",
    "registers": "R100",
    "discretes": "S100",
    "action": "reverse",
    "algorithm": "position",
    "sample_rate": 0.5,
    "tuning": {"proportional_gain": 1.8, "integral_time": 22.5},
    "pv": {"tag": "IR1"},
    "output": {"tag": "OR1", "pulse": {"tag": "O1", "cycle_time": 10}},
    "setpoint": {"value": 1843},
}
SECOND = {
    **LOOP,
    "name": "COOLER",
    "registers": "R200",
    "discretes": "S200",
    "action": "direct",
    "pv": {"tag": "IR2"},
    "output": {"tag": "OR2"},
}
HEAD = ",".join(COLUMNS)


def configuration(*loops: dict, **plc) -> dict:
    """A file of some loops."""
    return {"pidcfg": 1, "vendor": "ezlogix", **({"plc": plc} if plc else {}), "loops": list(loops)}


def image_of(*loops: dict, **plc):
    """Its image."""
    return encode(EzlogixFile.model_validate(configuration(*loops, **plc))).image


@pytest.fixture
def image():
    """A loop with a control output and one without."""
    return image_of(LOOP, SECOND)


def table(text: str) -> dict[str, dict[str, str]]:
    """The rows of a tag list by name."""
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return {row["tag"]: row for row in rows}


def again(listing, options=None):
    """The image of what a tag list decodes to."""
    decoded = decode(listing.words, listing.settings, listing.plc, options)
    return encode(EzlogixFile.model_validate(decoded.data)).image


# --- writing ----------------------------------------------------------------------------------------------------------


def test_a_tag_has_address_raw_value_and_what_it_is(image):
    rows = table(TAGS.write(image, ()))
    assert list(rows["PID1_PGain"].values()) == [
        "PID1_PGain",
        "R102",
        "word",
        "180",
        "OVEN1",
        "proportional_gain",
        "Proportional Gain, 0.01",
    ]
    assert list(rows["PID2_ITime"].values()) == [
        "PID2_ITime",
        "R203",
        "word",
        "225",
        "COOLER",
        "integral_time",
        "Integral (Reset) Time, 0.1 s",
    ]
    assert (rows["PID1_Mode"]["address"], rows["PID1_Mode"]["type"]) == ("S100", "bit")


def test_every_variable_has_a_name_and_every_name_a_variable():
    named = {w.name for block in TABLES for w in block.words if w.access != "reserved"}
    assert named == set(VARIABLES)
    assert len(set(VARIABLES.values())) == len(VARIABLES)


def test_times_of_the_control_output_have_tags_only_where_it_is_enabled(image):
    rows = table(TAGS.write(image, ()))
    fields = {loop: {row["field"] for row in rows.values() if row["loop"] == loop} for loop in ("OVEN1", "COOLER")}
    assert fields["OVEN1"] == set(VARIABLES)
    assert fields["COOLER"] == set(VARIABLES) - PULSE_REGISTERS


def test_what_the_controller_writes_and_requests_have_no_value(image):
    rows = table(TAGS.write(image, ()))
    without = {row["field"] for row in rows.values() if not row["value"]}
    assert without == {"error", "autotune_status", "saturation", "start_autotune"}


def test_pv_cv_and_control_output_have_tags_of_their_own_already(image):
    assert not {row["address"] for row in table(TAGS.write(image, ())).values()} & {"IR1", "OR1", "O1", "IR2", "OR2"}


def test_a_template_names_the_tags(image):
    rows = table(TAGS.write(image_of(LOOP, tag_names="{name}_{variable}"), ()))
    assert "OVEN1_Setpoint" in rows
    assert "PID1_Setpoint" not in rows


@pytest.mark.parametrize(
    "template",
    [
        "{variable}",
        "P{loop}",
        "{loop}{variable}",
        "P{loop:05}{variable}",
        "P{loop}{variable}{x}",
        "P{loop}{variable}}}",
        "P{loop}{variable}{loop:>9999999999}",
        "P{loop}{variable}{name.__class__}",
        "P-{loop}{variable}",
    ],
)
def test_a_template_of_anything_else_is_refused(template):
    with pytest.raises(ValidationError, match="is not a template of tag names"):
        image_of(LOOP, tag_names=template)


def test_a_name_that_is_no_tag_is_refused():
    with pytest.raises(UnwritableError, match="loop TIC-1: 'TIC-1_SampleRate' is not usable as a tag"):
        make_tags(image_of({**LOOP, "name": "TIC-1"}, tag_names="{name}_{variable}"))
    assert make_tags(image_of({**LOOP, "name": "TIC-1"}))[0].tag == "PID1_SampleRate"


def test_two_tags_of_one_name_are_refused():
    with pytest.raises(UnwritableError, match="R100 and R200 would both have the tag oven1_SampleRate"):
        make_tags(image_of(LOOP, {**SECOND, "name": "oven1"}, tag_names="{name}_{variable}"))


# --- into a list of the user's ----------------------------------------------------------------------------------------

USERS = '# my tags\r\ncomment,tag,address\r\n"line, first",START,I1\r\nkiln,PV_KILN,IR7\r\n'


def test_new_tags_follow_the_users_in_their_columns(image):
    merged, report = TAGS.merge(image, USERS)
    assert merged.startswith(USERS)
    added = merged.removeprefix(USERS).split("\r\n")
    assert [line[:7] for line in added[:3]] == ["# plc: ", "# loop:", "# loop:"]
    assert added[3] == '"Sample Rate, 0.01 s",PID1_SampleRate,R100'
    count = len(make_tags(image))
    assert len(added) == count + 4
    assert report == (
        f"created {count}, already there: none",
        "the list has no column value, so the values are not in it",
    )


def test_a_byte_order_mark_and_a_missing_last_line_end_stay(image):
    users = "\ufeff" + '"tag","address","value"\nA,R1,5'
    merged, _ = TAGS.merge(image, users)
    assert merged.startswith(users + "\n# plc: ")
    assert "\nPID1_SampleRate,R100,50\n" in merged


def test_the_second_time_nothing_is_created(image):
    once, _ = TAGS.merge(image, USERS)
    twice, report = TAGS.merge(image, once)
    assert twice == once
    assert report[0].startswith("created 0, already there: PID1_SampleRate, PID1_Setpoint")
    assert report[0].endswith(f"and {len(make_tags(image)) - 12} more")


def test_what_is_there_is_left_and_told():
    users = f"{HEAD}\nGAIN,R102,word,7,,,mine\npid1_itime,R9,word,7,,,\nPID1_Deadband,r105,word,99,,,\n"
    merged, report = TAGS.merge(image_of(LOOP), users)
    assert merged.startswith(users)
    assert not {"R102", "R103", "R105"} & {row["address"] for row in list(table(merged).values())[3:]}
    assert report == (
        f"created {len(VARIABLES) - 3}, already there: PID1_Deadband",
        "conflict, left as it is: PID1_PGain (R102) was not created, since R102 has the tag GAIN",
        "conflict, left as it is: PID1_ITime (R103) was not created, since the name is that of R9",
        "left with its value 99: PID1_Deadband (R105); the configuration says 0",
    )


def test_an_old_action_in_the_list_is_told(image):
    """The list would decode to a loop that cools where it should heat."""
    users = TAGS.write(image_of({**LOOP, "action": "direct"}, process_when_stopped=False), ())
    merged, report = TAGS.merge(image_of(LOOP), users)
    assert merged == users
    assert report[1:] == (
        "left as it is: the line '# plc:'; the configuration says otherwise in process_when_stopped",
        "left as it is: the line '# loop: OVEN1'; the configuration says otherwise in action",
    )


@pytest.mark.parametrize(
    ("users", "message"),
    [
        ("# nothing\n", "the list has no header; it begins with a line like tag,address,type"),
        ("name,where\nA,R1\n", "the header has no column tag"),
        ("tag,address\nA,R1\nB\n", "1 cell stands under a header of 2 columns"),
        ("tag,address\nA,R1\na,R2\n", "the tag a stands here again, after line 2"),
        ('tag,address\n"A,R1\n', "not CSV"),
        ('tag,address\n# loop: {"loop": [1]\nA,R1\n', "not JSON"),
        ("tag,address\nA," + "R" * 10_000_000, "field larger than field limit"),
    ],
)
def test_a_list_that_cannot_be_read_is_not_added_to(image, users, message):
    with pytest.raises(ListingError) as refused:
        TAGS.merge(image, users)
    assert message in str(refused.value)


# --- reading ----------------------------------------------------------------------------------------------------------


@SLOW
@given(configurations())
def test_encode_decode_encode_is_identical(config):
    image = encode(config).image
    text = TAGS.write(image, ("check it",))
    assert detect_kind(text, FORMATS) is TAGS
    back = again(TAGS.read(text))
    assert back.words == image.words
    assert back.settings == image.settings
    assert TAGS.write(back, ("check it",)) == text


def test_without_comment_lines_the_columns_tell_the_blocks(image):
    bare = "".join(line for line in TAGS.write(image, ()).splitlines(keepends=True) if not line.startswith("#"))
    found = TAGS.read(bare)
    assert found.settings == (
        {"loop": "OVEN1", "registers": "R100", "discretes": "S100"},
        {"loop": "COOLER", "output": {"pulse": None}, "registers": "R200", "discretes": "S200"},
    )
    options = {
        "action": ["reverse", "direct"],
        "algorithm": ["position"],
        "pv_tag": ["IR1", "IR2"],
        "cv_tag": ["OR1", "OR2"],
        "output_tag": [{"tag": "O1"}, None],
    }
    assert again(found, options).words == image.words


def test_tags_that_do_not_agree_about_their_block_are_refused(image):
    bare = "".join(line for line in TAGS.write(image, ()).splitlines(keepends=True) if not line.startswith("#"))
    with pytest.raises(ListingError, match="PID1_PGain at R103 is not in the block of OVEN1"):
        TAGS.read(bare.replace("PID1_PGain,R102", "PID1_PGain,R103").replace("PID1_ITime,R103", "PID1_ITime,R102"))
    with pytest.raises(ListingError, match="A at R5 is not in the block of X"):
        TAGS.read(f"{HEAD}\nA,R5,word,1,X,deadband,\n".replace("deadband", "cv_offset"))


HOSTILE = {
    "A,R1,word,65536,,,": "A (R1): the value '65536' is not a word of 0 to 65535",
    "A,R1,word,-1,,,": "the value '-1' is not a word",
    "A,R1,word,1.5,,,": "the value '1.5' is not a word",
    "A,R1,word,nan,,,": "the value 'nan' is not a word",
    "A,R1,word,1e999,,,": "the value '1e999' is not a word",
    "A,R1,word,\u0661,,,": "is not a word",
    "A,S1,bit,2,,,": "A (S1): the value '2' is not true or false",
    "A,R9,word,1,,,": "R9 stands here again",
    "OK,R1,word,1,,,": "the tag OK stands here again, after line 2",
    "A,R1,word,1": "4 cells stand under a header of 7 columns",
    '"A': "not CSV",
    "# loop: 5": "the settings are not a mapping",
    "# loop: {": "not JSON",
    "# plc: [": "not JSON",
}


@pytest.mark.parametrize("row", HOSTILE)
def test_a_bad_row_is_refused_with_its_line(row):
    with pytest.raises(ListingError) as refused:
        TAGS.read(f"{HEAD}\nOK,R9,word,1,,,\n{row}\n")
    assert HOSTILE[row] in str(refused.value)
    assert refused.value.line == 3


@pytest.mark.parametrize(
    "row", ['# loop: {"loop": []}', '# loop: {"registers": 5, "output": {"pulse": null}}', '# loop: {"output": 3}']
)
def test_comment_lines_of_another_shape_are_refused_by_their_reader_not_by_a_crash(image, row):
    text = f"{HEAD}\nOK,R9,word,1,,,\n{row}\n"
    assert len(TAGS.read(text).settings) == 1
    assert TAGS.merge(image, text)[0].startswith(text)


def test_mutilated_lists_are_read_or_refused_but_never_crash(image):
    text, chance = TAGS.write(image, ()), random.Random(5)
    for _ in range(200):
        at, length = chance.randrange(len(text)), chance.randrange(1, 30)
        rubbish = "".join(chance.choice('",\n\r0;=\ufeffÄ\x1c\u2028\ud800{}[]:#R') for _ in range(length))
        with suppress(ListingError):
            TAGS.read(text[:at] + rubbish + text[at + length :])


def test_tags_of_others_are_read_over(image):
    text = TAGS.write(image, ()) + "START,I1,bit,on,,,\nSPEED,R9,word,,,,\nLEVEL,R10,word,7,,,\n"
    found = TAGS.read(text)
    assert found.words[SPACE.parse("R10")] == 7
    assert again(found).words == image.words


# --- the command ------------------------------------------------------------------------------------------------------


def test_the_command_writes_merges_and_reads(tmp_path, image):
    (tmp_path / "ovens.yaml").write_text(json.dumps(configuration(LOOP, SECOND)), "utf-8")
    (tmp_path / "mine.csv").write_bytes(f"{HEAD}\r\nSTART,I1,bit,,,,\r\n".encode())
    result = run("encode", "ovens.yaml", "--format", "tags", "--into", "mine.csv", "-o", "all.csv", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert f"created {len(make_tags(image))}, already there: none" in result.stderr.decode()
    result = run("decode", "all.csv", "--vendor", "ezlogix", "-o", "back.yaml", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    listings = [run("encode", name, "-q", cwd=tmp_path).stdout for name in ("ovens.yaml", "back.yaml")]
    assert listings[0] == listings[1] != b""
