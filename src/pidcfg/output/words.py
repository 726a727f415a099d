"""A PLC's memory: the results of `pidcfg.encode` and `pidcfg.decode`."""

from __future__ import annotations

import json
from copy import deepcopy
from dataclasses import field, fields, replace
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.terms import Subject
from pidcfg.conversion.vendor_terms import changes_from
from pidcfg.encoders.contract import formats_of
from pidcfg.encoders.decoding import (
    annotate_listing,
    decode_listing,
    exact_text,
    join_listings,
    read_listing,
    refuse_large,
)
from pidcfg.encoders.listing import ListingError
from pidcfg.output.arguments import ArgumentError, vendor_options
from pidcfg.output.findings import errors_in, findings_data, short_repr
from pidcfg.text.diagnostics import Diagnostic, Severity, Span
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import SUFFIXES
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.validate.engine import check_document
from pidcfg.vendors import VENDORS, format_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from pidcfg.encoders.listing import FileKind, Listing
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Data
    from pidcfg.text.reader import Limits
    from pidcfg.validate.engine import Checked
    from pidcfg.validate.map_files import MapFile
    from pidcfg.vendors import Vendor

MODBUS = "modbus"
"""The format whose registers a user may state."""
File = tuple[bytes, str]
"""The bytes of a file, and its name."""


@frozen
class EncodeResult:
    """The memory of a configuration, and the files of one format."""

    __repr__ = short_repr

    document: Document
    findings: tuple[Diagnostic, ...]
    """Of the configuration, and of the file that the format adds to."""
    vendor: str | None = None
    image: Any = None
    """`pidcfg.encoders.image.Image`, of a vendor that names its parameters `pidcfg.encoders.parameters.Program`; None
    where errors are in the way."""
    kind: FileKind | None = None
    """The format: its name, its encoding in a file."""
    files: Mapping[str, str] = field(default_factory=dict)
    """The texts of the format by what is added to the file's name, mostly nothing: the key is then empty."""
    checklist: tuple[str, ...] = ()
    """What a person should check after the download."""
    merged: tuple[str, ...] = ()
    """What was done to a file of the user's, where lines that begin with ``conflict`` say what was left out; what is
    to be told of an image that is written in part."""

    def __reduce__(self) -> tuple[Callable[..., EncodeResult], tuple[object, ...]]:
        """The format goes by its name, since its reader and writer cannot be copied to another process."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return _restore, tuple({**values, "kind": None if self.kind is None else self.kind.name}.values())

    @property
    def ok(self) -> bool:
        """Whether there is a text; a part in which nothing differs may need none."""
        return bool(self.files) or (self.image is not None and not self.image.cells)

    @property
    def text(self) -> str:
        """The text of a format of one file; raises `ValueError` where there is none, or where there are several."""
        if len(self.files) != 1:
            raise ValueError(f"there are {len(self.files)} files; see `files` and `findings`")
        return next(iter(self.files.values()))

    def _repr_html_(self) -> str:
        """What notebooks show."""
        from pidcfg.output.notebook import words_html

        return words_html(self)

    def to_json(self) -> Data:
        """What ``pidcfg encode --format json`` prints: every word; where there is none, the errors."""
        if self.image is None or self.vendor is None:
            return findings_data(errors_in(self.findings))
        words: Data = json.loads(format_of(VENDORS[self.vendor], "json").write(self.image, self.checklist))
        return words


def _restore(document: Document, findings: tuple[Diagnostic, ...], vendor: str | None, *others: Any) -> EncodeResult:
    """A result of `encode` from what `EncodeResult.__reduce__` made of it."""
    image, name, *rest = others
    kind = None if vendor is None else formats_of(VENDORS[vendor]).FORMATS.get(name)
    return EncodeResult(document, findings, vendor, image, kind, *rest)


@frozen
class EncodeOptions:
    """How a configuration is written."""

    into: File | None = None
    """A file that the format adds to."""
    changed_from: File | None = None
    """A listing, or by the ending of its name a configuration: only words that differ from it are written."""
    live: bool = False
    """Whether words that the PLC or the process writes are so, too."""
    allow_errors: bool = False
    """Although the configuration has errors, if only every value has its word."""
    map: MapFile | None = None
    """A Modbus map that is stated, for the format ``modbus``."""


def encode_checked(checked: Checked, name: str, options: EncodeOptions) -> EncodeResult:
    """The memory of a checked configuration in a format."""
    vendor, encoding = checked.vendor, checked.encoding
    has_errors = bool(errors_in(checked.findings))
    if vendor is None or encoding is None or (has_errors and not (options.allow_errors and encoding.is_complete)):
        return EncodeResult(checked.document, checked.findings)
    if options.map is not None and name != MODBUS:
        raise ArgumentError(f"`map` is for the format {MODBUS}", "map")
    try:
        kind = modbus_of(checked, options.map) if name == MODBUS else format_of(vendor, name)
    except KeyError as error:
        raise ArgumentError(error.args[0], "format") from None
    result = EncodeResult(
        checked.document, checked.findings, vendor.key, encoding.image, kind, checklist=checked.checklist
    )
    if options.changed_from is None:
        if options.live:
            raise ArgumentError("`live` is for `changed_from` only", "live", "changed_from")
        return _with_texts(result, kind, options.into)
    return _keep_changed_words(result, kind, Subject(vendor, checked.config, encoding), options)


def modbus_of(checked: Checked, map_file: MapFile | None) -> FileKind:
    """The format ``modbus`` of a configuration, by its vendor's map or a stated one; raises `UnusableMapError`."""
    from pidcfg.encoders.listing import modbus_kind, named_modbus_kind
    from pidcfg.encoders.modbus_map import NamedNumbering
    from pidcfg.validate.map_files import numbering_of, space_of

    if checked.vendor is not None and map_file is None and MODBUS in (formats := formats_of(checked.vendor).FORMATS):
        kind: FileKind = formats[MODBUS]
        return kind
    if checked.vendor is None or checked.encoding is None:
        raise ValueError(f"{checked.document.file} has no memory")
    numbering = numbering_of(checked.vendor, map_file, checked.encoding.image, checked.document.file)
    if isinstance(numbering, NamedNumbering):
        return named_modbus_kind(numbering.cells)
    return modbus_kind(space_of(checked.vendor), numbering)


def _keep_changed_words(result: EncodeResult, kind: FileKind, subject: Subject, options: EncodeOptions) -> EncodeResult:
    """The result with what differs from a listing, or from what another configuration is encoded to."""
    if not kind.may_be_partial:
        formats = [other.name for other in formats_of(subject.vendor).FORMATS.values() if other.may_be_partial]
        reason = f"{kind.name} is not written in part (`changed_from`); {', '.join(formats)} are"
        raise ArgumentError(reason, "changed_from")
    if options.into is not None:
        raise ArgumentError("`into` and `changed_from` do not go together", "into", "changed_from")
    data, name = options.changed_from or (b"", "")
    is_configuration = PurePath(name).suffix.lower() in SUFFIXES
    if is_configuration:
        baseline = check_document(read_document(data, name, result.document.limits))
        if baseline.encoding is None or not baseline.encoding.is_complete:
            return replace(result, findings=(*result.findings, *errors_in(baseline.findings)[:1]))
        data = _words_of(baseline, subject.vendor)
    try:
        listing = read_listing(data, subject.vendor, result.document.limits)
    except ListingError as error:
        return replace(result, findings=(*result.findings, listing_fault(error, name)))
    image, notes = changes_from(subject, listing, live=options.live or is_configuration)
    return replace(_with_texts(replace(result, image=image), kind, None), merged=notes)


def _words_of(baseline: Checked, vendor: Vendor) -> bytes:
    """The listing of a configuration, which is one of this vendor."""
    if baseline.vendor is not vendor or baseline.encoding is None:
        title = "no vendor" if baseline.vendor is None else baseline.vendor.title
        raise ArgumentError(f"`changed_from` is a file of {title}, not of {vendor.title}", "changed_from")
    text: str = format_of(vendor, "json").write(baseline.encoding.image, ())
    return text.encode()


def _with_texts(result: EncodeResult, kind: FileKind, into: File | None) -> EncodeResult:
    """The result with the texts of its format, perhaps within a file of the user's."""
    if into is None:
        if kind.needs_into:
            raise ArgumentError(f"{kind.name} is written into a file of yours; name it with `into`", "into")
        text = kind.write(result.image, result.checklist)
        return replace(result, files={"": text} if isinstance(text, str) else text)
    if kind.merge is None:
        raise ArgumentError(f"{kind.name} is not written into another file", "into")
    data, name = into
    try:
        refuse_large(data, result.document.limits)
        text, report = kind.merge(result.image, exact_text(data, kind.encoding))
    except ListingError as error:
        return replace(result, findings=(*result.findings, listing_fault(error, name)))
    return replace(result, files={"": text}, merged=report)


def listing_fault(error: ListingError, name: str, cure: str | None = None) -> Diagnostic:
    """What is wrong with a memory listing, as a finding."""
    span = Span(error.line, error.column, error.line, error.column + 1)
    return Diagnostic("PID041", Severity.ERROR, str(error), name, span, help=cure)


@frozen
class DecodeResult:
    """The configuration of a memory listing, or the listing with a meaning beside every word."""

    __repr__ = short_repr

    findings: tuple[Diagnostic, ...] = ()
    data: Data | None = None
    """The configuration as plain data, in the order of its file; None: there is none, or meanings were asked for."""
    text: str = ""
    """The configuration as YAML, or the listing with its meanings."""
    notes: tuple[str, ...] = ()
    """What it cannot carry, and words that do not come back when it is encoded again."""
    warnings: tuple[str, ...] = ()
    """Those of the notes that name a word that is no value: the configuration has 0 in its place (D50)."""
    suggestion: str = ""
    """The listing as text with BCD in place of words that seem typed in decimal (D950); empty: none does."""

    @property
    def ok(self) -> bool:
        """Whether the listing could be read."""
        return not self.findings

    def to_json(self) -> Data:
        """The configuration that ``pidcfg decode`` prints as YAML; where there is none, the text or the errors."""
        if self.data is not None:
            return deepcopy(self.data)
        return {"version": 1, "text": self.text} if self.ok else findings_data(self.findings)


@frozen
class DecodeOptions:
    """How a listing is read."""

    format: str | None = None
    """Its format; None: it tells by itself."""
    like: Checked | None = None
    """A configuration that gives names, ranges and units where the listing does not."""
    annotate: bool = False
    """Give the listing with a meaning beside every word instead."""
    with_text: bool = True
    """Whether the configuration is wanted as text, too."""
    pou: str | None = None
    """The program that is wanted of a project with several."""


def decode_files(
    files: Sequence[tuple[bytes | Listing, str]],
    vendor: Vendor,
    choices: DecodeOptions,
    options: Mapping[str, object],
    limits: Limits,
) -> DecodeResult:
    """The configuration of a listing in one or more files; ``options``: the vendor's own."""
    image = None
    if choices.like is not None:
        image = _image_of(choices.like, vendor)
        if image is None:
            return DecodeResult(tuple(errors_in(choices.like.findings)))
    listings, faults = [], []
    for data, name in files:
        try:
            listings.append(read_listing(data, vendor, limits, choices.format, choices.pou))
        except ListingError as error:
            faults.append(listing_fault(error, name))
    if faults:
        return DecodeResult(tuple(faults))
    try:
        values = vendor_options(vendor, "decode_options", options)
        listing = join_listings(listings)
        if choices.annotate:
            text, notes = annotate_listing(listing, vendor, values)
            return DecodeResult(text=text, notes=notes)
        decoded = decode_listing(listing, vendor, values, image)
    except ListingError as error:
        leading_names = [name for listing, (_, name) in zip(listings, files, strict=True) if listing.is_leading]
        return DecodeResult((listing_fault(error, [*leading_names, files[-1][1]][0]),))
    text = yaml_text(decoded.data) if choices.with_text else ""
    return DecodeResult((), decoded.data, text, decoded.notes, decoded.warnings, decoded.suggestion)


def _image_of(like: Checked, vendor: Vendor) -> Any:
    """The image of a configuration that a listing is to be read like; None: it has errors that leave none."""
    if like.vendor is not None and like.vendor is not vendor:
        raise ArgumentError(f"`like` is a file of {like.vendor.title}, not of {vendor.title}", "like")
    return like.encoding.image if like.encoding is not None and like.encoding.is_complete else None
