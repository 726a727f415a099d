"""Two configurations compared: the result of `pidcfg.diff`, and its JSON."""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from collections import Counter
from dataclasses import replace
from pathlib import PurePath
from typing import TYPE_CHECKING, get_args

from pidcfg.conversion import ConvertError
from pidcfg.conversion.comparison import (
    Comparison,
    NeutralSide,
    compare_loops,
    fields_of,
    match_loops,
    neutral_fields,
    neutral_side,
)
from pidcfg.conversion.differences import RISKS, LoopComparison, Status, states_of
from pidcfg.conversion.terms import Subject
from pidcfg.conversion.vendor_terms import raw_terms, terms_of
from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.decoding import read_listing, reading_of
from pidcfg.encoders.listing import Listing, ListingError
from pidcfg.output.arguments import ArgumentError
from pidcfg.output.conversion import verified_data
from pidcfg.output.findings import errors_in, findings_data, short_repr
from pidcfg.output.words import listing_fault
from pidcfg.text.diagnostics import Diagnostic, Severity
from pidcfg.text.document import Document, Node
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import SUFFIXES, source_data
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document, check_source
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from pidcfg.conversion.differences import Difference, State
    from pidcfg.schemas.base import ConfigurationFile
    from pidcfg.study.verification.verify import VerifiedLoop
    from pidcfg.text.paths import Data
    from pidcfg.text.reader import Files, Limits
    from pidcfg.validate.engine import Checked, Source
    from pidcfg.vendors import Vendor

# --- Both sides of a comparison in the battery of `pidcfg.study.verification` -----------------------------------------


def with_verdict(result: DiffResult, progress: Callable[[float], None] | None, jobs: int = 1) -> DiffResult:
    """A comparison with both sides in the battery; its notes say which loops cannot be run, and why."""
    from pidcfg.study.verification.verify import verify_sides

    if result.sides is None or result.sources is None:
        reason = "not compared: nothing says the ranges of both sides, so neither can be run"
        return replace(result, verified=(), notes=(*result.notes, reason))
    notes: list[str] = []
    loops = verify_sides(result.sides, result.sources, (result.before, result.after), notes.append, progress, jobs)
    changed = {
        entry.loop: [d.key or d.field for d in entry.differences if d.risk != "cosmetic"] for entry in result.loops
    }
    loops = [
        replace(loop, hidden=(*loop.hidden, *(key for key in changed.get(loop.loop, ()) if key not in loop.hidden)))
        if loop.passed
        else loop
        for loop in loops
    ]
    return replace(result, verified=tuple(loops), notes=(*result.notes, *notes))


# ----------------------------------------------------------------------------------------------------------------------
# The two sides of a comparison: configurations, and listings that are read when it is known what they are like.

Entry = tuple[bytes | Listing, str]
"""A memory listing, read or as the bytes of its file, and its name."""


OPTION_SIGN = "--"
"""What stands in the message of a listing that an option of `decode` would complete."""
LIKE_CURE = "name a configuration to read it like (--like FILE)"


@frozen
class DiffOptions:
    """How two sides are compared: the family of listings, what they are read like, whether live words count."""

    vendor: Vendor | None = None
    like: Checked | None = None
    live: bool = False


class SideError(Exception):
    """A side that cannot be compared."""

    def __init__(self, name: str, findings: Sequence[Diagnostic], document: Document | None = None) -> None:
        super().__init__(name)
        self.name, self.findings = name, tuple(findings)
        self.document = document or Document(name, "", None, Node(None))


def subjects_of(
    sides: tuple[Checked | Entry, Checked | Entry], names: tuple[str, str], options: DiffOptions, limits: Limits
) -> tuple[Subject, Subject]:
    """Both sides; listings are read when it is known what they are like."""
    subjects: list[Subject | None] = [
        None if isinstance(side, tuple) else _subject_of(side, name) for side, name in zip(sides, names, strict=True)
    ]
    like = None if options.like is None else _subject_of(options.like, options.like.document.file)
    like = like or next((subject for subject in subjects if subject is not None), None)
    vendor = options.vendor or (_vendor_in_listings(sides) if like is None else like.vendor)
    if options.like is not None and like is not None and like.vendor is not vendor:
        raise ArgumentError(f"`like` is a file of {like.vendor.title}, not of `vendor`", "like", "vendor")
    for i in _reading_order(sides, vendor, like, limits):
        side = sides[i]
        if isinstance(side, tuple):
            subjects[i] = _listing_subject(side, vendor, like, limits)
            like = like or subjects[i]
    one, two = subjects
    if one is None or two is None:
        raise AssertionError("both sides are read")
    return one, two


VENDOR_IN_LISTING = re.compile(
    rb'''# (\w+) (?:memory listing|parameters):|\{\s*"version"\s*:\s*1\s*,\s*"vendor"\s*:\s*"(\w+)"'''
)
"""How a listing that `encode` writes as text or as JSON says whose it is."""


def _vendor_in_listings(sides: Iterable[Checked | Entry]) -> Vendor | None:
    """The PLC family that listings name at their beginning; None where none does, or two do."""
    texts = [side[0] for side in sides if isinstance(side, tuple) and isinstance(side[0], bytes)]
    matches = [VENDOR_IN_LISTING.match(text.removeprefix(BOM_UTF8)) for text in texts]
    keys = {(match[1] or match[2]).decode() for match in matches if match is not None}
    return VENDORS.get(keys.pop()) if len(keys) == 1 else None


def _reading_order(
    sides: tuple[Checked | Entry, Checked | Entry], vendor: Vendor | None, like: Subject | None, limits: Limits
) -> list[int]:
    """Which side is read first: of two listings the one that says names, and gives a configuration by itself."""
    order = sorted((0, 1), key=lambda i: _has_loop_names(sides[i], vendor, limits), reverse=True)
    first = sides[order[0]]
    if like is None and isinstance(first, tuple):
        try:
            _listing_subject(first, vendor, None, limits)
        except SideError:
            order.reverse()
    return order


def _has_loop_names(side: Checked | Entry, vendor: Vendor | None, limits: Limits) -> bool:
    """Whether a listing says names of loops, so that it is read before one that does not."""
    try:
        return isinstance(side, tuple) and vendor is not None and bool(read_listing(side[0], vendor, limits).settings)
    except ListingError:
        return False


def _subject_of(checked: Checked, name: str) -> Subject:
    """A configuration whose values all have their words."""
    if checked.vendor is None or checked.encoding is None or not checked.encoding.is_complete:
        raise SideError(name, checked.findings, checked.document)
    return Subject(checked.vendor, checked.config, checked.encoding)


def _listing_subject(entry: Entry, vendor: Vendor | None, like: Subject | None, limits: Limits) -> Subject:
    """A listing as far as it can be read."""
    if vendor is None:
        raise ArgumentError("neither file says the PLC family; name it with `vendor`", "vendor")
    data, name = entry
    config_like = (like.config, like.encoding) if like is not None and like.vendor is vendor else None
    cure = None
    try:
        listing = read_listing(data, vendor, limits)
        cure = f"{LIKE_CURE}, or decode it with what it lacks: pidcfg decode {name} --vendor {vendor.key} --help"
        reading = reading_of(listing, vendor, config_like)
    except ListingError as error:
        raise SideError(
            name, [listing_fault(error, name, cure if OPTION_SIGN in str(error) else cure and LIKE_CURE)]
        ) from None
    return Subject(vendor, reading.config, reading.encoding, reading)


# --- Two configurations compared: the result of `pidcfg.diff`, and its JSON -------------------------------------------

Configuration = tuple["ConfigurationFile", "Vendor"]
"""A typed configuration and its vendor."""


@frozen
class DiffResult:
    """What differs between two configurations, loop by loop, ranked by what can go wrong."""

    __repr__ = short_repr

    before: str
    after: str
    """Names of both sides."""
    findings: tuple[Diagnostic, ...] = ()
    """What keeps a side from being compared; empty: both were."""
    document: Document | None = None
    refused: str = ""
    """The side that the findings are of, and its name."""
    loops: tuple[LoopComparison, ...] = ()
    sources: tuple[Configuration, Configuration] | None = None
    """Configuration and vendor of both sides."""
    verified: tuple[VerifiedLoop, ...] | None = None
    """Loop by loop the verdict of the battery on both sides; None: that was not asked for."""
    notes: tuple[str, ...] = ()
    """What a listing did not say, or could not be read of it."""

    @property
    def ok(self) -> bool:
        """Whether both sides could be compared; they may differ."""
        return not self.refused

    @property
    def same(self) -> bool:
        """Whether nothing differs; what the operator sets is no difference."""
        return self.ok and all(loop.same for loop in self.loops)

    @property
    def sides(self) -> tuple[NeutralSide, NeutralSide] | None:
        """Both sides in the neutral form, as far as they have one; None: words of one cannot be read back."""
        if self.sources is None:
            return None
        try:
            one, two = (neutral_side(*source, partial=True) for source in self.sources)
        except DecodeError:
            return None
        return one, two

    @property
    def alike(self) -> bool:
        """Whether all loops are on both sides and behave alike there, as far as the battery was asked."""
        loops, names = self.verified, [entry.loop for entry in self.loops if entry.loop]
        return loops is None or (len(loops) == len(names) > 0 and all(loop.passed for loop in loops))

    @property
    def summary(self) -> dict[str, int]:
        """How many differences there are of each risk, and loops of each status."""
        count = Counter(difference.risk for loop in self.loops for difference in loop.differences)
        statuses = Counter(loop.status for loop in self.loops)
        return {risk: count[risk] for risk in RISKS} | {status: statuses[status] for status in get_args(Status)}

    def _repr_html_(self) -> str:
        """What notebooks show."""
        from pidcfg.output.notebook import differences_html

        return differences_html(self)

    def to_json(self) -> Data:
        """What ``pidcfg diff --format json`` prints: the differences, or the errors of the side that is in the way."""
        if not self.ok:
            return findings_data(errors_in(self.findings))
        loops = [
            {
                "loop": loop.loop,
                "status": loop.status,
                "was": loop.was or None,
                "moved": None if loop.moved is None else {"from": loop.moved[0], "to": loop.moved[1]},
                "differences": [_difference_data(d) for d in loop.differences],
                "operated": [_difference_data(d) for d in loop.operated],
                "left_out": list(loop.left_out),
                "missing": list(loop.missing),
                "states": [_state_data(state) for state in loop.states],
            }
            for loop in self.loops
        ]
        document: Data = {
            "version": 1,
            "from": self.before,
            "to": self.after,
            "loops": loops,
            "summary": self.summary,
            "notes": list(self.notes),
        }
        if self.verified is not None:
            document["verify"] = [verified_data(loop) for loop in self.verified]
        return document


def _difference_data(d: Difference) -> Data:
    return {
        "field": d.field,
        "key": d.key or None,
        "risk": d.risk,
        "from": d.before,
        "to": d.after,
        "unit": d.unit,
        "address": d.address or None,
        "word_from": d.word_before,
        "word_to": d.word_after,
        "note": d.note,
    }


def _state_data(state: State) -> Data:
    return {
        "kind": state.kind,
        "text": state.text,
        "key": state.key,
        "address": state.address,
        "word": state.word,
        "side": state.side or None,
    }


WORD_BY_WORD_NOTE = (
    "nothing tells where the loops are, so that words are compared by their addresses; name a configuration to read "
    "the listings like"
)


def is_listing(name: str) -> bool:
    """Whether a text of this name is a memory listing; a text without a file's name is a configuration."""
    return not name.startswith("<") and PurePath(name).suffix.lower() not in SUFFIXES


def side_of(source: Source, name: str | None, files: Files, limits: Limits) -> tuple[Checked | tuple[bytes, str], str]:
    """A side of a comparison, a checked configuration or the bytes and name of a listing; and what it is called."""
    if isinstance(source, Document):
        return check_source(source, name, files, limits), name or source.file
    data, label = source_data(source, name, files, limits.listing_bytes + 1)
    if is_listing(label):
        return (data, label), label
    return check_document(read_document(data, label, limits)), label


def compare_sides(
    sides: tuple[Checked | Entry, Checked | Entry],
    names: tuple[str, str],
    options: DiffOptions,
    limits: Limits,
) -> DiffResult:
    """The comparison of two checked configurations or listings.

    A listing is of the vendor that is named, or of the other side's. Names, ranges and units that it does not carry are
    those of the configuration that it is to be read like, else of the other side.
    """
    try:
        subjects = subjects_of(sides, names, options, limits)
        (one, two), sources = subjects, tuple((subject.config, subject.vendor) for subject in subjects)
        if one.vendor is two.vendor:
            loops = _compare_within_vendor(one, two, live=options.live)
        else:
            loops = compare_loops(*(_neutral_side(name, *source) for name, source in zip(names, sources, strict=True)))
    except SideError as error:
        return _compare_word_by_word(sides, names, options, limits) or DiffResult(
            *names, error.findings, error.document, error.name
        )
    loops = list(_with_states(loops, subjects, names))
    notes = tuple(
        f"{name}: {note}"
        for name, subject in zip(names, subjects, strict=True)
        for note in (subject.reading.notes if subject.reading else ())
    )
    return DiffResult(*names, loops=tuple(loops), sources=(sources[0], sources[1]), notes=notes)


def _with_states(
    rows: Sequence[LoopComparison], subjects: tuple[Subject, Subject], names: tuple[str, str]
) -> Iterator[LoopComparison]:
    """The comparison, with what the listings say of loops that do not run as they are set up."""
    before, after = ([loop.name for loop in subject.config.loops] for subject in subjects)
    partners = {row.was: row.loop for row in rows if row.was}
    if subjects[0].vendor is not subjects[1].vendor:
        partners = {before[i]: after[j] for i, j in match_loops(before, after) if i is not None and j is not None}
    states: dict[str, list[State]] = {}
    both_listings = all(subject.reading for subject in subjects)
    for i, (subject, other) in enumerate((subjects, reversed(subjects))):
        for owner, state in states_of(subject, other):
            for name in [owner] if owner else (before, after)[i]:
                row = name if i else partners.get(name, name)
                states.setdefault(row, []).append(replace(state, side=names[i] if both_listings else ""))
    unchanged = [LoopComparison(name, "same") for name in states if name not in {row.loop for row in rows}]
    yield from (row.with_states(tuple(states.get(row.loop, ()))) for row in (*rows, *unchanged))


def _compare_word_by_word(
    sides: tuple[Checked | Entry, Checked | Entry], names: tuple[str, str], options: DiffOptions, limits: Limits
) -> DiffResult | None:
    """Two listings of which nothing tells where their loops are; None: they are not, or cannot be read at all."""
    entries = [side for side in sides if isinstance(side, tuple)]
    if len(entries) < len(sides) or options.vendor is None or options.like is not None:
        return None
    try:
        one, two = (raw_terms(read_listing(data, options.vendor, limits), options.vendor) for data, _ in entries)
    except ListingError:
        return None
    rows = Comparison(one, two, lambda *_: (), with_live=True).rows()
    return DiffResult(*names, loops=tuple(rows), notes=(WORD_BY_WORD_NOTE,))


def _compare_within_vendor(first: Subject, second: Subject, *, live: bool) -> list[LoopComparison]:
    """The comparison within a vendor."""
    before, after = (terms_of(subject) for subject in (first, second))
    fields = [fields_of(subject.vendor, subject.config, subject.encoding) for subject in (first, second)]

    def neutral_names(loop: str, key: str) -> list[str]:
        return [name for side in fields for name in neutral_fields(side, loop, key)]

    return Comparison(before, after, neutral_names, with_live=live).rows()


def _neutral_side(name: str, config: ConfigurationFile, vendor: Vendor) -> NeutralSide:
    try:
        return neutral_side(config, vendor)
    except DecodeError as error:
        cure = "correct what `pidcfg validate` says of it"
        message = f"its words cannot be read back: {error}"
        raise SideError(name, [Diagnostic("PID041", Severity.ERROR, message, name, help=cure)]) from None
    except ConvertError as error:
        rows = [Diagnostic("PID042", Severity.ERROR, row.message, name, path=row.path) for row in error.missing]
        raise SideError(name, rows) from None
