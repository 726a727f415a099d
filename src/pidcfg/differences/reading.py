"""A listing read as far as it goes: what is refused of it is named, and hides nothing else.

A word that is no value, a pair of words that contradict each other, a setting beside the words that cannot be: each is
remembered with its reason, and what the other side of the comparison has stands in its place until the rest gives a
configuration. That configuration says only what the words mean; what is compared is what the listing itself holds.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.parameters import Program
from pidcfg.encoders.settings import RefusedError, read_settings
from pidcfg.encoders.words import DecodeError
from pidcfg.listings import like_options, name_in, nothing, with_names
from pidcfg.paths import dotted, has_key, put, steps, value_at

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.listing import Listing
    from pidcfg.paths import Path
    from pidcfg.vendors import Vendor

OWNERS = ("loops", "blocks")
SIGNALS = "signals"


@dataclass(frozen=True, slots=True)
class Reading:
    """A listing that is read as far as it goes: a word that is no value does not hide the others."""

    listing: Listing
    config: Any
    """The configuration; what is refused, or is not there, is that of the other side."""
    encoding: Any
    """Where the words of that configuration are, and what they mean."""
    unreadable: Mapping[Any, str]
    """Words that are no values, and why."""
    partial: bool = False
    """Whether words are missing, and those of the other image stand in their place."""
    notes: tuple[str, ...] = ()
    refused: Mapping[tuple[str, str], str] = field(default_factory=dict)
    """Settings beside the words that cannot be, by loop and key, and why."""
    fault: str = ""
    """Why the listing gives no configuration at all: it is then compared at the places of the other side."""


def reading_of(listing: Listing, vendor: Vendor, like: Any = None) -> Reading:
    """The loops of a listing; raises `ListingError` where nothing tells where they are.

    ``like``: a configuration and its encoding, which gives names, ranges and units, and what is missing or refused.
    """
    return _Reader(listing, vendor, like).read()


class _Reader:
    """A listing on its way to a reading."""

    def __init__(self, listing: Listing, vendor: Vendor, like: Any) -> None:
        self.listing, self.vendor, self.like = listing, vendor, like
        self.image: Any = None if like is None else like[1].image
        named = listing if self.image is None else with_names(listing, self.image)
        self.options = {} if self.image is None else like_options(listing, {})
        self.given: Mapping[Any, Any] = {} if self.image is None else self.image.words
        self.words, self.plc = dict(listing.words), deepcopy(dict(named.plc))
        self.settings = [deepcopy(dict(entry)) for entry in named.settings]
        self.unreadable: dict[Any, str] = {}
        self.refused: dict[tuple[str, str], str] = {}
        self.partial = False
        self.data: Mapping[str, Any] = {}

    def read(self) -> Reading:
        """The configuration of what is not refused; where that is none, the other side's."""
        while True:
            try:
                decoded = self.vendor.load("decode")(self.words, self.settings, self.plc, self.options)
                self.data = decoded.data
                config = read_settings(self.vendor.model, self.data, "the listing gives no configuration")
                return self._reading(config, self.vendor.encoder(config))
            except DecodeError as error:
                if isinstance(error, RefusedError) and self.like is not None:
                    is_cured = self._without_refused(error)
                else:
                    is_cured = self._without_word(error) or self._completed()
                if not is_cured and self.like is None:
                    raise ListingError(str(error), self.listing.lines.get(error.place, 1)) from None
                if not is_cured:
                    return self._reading(self.like[0], self.like[1], str(error))

    def _reading(self, config: Any, encoding: Any, fault: str = "") -> Reading:
        note = (f"compared word by word at the places of the other side: {fault}",) if fault else ()
        notes = (*self.listing.notes, *note)
        return Reading(self.listing, config, encoding, self.unreadable, self.partial, notes, self.refused, fault)

    def _without_word(self, error: DecodeError) -> bool:
        """Leaves out a word that is no value, at first by what the other side has, then altogether."""
        place = error.place
        if place not in self.listing.words or place not in self.words:
            return False
        if place not in self.unreadable:
            self.words[place] = self.given.get(place, nothing(self.words[place]))
        elif place not in self.given:
            del self.words[place]
        else:
            return False
        self.unreadable.setdefault(place, str(error))
        return True

    def _completed(self) -> bool:
        """Takes words that are missing from the other side."""
        if self.given.keys() <= self.words.keys():
            return False
        self.words, self.partial = {**self.given, **self.words}, True
        return True

    # --- what a schema refuses --------------------------------------------------------------------------------------

    def _without_refused(self, error: RefusedError) -> bool:
        """Takes what a schema refuses from the other side: a setting beside the words, or words of one section."""
        path = _named(error.path)
        if error.where == "plc":
            return self._settled(("", dotted(("plc", *path))), self.plc, self.image.plc, path, error)
        if error.where.startswith("settings["):
            i = int(error.where.removeprefix("settings[").removesuffix("]"))
            entry = self.settings[i]
            return self._settled((name_in(entry), dotted(path)), entry, self._other(entry, i), path, error)
        return self._without_section(error)

    def _other(self, entry: Mapping[str, Any], i: int) -> Mapping[str, Any]:
        """The settings of the other side for a loop: by its name, else by its place."""
        entries: Sequence[Mapping[str, Any]] = self.image.settings
        named = next((other for other in entries if name_in(other) == name_in(entry)), None)
        return named or (entries[i] if i < len(entries) else {})

    def _settled(
        self,
        key: tuple[str, str],
        entry: dict[str, Any],
        other: Mapping[str, Any],
        path: Path,
        error: RefusedError,
    ) -> bool:
        """Puts the other side's setting in place of a refused one; False: that was done already."""
        if key in self.refused or not path:
            return False
        self.refused[key] = str(error)
        if has_key(other, path):
            put(entry, path, deepcopy(value_at(other, path)))
        elif has_key(entry, path):
            del value_at(entry, path[:-1])[path[-1]]
        return True

    def _without_section(self, error: RefusedError) -> bool:
        """Takes the words and settings of a section that contradict each other from the other side."""
        name, path = self._owner(error.path)
        if not path:
            return False
        held = self.listing.words.keys() - self.unreadable.keys()
        places = [place for place in dict.fromkeys(self._places(name, path)) if place in held]
        for place in places:
            self.unreadable[place] = str(error)
            if place in self.given:
                self.words[place] = self.given[place]
            else:
                del self.words[place]
        i = next((i for i, entry in enumerate(self.settings) if name_in(entry) == name), None)
        if i is None or not has_key(self.settings[i], path):
            return bool(places)
        entry = self.settings[i]
        return self._settled((name, dotted(path)), entry, self._other(entry, i), path, error) or bool(places)

    def _owner(self, path: Path) -> tuple[str, Path]:
        """The loop or block that a place of the configuration is in, and the rest of the place."""
        top, *rest = path or ("",)
        if top == SIGNALS and rest:
            return "", (str(rest[0]),)
        if top not in OWNERS or not rest or not isinstance(rest[0], int):
            return "", ()
        item: Any = self.data[top][rest[0]]
        inner: list[str | int] = []
        for step in rest[1:]:  # a step that is no key of the data names the kind of a block
            if has_key(item, (step,)) or (isinstance(item, dict) and inner):
                inner.append(step)
                item = value_at(item, (step,))
        return str(value_at(self.data, (top, rest[0], "name"))), _named(inner)

    def _places(self, name: str, path: Path) -> Iterator[Any]:
        """The words of the listing that hold a section of a loop."""
        key = dotted(path)
        if isinstance(self.image, Program):
            whole = f"{name}.{key}" if name else key
            yield from (word for word in self.words if word == whole or word.startswith(f"{whole}."))
            return
        for block in self.like[1].blocks:
            if block.loop == name:
                inner = dotted(block.place[2:])
                for row in (*block.table.words, *block.table.bits):
                    own = ".".join(part for part in (inner, row.path) if part)
                    if row.path is not None and (own == key or own.startswith(f"{key}.")):
                        yield block.start + row.offset


def _named(path: Sequence[str | int]) -> Path:
    """A place up to its first list: a pair is one setting."""
    whole = steps(dotted(path))
    end = next((i for i, step in enumerate(whole) if isinstance(step, int)), len(whole))
    return whole[:end]
