"""EZLogix configurations to registers and discretes and back."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from pydantic import ValidationError

from ezlogix_strategies import configurations, registers
from pidcfg.encoders.codecs import DecodeError, EncodeError
from pidcfg.encoders.ezlogix.files import FORMATS
from pidcfg.encoders.ezlogix.image import decode, encode
from pidcfg.encoders.maps.ezlogix import BLOCKS, MIN_SAMPLE_COUNTS, SPACE, TABLES, VARIABLES, Window
from pidcfg.encoders.regmap import NoRegisterError
from pidcfg.schemas.ezlogix import EzlogixFile
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text

SLOW = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
LOOP = {
    "registers": "R101",
    "discretes": "S201",
    "algorithm": "position",
    "action": "reverse",
    "sample_rate": 0.5,
    "tuning": {"proportional_gain": 1},
    "pv": {"tag": "IR1"},
    "output": {"tag": "OR1"},
}
LISTINGS = ("text", "csv", "json")


def configuration(plc: dict | None = None, **changes) -> EzlogixFile:
    """A file of one plain loop with some keys changed."""
    loop = {"name": "L1", **LOOP, **changes}
    return EzlogixFile.model_validate({"pidcfg": 1, "vendor": "ezlogix", "plc": plc or {}, "loops": [loop]})


def value(address: str, **changes):
    """What an address shows of a plain loop with some keys changed."""
    encoding = encode(configuration(**changes))
    assert encoding.misfits == ()
    return next(c.value for c in encoding.image.cells if c.address == address)


@pytest.mark.parametrize(("base", "fits"), [("R65504", True), ("R65505", False), ("R65535", False)])
@pytest.mark.parametrize("discretes", ["S201", "S65528", "S65529"])
def test_a_block_that_leaves_its_bank_has_no_image(base, fits, discretes):
    encoding = encode(configuration(registers=base, discretes=discretes))

    assert encoding.is_complete == (fits and discretes != "S65529")
    if encoding.is_complete:
        assert encoding.image.cells[31].address == "R65535"
    else:
        where = discretes if fits else base
        with pytest.raises(NoRegisterError, match=f"^the block of L1 at {where} goes on behind the last register$"):
            _ = encoding.image


def test_an_address_behind_the_last_bank_is_none():
    last = SPACE.number_of("S", 65535)
    assert SPACE.name(last) == "S65535"
    for ask in (SPACE.name, SPACE.kind_of, SPACE.bank_and_number):
        with pytest.raises(NoRegisterError, match="no register lies behind S65535"):
            ask(last + 1)


PULSE = {"tag": "OR1", "pulse": {"tag": "O1", "cycle_time": 10.0, "min_on": 0.5, "min_off": 0.7}}
OVEN = {"tag": "IR1", "range": [0, 400]}


@pytest.mark.parametrize(
    ("changes", "address", "shown"),
    [
        ({"sample_rate": 0.05}, "R101", 5),
        ({"sample_rate": 99.99}, "R101", 9999),
        ({"setpoint": {"value": 2000}}, "R102", 2000),
        ({"setpoint": {"value": 180}, "pv": OVEN}, "R102", 1843),
        ({"tuning": {"proportional_gain": 1.25}}, "R103", 125),
        ({"tuning": {"proportional_gain": 1, "integral_time": 12.5}}, "R104", 125),
        ({"tuning": {"proportional_gain": 1, "integral_time": 6000.0}}, "R104", 60000),
        ({"tuning": {"proportional_gain": 1, "integral_time": "off"}}, "R104", 0),
        ({"tuning": {"proportional_gain": 1, "derivative_time": 12.5}}, "R105", 125),
        ({"tuning": {"proportional_gain": 1, "derivative_time": 600}}, "R105", 6000),
        ({"deadband": 1.0, "pv": OVEN}, "R106", 10),
        ({}, "R107", 0),
        ({}, "R108", 4095),
        ({"setpoint": {"limits": [0, 300]}, "pv": OVEN}, "R108", 3071),
        ({}, "R109", 0),
        ({}, "R110", 4095),
        ({"output": {"tag": "OR1", "limits": [100, 4000]}}, "R109", 100),
        ({"output": {"tag": "OR1", "limits": [100, 4000]}}, "R110", 4000),
        ({"output": {"tag": "OR1", "range": [0, 100], "offset": 50}}, "R111", 2048),
        ({"output": {"tag": "OR1", "range": [4, 20], "offset": 12}}, "R111", 2048),
        ({}, "R112", 0),
        ({}, "R113", 0),
        ({}, "R114", 600),
        ({"autotune": {"timeout": 900}}, "R114", 900),
        ({"autotune": {"timeout": "15 min"}}, "R114", 900),
        ({"output": PULSE}, "R115", 100),
        ({"output": PULSE}, "R116", 5),
        ({"output": PULSE}, "R117", 7),
        ({}, "R115", 0),
        ({"mode": "manual"}, "S201", False),
        ({"mode": "auto"}, "S201", True),
        ({"anti_windup": False}, "S202", False),
        ({}, "S202", True),
        ({"pv": {"tag": "IR1", "square_root": True}}, "S203", True),
        ({"autotune": {"type": "PI"}}, "S206", True),
        ({"autotune": {"type": "PID"}}, "S206", False),
    ],
)
def test_every_parameter_stands_where_the_manual_puts_it(changes, address, shown):
    assert value(address, **changes) == shown


def test_blocks_have_the_sizes_of_the_manual_with_17_registers_and_6_discretes_in_use():
    assert [t.size for t in TABLES] == [32, 8]
    assert [sum(w.access != "reserved" for w in t.words) for t in TABLES] == [17, 6]
    for table in TABLES:
        assert [w.offset for w in table.words] == list(range(table.size))
    assert {w.name for t in TABLES for w in t.words if w.access != "reserved"} == set(VARIABLES)


def test_what_the_controller_owns_and_the_request_to_tune_are_never_encoded():
    assert not any(c.raw for c in encode(configuration(mode="auto")).image.cells if c.access != "setting")


def test_the_action_stands_beside_the_registers_and_in_none_of_them():
    heating, cooling = (encode(configuration(action=action)).image for action in ("reverse", "direct"))
    assert heating.words == cooling.words
    assert [image.settings[0]["action"] for image in (heating, cooling)] == ["reverse", "direct"]


def test_the_set_point_of_a_square_root_loop_is_on_the_root_s_scale():
    """The root of 4095 counts is 64: half of the range is 32 counts."""
    pv = {"tag": "IR1", "range": [0, 100], "square_root": True}
    assert value("R102", pv=pv, setpoint={"value": 50}) == 32
    assert value("R108", pv=pv) == 64
    misfits = encode(configuration(pv=pv, setpoint={"value": "65 counts"})).misfits
    assert [m.path for _, m in misfits] == ["setpoint.value"]


def test_counts_that_do_not_begin_at_zero():
    """4 to 20 mA on a 0 to 20 mA input: 819 to 4095 counts."""
    pv = {"tag": "IR1", "range": [0, 100], "counts": [819, 4095]}
    assert [value("R102", pv=pv, setpoint={"value": v}) for v in (0, 50, 100)] == [819, 2457, 4095]
    assert [value(a, pv=pv) for a in ("R107", "R108")] == [819, 4095]


@pytest.mark.parametrize(
    ("changes", "path"),
    [
        ({"sample_rate": 0.004}, "sample_rate"),
        ({"tuning": {"proportional_gain": 0.004}}, "tuning.proportional_gain"),
        ({"tuning": {"proportional_gain": 1, "integral_time": 0.04}}, "tuning.integral_time"),
        ({"tuning": {"proportional_gain": 1, "derivative_time": 0.05}}, "tuning.derivative_time"),
        ({"setpoint": {"value": 4096}}, "setpoint.value"),
        ({"setpoint": {"value": -1}}, "setpoint.value"),
        ({"output": {"tag": "OR1", "limits": [0, 4096]}}, "output.limits.1"),
        ({"deadband": 4096}, "deadband"),
        ({"autotune": {"timeout": 65536}}, "autotune.timeout"),
    ],
)
def test_what_does_not_fit_is_reported_and_not_truncated(changes, path):
    assert [m.path for _, m in encode(configuration(**changes)).misfits] == [path]


def test_the_shortest_sample_rate_of_the_manual_is_five_hundredths():
    assert MIN_SAMPLE_COUNTS == value("R101", sample_rate=0.05) == 5


@pytest.mark.parametrize("timeout", [1.5, "1500 ms", "2 m"])
def test_a_timeout_is_whole_seconds(timeout):
    with pytest.raises(ValidationError, match=r"is not a whole number of s|is not a time"):
        configuration(autotune={"timeout": timeout})


def test_every_path_of_the_map_exists_in_the_schema():
    model = configuration(output=PULSE).loops[0]
    for table in TABLES:
        for path in table.paths():
            found: object = model
            for key in (k for k in path.split(".") if not k.isdigit()):
                assert hasattr(found, key), path
                found = getattr(found, key)


@SLOW
@given(configurations())
def test_encode_decode_encode_is_identical(config):
    """For random configurations, through every listing; what two of them hold alike is decoded once."""
    encoding = encode(config)
    image, decoded = encoding.image, []
    assert not encoding.misfits
    for name in LISTINGS:
        kind = FORMATS[name]
        listing = kind.read(kind.write(image, ()))
        assert listing.words == image.words, name
        if (listing.settings, listing.plc) in decoded:
            continue
        decoded.append((listing.settings, listing.plc))
        again = decode(listing.words, listing.settings, listing.plc)
        model = EzlogixFile.model_validate(read_document(yaml_text(again.data).encode(), "again").data)
        back = encode(model).image
        assert (back.words, back.settings, back.plc) == (image.words, image.settings, image.plc), name


@SLOW
@given(registers())
def test_registers_come_back_but_for_what_is_not_the_engineer_s(image):
    """Whatever a PLC holds: every setting is in the configuration."""
    beside = [
        {
            "loop": "L",
            "registers": "R1",
            "discretes": "S1",
            "action": "direct",
            "algorithm": "position",
            "pv": {"tag": "IR1", "range": [-40, 160.5]},
            "output": {"tag": "OR1", "range": [4, 20], "pulse": {"tag": "O1"}},
        }
    ]
    data = decode(image, beside).data
    document = read_document(yaml_text(data).encode(), "again")
    again = encode(EzlogixFile.model_validate(document.data))
    assert all(m.error.stored is not None for _, m in again.misfits), "only what lies outside its scale"
    for prefix, table in BLOCKS.values():
        for row in table.words:
            address = SPACE.number_of(prefix, 1 + row.offset)
            if row.path is not None:
                assert again.image.words[address] == image[address], row.name


@pytest.mark.parametrize(
    ("drop", "message"),
    [
        ("action", "the controller action (direct or reverse) of L1, which no register holds; give --action"),
        ("algorithm", "give --algorithm"),
        ("pv", "the tag of the PV of L1; give --pv-tag"),
        ("registers", "where the 32 registers begin of L1; give --registers"),
    ],
)
def test_what_a_listing_does_not_say_is_asked_for(drop, message):
    image = encode(configuration()).image
    beside = {k: v for k, v in image.settings[0].items() if k != drop}
    with pytest.raises(DecodeError) as error:
        decode(image.words, [beside])
    assert message in str(error.value)


BARE = {
    "registers": ["R101"],
    "discretes": ["S201"],
    "action": ["reverse"],
    "algorithm": ["position"],
    "pv_tag": ["IR1"],
    "cv_tag": ["OR1"],
}


def test_a_cycle_time_without_a_word_on_the_control_output_is_asked_for():
    image = encode(configuration(output=PULSE)).image.words
    with pytest.raises(DecodeError, match=r"R115 holds a cycle time.*give --output-tag"):
        decode(image, options=BARE)
    again = decode(image, options={**BARE, "output_tag": [{"tag": "O1"}]})
    assert again.data["loops"][0]["output"]["pulse"] == {"tag": "O1", "cycle_time": 10, "min_on": 0.5, "min_off": 0.7}
    assert "output_tag" not in BARE
    assert "pulse" not in decode(encode(configuration()).image.words, options=BARE).data["loops"][0]["output"]


def test_decode_says_what_it_cannot_carry_or_takes_for_granted():
    image = encode(configuration()).image
    words = {**image.words, SPACE.number_of("S", 205): 1, SPACE.number_of("R", 113): 3, SPACE.number_of("R", 120): 7}
    assert decode(words, options=BARE).notes == (
        "LOOP-1: R113 = 3 (Autotune Status) is not carried over",
        "LOOP-1: R120 = 7 (Reserved) is not carried over",
        "LOOP-1: S205 = 1 (Start Autotune) is not carried over",
        "process_when_stopped is taken as true, the dialog's default; no register holds it",
    )
    assert len(decode(words, image.settings, image.plc).notes) == 3


def test_what_holds_for_the_plc_comes_back():
    plc = {"process_when_stopped": False, "tag_names": "{name}_{variable}"}
    image = encode(configuration(plc)).image
    assert decode(image.words, image.settings, image.plc).data["plc"] == plc


def test_the_starter_comes_back():
    path = Path(__file__).parents[1] / "src" / "pidcfg" / "cli" / "starters" / "ezlogix.yaml"
    config = EzlogixFile.model_validate(read_document(path.read_bytes(), path.name).data)
    image = encode(config).image
    assert encode(EzlogixFile.model_validate(decode(image.words, image.settings, image.plc).data)).image == image


@pytest.mark.parametrize("part", ["pv", "output"])
def test_a_tag_beyond_the_last_register_does_not_exist(part):
    assert configuration(**{part: {"tag": "R65535"}})
    with pytest.raises(ValidationError, match="R65536 does not exist"):
        configuration(**{part: {"tag": "R65536"}})


BEYOND = [
    # register, what it holds, square root, counts in the file, whether the file gets all counts
    ("setpoint", 5500, 0, None, True),
    ("setpoint_high", 8500, 0, None, True),
    ("deadband", 4096, 0, None, True),
    ("setpoint", 4095, 0, None, False),
    ("cv_offset", 5000, 0, None, False),
    ("error", 5500, 0, None, False),
    ("setpoint", 100, 1, None, True),
    ("setpoint", 64, 1, None, False),
    ("setpoint", 5500, 0, [0, 10000], False),
]


@pytest.mark.parametrize(("name", "word", "root", "counts", "taken"), BEYOND)
def test_registers_beyond_4095_get_the_counts_of_a_whole_register_and_say_so(name, word, root, counts, taken):
    pv = {"tag": "R1", **({} if counts is None else {"counts": counts})}
    encoding = encode(configuration(pv=pv, setpoint={"value": 5}))
    words = dict(encoding.image.words)
    words[SPACE.number_of("R", 101 + TABLES[0].offset_of(name))] = word
    words[SPACE.number_of("S", 201 + TABLES[1].offset_of("square_root"))] = root
    limit = SPACE.number_of("R", 101 + TABLES[0].offset_of("setpoint_high"))
    words[limit] = min(words[limit], 64) if root else words[limit]
    found = decode(words, encoding.image.settings)

    said = [note for note in found.notes if "(D951)" in note]
    assert (found.data["loops"][0]["pv"].get("counts") == [0, 65535], len(said)) == (taken, int(taken))
    if taken:
        config = EzlogixFile.model_validate(found.data)
        assert encode(config).misfits == ()
        assert encode(config).image.words == {n: w for n, w in words.items() if n in encode(config).image.words}


def test_a_range_without_counts_is_not_stretched_and_the_note_names_the_key():
    encoding = encode(configuration(pv={"tag": "R1", "range": [0, 100]}, setpoint={"value": 50}))
    words = dict(encoding.image.words) | {SPACE.number_of("R", 102): 5500}
    found = decode(words, encoding.image.settings)

    assert "counts" not in found.data["loops"][0]["pv"]
    assert "R102 (setpoint) holds 5500, more than 4095, the end of pv.range: say in pv.counts" in found.notes[0]


@pytest.mark.parametrize(
    ("counts", "fits", "stored"),
    [
        (100, True, None), (4000, True, None), (99, False, 99), (4001, False, 4001), (0, False, 0),
        (0xFFFF, False, 0xFFFF), (-1, False, None), (0x10000, False, None),
    ],
)  # fmt: skip
def test_counts_outside_the_ends_of_a_scale_are_told_and_stored_where_the_word_has_room(counts, fits, stored):
    if fits:
        assert Window(100, 4000).encode(counts) == Window.decode(counts) == counts
        return
    with pytest.raises(EncodeError) as error:
        Window(100, 4000).encode(counts)
    assert (error.value.fault, error.value.stored) == ("range", stored)
