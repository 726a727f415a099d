"""Every word of a listing changed by itself, and beside something that is refused: whether `pidcfg.diff` shows it.

``python tests/diff_words.py [STEP] [VENDOR…]`` prints, for each vendor, format and refusal, how many changes there were
and how many went unseen; STEP takes only each so many-th word.
"""

from __future__ import annotations

import sys
from collections import Counter
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import pidcfg
from pidcfg.encoders.decoding import read_listing
from pidcfg.encoders.listing import UnwritableError
from pidcfg.encoders.parameters import Program
from pidcfg.schemas.iec import Wire
from pidcfg.text.paths import set_value
from pidcfg.text.reader import DEFAULT

EXAMPLES = Path(__file__).parents[1] / "examples"
FILES = {
    "dl06": "reactor",
    "click": "tank",
    "ezlogix": "oven",
    "dpide": "oven",
    "nextopid": "furnace",
    "generic": "boiler",
}
RANGE = ("pv.range", [400, 0])
REFUSALS = {
    "dl06": {"a range that descends": RANGE, "no BCD": ("V2050", 0x02A0), "a key that is none": ("nothing", 1)},
    "click": {"an input range that descends": ("pv.input_range", [10, 0]), "no number": ("DF106", 0x7FC00000)},
    "ezlogix": {"counts that descend": ("pv.counts", [4095, 0]), "a tag that is none": ("pv.tag", "XX1")},
    "dpide": {"a range that descends": RANGE, "no device": ("device", "X500"), "no unit": ("pv.unit", 7)},
    "nextopid": {"a range that descends": ("output.range", [100, 0]), "no controller": ("type", "PID_NONE")},
    "generic": {"a range that descends": ("TIC-1.pv.range.1", -150.5), "no name": ("pv.unit", 7)},
}
"""What is refused of a listing: a setting of its first loop, or the content of a word."""
FLOAT = 8
"""Hexadecimal digits of a single-precision number."""


def with_word(image, number, raw):
    """An image with another content of one word."""
    place, cell = next((i, cell) for i, cell in enumerate(image.cells) if cell.number == number)
    new = cell._replace(raw=raw) if isinstance(cell, tuple) else replace(cell, raw=raw)
    return replace(image, cells=(*image.cells[:place], new, *image.cells[place + 1 :]))


def refused(image, where, value):
    """An image with what is refused."""
    cell = next((c for c in image.cells if c.address == where), None)
    if cell is not None:
        return with_word(image, cell.number, value)
    settings = [deepcopy(dict(entry)) for entry in image.settings]
    set_value(next(entry for entry in settings if "loop" in entry), tuple(where.split(".")), value)
    return replace(image, settings=tuple(settings))


def reserved_in(checked, cell):
    """The bits of a word that mean nothing."""
    blocks = () if isinstance(checked.encoding.image, Program) else checked.encoding.blocks
    rows = [row for block in blocks for row in block.table.bits if block.start + row.offset == cell.number]
    return sum({row.mask for row in rows if row.access == "reserved"})


def other_contents(cell, reserved):
    """Other contents of a word, such as it may have; ``reserved``: bits that mean nothing."""
    raw = cell.raw
    if isinstance(raw, Wire):
        return [Wire(f"{raw.text} + 1.0")]
    if isinstance(raw, str):
        return [word for word in cell.type.words if word != raw][:1]
    if isinstance(raw, bool) or getattr(cell, "hex", "0000") in {"0", "1"}:
        return [type(raw)(not raw)]
    if isinstance(raw, float):
        return [raw * 1.5 + 1, -raw - 0.5]
    if len(getattr(cell, "hex", "")) == FLOAT:
        return [0x41C80000 if raw != 0x41C80000 else 0x42C80000, raw ^ 0x80000000 if raw else 0x3F000000]
    bits = [bit for bit in (0x0001, 0x0100, 0x0008) if not bit & reserved][:2]
    return [raw ^ bit for bit in bits] if hasattr(cell, "hex") else [raw + 1]


def score_of(vendor, step=1, names=None):
    """By format and refusal: changes, and those that went unseen, with the words that did."""
    checked = pidcfg.check_file(EXAMPLES / vendor / f"{FILES[vendor]}.yaml")
    image, scores = checked.encoding.image, {}
    for name, kind in checked.vendor.load("formats").items():
        if kind.needs_into or (names and name not in names):
            continue
        for title, refusal in {"alone": None, **REFUSALS[vendor]}.items():
            changes, unseen = 0, Counter()
            cells = [cell for cell in image.cells if getattr(cell, "access", "setting") != "reserved"]
            for cell in cells[len(title) % step :: step]:
                for raw in other_contents(cell, reserved_in(checked, cell)):
                    base = image if refusal is None else refused(image, *refusal)
                    texts = [written(kind, one) for one in (base, with_word(base, cell.number, raw))]
                    if None in texts or (refusal is not None and cell.address == refusal[0]):
                        continue
                    if len({words(text, checked.vendor, name).get(cell.number) for text in texts}) == 1:
                        continue  # the format has no place for this word
                    changes += 1
                    if why := unseen_in(checked, texts[1], f"x.{name}", cell):
                        unseen[f"{cell.address} {cell.field}: {why}"] += 1
            scores[name, title] = changes, unseen
    return scores


def written(kind, image):
    """The listing of an image; None: the format cannot be written of it."""
    try:
        text = kind.write(image, ())
    except (UnwritableError, ValueError, KeyError):
        return None
    return text.encode(kind.encoding) if isinstance(text, str) else None


def words(text, vendor, name):
    """The words of a listing; none where it cannot be read."""
    try:
        return read_listing(text, vendor, DEFAULT, name).words
    except ValueError:
        return {}


def unseen_in(checked, text, name, cell):
    """Why a change went unseen; empty: it did not."""
    result = pidcfg.diff(checked.document, text, names=(None, name), live=True)
    if not result.ok:
        return result.findings[0].message
    rows = [d for loop in result.loops for d in loop.differences]
    if not any(cell.address in {d.address, d.address.partition(".")[0]} or is_at(d, cell) for d in rows):
        apart = [key for loop in result.loops for key in (*loop.left_out, *loop.missing)]
        return f"not told; apart: {apart}"
    return "told as the same value" if all(d.other_word_only for d in rows) else ""


def is_at(difference, cell):
    """Whether a difference is of a named parameter that stands in a device."""
    return getattr(cell, "device", None) not in {None, ""} and difference.address == cell.device


def main(args):
    """Prints the score of each vendor."""
    for vendor in args[1:] or FILES:
        for (name, title), (changes, unseen) in score_of(vendor, int(args[0]) if args else 1).items():
            sys.stdout.write(f"{vendor} {name}, {title}: {changes} changes, {unseen.total()} unseen\n")
            sys.stdout.writelines(f"  {key} × {count}\n" for key, count in unseen.most_common(12))
            sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
