"""The pages of coverage name real things, leave out nothing, and have the manuals' sections."""

from __future__ import annotations

import re
from importlib import import_module

import pytest

import generated
from pidcfg.cli.main import COMMANDS
from pidcfg.text import references
from pidcfg.text.references import Decision, Manual
from pidcfg.text.source import read_document
from pidcfg.validate.catalog import find_rules
from pidcfg.vendors import VENDORS

ROOT = generated.ROOT
pages = import_module("coverage_pages")
MANUALS = ROOT.parent / "shared" / "manuals"
TEXTS = {
    "dl06": "dl06-pid-loop-operation.txt",
    "click": "click-pid-control-cl246.txt",
    "ezlogix": "ezlogix-pid-loop.txt",
    "nextopid": "altus-nextopid.txt",
    "dpide": "delta-as-dpide.txt",
}
OF_FILES = {"pidcfg", "vendor", "plc.map"}
"""Keys of every file, of which no manual speaks."""
REGISTERED = ("dl06", "click", "ezlogix")
"""Those whose memory is words, not parameters."""
SMALL = {"a", "and", "at", "for", "from", "in", "of", "on", "or", "the", "to", "with", "your"}
"""Words that a heading does not begin with a capital."""
NO_HEADING = re.compile(r"Bit .*Bit=|Addr$|Offset |Type |Loop Number |V\d|DL06$|OUT$")
"""Rows of the DL06's tables and words of its figures, which stand alone like headings."""
NOT_HERE = "the manuals' texts are not here"
each = pytest.mark.parametrize("key", TEXTS)


def rows(key):
    """The rows of a vendor."""
    return pages.coverage(key).rows


def blocks(key):
    """The function blocks of a vendor and the names of their parameters, members of structures once."""
    return {table.title: {row.name: row for row in table.rows} for table in VENDORS[key].load("registers")}


def known_keys(key, block):
    """The keys that a row may name: of the file, and of the named function block also what it gives out."""
    keys = {*pages.key_paths(VENDORS[key].model)}
    if block is not None:
        keys |= {part for name in blocks(key)[block] for part in (name, name.partition(".")[0])}
    return keys


def missing_names(key):
    """What the rows of a vendor name that does not exist."""
    codes, decisions = {*find_rules()}, {d.number for d in pages.all_decisions()}
    for row in rows(key):
        known = known_keys(key, row.block)
        yield from (name for name in row.keys if not any(k == name or k.startswith(f"{name}.") for k in known))
        yield from (code for code in row.rules if code not in codes)
        yield from (tool for tool in row.tools if tool not in COMMANDS)
        yield from (page for page in row.pages if not (ROOT / "docs" / page.partition("#")[0]).exists())
        text = f"{row.runs} {row.missing}"
        yield from (f"D{n}" for n in re.findall(r"\bD(\d{2,3})\b", text) if int(n) not in decisions)
        yield from (name for name in re.findall(r"examples/\S+?\.yaml", text) if not (ROOT / name).exists())


def test_every_plc_with_a_manual_has_a_page():
    assert [vendor.key for vendor in pages.covered()] == [*TEXTS]


@each
def test_what_a_row_names_exists(key):
    assert [*missing_names(key)] == []


@pytest.mark.parametrize(
    "entry",
    [
        {"keys": ["tuning.gian"]},
        {"rules": ["DL999"]},
        {"tools": ["emulate"]},
        {"pages": ["nowhere.md"]},
        {"runs": "see D999"},
        {"not": "examples/dl06/nowhere.yaml"},
    ],
    ids=str,
)
def test_what_does_not_exist_is_found(entry, monkeypatch):
    monkeypatch.setattr(pages, "coverage", lambda _: pages.Coverage(None, (pages.row(section="x", **entry),)))
    assert len([*missing_names("dl06")]) == 1


@pytest.mark.parametrize(
    "entry", [{}, {"section": "a", "sections": ["b"]}, {"section": "a", "rule": ["DL201"]}], ids=str
)
def test_a_row_that_is_misspelt_is_refused(entry):
    with pytest.raises(ValueError, match=r"section|rule"):
        pages.row(**entry)


@each
def test_a_section_stands_once_and_one_without_anything_says_why(key):
    names = [(name, row.block) for row in rows(key) for name in row.sections]
    if key != "ezlogix":  # its monitor has the fields of the set-up again
        assert len({*names}) == len(names)
    assert [row.sections for row in rows(key) if row.nothing and not row.missing] == []


@each
def test_every_key_stands_at_a_section(key):
    named = {name for row in rows(key) for name in row.keys}
    left = [k for k in pages.key_paths(VENDORS[key].model) if not any(n == k or k.startswith(f"{n}.") for n in named)]
    assert {*left} <= OF_FILES, f"name them in docs/covered/{key}.yaml"


@each
def test_every_rule_is_on_the_page(key):
    text = pages.coverage_page(VENDORS[key])
    assert [code for code in find_rules(VENDORS[key].prefix) if f"[{code}](" not in text] == []


def test_a_rule_stands_at_the_first_section_that_it_rests_on_and_at_the_end_without_one(monkeypatch):
    resting = {"Bias Freeze": ["DL222"], "Elsewhere": ["DL201"]}
    row = pages.with_rules(pages.row(section="PID Algorithms > Bias Freeze", rules=["PID101"]), resting)
    again = pages.with_rules(pages.row(section="Bias Freeze"), resting)
    assert (row.rules, again.rules, resting) == (("DL222", "PID101"), (), {"Elsewhere": ["DL201"]})
    monkeypatch.setattr(pages, "coverage", lambda _: pages.Coverage(pages.refs.DL06, (row,)))
    assert pages.unplaced(VENDORS["dl06"]) == sorted({*find_rules("DL")} - {"DL222"})


@pytest.mark.parametrize("key", REGISTERED)
def test_every_setting_of_the_memory_is_shown_where_its_key_is(key):
    shown = {word for row in rows(key) for word in pages.words_of(VENDORS[key], row)}
    tables = VENDORS[key].load("registers")
    keys = [name for row in rows(key) for name in row.keys]
    for table in tables:
        for word in table.points:
            if word.path is not None and not word.path.startswith("state."):
                assert any(pages.holds(word.path, name) for name in keys), word.path
    assert all(
        any(table.offset_text(word.offset) in place for place in shown)
        for table in tables
        for word in table.words
        if word.path
    )


def test_rows_of_a_function_block_have_all_its_parameters():
    named = {}
    for row in rows("nextopid"):
        if row.block is not None:
            named.setdefault(row.block, set()).update(row.keys)
    pid = named["PIDA_REAL"]
    for block, parameters in blocks("nextopid").items():
        tops = {name.partition(".")[0] for name in parameters}
        whole = {name.partition(".")[0] for name in named[block] & {*known_keys("nextopid", block)}}
        if block.endswith("_INT"):
            assert named[block] == {name for name, row in parameters.items() if row.type.name == "INT"}
        else:
            assert tops <= whole | (pid if block == "PIDA_TUNE_REAL" else set()), block


def test_ranges_and_choices_find_their_words():
    found = {
        name: pages.words_of(VENDORS[key], pages.row(section="x", keys=[name]))
        for key, name in (
            ("dl06", "setpoint.limits"),
            ("dl06", "plc.loop_table"),
            ("dl06", "ramp_soak.steps.slope"),
            ("dl06", "pv.format"),
            ("click", "action"),
        )
    }
    assert found == {
        "setpoint.limits": ["loop table +26", "loop table +27"],
        "plc.loop_table": ["set-up words +00"],
        "ramp_soak.steps.slope": ["ramp/soak pair +01"],
        "pv.format": ["loop table +01 bit 0, 1, 9"],
        "action": ["Cn+09"],
    }


# --- beside the manuals' own texts, where they are -------------------------------------------------------------------


def text_of(key):
    """The lines of a manual without marks, line breaks within headings undone."""
    if not MANUALS.exists():
        pytest.skip(NOT_HERE)
    lines = (MANUALS / TEXTS[key]).read_text("utf-8").splitlines()
    return [" ".join(line.strip(" #*-").split()) for line in lines]


def headings(key):
    """The headings that the rows name, in order, the last part of each."""
    return [name.rpartition(" > ")[2] for row in rows(key) for name in row.sections]


def position(lines, heading, start):
    """The first line from `start` on that is a heading, perhaps of two lines, or that begins with it."""
    whole = [n for n in range(start, len(lines)) if lines[n] == heading or " ".join(lines[n : n + 2]) == heading]
    return (whole or [n for n in range(start, len(lines)) if lines[n].startswith(heading)] or [None])[0]


@pytest.mark.parametrize("key", ["dl06", "click", "ezlogix", "nextopid"])
def test_the_manual_has_the_sections_in_this_order(key):
    lines, at, lost = text_of(key), 0, []
    for heading in headings(key):
        found = position(lines, heading, at)
        lost += [heading] if found is None else []
        at = at if found is None else found + 1
    assert lost == []


def test_the_scanned_manual_has_the_sections_and_operands():
    lines = text_of("dpide")
    assert [
        h for h in headings("dpide") if not any(h in line or h.replace("I_MV", "|_MV") in line for line in lines)
    ] == []


def test_every_heading_and_field_of_the_ezlogix_manual_has_a_row():
    if not MANUALS.exists():
        pytest.skip(NOT_HERE)
    source = (MANUALS / TEXTS["ezlogix"]).read_text("utf-8")
    titles = re.findall(r"^#+ +(.+)$", source, re.MULTILINE) + re.findall(r"^\*\*(.+?)\*\*", source, re.MULTILINE)
    named = {name.strip(":") for name in headings("ezlogix")}
    found = {re.sub(r" *\( \$.*?\)", "", title).strip("*: ") for title in titles}
    assert found - named == {"6", "Chapter 6: PID Loop"}


def test_every_heading_of_the_dl06_manual_has_a_row():
    lines, found = text_of("dl06"), set()
    for before, line, after in zip(lines, lines[1:], lines[2:], strict=False):
        words = re.findall(r"[A-Za-z][\w’-]*", line)
        alone = before in {"", "page"} and len(after) > len("What a paragraph has")
        if alone and words and len(words) <= 12 and line[0].isupper() and line[-1] not in ".,;!?":
            found |= {line} if all(w[0].isupper() or w in SMALL for w in words) else set()
    extra = {line for line in found - {*headings("dl06")} if not NO_HEADING.match(line)}
    assert len(found) > 80
    assert extra == set()


def test_every_chapter_and_parameter_of_the_nextopid_manual_has_a_row():
    lines = text_of("nextopid")
    chapters = {line for line in lines if re.fullmatch(r"1?\d\. ?[A-Z][\w ]+", line)} - {"10. ControlLag"}
    named = {part for row in rows("nextopid") for name in row.sections for part in name.split(" > ")}
    assert {c.replace(" ", "") for c in chapters} <= {name.replace(" ", "") for name in named}
    parameters = {
        line.split()[0]
        for line, *below in zip(lines, lines[1:], lines[2:], strict=False)
        if re.match(r"\w+ [-–] ", line) and any(text.startswith("Type:") for text in below)
    }
    assert len(parameters) > 50
    assert parameters <= {key for row in rows("nextopid") for key in row.keys}


@pytest.mark.parametrize("key", ["dl06", "ezlogix", "nextopid"])
def test_a_section_that_is_left_out_is_missed(key, monkeypatch):
    checks = {
        "dl06": test_every_heading_of_the_dl06_manual_has_a_row,
        "ezlogix": test_every_heading_and_field_of_the_ezlogix_manual_has_a_row,
        "nextopid": test_every_chapter_and_parameter_of_the_nextopid_manual_has_a_row,
    }
    text_of(key)
    table = pages.coverage(key)
    names = {"dl06": "Bias Freeze", "ezlogix": "Saturation", "nextopid": "2. PIDA_REAL > Input Parameters"}
    left = table.rows if key == "nextopid" else [r for r in table.rows if names[key] not in r.sections]
    left = [r._replace(keys=tuple(k for k in r.keys if k != "OVERR")) for r in left]
    monkeypatch.setattr(pages, "coverage", lambda _: pages.Coverage(table.manual, tuple(left)))
    with pytest.raises(AssertionError):
        checks[key]()


# --- The places that facts are cited with stand in their manuals: headings of docs/covered, and what is below them ----


MANUAL_FILES = {
    "DL06": "dl06",
    "CLICK": "click",
    "CLICK_ERRORS": "click errors",
    "CLICK_ADDRESSES": "click addresses",
    "EZLOGIX": "ezlogix",
    "NEXTOPID": "nextopid",
    "DPIDE": "dpide",
}
"""The name of each manual in the source, and of its list of places."""
CITED = re.compile(r'\b([A-Z0-9_]+)\.at\(\s*"([^"]+)"')
CHAPTER = re.compile(r"(?:, and )?chapters? ([\d, and]+): ")
FIGURES = re.compile(r"figures? [\d, and-]+")


def yaml_of(path):
    return read_document(path.read_bytes(), str(path)).data


def words(text):
    """A heading without its marks: sources write dashes and colons in several ways."""
    return re.sub(r"[\W_]+", " ", text).strip().lower()


PLACES = yaml_of(ROOT / "tests/data/places.yaml")
CHAPTERS = {int(number): {words(name) for name in names} for number, names in PLACES["chapters"].items()}


def place_headings(manual):
    """The place_headings of a manual, each also without its number and without the one above it."""
    path = ROOT / f"docs/covered/{manual}.yaml"
    names = set()
    for row in yaml_of(path)["sections"] if path.exists() else ():
        for section in row.get("sections") or [row["section"]]:
            for part in str(section).split(" > "):
                names |= {words(part), words(re.sub(r"^[\d.]+ ", "", part))}
    return names


HEADINGS = {manual: place_headings(manual) for manual in MANUAL_FILES.values()}
KNOWN = {m: HEADINGS[m] | {words(str(name)) for name in PLACES.get(m) or {}} for m in MANUAL_FILES.values()}


def wrong_names(manual, place):
    """The names of a place that its manual does not have there."""
    if words(place) in KNOWN[manual] or FIGURES.fullmatch(place):
        return []
    parts = CHAPTER.split(place)
    if len(parts) == 1:
        return [name for name in re.split(r", | and ", place) if words(name) not in KNOWN[manual]]
    wrong = [parts[0]] if parts[0] else []
    for numbers, names in zip(parts[1::2], parts[2::2], strict=True):
        chapters = [CHAPTERS.get(int(number), set()) for number in re.findall(r"\d+", numbers)]
        wrong += [name for name in re.split(r", (?:and )?", names) if not any(words(name) in c for c in chapters)]
    return wrong


def cited_in_the_source():
    found = {}
    for path in sorted((ROOT / "src/pidcfg").rglob("*.py")):
        for manual, place in CITED.findall(path.read_text("utf-8")):
            found.setdefault((manual, place), path.relative_to(ROOT).as_posix())
    return found


def test_every_manual_has_a_list_of_its_places():
    assert {name for name, value in vars(references).items() if isinstance(value, Manual)} == set(MANUAL_FILES)


@pytest.mark.parametrize(("manual", "place"), cited_in_the_source(), ids=lambda value: value)
def test_every_place_that_the_source_cites_stands_in_its_manual(manual, place):
    assert wrong_names(MANUAL_FILES[manual], place) == []


@pytest.mark.parametrize("manual", MANUAL_FILES.values())
def test_what_is_no_heading_stands_under_one(manual):
    for name, above in (PLACES.get(manual) or {}).items():
        assert words(str(name)) not in HEADINGS[manual], f"{name} is a heading"
        assert not above or words(above) in HEADINGS[manual], above


@pytest.mark.parametrize("vendor", VENDORS.values(), ids=lambda vendor: vendor.key)
def test_rules_and_registers_cite_a_place_or_a_decision(vendor):
    short = {getattr(references, name).short: key for name, key in MANUAL_FILES.items()}
    bases = [rule.basis for rule in vendor.load("rules").values()]
    bases += [row.basis for table in vendor.load("registers") for row in getattr(table, "words", ())]
    for basis in {basis for basis in bases if basis is not None and not isinstance(basis, Decision)}:
        assert wrong_names(short[basis.manual.short], basis.place) == [], basis


@pytest.mark.parametrize(
    ("manual", "place", "wrong"),
    [
        ("dl06", "Bias Freeze", []),
        ("dl06", "Bias Freezing", ["Bias Freezing"]),
        ("click", "Manual Mode, Auto Mode", []),
        ("click", "Manual Mode, Cascade Mode", ["Cascade Mode"]),
        ("nextopid", "chapter 2: BIAS", []),
        ("nextopid", "chapter 7: BIAS", ["BIAS"]),
        ("nextopid", "chapter 10: Gs, and chapter 2: Direct", []),
        ("nextopid", "chapter 10: Direct, and chapter 2: Gs", ["Direct", "Gs"]),
        ("nextopid", "chapter 18: Anything", ["Anything"]),
    ],
)
def test_a_place_that_is_not_there_is_found(manual, place, wrong):
    assert wrong_names(manual, place) == wrong
