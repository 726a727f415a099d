"""What pidcfg says of configurations with one small change each, in full; ``generated`` writes the answers anew.

A value of an example is another one, or its line is gone. What is found then, which words differ, how the loop holds
its gains, and what becomes of the fields on the way to another vendor stands in a file below
``tests/data/configurations`` behind the place and the change.
"""

from __future__ import annotations

import re
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pidcfg import api
from pidcfg.encoders.contract import encoder_of
from pidcfg.encoders.listing import ListingError
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document
from pidcfg.vendors import VENDORS
from spoiled_listings import EXAMPLES, Source, Spoiled, answers_of, spread

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from pidcfg.conversion.pipeline import LoopReport

FOLDER = Path(__file__).parent / "data" / "configurations"
VALUE = re.compile(r"(?<=: |, )(?<!name: )(?:[-+]?\d[\d.]*|\w+)(?=[\s,}\]])|(?<=\[)[-+]?\d[\d.]*(?=,)")
"""Numbers and words where values stand."""
COMMENT = re.compile(r"(?m)^ *#.*\n| +#.*$")
NUMBERS = ("0", "-{}", "{}00", "{}.0625", "1", "{} counts", "0.01", "x", "{} %")
MILD = ("1{}", "{}.0625", "1", "{}5", "0.01", "0", "{}.0000001")
"""Changes that most limits let pass: what is found at fault is not converted."""
WORDS = {"true": "false", "false": "true", "direct": "reverse", "reverse": "direct"}
MODES = ("auto", "manual", "cascade", "0", "off")
PLACES = 60


def spoiled(text: str, places: int, part: float, numbers: Sequence[str] = NUMBERS) -> Iterator[Spoiled]:
    """The configuration with another value each, and with a line less."""
    found = list(VALUE.finditer(text))
    for turn, i in enumerate(spread(len(found), places, part)):
        value, begin, end = found[i][0], found[i].start(), found[i].end()
        if value[-1].isdigit():
            new = numbers[turn % len(numbers)].format(value.removeprefix("-"))
        else:
            new = WORDS.get(value, MODES[turn % len(MODES)])
        line, column = text.count("\n", 0, begin) + 1, begin - text.rfind("\n", 0, begin)
        yield Spoiled(f"{line}:{column} {value} -> {new}", text[:begin] + new + text[end:])
    lines = text.splitlines(keepends=True)
    for i in spread(len(lines), places // 4, part):
        yield Spoiled(f"{i + 1} is gone: {lines[i].strip()}", "".join(lines[:i] + lines[i + 1 :]))


def checked(text: str) -> str:
    """Findings, the checklist, gains and words."""
    found = check_document(read_document(text.encode(), "a.yaml"))
    said = [
        f"{d.span.line}:{d.span.column} {d.severity.label} {d.code}: {d.message} | {d.plc_effect} | {d.help}"
        for d in (*found.findings, *found.to_check)
    ]
    if found.encoding is None or found.vendor is None:
        raise ListingError("\n".join(said))
    tuning_of = encoder_of(found.vendor).tuning_of
    said += [f"{loop.name}: {shown(tuning_of(found.config, loop))}" for loop in found.config.loops]
    said += [f"{cell.address} {cell.raw}" for cell in found.encoding.image.cells]
    return "\n".join(said)


def converted(target: str, text: str) -> str:
    """The configuration for another vendor and what became of every field."""
    result = api.convert(text.encode(), target, name="a.yaml")
    if result.data is None:
        raise ListingError("; ".join(f"{d.code}: {d.message}" for d in result.findings))
    found = [f"{d.code}: {d.message}" for d in result.target_findings]
    return result.text + "\n".join([*found, *(line for loop in result.loops for line in lines_of(loop))])


def lines_of(report: LoopReport) -> list[str]:
    """A loop's report, a field a line."""
    head = f"{report.loop} {report.status} {report.reason}".rstrip()
    return [head, *map(shown, report.changes)]


def shown(row: Any) -> str:
    """The fields of a record that say something, but for the vendor's words."""
    names = row._fields if hasattr(row, "_fields") else row.__dataclass_fields__
    return " ".join(f"{name}={getattr(row, name)!r}" for name in names if name != "words" and getattr(row, name))


def _text(vendor: str, name: str) -> str:
    return COMMENT.sub("", (EXAMPLES / vendor / f"{name}.yaml").read_text("utf-8"))


def _checked(vendor: str, name: str) -> Source:
    return Source(_text(vendor, name), PLACES, checked)


def _converted(vendor: str, name: str, target: str) -> Source:
    """Other values for each target: together they are those of the whole file."""
    others = [other for other in VENDORS if other != vendor]
    part = others.index(target) / len(others)
    return Source(_text(vendor, name), PLACES // len(others), partial(converted, target), part)


CHECKED = {
    "click": ("booster", "brewery", "tank"),
    "dl06": ("oven", "reactor", "flow", "feedpump"),
    "dpide": ("oven", "dryer", "dyeing"),
    "ezlogix": ("oven", "dosing", "greenhouse"),
    "generic": ("boiler",),
    "nextopid": ("cascade", "autotune", "override", "diagnostics", "splitrange"),
}
TARGETS = [(one, two) for one in CHECKED for two in VENDORS if one != two]
SOURCES: dict[str, Callable[[], Source]] = {
    **{f"{vendor}-{name}": partial(_checked, vendor, name) for vendor, names in CHECKED.items() for name in names},
    **{f"{one}-to-{two}": partial(_converted, one, CHECKED[one][0], two) for one, two in TARGETS},
}


@cache
def answers(name: str) -> str:
    """The file of a source: each change, and below it the answer."""
    return answers_of(SOURCES[name](), partial(spoiled, numbers=MILD) if "-to-" in name else spoiled)


def golden_files(wanted: Callable[[str], bool] = bool) -> dict[Path, bytes]:
    """All of them, or those whose names are wanted."""
    return {FOLDER / f"{name}.txt": answers(name).encode() for name in SOURCES if wanted(name)}
