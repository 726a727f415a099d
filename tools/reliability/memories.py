"""Listings of what a memory may hold: nothing, zeros, FFFF, loops over the end of a bank, contents that mean nothing.

What `codecs` changes are sound listings; here whole ones are made up, as a PLC that was never loaded has them.
"""

from __future__ import annotations

import json
import random
from typing import TYPE_CHECKING, Any

from pidcfg.api import encode
from pidcfg.vendors import VENDORS
from reliability import hostile
from reliability.codecs import EDGES, REALS, TEXTS, changed, other

if TYPE_CHECKING:
    from pathlib import Path

NAME = "memory"
BLOCKS = {"dl06": {"loop_table": "V"}, "click": {"bits": "C", "integers": "DS", "floats": "DF"},
          "ezlogix": {"registers": "R", "discretes": "S"}}  # fmt: skip
"""Options that say where the loops of a listing begin, and the bank of their registers."""
REST = {"dl06": ("--reset-decimals", "1"), "click": ("--pwm-bit", "none"),
        "ezlogix": ("--action", "reverse", "--algorithm", "position", "--pv-tag", "IR1", "--cv-tag", "OR1",
                    "--output-tag", "none")}  # fmt: skip
"""What else a listing does not say."""
COUNTS = (0, 1, 1, 2, 4, 8, 9, 0x10, 0x9999, 0xFFFF)
POINTER = 0o7640
"""The word of a DL06 that says where its loops are; behind it stands how many there are."""
SCENARIO = "pidcfg: 1\nscenario: a\nconfig: {}\nduration: 2\n"
COMMANDS = (
    "decode {} --vendor {vendor} --annotate",
    "decode {} --vendor {vendor}",
    "decode {} --vendor {vendor} --like {like}",
    "decode {} --vendor {vendor} --like {like} --annotate",
    "diff {} {like} --vendor {vendor} --live --format json",
    "diff {like} {} --format json",
    "diff {} {} --vendor {vendor} --live",
    "simulate memory.scenario.yaml --limit loop_steps=1000",
)


def contents(rng: random.Random) -> Any:
    """A way to fill registers: what one of so many bits holds."""
    fixed = rng.choice((0, -1, 0x9999, None, None, None))

    def content(bits: int) -> int:
        raw = fixed if fixed is not None else rng.choice((*EDGES, rng.getrandbits(bits), rng.getrandbits(bits)))
        return raw & ((1 << bits) - 1)

    return content


def words(vendor: str, rng: random.Random) -> tuple[dict[str, str], list[str]]:
    """Contents in hexadecimal by address, and options that say where the loops are."""
    book, content = VENDORS[vendor].load("explainer"), contents(rng)
    held: dict[str, str] = {}
    options: list[str] = []
    count = rng.choice((1, 1, 2, 3))
    for option, prefix in BLOCKS[vendor].items():
        bank = next(bank for bank in book.space.banks if bank.prefix == prefix)
        size = next(block.length for block in book.blocks if block.prefix == prefix)
        start = rng.choice((0, bank.first, bank.last, bank.last - 1, bank.last - size, bank.last - size + 1,
                            bank.last - size + 2, rng.randint(bank.first, bank.last), 0o2000))  # fmt: skip
        length = rng.choice((0, 1, 2, size, size, size * count, size * count, size * count, size * count + 3))
        share = rng.choice((0.1, 0.95, 1, 1, 1, 1))
        held |= {
            bank.address_name(n): bank.kind.hex(content(4 * bank.kind.digits if bank.kind.digits > 1 else 1))
            for n in range(start, start + length)
            if bank.first <= n <= bank.last and rng.random() < share
        }
        if vendor == "dl06":
            pointer = rng.choice((start, start, start, content(16)))
            number = rng.choice((count, *COUNTS, content(16)))
            setup = [pointer, number, *(content(16) for _ in range(4))][: rng.choice((0, 1, 2, 2, 2, 6))]
            held |= {bank.address_name(POINTER + n): bank.kind.hex(raw) for n, raw in enumerate(setup)}
        if rng.random() < (0.5 if vendor == "dl06" else 0.9):
            options += [f"--{option.replace('_', '-')}", bank.address_name(max(start, bank.first))]
    if rng.random() < 0.6:
        options += REST[vendor]
    if vendor == "dl06" and rng.random() < 0.3:
        options += ["--number-of-loops", str(rng.choice(COUNTS))]
    return held, options


def emptied(listing: dict[str, Any], rng: random.Random) -> dict[str, Any]:
    """A listing of names with all values, or all but one word, or all that stands beside the words, replaced."""
    value = rng.choice((None, None, 0, -1, 0xFFFF, *REALS, *TEXTS))
    kept = [word for word in listing["words"] if rng.random() < 0.9] if rng.random() < 0.5 else listing["words"]
    kept = rng.choice((kept, kept, kept, [rng.choice(listing["words"])], []))
    made = []
    for word in kept:
        new = {key: inner for key, inner in word.items() if key != "hex"}
        if "value" in word:
            new["value"] = other(word["value"], rng) if value is None else _same_type(word["value"], value)
        made.append(new)
    gone = rng.choice((set(), set(), {"settings"}, {"plc"}, {"settings", "plc"}, {"vendor"}))
    return {key: inner for key, inner in listing.items() if key not in gone} | {"words": made}


def _same_type(old: object, new: Any) -> object:
    if isinstance(old, bool):
        return bool(new)
    return type(old)(new) if isinstance(old, int | float) and isinstance(new, int | float) else new


class Memories:
    """Made-up listings, a row of them for each seed and vendor, through the commands that read listings."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.seed, self.folder = seed, folder
        self.failures: list[str] = []
        self.answers = self.runs = 0
        self.listings = {}
        for vendor, file in hostile.CONFIGURATIONS.items():
            (folder / f"{vendor}.yaml").write_bytes((hostile.EXAMPLES / file).read_bytes())
            self.listings[vendor] = json.loads(encode(hostile.EXAMPLES / file, "json").text)

    def run(self, vendor: str, number: int, lines: tuple[str, ...] = COMMANDS) -> None:
        """One listing through the commands, in the folder."""
        rng = random.Random(f"{self.seed} {vendor} {number}")
        options: list[str] = []
        if vendor in BLOCKS and rng.random() < 0.7:
            held, options = words(vendor, rng)
            text = "".join(f"{name}  {raw}\n" for name, raw in held.items())
        else:
            text = json.dumps(rng.choice((emptied, changed))(self.listings[vendor], rng))
        name = self.folder / (NAME + (".json" if text.startswith("{") else ".txt"))
        name.write_text(text, "utf-8")
        (self.folder / "memory.scenario.yaml").write_text(SCENARIO.format(name.name), "utf-8")
        for line in lines:
            given = [word.format(name.name, vendor=vendor, like=f"{vendor}.yaml") for word in line.split()]
            given += options if line.startswith("decode") else []
            code, out, err = hostile.command(given)
            self.runs += 1
            self.answers += code in {0, 1}
            if code not in hostile.DECLARED or "Traceback" in out + err or (code == 2 and not (out + err).strip()):
                told = " | ".join((out + err).strip().splitlines()[-3:])
                self.failures.append(f"{vendor} {number}: {' '.join(given)}: exit {code}: {told}")
