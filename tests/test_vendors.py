"""What holds for every vendor because it has a row in `VENDORS`: none is named here, a new one is tested by its row."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from importlib import import_module, resources
from pathlib import Path
from types import SimpleNamespace

import pytest
from pydantic import BaseModel
from ruamel.yaml import YAML

import generated
import pidcfg as api
from pidcfg.cli.formats import formats_of
from pidcfg.encoders.parameters import NamedLoops
from pidcfg.encoders.regmap import RegisterMap
from pidcfg.output.explanation.lookup import PV_RISES
from pidcfg.output.report.sheets import direction_text, tuning_facts
from pidcfg.schemas.base import LoopNameSettings, SectionSettings
from pidcfg.schemas.document import models_in
from pidcfg.vendors import VENDORS
from shell import captured, pidcfg

SCENARIO = """\
pidcfg: 1
scenario: A starter runs, and fails
config: starter.yaml
duration: 60
plants:
  - {{name: plant, model: first_order, input: {out}, gain: 0.5, load: 20, time_constant: 10, dead_time: 4, noise: 0.1}}
connect: {{{inlet}: plant}}
events:
  - {{at: 5, loop: {loop}, set: {{setpoint: 60}}}}
expect:
  - {{signal: {loop}.PV, max: -1000000}}
"""
every_vendor = pytest.mark.parametrize("vendor", VENDORS.values(), ids=list(VENDORS))


def starter(vendor):
    """The file that `pidcfg init` writes for a vendor."""
    return resources.files("pidcfg").joinpath(vendor.starter).read_text("utf-8")


def scenario(vendor):
    """A step of the set point for the first loop of the starter."""
    encoded = api.encode(starter(vendor))
    controller = vendor.module("controller")
    plc = controller.load(encoded.image, controller.Options())
    loop = plc.loops[0]
    return SCENARIO.format(loop=loop, out=f"{loop}.{plc.out_name}", inlet=plc.pv_inputs.get(loop, f"{loop}.PV"))


@pytest.fixture
def folder(vendor, tmp_path, monkeypatch):
    """A folder with the starter and a scenario of it."""
    (tmp_path / "starter.yaml").write_text(starter(vendor), "utf-8")
    (tmp_path / "run.scenario.yaml").write_text(scenario(vendor), "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*words, code=0):
    """What a command prints; it must end with ``code``."""
    ended, terminal, out = captured(pidcfg, list(words))
    assert ended == code, terminal
    return out


# --- the starter, there and back -------------------------------------------------------------------------------------

LISTINGS = [
    (vendor, name) for vendor in VENDORS.values() for name, kind in vendor.load("formats").items() if kind.is_complete
]


def memory(result):
    """Everything that an image holds."""
    return result.image.words, result.image.settings, dict(result.image.plc)


def test_every_vendor_has_listings_that_hold_everything():
    assert {vendor.key for vendor, _ in LISTINGS} == {*VENDORS}


@every_vendor
def test_init_writes_a_file_without_errors(vendor, tmp_path):
    path = tmp_path / "new.yaml"
    run("init", "--vendor", vendor.key, "-o", str(path))
    assert path.read_text("utf-8") == starter(vendor)
    assert api.check(path).ok


@pytest.mark.parametrize(("vendor", "name"), LISTINGS, ids=[f"{vendor.key}-{name}" for vendor, name in LISTINGS])
def test_the_starter_comes_back_from_every_listing(vendor, name):
    there = api.encode(starter(vendor), name)
    back = api.decode(there.text, vendor.key)
    assert back.ok, back.findings
    again = api.encode(back.text, name)
    if '"loop": ' in there.text:  # with what no register holds
        assert memory(again) == memory(there)
        assert without_checks(again.text) == without_checks(there.text)
    else:
        assert again.image.words == there.image.words


def without_checks(text):
    """A listing without what is to be checked of the file that it was made of: more of it than of the words alone."""
    if text.startswith("{"):
        return {key: value for key, value in json.loads(text).items() if key != "checklist"}
    return [line for line in text.splitlines() if not line.startswith("# check after")]


@every_vendor
def test_a_number_that_is_spoiled_does_not_come_back_as_it_was(vendor):
    there = api.encode(starter(vendor), "json")
    listing, notes = json.loads(there.text), api.decode(there.text, vendor.key).notes
    spoiled = 0
    for i, word in enumerate(listing["words"]):
        if isinstance(word.get("value", ""), bool | str):
            continue
        words = [dict(one) for one in listing["words"]]
        words[i]["value"] += 1
        words[i].pop("hex", None)
        back = api.decode(json.dumps({**listing, "words": words}), vendor.key)
        if back.ok:
            again = api.encode(back.text, allow_errors=True)
            assert again.image is None or again.image.words != there.image.words or back.notes != notes, word
        spoiled += 1
    assert spoiled > 5


# --- maps and schema -------------------------------------------------------------------------------------------------


def leaves(model, above=""):
    """Paths of all keys of a model; a section is not one of them."""
    for key, field in model.model_fields.items():
        inner = [m for m in models_in(field.annotation) if m is not model]
        for below in inner:
            yield from leaves(below, f"{above}{key}.")
        if not inner:
            yield f"{above}{key}"


def sections(model, above=""):
    """Where rows may begin: the top, and every section below it."""
    yield above
    for key, field in model.model_fields.items():
        for below in models_in(field.annotation):
            if below is not model:
                yield from sections(below, f"{above}{key}.")


def leads_to(row, key):
    """Whether a row holds a field: the field itself, an end of a pair, or all of the section that the field is in."""
    return row in {key, f"{key}.0", f"{key}.1"} or key.startswith(f"{row}.")


def is_held(key, rows):
    """Whether rows hold a field; of a pair both ends."""
    return any(key == row or key.startswith(f"{row}.") for row in rows) or {f"{key}.0", f"{key}.1"} <= rows


def rows_of(table):
    """What a file says of a table's rows, by the paths of their values."""
    if isinstance(table, RegisterMap):
        return table.paths()
    return [row.name for row in table.rows if row.access == "input"]


def tables_of(vendor):
    """Each table with the model that it is about, and where its rows begin there.

    A book says the model of a block of several kinds; the others are about the section to which most rows lead.
    """
    models = getattr(vendor.load("explainer"), "schemas", {})
    for table in vendor.load("registers"):
        if table.title in models:
            yield table, models[table.title], ""
            continue
        keys, rows = {*leaves(vendor.model)}, rows_of(table)
        starts = [*sections(vendor.model)]
        yield (
            table,
            vendor.model,
            max(starts, key=lambda start: sum(any(leads_to(start + row, key) for key in keys) for row in rows)),
        )


def kept_outside(vendor):
    """Keys that stand beside the registers, as the vendor's decoder reads them there."""
    bases = (LoopNameSettings, SectionSettings)
    held = vars(vendor.module("decode")).values()
    models = [m for m in held if isinstance(m, type) and issubclass(m, BaseModel) and m.__name__.endswith("Settings")]
    named = [m for loops in held if isinstance(loops, NamedLoops) for m in (loops.settings, loops.file)]
    settings = [model for model in (*models, *named) if model not in bases]
    return {path for model in settings for path in leaves(model)} | {"pidcfg", "vendor", "name"}


def has_free_keys(model, path):
    """Whether the keys below a key are the user's, such as names of signals."""
    field = model.model_fields.get(path)
    return field is not None and hasattr(field.get_default(call_default_factory=True), "items")


@every_vendor
def test_every_row_leads_to_a_field(vendor):
    writers = vendor.load("explainer").writers
    for table, model, start in tables_of(vendor):
        keys = {*leaves(model)}
        for row in rows_of(table):
            assert any(leads_to(start + row, key) for key in keys) or row in writers, (table.title, row)


@every_vendor
def test_every_field_has_a_row_or_stands_beside_the_registers(vendor):
    rows = {}
    for table, model, start in tables_of(vendor):
        rows.setdefault(model, set()).update(start + row for row in rows_of(table))
    outside, aliases = kept_outside(vendor), getattr(vendor.load("explainer"), "aliases", {})
    blocks = {key for model in rows if model is not vendor.model for key in leaves(model)}
    for model in {vendor.model, *rows}:
        for path in leaves(model):
            inner = path.partition(".")[2]
            if model is vendor.model and inner in blocks:
                continue
            held = is_held(path, rows.get(model, set())) or inner in aliases or has_free_keys(model, path)
            assert held or {path, inner} & outside, (model, path)


# --- both engines ----------------------------------------------------------------------------------------------------


@every_vendor
def test_both_engines_run_the_starter_alike(vendor):
    pytest.importorskip("numba")
    found = []
    for engine in ("python", "numba"):
        trend = io.StringIO()
        files = {"starter.yaml": starter(vendor)}
        result = api.simulate(scenario(vendor), engine=engine, trend=trend, name="run.yaml", files=files)
        report = result.to_json()
        assert report.pop("engine") == engine
        assert report["loops"], report
        found.append((report, trend.getvalue()))
    assert found[0] == found[1]


@every_vendor
@pytest.mark.parametrize("own", [False, True], ids=["setpoint", "own-key"])
def test_an_event_on_the_set_point_begins_a_step(vendor, own):
    controller = vendor.module("controller")
    key = controller.load(api.encode(starter(vendor)).image, controller.Options()).setpoint if own else "setpoint"
    files, text = {"starter.yaml": starter(vendor)}, scenario(vendor).replace("setpoint: 60", f"{key}: 60")
    (loop,) = api.simulate(text, name="run.yaml", files=files).to_json()["loops"].values()
    assert loop["metrics"]["overshoot"] is not None


# --- commands and formats --------------------------------------------------------------------------------------------


@every_vendor
def test_explain_knows_what_it_offers_and_the_gains_of_a_file(vendor, folder):
    book, tuned = vendor.load("explainer"), vendor.load("tuned")
    for _, example in book.examples:
        assert vendor.title in run("explain", *example.split(), "--vendor", vendor.key)
    for name in tuned.names:
        (one, *_) = json.loads(run("explain", name, "--in", "starter.yaml", "--format", "json"))["explanations"]
        assert (one["vendor"], one["loop"]) == (vendor.key, api.load(starter(vendor)).model.loops[0].name)
        assert one["set_by"], one


@every_vendor
def test_annotate_has_a_line_for_every_word(vendor, folder):
    listing = api.encode(starter(vendor))
    text = api.decode(listing.text, vendor.key, annotate=True).text
    assert all(cell.address in text for cell in listing.image.cells)


@every_vendor
def test_tune_gives_gains_that_the_vendor_holds(vendor):
    process = {"gain": 2, "time_constant": 60, "dead_time": 5, "closed_loop": 30}
    result = api.tune("synthesis", **process, sample_time=0.5, vendor=vendor.key, pv_range=(0, 200))
    row = result.to_json()["for"]
    assert row["vendor"] == vendor.key
    assert row["action"] == vendor.load("tuned").heating
    assert all(value["stored"] is not None for value in row["values"])


@every_vendor
def test_the_schema_accepts_the_starter_and_refuses_an_unknown_key(vendor):
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(run("schema", vendor.key))
    data = YAML(typ="safe").load(starter(vendor))
    jsonschema.validate(data, schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({**data, "loop": []}, schema)


@every_vendor
def test_a_report_has_a_sheet_of_the_loop_and_its_facts(vendor, folder):
    run("report", "run.scenario.yaml", "-o", "page.html", "--csv", "tables", "--xlsx", "tables.xlsx", "--quiet", code=1)
    page = (folder / "page.html").read_text("utf-8")
    name = api.load(starter(vendor)).model.loops[0].name
    assert name in page
    assert vendor.title in page
    for fact in ("Set point", "Direction", "Sample time"):
        assert f">{fact}<" in page, fact
    assert (folder / "tables.xlsx").stat().st_size > 0
    assert any(name in path.read_text("utf-8-sig") for path in (folder / "tables").iterdir())


@every_vendor
@pytest.mark.parametrize("format", formats_of("validate"))
def test_validate_in_every_format(vendor, folder, format):  # noqa: A002 - what the option is called
    run("validate", "starter.yaml", "--format", format)
    (folder / "bad.yaml").write_text(starter(vendor).replace("loops:", "loop:"), "utf-8")
    assert "bad.yaml" in run("validate", "bad.yaml", "--format", format, code=1)


@every_vendor
@pytest.mark.parametrize("format", formats_of("diff"))
def test_diff_in_every_format(vendor, folder, format):  # noqa: A002 - as above
    name = api.load(starter(vendor)).model.loops[0].name
    (folder / "other.yaml").write_text(starter(vendor).replace(f"name: {name}", f"name: {name[:-1]}X"), "utf-8")
    assert name in run("diff", "starter.yaml", "other.yaml", "--format", format)
    run("diff", "starter.yaml", "starter.yaml", "--format", format)


@every_vendor
def test_simulate_in_every_format(vendor, folder):
    outputs = [f"--output={name}=out.{name}" for name in formats_of("simulate")]
    run("simulate", "run.scenario.yaml", "--engine", "python", *outputs, code=1)
    for name in formats_of("simulate"):
        assert f"{api.load(starter(vendor)).model.loops[0].name}.PV" in (folder / f"out.{name}").read_text("utf-8"), (
            name
        )


@every_vendor
def test_convert_reports_in_every_format(vendor, folder):
    outputs = [f"--report-output={name}=out.{name}" for name in formats_of("convert")]
    run("convert", "starter.yaml", "--to", vendor.key, "-o", "copy.yaml", "--allow-loss", *outputs)
    name = api.load(starter(vendor)).model.loops[0].name
    for kind in formats_of("convert"):
        assert name in (folder / f"out.{kind}").read_text("utf-8"), kind


# --- what a vendor of another shape would need ------------------------------------------------------------------------


class Nested:
    """A vendor whose action and form stand in sections."""

    def load(self, what):
        return {"explainer": SimpleNamespace(direction=SimpleNamespace(key="control.action"))}[what]

    def module(self, what):
        tuned = SimpleNamespace(
            heating="control.action direct", dependent=("tuning.form", True), names=(), key=lambda name: name
        )
        return {"registers": SimpleNamespace(TUNING_NUMBERS=tuned)}[what]


@pytest.mark.parametrize(
    ("action", "form", "found"),
    [
        ("direct", True, [PV_RISES[True], "dependent: Ti and Td are times"]),
        ("reverse", False, [PV_RISES[False], "independent: Ki and Kd are gains"]),
    ],
)
def test_a_report_reads_action_and_form_in_sections(action, form, found):
    loop = SimpleNamespace(control=SimpleNamespace(action=action), tuning=SimpleNamespace(form=form))
    assert [direction_text(Nested(), loop), *(fact.text for fact in tuning_facts(Nested(), loop, {}))] == found


@every_vendor
def test_the_page_of_the_rules_needs_no_words_of_its_own(vendor, monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "docs")
    rule_pages = import_module("rule_pages")
    monkeypatch.delitem(rule_pages.TITLES, vendor.key)
    monkeypatch.delitem(rule_pages.ABOUT, vendor.key)
    page = rule_pages.rule_pages()[f"rules-{vendor.key}.md"]
    assert page.startswith(f"# Rules of the {vendor.title}\n")


# --- a part that is missing ------------------------------------------------------------------------------------------


def test_a_part_that_is_missing_is_named():
    vendor = replace(next(iter(VENDORS.values())), key="nobody")
    with pytest.raises(LookupError, match=r"nobody has no rules: pidcfg\.validate\.rules\.nobody is missing"):
        vendor.load("rules")
    with pytest.raises(LookupError, match=r"nobody has no rules"):
        vendor.module("rules")


def test_an_object_that_is_missing_is_named(monkeypatch):
    vendor = next(iter(VENDORS.values()))
    monkeypatch.delattr(vendor.module("rules"), "RULES")
    with pytest.raises(LookupError, match=rf"{vendor.key} has no rules: pidcfg\.validate\.rules\..* has no RULES"):
        vendor.load("rules")


@pytest.mark.parametrize("vendor", VENDORS.values(), ids=VENDORS)
def test_the_beginnings_of_addresses_are_those_of_the_maps(vendor):
    space = getattr(vendor.load("explainer"), "space", None)
    assert vendor.banks == tuple(bank.prefix for bank in (space.banks if space else ()))


@every_vendor
def test_the_page_of_its_registers_is_what_its_tables_say(vendor):
    page = generated.ROOT / "docs" / f"{vendor.key}-registers.md"
    assert import_module("generate").registers(vendor) == page.read_text("utf-8")
