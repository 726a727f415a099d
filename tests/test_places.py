"""The places that facts are cited with stand in their manuals: headings of docs/covered, and what is below them."""

import re
from pathlib import Path

import pytest

from pidcfg.text import references
from pidcfg.text.references import Decision, Manual
from pidcfg.text.source import read_document
from pidcfg.vendors import VENDORS

ROOT = Path(__file__).parents[1]
MANUALS = {
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


def headings(manual):
    """The headings of a manual, each also without its number and without the one above it."""
    path = ROOT / f"docs/covered/{manual}.yaml"
    names = set()
    for row in yaml_of(path)["sections"] if path.exists() else ():
        for section in row.get("sections") or [row["section"]]:
            for part in str(section).split(" > "):
                names |= {words(part), words(re.sub(r"^[\d.]+ ", "", part))}
    return names


HEADINGS = {manual: headings(manual) for manual in MANUALS.values()}
KNOWN = {m: HEADINGS[m] | {words(str(name)) for name in PLACES.get(m) or {}} for m in MANUALS.values()}


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
    assert {name for name, value in vars(references).items() if isinstance(value, Manual)} == set(MANUALS)


@pytest.mark.parametrize(("manual", "place"), cited_in_the_source(), ids=lambda value: value)
def test_every_place_that_the_source_cites_stands_in_its_manual(manual, place):
    assert wrong_names(MANUALS[manual], place) == []


@pytest.mark.parametrize("manual", MANUALS.values())
def test_what_is_no_heading_stands_under_one(manual):
    for name, above in (PLACES.get(manual) or {}).items():
        assert words(str(name)) not in HEADINGS[manual], f"{name} is a heading"
        assert not above or words(above) in HEADINGS[manual], above


@pytest.mark.parametrize("vendor", VENDORS.values(), ids=lambda vendor: vendor.key)
def test_rules_and_registers_cite_a_place_or_a_decision(vendor):
    short = {getattr(references, name).short: key for name, key in MANUALS.items()}
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
