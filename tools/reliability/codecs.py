"""Listings with changed values through decode, encode and decode again."""

from __future__ import annotations

import json
import random
import traceback
from typing import Any

from pidcfg.api import decode, encode
from reliability.fuzz import SOUND, Found, words_of

EDGES = (0, 1, 2, 3, 255, 256, 4095, 4096, 9998, 9999, 0x7FFF, 0x8000, 0x9999, 0xA000, 0xFFFF)
"""Contents of a register that mean something somewhere."""
REALS = (0.0, -0.0, 1.0, -1.0, 1e-38, 3.4e38, 0.1, 100.0, 4095.5, 1e9, -1e9, 1e-9)
TEXTS = ("T#0ms", "T#1s", "T#49d17h2m47s295ms", "TRUE", "", "auto", "x.y", "A + B")


class Codecs:
    """Changed listings of the examples, a row of them for each seed."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.listings = [(path, json.loads(encode(path, "json").text)) for path in SOUND]
        self.found = Found()

    def run(self, number: int) -> None:
        """One listing there and back."""
        rng = random.Random(f"{self.seed} codec {number}")
        path, listing = rng.choice(self.listings)
        text = json.dumps(changed(listing, rng))
        self.found.mutants += 1
        try:
            self._round(text, listing["vendor"])
        except AssertionError as error:
            self._failed(number, path, str(error))
        except Exception:  # noqa: BLE001 - whatever is raised is a finding
            self._failed(number, path, traceback.format_exc().strip().replace("\n", " | ")[-400:])

    def _failed(self, number: int, path: Any, why: str) -> None:
        self.found.failures.append(f"codec {self.seed} {number} {path.parent.name}/{path.stem}: {why}")

    def _round(self, text: str, vendor: str) -> None:
        first = decode(text, vendor, name="m.json")
        self.found.codecs += 1
        if not first.ok:
            return
        self.found.valid += 1
        there = encode(first.text, "json", name="b.yaml", allow_errors=True)
        self.found.codecs += 1
        if not there.ok:
            faults = [d.message for d in there.findings if d.severity.name == "ERROR"]
            assert first.notes or faults, "what was decoded does not encode, and nothing says why"
            return
        again = decode(there.text, vendor, name="m.json")
        self.found.codecs += 1
        assert again.ok, f"what was encoded does not decode: {again.findings[:1]}"
        if again.text != first.text:  # a default that is written out
            back = encode(again.text, "json", name="c.yaml", allow_errors=True)
            assert back.ok and words_of(back.image) == words_of(there.image), "other words come back"  # noqa: PT018


def changed(listing: dict[str, Any], rng: random.Random) -> dict[str, Any]:
    """A copy with one to four values that are others, or entries that are gone."""
    words = [dict(word) for word in listing["words"]]
    valued = [word for word in words if "value" in word]
    for _ in range(rng.choice((1, 1, 2, 4))):
        word = rng.choice(valued)
        if rng.randrange(12) == 0:
            words[:] = [each for each in words if each is not word]
        else:
            word["value"] = other(word["value"], rng)
            word.pop("hex", None)
    return {**listing, "words": words}


def other(value: object, rng: random.Random) -> object:
    """Another content, mostly of the same type."""
    if isinstance(value, bool) or rng.randrange(40) == 0:
        return rng.choice((True, False))
    if isinstance(value, int):
        return rng.choice((*EDGES, rng.randrange(1 << 16), value ^ 1 << rng.randrange(16)))
    if isinstance(value, float):
        return rng.choice((*REALS, value * rng.uniform(-2, 2), rng.uniform(-1e4, 1e4)))
    return rng.choice(TEXTS)
