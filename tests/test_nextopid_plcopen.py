"""NextoPID programs as PLCopen XML."""

from __future__ import annotations

import copy
import json
import re
import xml.etree.ElementTree as ET
from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from command import run
from nextopid_networks import DATA, NETWORKS, OVERRIDE, fault, network
from nextopid_strategies import configurations
from pidcfg.encoders.decoding import decode_listing
from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.nextopid import DECODE_OPTIONS
from pidcfg.encoders.nextopid.files import FORMATS, checklist, parse_xml, read_plcopen
from pidcfg.encoders.nextopid.image import decode, encode
from pidcfg.encoders.nextopid.st_read import add_zeros, read_st
from pidcfg.encoders.nextopid.st_write import Variable, write_plcopen, write_st
from pidcfg.encoders.nextopid.st_write import _variable_xml as variable_xml
from pidcfg.encoders.parameters import Parameter, store_value
from pidcfg.schemas.iec import DINT, INT, REAL, TIME, UINT, USINT, Wire
from pidcfg.schemas.nextopid import NextopidFile
from pidcfg.vendors import VENDORS

TC6, XHTML = "{http://www.plcopen.org/xml/tc6_0201}", "{http://www.w3.org/1999/xhtml}"
ORDER = {
    "project": ["fileHeader", "contentHeader", "types", "instances"],
    "types": ["dataTypes", "pous"],
    "coordinateInfo": ["fbd", "ld", "sfc"],
    "pou": ["interface", "body", "documentation"],
    "variable": ["type", "initialValue", "documentation"],
    "instances": ["configurations"],
    "configurations": ["configuration"],
    "configuration": ["resource"],
    "resource": ["task"],
    "task": ["pouInstance"],
}
"""What stands in an element, in the order of the schema; what may be left out, may."""
NEEDED = {
    "fileHeader": {"companyName", "productName", "productVersion", "creationDateTime"},
    "contentHeader": {"name", "modificationDateTime"},
    "pou": {"name", "pouType"},
    "variable": {"name"},
    "configuration": {"name"},
    "resource": {"name"},
    "task": {"name", "priority"},
    "pouInstance": {"name", "typeName"},
}
HEAD = '<project xmlns="http://www.plcopen.org/xml/tc6_0201">'


def written(config) -> str:
    return write_plcopen(encode(config).image, checklist(config))


def document(body: str, variables: str = "", kind: str = "program") -> str:
    """A project around some variables and a body."""
    return (
        f'{HEAD}\n<types><dataTypes/><pous><pou name="PLC_PRG" pouType="{kind}">\n<interface><localVars>{variables}'
        f"</localVars></interface>\n<body>{body}</body></pou></pous></types></project>"
    )


def text_body(text: str) -> str:
    return f'<ST><xhtml xmlns="http://www.w3.org/1999/xhtml">{text}</xhtml></ST>'


LOOP = """<variable name="TIC_1"><type><derived name="PIDA_REAL"/></type><initialValue><structValue>
<value member="Kp"><simpleValue value="REAL#1.5"/></value><value member="MAXMV"><simpleValue value="1_00"/></value>
</structValue></initialValue></variable>"""


ARRAY_OF_LOOPS = '<array><dimension lower="1" upper="3"/><baseType><derived name="PIDA_REAL"/></baseType></array>'


@pytest.mark.parametrize("name", NETWORKS)
def test_golden(name):
    assert written(network(name)).encode() == (DATA / f"{name}.xml").read_bytes()


@settings(max_examples=40, deadline=None)
@given(configurations())
def test_encode_decode_encode_is_identical(config):
    text = write_plcopen(encode(config).image)
    found = read_plcopen(text)
    back = NextopidFile.model_validate(decode(found.words, found.settings, found.plc).data)
    assert write_plcopen(encode(back).image) == text
    assert not found.notes


@settings(max_examples=20, deadline=None)
@given(configurations())
def test_it_says_the_same_as_structured_text(config):
    image = encode(config).image
    both = read_plcopen(write_plcopen(image)), read_st(write_st(image))
    assert both[0].words == both[1].words
    assert (both[0].settings, both[0].plc) == (both[1].settings, both[1].plc)


@settings(max_examples=20, deadline=None)
@given(configurations())
def test_structure(config):
    root = ET.fromstring(written(config))  # noqa: S314  # written just now
    assert root.tag == f"{TC6}project"
    for element in root.iter():
        name = element.tag.removeprefix(TC6)
        inside = [child.tag.removeprefix(TC6) for child in element]
        if name in ORDER:
            assert inside == [part for part in ORDER[name] if part in inside]
        assert NEEDED.get(name, set()) <= set(element.attrib)
        if name in {"ST", "documentation"}:
            assert [child.tag for child in element] == [f"{XHTML}xhtml"]
        if name == "structValue":
            assert all("member" in value.attrib and len(value) == 1 for value in element)


def test_initial_values_stand_in_structures():
    root = ET.fromstring((DATA / "feed_forward.xml").read_bytes())  # noqa: S314  # our own file
    path = f".//{TC6}variable[@name='TIC']/{TC6}initialValue/{TC6}structValue/{TC6}value"
    values = {value.get("member"): value for value in root.findall(path)}
    assert values["Kp"][0].get("value") == "1.0"
    inner = values["AutoTuneParam"].findall(f"{TC6}structValue/{TC6}value")
    assert [v[0].get("value") for v in inner] == ["5.0", "0.1", "10.0", "3", "AUTOTUNE_MODE.AUTOTUNE_PID"]


def test_what_another_system_writes():
    glue = "TIC_1(PV := FT_101 * 2.0); (* &lt;b&gt; *)"
    signal = '<variable name="FT_101" address="%ID0"><type><REAL/></type></variable>'
    found = read_plcopen(document(text_body(glue), LOOP + signal))
    assert found.words == {"FT_101": 0.0, "TIC_1.Kp": 1.5, "TIC_1.MaxMV": 100.0, "TIC_1.PV": Wire("FT_101 * 2")}
    assert found.plc == {"program": "PLC_PRG"}
    assert found.settings == ({"loop": "TIC_1", "type": "PIDA_REAL"},)


def test_global_variables_and_other_languages():
    text = document("<FBD/>", LOOP).replace(
        "</types>",
        '</types><instances><configurations><configuration name="C"><resource name="R"><globalVars><variable name="L">'
        '<type><derived name="ControlLag"/></type></variable></globalVars></resource></configuration></configurations>'
        "</instances>",
    )
    found = read_plcopen(text)
    assert [entry["type"] for entry in found.settings] == ["ControlLag", "PIDA_REAL"]
    assert found.notes == ("the FBD of line 6 is left out: only Structured Text is read",)


EXTERNALS = (
    '<externalVars><variable name="TIC_1"><type><derived name="PIDA_REAL"/></type></variable></externalVars><localVars>'
)


def test_an_external_variable_is_that_of_the_global_list_with_its_value():
    plain, external = (read_plcopen(text) for text in (project(), project().replace("<localVars>", EXTERNALS)))
    assert external.words["TIC_1.Kp"] == Decimal("1.5")
    assert (external.words, external.settings) == (plain.words, plain.settings)
    with pytest.raises(ListingError, match="TIC_1 is declared with another type than in line 12"):
        read_plcopen(project().replace("<localVars>", EXTERNALS.replace("PIDA_REAL", "PIDA_INT")))


BOMB = '<!DOCTYPE project [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;">]>\n' + document(text_body("&b;"))


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        (BOMB, 1, "a document type stands here"),
        ('<!DOCTYPE project SYSTEM "file:///etc/passwd">' + document(""), 1, "a document type stands here"),
        (document(text_body("&b;")), 4, "not XML: undefined entity"),
        (document(text_body("<b>" * 80 + "</b>" * 80)), 4, "more than 64 elements in each other"),
        (f"{HEAD}<types>", 1, "not XML: no element found"),
        ("<html/>", 1, "is no project of PLCopen XML"),
        (f"{HEAD}</project>", 1, "the project has no program"),
        (document("", LOOP + LOOP), 5, "TIC_1 is declared again"),
        (document("", LOOP, "functionBlock"), 2, "stand in a POU that is no program"),
        (document(text_body("\nTIC_1(PV := );"), LOOP), 7, "nothing stands behind PV"),
        (document("", LOOP.replace("REAL#1.5", "T#1s")), 4, "TIC_1.Kp: T#1s is not a value of REAL; numbers are in s"),
        (document("", LOOP.replace("Kp", "Kq")), 4, "PIDA_REAL has no input parameter Kq; did you mean Kp?"),
        (document("", LOOP.replace("MAXMV", "KP")), 4, "KP stands here again"),
        (document("", '<variable name="TIC_1"/>'), 3, "the variable has no type"),
        (document("", f'<variable name="L"><type>{ARRAY_OF_LOOPS}</type></variable>'), 3, "instances of PIDA_REAL are"),
        (document("", LOOP.replace("derived name", "derived nome")), 3, ""),
        ('<?xml version="1.0" encoding="klingon"?>' + document(text_body("TIC_1(;"), LOOP), 6, "unexpected ';'"),
    ],
)
def test_refused(text, line, says):
    if not says:
        assert read_plcopen(text).settings == ()
        return
    with pytest.raises(ListingError, match=re.escape(says)) as error:
        read_plcopen(text)
    assert error.value.line == line


def several(*programs: tuple[str, str]) -> str:
    """A project of several programs: their names and variables."""
    pou = document("", "VARIABLES").partition("<pous>")[2].partition("</pous>")[0]
    pous = "".join(pou.replace("PLC_PRG", name).replace("VARIABLES", variables) for name, variables in programs)
    return document("", "VARIABLES").replace(pou, pous)


TWO = several(("Main", ""), ("Boiler", LOOP), ("Dryer", LOOP.replace("TIC_1", "TIC_2")))


def test_several_programs_with_blocks():
    with pytest.raises(ListingError, match=r"several POUs have blocks of the library \(Boiler, Dryer\); give .* --pou"):
        read_plcopen(TWO)


@pytest.mark.parametrize(("name", "loop"), [("Boiler", "TIC_1"), ("DRYER", "TIC_2")])
def test_one_of_several_programs_is_read_by_its_name(name, loop):
    found = read_plcopen(TWO, name)
    assert [entry["loop"] for entry in found.settings] == [loop]
    assert found.plc == {"program": name.capitalize()}


@pytest.mark.parametrize(
    ("text", "name", "says"),
    [
        (TWO, "Oven", "the project has no POU 'Oven'; those with blocks of the library are Boiler, Dryer"),
        (several(("A", ""), ("B", "")), "C", "the project has no POU 'C'; it has A, B"),
        (several(("A", ""), ("B", "")), "", "no program of the project has a block of the NextoPID library (A, B)"),
        (several(("A", LOOP), ("a", LOOP)), "A", "the project has the POU 'A' more than once"),
    ],
)
def test_a_program_that_is_not_there_is_told_with_those_that_are(text, name, says):
    with pytest.raises(ListingError, match=re.escape(says)):
        read_plcopen(text, name)


def test_the_command_reads_one_program_of_a_several(tmp_path):
    (tmp_path / "plant.xml").write_text(TWO, "utf-8")
    told = run("decode", "plant.xml", "--vendor", "nextopid", cwd=tmp_path)
    assert told.returncode == 2
    assert b"(Boiler, Dryer); give one of them with --pou" in told.stderr
    one = run("decode", "plant.xml", "--vendor", "nextopid", "--pou", "boiler", "--sample-time", "100 ms", cwd=tmp_path)
    assert one.returncode == 0, one.stderr
    assert b"name: TIC_1" in one.stdout
    (tmp_path / "v.txt").write_text("V2000 7E08\n", "utf-8")
    other = run("decode", "v.txt", "--vendor", "dl06", "--pou", "boiler", cwd=tmp_path)
    assert b"--pou names a program of a project in PLCopen XML, and this file is of the format text" in other.stderr


PIECES = [
    "<",
    ">",
    "/>",
    "&",
    "&lt;",
    '"',
    "]]>",
    "<!--",
    "-->",
    "<?x?>",
    "<ST>",
    "value",
    "\x00",
    "é",
    "=",
    "\n",
    "9" * 5000,
]


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(sorted(NETWORKS)), st.randoms(use_true_random=False))
def test_a_damaged_file_is_read_or_refused(name, random):
    text = (DATA / f"{name}.xml").read_text("utf-8")
    for _ in range(random.randint(1, 4)):
        at = random.randrange(len(text))
        text = text[:at] + random.choice([*PIECES, ""]) + text[at + random.randrange(12) :]
    found = fault(read_plcopen, text)
    assert found is None or (found.line >= 1 and found.column >= 1)


def test_a_byte_order_mark_does_no_harm():
    assert parse_xml("\ufeff" + written(network("override"))).name == "project"


# --- tasks, and projects as CODESYS exports them ---------------------------------------------------------------------

PROJECT = """<?xml version="1.0" encoding="utf-8"?>
<project xmlns="http://www.plcopen.org/xml/tc6_0200">
  <fileHeader companyName="" productName="CODESYS" productVersion="CODESYS V3.5 SP21"
    creationDateTime="2026-01-01T00:00:00"/>
  <types><dataTypes/><pous/></types>
  <instances><configurations><configuration name="Device">
    <resource name="Application">
      <task name="MainTask" interval="{interval}" priority="1">
        <pouInstance name="PLC_PRG" typeName=""><documentation><xhtml xmlns="http://www.w3.org/1999/xhtml"/></documentation></pouInstance>
      </task>
      <globalVars name="GVL_PID">
        <variable name="TIC_1"><type><derived name="PIDA_REAL"/></type><initialValue><structValue>
          <value member="SP"><simpleValue value="50.0"/></value><value member="Kp"><simpleValue value="1.5"/></value>
          <value member="MaxMV"><simpleValue value="100"/></value>
          <value member="MaxPV"><simpleValue value="200"/></value>
        </structValue></initialValue></variable>
        <variable name="Level"><type><REAL/></type></variable>
      </globalVars>
      <globalVars name="GVL_IO">
        <variable name="Man" address="%IX0.0"><type><BOOL/></type></variable>
        <variable name="Level"><type><INT/></type></variable>
      </globalVars>
      <addData>
        <data name="http://www.3s-software.com/plcopenxml/pou" handleUnknown="implementation">
          <pou name="Other" pouType="functionBlock"><interface/><body><ST><xhtml xmlns="http://www.w3.org/1999/xhtml"/></ST></body></pou>
        </data>
        <data name="http://www.3s-software.com/plcopenxml/pou" handleUnknown="implementation">
          <pou name="PLC_PRG" pouType="program"><interface><localVars>
            <variable name="PT"><type><REAL/></type></variable>
          </localVars></interface><body><ST><xhtml xmlns="http://www.w3.org/1999/xhtml">{body}</xhtml></ST></body></pou>
        </data>
      </addData>
    </resource>
  </configuration></configurations></instances>
</project>
"""
CALL = "GVL_PID.TIC_1(PV := PT, Manual := GVL_IO.Man);\nIF NOT Man THEN TIC_1.ManualMV := GVL_PID.TIC_1.MV; END_IF"


def project(body: str = CALL, interval: str = "PT0.02S") -> str:
    return PROJECT.format(body=body, interval=interval)


@pytest.mark.parametrize("interval", ["PT0.02S", "pt0.020s", "T#20ms", "TIME#0.02s"])
def test_a_project_of_codesys_has_programs_and_instances_in_its_resource(interval):
    listing = add_zeros(read_plcopen(project(interval=interval)))
    data = decode(listing.words, listing.settings, listing.plc).data
    assert data["plc"] == {"sample_time": 0.02, "program": "PLC_PRG"}
    assert data["signals"] == {"Man": False, "PT": 0}
    assert [(loop["name"], loop["SP"], loop["PV"], loop["Manual"]) for loop in data["loops"]] == [
        ("TIC_1", 50, "PT", "Man")
    ]
    assert data["moves"] == [{"move": "TIC_1.MV", "to": "TIC_1.ManualMV", "when": "NOT Man"}]


SECOND_PROGRAM = (
    '<pou name="SECOND" pouType="program"><interface/><body><ST>'
    '<xhtml xmlns="http://www.w3.org/1999/xhtml">{}</xhtml></ST></body></pou>'
)


@pytest.mark.parametrize(
    ("statement", "says"),
    [
        ("Level := 5;", None),
        ("TIC_12 := 5.0;", None),
        (
            "tic_1.SP := 5.0;",
            r"several POUs have blocks of the library \(SECOND, PLC_PRG\); give one of them with --pou",
        ),
    ],
)
def test_the_program_is_the_one_that_names_a_block_of_a_global_list(statement, says):
    text = project().replace('<pou name="Other"', SECOND_PROGRAM.format(statement) + '<pou name="Other"')
    if says is None:
        assert read_plcopen(text).plc["program"] == "PLC_PRG"
        return
    with pytest.raises(ListingError, match=says):
        read_plcopen(text)


def test_each_structure_of_initial_values_ends_before_the_next_member():
    """No block of the library has two of them, or a plain parameter behind one."""
    names = ("a", "B.x", "B.y", "C.x", "d", "E.x")
    variable = Variable("V", "T", {name: (REAL, float(at)) for at, name in enumerate(names)})
    (structure,) = ET.fromstring("\n".join(variable_xml(variable))).iterfind("initialValue/structValue")  # noqa: S314
    members = {
        value.get("member"): {inner.get("member") for inner in value.iterfind("structValue/value")}
        for value in structure
    }
    assert members == {"a": set(), "B": {"x", "y"}, "C": {"x"}, "d": set(), "E": {"x"}}
    assert [value.get("value") for value in structure.iter("simpleValue")] == [f"{at}.0" for at in range(6)]


def test_settings_may_stand_in_the_comments_of_the_text_too():
    listing = read_plcopen(project(f'(* plc: {{"name": "Boiler"}} *)\n{CALL}'))
    assert (listing.plc["name"], listing.plc["sample_time"]) == ("Boiler", 0.02)
    loop = '(* loop: {"loop": "TIC_1", "type": "PIDA_REAL", "description": "Zone 1"} *)'
    assert read_plcopen(project(f"{loop}\n{CALL}")).settings[0]["description"] == "Zone 1"


def test_what_two_lists_call_alike_is_neither():
    with pytest.raises(ListingError, match=r"GVL_IO.Level is no variable that the program declares"):
        read_plcopen(project("TIC_1(PV := GVL_IO.Level);"))


@pytest.mark.parametrize(
    ("task", "time"),
    [
        ('<task name="B" interval="PT5S" priority="2"><pouInstance name="OTHER" typeName=""/></task>', 0.02),
        ('<task name="B" priority="2"><pouInstance name="OTHER" typeName=""/></task>', 0.02),
        ('<task name="B" priority="2"><pouInstance name="PLC_PRG" typeName=""/></task>', 0.02),
        ('<task name="B" interval="PT5S" priority="2"><pouInstance name="x" typeName="plc_prg"/></task>', None),
    ],
)
def test_the_interval_is_that_of_the_one_task_that_calls_the_program(task, time):
    text = project().replace("<task ", f"{task}<task ")
    assert read_plcopen(text).plc.get("sample_time") == time


@pytest.mark.parametrize("value", ["", "<arrayValue><value/></arrayValue>", '<simpleValue value="Other"/>'])
def test_an_initial_value_that_is_no_literal_is_refused_where_a_block_reads_it(value):
    text = project("TIC_1(PV := PT);").replace(
        "REAL/></type></variable>\n          </localVars>",
        f"REAL/></type><initialValue>{value}</initialValue></variable></localVars>",
    )
    with pytest.raises(ListingError, match="PT is read by a block, and begins with something that is no literal"):
        read_plcopen(text)
    assert "PT" not in read_plcopen(text.replace("PV := PT", "PV := 5.0")).words


@pytest.mark.parametrize("interval", ["", "cycle", "PT0S", "P1D"])
def test_an_interval_that_is_no_time_is_asked_for(interval):
    assert "sample_time" not in read_plcopen(project(interval=interval or "x")).plc


def test_a_task_that_contradicts_the_comments_is_refused():
    text = written(network("override")).replace('interval="PT', 'interval="PT1')
    with pytest.raises(ListingError, match=r"the task calls the program every .* s, and the comments say") as error:
        read_plcopen(text)
    assert "interval=" in text.splitlines()[error.value.line - 1]


def test_the_task_calls_the_program_at_its_interval():
    config = network("override")
    root = ET.fromstring(written(config))  # noqa: S314 - our own text
    (task,) = root.iter(f"{TC6}task")
    assert task.attrib["interval"] == f"PT{config.plc.sample_time}S"
    assert (task.attrib["priority"], task[0].attrib) == ("1", dict.fromkeys(("name", "typeName"), config.plc.program))


def test_a_project_of_more_than_a_megabyte_is_read():
    filler = '<data name="x" handleUnknown="discard"><Libraries>' + '<Library Name="Standard" />' * 45_000
    text = project().replace("<addData>", f"<addData>{filler}</Libraries></data>", 1)
    assert len(text) > 1_100_000
    result = check_listing(text)
    assert [loop["name"] for loop in result["loops"]] == ["TIC_1"]


def check_listing(text: str):
    from pidcfg.encoders.decoding import read_listing
    from pidcfg.text.reader import DEFAULT
    from pidcfg.vendors import VENDORS

    listing = read_listing(text.encode(), VENDORS["nextopid"], DEFAULT)
    return decode(listing.words, listing.settings, listing.plc).data


# --- NextoPID configurations to parameters with names, in every listing, and back -------------------------------------


VENDOR = VENDORS["nextopid"]
LISTINGS = ("text", "csv", "json")


def again(text: str, kind: str, **options):
    """The configuration that a listing of this kind decodes to, and the notes."""
    decoded = decode_listing(FORMATS[kind].read(text), VENDOR, options)
    return NextopidFile.model_validate(decoded.data), decoded.notes


@pytest.mark.parametrize("kind", LISTINGS)
@settings(max_examples=25, deadline=None)
@given(config=configurations())
def test_encode_decode_encode_is_identical_in_every_listing(kind, config):
    text = FORMATS[kind].write(encode(config).image, checklist(config))
    back, notes = again(text, kind)
    assert FORMATS[kind].write(encode(back).image, checklist(back)) == text
    assert not notes


READ_BACK = [kind for kind in FORMATS if kind != "modbus-map"]
"""Formats that hold contents, and not only where they are."""


@pytest.mark.parametrize("kind", READ_BACK)
@pytest.mark.parametrize("name", NETWORKS)
def test_every_format_gives_the_same_network(kind, name):
    config = network(name)
    back, notes = again(FORMATS[kind].write(encode(config).image, ()), kind)
    wanted, found = encode(config), encode(back)
    assert found.image.settings == wanted.image.settings
    assert found.image.plc == wanted.image.plc
    assert found.order == wanted.order
    assert {key: (wire.code, wire.constants) for key, wire in found.wires.items()} == {
        key: (wire.code, wire.constants) for key, wire in wanted.wires.items()
    }
    values = [{k: v for k, v in e.image.words.items() if not isinstance(v, Wire)} for e in (found, wanted)]
    assert values[0] == values[1]
    assert not notes


@pytest.mark.parametrize("kind", READ_BACK)
@pytest.mark.parametrize("name", NETWORKS)
def test_a_listing_is_known_by_how_it_begins(kind, name):
    text = FORMATS[kind].write(encode(network(name)).image, ())
    assert next(other for other, of in FORMATS.items() if of.looks_like(text)) == kind


def test_every_parameter_of_the_library_has_a_field_or_is_an_output():
    for kind in BLOCK_TYPES.values():
        names = {row.name.partition(".")[0] for row in kind.inputs}
        assert names <= set(kind.model.model_fields)
        assert len({row.name.upper() for row in kind.table.rows}) == len(kind.table.rows)


WHOLE = "SP SP_CASC PV BIAS ManualMV TRK_VAL MaxVarMV MaxMV MinMV DeadBand MaxPV MinPV MV"
"""Of the manual's PIDA_INT and PIDA_TUNE_INT, what is 16-bit signed."""
TUNING = {"AutoTuneParam.NumCycles": "UINT", "AutoTuneParam.Mode": "AUTOTUNE_MODE"}
OTHER_TYPES = {
    "ControlPWM": {"Period": "UINT"},
    "ControlSplitRange": {"Mode": "USINT"},
    "PIDA_TUNE_REAL": TUNING,
    "PIDA_TUNE_INT": TUNING,
}
REAL_OUTPUTS = (
    "MV MV1 MV2 ProportionalAction DerivativeAction IntegralAction SampleTime OutVar "
    "AutoTuneResult.Kp AutoTuneResult.Ti_Ki AutoTuneResult.Td_Kd"
)


@pytest.mark.parametrize("name", BLOCK_TYPES)
def test_a_parameter_has_the_type_of_the_manual(name):
    kind = BLOCK_TYPES[name]
    types = {row.name: row.type.name for row in kind.table.rows}
    assert {key for key, of in types.items() if of == "INT"} == (set(WHOLE.split()) if name.endswith("_INT") else set())
    assert {key: of for key, of in types.items() if of not in {"INT", "REAL", "BOOL"}} == OTHER_TYPES.get(name, {})
    flags = {row.name for row in kind.outputs if row.name not in REAL_OUTPUTS.split() or name == "ControlON_OFF"}
    assert {row.name for row in kind.outputs if row.type.name == "BOOL"} == flags


@pytest.mark.parametrize("kind", ["REAL", "INT"])
def test_a_block_that_tunes_begins_with_the_rows_of_the_one_that_does_not(kind):
    plain, tuning = (BLOCK_TYPES[f"{name}_{kind}"].table.rows for name in ("PIDA", "PIDA_TUNE"))
    assert [row[:3] for row in tuning[: len(plain)]] == [row[:3] for row in plain]
    assert {row.name.partition(".")[0] for row in tuning[len(plain) :]} == {
        *("AutoTune", "AutoTuneParam", "AutoTuneDone", "AutoTuneError", "AutoTuneResult")
    }


TIMES = ("Tfd", "Tc", "Tlag", "Tlead", "DelayTime", "SampleTime")
"""Of the manual's parameters those whose unit is seconds, whatever else is set."""


def test_only_controllers_have_parameters_in_the_units_of_pv_and_output():
    for name, kind in BLOCK_TYPES.items():
        units = {row.name: row.unit for row in kind.table.rows if "pv" in row.unit or "output" in row.unit}
        if name.startswith("PIDA_"):
            wanted = ("pv", "output", "output/pv", "output/cycle")
            assert tuple(units[key] for key in ("SP", "ManualMV", "Kp", "MaxVarMV")) == wanted
        else:
            wanted = ("SP", "PV", "DeadBand", "MaxPV", "MinPV") if name == "ControlON_OFF" else ()
            assert units == dict.fromkeys(wanted, "pv")


@pytest.mark.parametrize(
    ("kind", "value", "stored", "fault"),
    [
        (REAL, "1.5", 1.5, None),
        (INT, "32767", 32767, None),
        (INT, "-32768", -32768, None),
        (INT, "-32769", 0, "range"),
        (INT, "0.5", 0, "form"),
        (UINT, "65535", 65535, None),
        (UINT, "65536", 0, "range"),
        (UINT, "-1", 0, "range"),
        (USINT, "255", 255, None),
        (USINT, "256", 0, "range"),
        (DINT, "2147483647", 2147483647, None),
        (DINT, "2147483648", 0, "range"),
        (TIME, "4294967.295", "T#4294967295ms", None),
        (TIME, "4294967.296", "T#0ms", "range"),
        (TIME, "-0.001", "T#0ms", "range"),
        (REAL, "1e39", 0.0, "range"),
        (INT, "32768", 0, "range"),
        (TIME, "0.0005", "T#0ms", "form"),
    ],
)
def test_a_value_that_its_type_does_not_hold_leaves_the_default_and_says_why(kind, value, stored, fault):
    content, misfit = store_value(Parameter("P", kind), Decimal(value))
    assert (content, misfit and (misfit.path, misfit.value, misfit.error.fault)) == (
        stored,
        fault and ("P", Decimal(value), fault),
    )


def test_every_time_of_the_library_is_in_seconds():
    rows = [row for kind in BLOCK_TYPES.values() for row in kind.table.rows]
    assert {row.name for row in rows if row.unit == "s"} == {*TIMES}
    assert {row.unit for row in rows if row.name in TIMES} == {"s"}


def test_the_page_of_parameters_tells_one_mode_from_the_other():
    page = (Path(__file__).parents[1] / "docs/nextopid-registers.md").read_text("utf-8")
    rows = [line.split(" | ") for line in page.splitlines() if "| input" in line and "Mode`" in line]
    assert {row[0]: row[4] for row in rows} == {
        "| `AutoTuneParam.Mode`": "The controller that is tuned.",
        "| `Mode`": "Which valve opens where: 1 to 4.",
    }


def test_what_an_int_cannot_hold_is_a_misfit_at_its_place():
    config = copy.deepcopy(OVERRIDE)
    config["loops"][1]["SP"], config["loops"][1]["MaxMV"] = 40000, 0.5
    found = encode(NextopidFile.model_validate(config)).misfits
    assert [(place, str(misfit.error)) for place, misfit in found] == [
        (("loops", 1, "SP"), "is outside the range of INT"),
        (("loops", 1, "MaxMV"), "INT holds whole numbers"),
    ]


@pytest.mark.parametrize(
    ("wire", "says"),
    [
        ("PIC.MVV", "'PIC.MVV' is no declared name"),
        ("Hold", "Hold is BOOL; numbers are wanted"),
        ("PIC.PV + 1", "PIC.PV is wired itself and of the same call"),
    ],
)
def test_a_wire_without_meaning_is_a_misfit(wire, says):
    config = copy.deepcopy(OVERRIDE)
    config["loops"][0]["BIAS"] = wire
    (place, misfit), *_ = encode(NextopidFile.model_validate(config)).misfits
    assert place == ("loops", 0, "BIAS")
    assert says in str(misfit.error)


def test_the_interval_of_the_task_may_come_from_the_command_line():
    document = json.loads(FORMATS["json"].write(encode(network("override")).image, ()))
    del document["plc"]
    text = json.dumps(document)
    with pytest.raises(ListingError, match="give --sample-time"):
        again(text, "json")
    (option,) = DECODE_OPTIONS
    assert again(text, "json", sample_time=option.read("100 ms"))[0].plc == network("override").plc
    assert option.read("fast") is None


def test_an_image_is_complete_without_what_the_program_around_assigns():
    words = encode(network("override")).image.words
    assert "HEAT.PV" not in words
    assert words["HEAT.ManualMV"] is False
    assert words["FIC.BIAS"] == Wire("(- 1)")
    assert checklist(network("override"))[1].endswith("HEAT.PV")


@pytest.mark.parametrize("given", [0, None])
@pytest.mark.parametrize("kind", READ_BACK)
def test_a_signal_of_0_is_no_signal_that_is_left_open(kind, given):
    data = copy.deepcopy(OVERRIDE)
    for item, key in (*((loop, "PV") for loop in data["loops"]), (data["blocks"][2], "MV")):
        item.update({key: given})
    config = NextopidFile.model_validate(data)
    back, _ = again(FORMATS[kind].write(encode(config).image, ()), kind)
    assert [loop.PV for loop in back.loops] == [given] * len(data["loops"])
    assert given == back.blocks[2].MV


def test_a_literal_that_is_wired_is_refused():
    document = json.loads(FORMATS["json"].write(encode(network("override")).image, ()))
    (entry,) = [word for word in document["words"] if word["address"] == "PULSES.Period"]
    entry["expression"] = str(entry.pop("value"))
    with pytest.raises(ListingError, match=r"the listing gives no configuration: blocks.2.ControlPWM.Period"):
        again(json.dumps(document), "json")
