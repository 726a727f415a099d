"""What a PLC holds, as a configuration or a listing, and a configuration against it: `pidcfg.pull`, `pidcfg.compare`.

As with the other calls, results are frozen and nothing is printed. A PLC that cannot be reached, or does not give what
is asked for, is a `PlcError`, which is a `ConnectionError` of one line with host, function and register.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from pathlib import Path
from typing import Any

from pidcfg.conversion import text_of
from pidcfg.conversion.differences import Difference, LoopComparison
from pidcfg.conversion.terms import CONFIGURATION_KEY
from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.contract import encoder_of, formats_of, tables_of
from pidcfg.encoders.image import read_settings
from pidcfg.encoders.listing import Numbering, shorten_names
from pidcfg.encoders.modbus_map import NamedNumbering, StatedNumbering, place_text
from pidcfg.encoders.parameters import AnyImage
from pidcfg.live.link import Address, AddressError, Link, RetryPolicy, parse_address, run_async
from pidcfg.live.reading import NamedRegisters, Registers, implausible_contents
from pidcfg.output.arguments import ArgumentError, check_arguments, refuse_unknown, vendor_named, vendor_options
from pidcfg.output.differences import DiffOptions, DiffResult, compare_sides
from pidcfg.output.findings import errors_in, findings_data, short_repr
from pidcfg.output.words import DecodeOptions, decode_files
from pidcfg.schemas.iec import Wire
from pidcfg.text.diagnostics import Diagnostic, Severity, sort_findings
from pidcfg.text.document import Document
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Data, parse_path, value_at
from pidcfg.text.paths import Path as KeyPath
from pidcfg.text.reader import DEFAULT, Files, Limits
from pidcfg.validate.engine import Checked, Source, check_source
from pidcfg.validate.map_files import MapFile, map_of_source, numbering_of
from pidcfg.vendors import VENDORS, Vendor, format_of

# --- What a PLC holds, as a configuration or a memory listing: the result of `pidcfg.pull` ----------------------------

NO_REGISTER_REASON = "no register has them"
"""Why settings are not read that stand in the program, in a dialog or a project."""
PLC_PREFIX = "plc."
"""How keys of the whole PLC begin."""
YAML_FORMAT = "yaml"
"""The format of a configuration; all others are listings."""


@frozen
class Plc:
    """A PLC, and everything that is needed to read it."""

    address: Address
    vendor: Vendor
    numbering: Numbering | NamedNumbering | None
    """None: the configuration has no memory, so that nothing is read."""
    like: Checked | None = None
    """A configuration that gives names, ranges, units and places."""
    option_texts: Mapping[str, object] = field(default_factory=dict)
    """Options of the vendor's decoder as texts."""

    @property
    def image(self) -> AnyImage | None:
        """The memory of that configuration; None where there is none, or it cannot be encoded."""
        encoding = None if self.like is None else self.like.encoding
        return encoding.image if encoding is not None and encoding.is_complete else None

    @property
    def registers(self) -> Registers:
        """Where to read."""
        if self.numbering is None:
            raise ValueError("the configuration has no memory")
        if isinstance(self.numbering, NamedNumbering):
            return NamedRegisters(self.vendor, self.numbering, self.image)
        options = vendor_options(self.vendor, "decode_options", self.option_texts)
        like: Any = self.image
        return Registers(self.vendor, self.numbering, like, options)

    def map_place(self, address: str) -> str:
        """Where a stated map has an address or a parameter; empty without such a map, or where it has none."""
        with suppress(LookupError):
            if isinstance(self.numbering, StatedNumbering):
                number = self.numbering.space.parse(address)
                return "" if number is None else place_text(self.numbering.place(number))
            if isinstance(self.numbering, NamedNumbering):
                points = self.numbering.points.values()
                name = next((point.name for point in points if address in {point.name, point.device}), "")
                return place_text(self.numbering.place(name))
        return ""

    @property
    def unread_settings(self) -> Mapping[str, tuple[str, ...]]:
        """Settings that are in no register, by name, under the reason."""
        numbering = self.numbering if isinstance(self.numbering, NamedNumbering) else None
        reasons = {
            "the map says that no register has them": () if numbering is None else numbering.unmapped,
            "they are numbers of the program, without a device": () if numbering is None else numbering.literals,
        }
        listed = {name for names in reasons.values() for name in names}
        reasons[NO_REGISTER_REASON] = tuple(name for name in self._settings_without_register() if name not in listed)
        return {why: names for why, names in reasons.items() if names}

    def _settings_without_register(self) -> Iterator[str]:
        """Settings of the configuration that act on its loops and stand in the program, in a dialog or a project."""
        config = None if self.like is None else self.like.config
        if config is None:
            return
        for key in tables_of(self.vendor).NO_REGISTER:
            if key.startswith(PLC_PREFIX):
                yield from [key] if value_at(config, parse_path(key)) is not None else ()
            else:
                yield from (
                    f"{loop.name}.{key}" for loop in config.loops if value_at(loop, parse_path(key)) is not None
                )
        for item in (*config.loops, *getattr(config, "blocks", ())):
            yield from (f"{item.name}.{key}" for key, value in item if isinstance(value, Wire))

    @property
    def unread_notes(self) -> tuple[str, ...]:
        """Settings that a map leaves out, as notes."""
        reasons = ((why, names) for why, names in self.unread_settings.items() if why != NO_REGISTER_REASON)
        return tuple(f"not read, since {why}: {shorten_names([*names])}" for why, names in reasons)


def plc_of(
    plc: str,
    like_vendor_map: tuple[Source | None, str | None, Path | str | bytes | None],
    options: Mapping[str, object] | None,
    files: Files,
    limits: Limits,
) -> Plc:
    """The PLC that `pull` and `trend` read; ``like_vendor_map``: a configuration like it, its vendor, its map."""
    like, vendor, map_source = like_vendor_map
    like_config = None if like is None else check_source(like, None, files, limits)
    if like_config is None and vendor is None:
        raise ArgumentError("name a configuration (`like`) or the PLC family (`vendor`)", "like", "vendor")
    family = None if vendor is None else vendor_named(vendor)
    document = None if like_config is None else like_config.document
    return source_of(plc, like_config, family, options or {}, map_of_source(map_source, document, files, limits))


def source_of(
    plc: str,
    like: Checked | None,
    vendor: Vendor | None,
    options: Mapping[str, object],
    map_file: MapFile | None = None,
) -> Plc:
    """The PLC at a URL and what is known about it; raises `ArgumentError`, `UnusableMapError`."""
    family = vendor or (None if like is None else like.vendor)
    if like is not None and like.vendor is not None and family is not like.vendor:
        raise ArgumentError(f"`like` is a file of {like.vendor.title}, not of `vendor`", "like", "vendor")
    family = family or VENDORS["dl06"]  # a file that names no vendor has findings, and nothing is read
    encoding = None if like is None else like.encoding
    image = encoding.image if encoding is not None and encoding.is_complete else None
    if like is not None and image is None:
        return Plc(address_of(plc), family, None, like, options)  # its findings say why; nothing is read
    file = "FILE" if like is None else like.document.file
    return Plc(address_of(plc), family, numbering_of(family, map_file, image, file), like, options)


def address_of(plc: str) -> Address:
    """The address that a URL says; raises `ArgumentError`."""
    try:
        return parse_address(plc)
    except AddressError as error:
        raise ArgumentError(f"`plc`: {error}", "plc") from None


def retry_policy(timeout: float, retries: int) -> RetryPolicy:
    """How long and how often; raises `ArgumentError`."""
    if not 0 < timeout <= 3600:
        raise ArgumentError(f"`timeout` is {timeout:g}; write seconds above 0 and up to 3600", "timeout")
    if not 0 <= retries <= 100:
        raise ArgumentError(f"`retries` is {retries}; write a whole number from 0 to 100", "retries")
    return RetryPolicy(timeout, retries)


@frozen
class PullResult:
    """What a PLC holds: its words, and the text of a configuration or a listing."""

    __repr__ = short_repr

    plc: str
    """The PLC, as ``10.0.0.5:502``."""
    vendor: str
    findings: tuple[Diagnostic, ...] = ()
    """What is wrong with the configuration that it was to be read like, or with the words; empty: there is a text."""
    image: AnyImage | None = None
    """Every word that was read; None: nothing was."""
    data: Data | None = None
    """The configuration as plain data; None: a listing was asked for."""
    text: str = ""
    notes: tuple[str, ...] = ()
    """What a configuration cannot carry, and contents that seem to be none."""
    warnings: tuple[str, ...] = ()
    """Those of the notes that name a word that is no value: the configuration has 0 in its place (D50)."""

    @property
    def ok(self) -> bool:
        """Whether there is a text."""
        return not self.findings

    def to_json(self) -> Data:
        """The configuration as data, or the words; where there is neither, the findings."""
        if not self.ok:
            return findings_data(errors_in(self.findings))
        if self.data is not None:
            return dict(self.data)
        words = [] if self.image is None else [cell.data() for cell in self.image.cells]
        return {"version": 1, "vendor": self.vendor, "plc": self.plc, "words": words}


def pull_from(source: Plc, format_name: str, policy: RetryPolicy, limits: Limits) -> PullResult:
    """Reads a PLC and writes what it holds in a format; raises `PlcError` where it cannot be read."""
    if format_name != YAML_FORMAT:
        kinds = [kind.name for kind in formats_of(source.vendor).FORMATS.values() if kind.is_complete]
        refuse_unknown("format", format_name, [YAML_FORMAT, *kinds])
    result = PullResult(str(source.address), source.vendor.key)
    if source.like is not None and source.image is None:
        return replace(result, findings=tuple(errors_in(source.like.findings)))
    image = read_plc(source, policy)
    result = replace(result, image=image, notes=tuple(implausible_contents(image)))
    configuration = decode_files(
        [(source.registers.listing(image), str(source.address))],
        source.vendor,
        DecodeOptions(like=source.like, with_text=format_name == YAML_FORMAT),
        source.option_texts,
        limits,
    )
    if format_name == YAML_FORMAT:
        return replace(
            result,
            findings=configuration.findings,
            data=configuration.data,
            text=configuration.text,
            notes=(*source.unread_notes, *result.notes, *_mode_note(source), *configuration.notes),
            warnings=configuration.warnings,
        )
    return _pull_listing(result, image, source, format_name, configuration.data)


def _mode_note(source: Plc) -> tuple[str, ...]:
    """A note where nothing that is confirmed tells in which mode the loops are."""
    if source.like is not None or getattr(source.vendor.module("encode"), "MODE_IS_CONFIRMED", True):
        return ()
    cause = "no register that is confirmed tells it; write the mode the loop is meant to run in"
    return (f"mode is manual, as after each start: {cause}",)


def read_plc(source: Plc, policy: RetryPolicy) -> AnyImage:
    """What a PLC holds; raises `PlcError`."""

    async def read_image() -> AnyImage:
        async with Link(source.address, policy) as link:
            return await source.registers.read_image(link)

    return run_async(read_image())


def _pull_listing(result: PullResult, image: AnyImage, source: Plc, format_name: str, data: Data | None) -> PullResult:
    """A listing, with what no register holds beside it as far as that is known."""
    reference = source.image
    with suppress(DecodeError):  # words that give no configuration make a listing all the same
        if data is not None:
            reference = encoder_of(source.vendor).encode(read_settings(source.vendor.model, data, "")).image
    complete_image = image if reference is None else replace(image, settings=reference.settings, plc=reference.plc)
    odd_cell = next((cell for cell in complete_image.cells if cell.no_number_hex), None)
    if format_name == "json" and odd_cell is not None:
        raise ArgumentError(
            f"`format` json has no word for what {odd_cell.address} holds, {odd_cell.no_number_hex}; csv has", "format"
        )
    return replace(result, image=complete_image, text=format_of(source.vendor, format_name).write(complete_image, ()))


@check_arguments
def pull(
    plc: str,
    *,
    like: Source | None = None,
    vendor: str | None = None,
    format: str = "yaml",
    options: Mapping[str, object] | None = None,
    map: Path | str | bytes | None = None,
    timeout: float = 2.0,
    retries: int = 2,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> PullResult:
    """Reads the loops of the PLC at a URL: a configuration, or with another ``format`` a memory listing.

    ``like``: a configuration that gives names, ranges, units and places; without it ``vendor`` and, where the PLC does
    not tell where its loops are, the vendor's ``options`` of ``pidcfg decode``. ``timeout`` in s; ``retries``: how
    often a request without an answer is sent again. Raises `PlcError`, and `ValueError` for a URL that is none.
    """
    source = plc_of(plc, (like, vendor, map), options, files, limits)
    return pull_from(source, format, retry_policy(timeout, retries), limits)


# --- A configuration against the PLC that it is for: the result of `pidcfg.compare` -----------------------------------

DIFF_CODE = "PID065"
"""A setting in which the PLC differs from its file."""
UNREACHED_CODE = "PID066"
"""A PLC that is not reached, or does not give what is asked for."""
UNREAD_CODE = "PID069"
"""Settings that no register has."""
UNREAD_CURE = "look at them in the vendor's software; --strict ends with 1 for them"
DIFF_CURE = "look who changed it: correct the file, or write its value into the PLC"

TROUBLE_CURE = "look what the PLC reports, `pidcfg explain` says what it means"


@frozen
class CompareResult:
    """What differs between a configuration and the PLC."""

    __repr__ = short_repr

    plc: str
    """The PLC, as ``10.0.0.5:502``."""
    document: Document
    findings: tuple[Diagnostic, ...]
    """A finding for each setting that differs; of a file that cannot be compared, what is wrong with it."""
    diff: DiffResult | None = None
    """The comparison loop by loop, file first; None: the file cannot be compared."""
    notes: tuple[str, ...] = ()
    """What is told and is no difference: set points that the operator has changed, words that are no values."""
    unread: tuple[str, ...] = ()
    """Settings that were not compared, since no register has them, by name."""
    warnings: tuple[Diagnostic, ...] = ()
    """The same as findings, one a loop and reason."""

    @property
    def ok(self) -> bool:
        """Whether the file could be compared; the PLC may differ from it."""
        return self.diff is not None and self.diff.ok

    @property
    def same(self) -> bool:
        """Whether no setting differs of those that were read."""
        return self.ok and not self.findings

    def to_json(self) -> Data:
        """What ``pidcfg compare --format json`` prints."""
        return findings_data([*self.findings, *self.warnings] if self.ok else errors_in(self.findings))


def compare_with(checked: Checked, source: Plc, image: AnyImage) -> CompareResult:
    """The comparison of a checked configuration with what was read of the PLC."""
    plc, document = str(source.address), checked.document
    diff = compare_sides(
        (checked, (source.registers.listing(image), plc)),
        (document.file, plc),
        DiffOptions(source.vendor),
        document.limits,
    )
    if not diff.ok:
        return CompareResult(plc, document, diff.findings, diff)
    findings = [finding for loop in diff.loops for finding in _loop_findings(loop, document, source.map_place)]
    notes = (*implausible_contents(image), *_operator_notes(diff))
    unread = tuple(name for names in source.unread_settings.values() for name in names)
    warnings = tuple(sort_findings([*_unread_warnings(document, source.unread_settings)]))
    return CompareResult(plc, document, tuple(sort_findings(findings)), diff, notes, unread, warnings)


def _unread_warnings(document: Document, reasons: Mapping[str, Sequence[str]]) -> Iterator[Diagnostic]:
    """What was not compared, loop by loop; what concerns all of them first."""
    loops = _loop_names(document)
    for why, names in reasons.items():
        remaining = list(names)
        for i, loop in enumerate(loops):
            loop_settings = [name for name in remaining if name.startswith(f"{loop}.")]
            remaining = [name for name in remaining if name not in loop_settings]
            if loop_settings:
                keys = [name.removeprefix(f"{loop}.") for name in loop_settings]
                yield _unread_finding(document, ("loops", i), keys, why, loop)
        if remaining:
            yield _unread_finding(document, (), remaining, why, "")


def _unread_finding(document: Document, path: KeyPath, names: Sequence[str], why: str, loop: str) -> Diagnostic:
    message = f"could not be read, since {why}: {', '.join(names)}"
    return Diagnostic(
        UNREAD_CODE, Severity.WARNING, message, document.file, document.locate(path), path, loop, help=UNREAD_CURE
    )


def _loop_findings(loop: LoopComparison, document: Document, register: Callable[[str], str]) -> Iterator[Diagnostic]:
    index = next((i for i, name in enumerate(_loop_names(document)) if name in {loop.loop, loop.was}), None)
    loop_path: KeyPath = ("loops",) if index is None else ("loops", index)
    if loop.status in {"added", "removed"}:
        message = (
            "the PLC does not have this loop" if loop.status == "removed" else f"the PLC has one more loop, {loop.loop}"
        )
        yield _finding(document, loop_path, message, loop.loop)
    elif loop.moved is not None:
        message = f"the PLC has the loop at {loop.moved[1]}, the file at {loop.moved[0]}"
        yield _finding(document, loop_path, message, loop.loop)
    for state in loop.states:
        message = f"the loop does not run as it is set up: {state.text} ({state.address} {state.word})"
        yield replace(_finding(document, loop_path, message, loop.loop, state.key), help=TROUBLE_CURE)
    for d in loop.differences:
        if d.key == CONFIGURATION_KEY:
            yield _finding(document, (), f"the PLC's words make no configuration{_note_text(d)}", "")
            continue
        path, message = parse_path(d.key or d.field), _difference_text(d, register(d.address or ""))
        if index is None:
            yield _finding(document, path, message, "", d.key)
        else:
            yield _finding(document, (*loop_path, *path), message, loop.loop, d.key)


def _note_text(d: Difference) -> str:
    return f": {d.note.removeprefix('no value: ')}" if d.note else ""


def _loop_names(document: Document) -> list[str]:
    loops = (document.data or {}).get("loops") or []
    return [str(loop.get("name")) for loop in loops if isinstance(loop, dict)]


def _finding(document: Document, path: KeyPath, message: str, loop: str, key: str = "") -> Diagnostic:
    span = document.locate(path)
    return Diagnostic(DIFF_CODE, Severity.ERROR, message, document.file, span, path, loop, help=DIFF_CURE, key=key)


def _difference_text(d: Difference, register: str) -> str:
    """Both values with their unit, and the register with both contents; by a stated map with its number."""
    unit = f" {d.unit}" if d.unit else ""
    plc_word = f" ({d.address} {d.word_after or '-'}{register and f' at {register}'})" if d.address else ""
    file_word = f" ({d.word_before})" if d.address and d.word_before else ""
    note = f"; {d.note}" if d.note else ""
    values = (
        f"the PLC holds {_value_text(d.after, unit)}{plc_word}, the file says {_value_text(d.before, unit)}{file_word}"
    )
    return f"{d.key or d.field}: {values}{note}"


def _value_text(value: object, unit: str) -> str:
    """A value with its unit; none where the content says that there is none, or is no value, as the note says then."""
    if value is None:
        return "none"
    return f"[{', '.join(map(text_of, value))}]{unit}" if isinstance(value, list) else f"{text_of(value)}{unit}"


def _operator_notes(diff: DiffResult) -> Iterator[str]:
    yield from diff.notes
    for loop in diff.loops:
        for d in loop.operated:
            unit = f" {d.unit}" if d.unit else ""
            word = f" ({d.address} {d.word_after})" if d.address else ""
            values = f"{d.key} is {text_of(d.after)}{unit}{word}, in the file {text_of(d.before)}"
            yield f"{loop.loop}: operated, and no difference: {values}"


def read_and_compare(checked: Checked, source: Plc, policy: RetryPolicy) -> CompareResult:
    """Reads the PLC and compares; a file that has no memory is not compared, and nothing is read."""
    if source.image is None:
        return CompareResult(str(source.address), checked.document, tuple(errors_in(checked.findings)))
    return compare_with(checked, source, read_plc(source, policy))


def unreached_finding(file: str, message: str) -> Diagnostic:
    """A file that could not be compared, as reports have it."""
    return Diagnostic(UNREACHED_CODE, Severity.ERROR, message, file)


@check_arguments
def compare(
    source: Source,
    plc: str,
    *,
    map: Path | str | bytes | None = None,
    timeout: float = 2.0,
    retries: int = 2,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> CompareResult:
    """A configuration against the PLC at a URL: ``same``, or a finding for each setting that differs.

    What runs is left out, and a set point that the operator has changed is told in ``notes``. Raises as `pull`.
    """
    checked = check_source(source, name, files, limits)
    source_plc = source_of(plc, checked, None, {}, map_of_source(map, checked.document, files, limits))
    return read_and_compare(checked, source_plc, retry_policy(timeout, retries))
