"""The public calls that speak to a PLC: `pidcfg.pull`, `pidcfg.compare`, `pidcfg.trend`. They only read it.

As with the other calls, results are frozen and nothing is printed. A PLC that cannot be reached, or does not give what
is asked for, is a `PlcError`, which is a `ConnectionError` of one line with host, function and register.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from pidcfg.live.link import (
    HIGHEST_SERIAL_UNIT,
    HIGHEST_UNIT,
    RTU,
    Address,
    AddressError,
    Patience,
    parse_address,
    parse_listen,
)
from pidcfg.output.arguments import ArgumentError, check_arguments, vendor_named
from pidcfg.output.sources import checked_of, document_of, stated_map
from pidcfg.text.reader import DEFAULT, Limits, reader_of
from pidcfg.validate.map_files import numbering_of
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from pidcfg.live.pull import CompareResult, PullResult
    from pidcfg.live.pull import Source as Plc
    from pidcfg.live.serving import ServeResult
    from pidcfg.live.trend import TrendResult
    from pidcfg.output.sources import Source
    from pidcfg.sim.engine.run import Sink
    from pidcfg.text.reader import Files
    from pidcfg.validate.engine import Checked
    from pidcfg.validate.map_files import MapFile
    from pidcfg.vendors import Vendor

FASTEST = 1e6
"""Times real time."""


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
    from pidcfg.live.pull import pull_from

    source = _plc_of(plc, (like, vendor, map), options, files, limits)
    return pull_from(source, format, patience_of(timeout, retries), limits)


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
    from pidcfg.live.pull import read_and_compare

    checked = checked_of(source, name, files, limits)
    source_plc = source_of(plc, checked, None, {}, stated_map(map, checked.document, files, limits))
    return read_and_compare(checked, source_plc, patience_of(timeout, retries))


def _plc_of(
    plc: str,
    known: tuple[Source | None, str | None, Path | str | bytes | None],
    options: Mapping[str, object] | None,
    files: Files,
    limits: Limits,
) -> Plc:
    """The PLC that `pull` and `trend` read; ``known``: a configuration like it, its vendor, its map."""
    like, vendor, stated = known
    other = None if like is None else checked_of(like, None, files, limits)
    if other is None and vendor is None:
        raise ArgumentError("name a configuration (`like`) or the PLC family (`vendor`)", "like", "vendor")
    family = None if vendor is None else vendor_named(vendor)
    document = None if other is None else other.document
    return source_of(plc, other, family, options or {}, stated_map(stated, document, files, limits))


def source_of(
    plc: str,
    like: Checked | None,
    vendor: Vendor | None,
    options: Mapping[str, object],
    stated: MapFile | None = None,
) -> Plc:
    """The PLC at a URL and what is known about it; raises `ArgumentError`, `UnusableMapError`."""
    from pidcfg.live.pull import Source as Plc

    family = vendor or (None if like is None else like.vendor)
    if like is not None and like.vendor is not None and family is not like.vendor:
        raise ArgumentError(f"`like` is a file of {like.vendor.title}, not of `vendor`", "like", "vendor")
    family = family or VENDORS["dl06"]  # a file that names no vendor has findings, and nothing is read
    encoding = None if like is None else like.encoding
    image = encoding.image if encoding is not None and encoding.whole else None
    if like is not None and image is None:
        return Plc(address_of(plc), family, None, like, options)  # its findings say why; nothing is read
    file = "FILE" if like is None else like.document.file
    return Plc(address_of(plc), family, numbering_of(family, stated, image, file), like, options)


def address_of(plc: str) -> Address:
    """The address that a URL says; raises `ArgumentError`."""
    try:
        return parse_address(plc)
    except AddressError as error:
        raise ArgumentError(f"`plc`: {error}", "plc") from None


def patience_of(timeout: float, retries: int) -> Patience:
    """How long and how often; raises `ArgumentError`."""
    if not 0 < timeout <= 3600:
        raise ArgumentError(f"`timeout` is {timeout:g}; write seconds above 0 and up to 3600", "timeout")
    if not 0 <= retries <= 100:
        raise ArgumentError(f"`retries` is {retries}; write a whole number from 0 to 100", "retries")
    return Patience(timeout, retries)


@check_arguments
def trend(
    plc: str,
    sink: Sink,
    *,
    like: Source | None = None,
    vendor: str | None = None,
    options: Mapping[str, object] | None = None,
    map: Path | str | bytes | None = None,
    interval: float = 1.0,
    seconds: float | None = None,
    taken: Callable[[float, Mapping[str, str]], None] | None = None,
    timeout: float = 2.0,
    retries: int = 2,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> TrendResult:
    """Records PV, set point, output and mode of each loop as CSV, a row every ``interval`` s, for ``tune``.

    ``sink``: an open text stream; a row is written at once. ``seconds``: how long, else until Ctrl-C, which keeps every
    row. ``taken`` is called after each row with its time and its values by column. The others as in `pull`.
    """
    from pidcfg.live.trend import Recording, record_trend

    if not 0 < interval < float("inf"):
        raise ArgumentError(f"`interval` is {interval:g}; write seconds above 0", "interval")
    if seconds is not None and not 0 <= seconds < float("inf"):
        raise ArgumentError(f"`seconds` is {seconds:g}; write seconds from 0 on", "seconds")
    source = _plc_of(plc, (like, vendor, map), options, files, limits)
    recording = Recording(sink, interval, seconds, taken or _nobody)
    return record_trend(source, recording, patience_of(timeout, retries), limits)


@check_arguments
def serve(
    source: Source,
    *,
    listen: str = "127.0.0.1:5020",
    unit: int | None = None,
    others: Mapping[int, Source] | None = None,
    map: Path | str | bytes | None = None,
    speed: float = 1.0,
    seconds: float | None = None,
    ready: Callable[[str], None] | None = None,
    tell: Callable[[str], None] | None = None,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> ServeResult:
    """Serves the virtual PLC of a scenario over Modbus, ``speed`` times as fast as the clock, until Ctrl-C.

    ``listen``: host and port, of which 0 is one of the system's choice, or the URL of a serial line. ``unit``: the unit
    that it answers as, and no other; 1 where nothing says it. ``others``: scenarios of further PLCs at the same place,
    by their units, as behind a gateway. ``map``: as in `pull`, of the first one. ``seconds``: ends by itself. ``ready``
    is called with the place once clients can come, ``tell`` when the simulation cannot keep up. The scenario's duration
    and expectations do not count: whoever operates the PLC decides. Raises `PlcError` where nobody can listen.
    """
    from pidcfg.live.serving import Serving, serve_document

    if not 0 < speed <= FASTEST:
        raise ArgumentError(f"`speed` is {speed:g}; write a number above 0 and up to {FASTEST:g}", "speed")
    if seconds is not None and not 0 < seconds < float("inf"):
        raise ArgumentError(f"`seconds` is {seconds:g}; write seconds above 0", "seconds")
    try:
        place = parse_address(listen) if listen.startswith(RTU) else Address(*parse_listen(listen))
    except AddressError as error:
        raise ArgumentError(f"`listen`: {error}", "listen") from None
    highest = HIGHEST_SERIAL_UNIT if place.device else HIGHEST_UNIT
    for number, argument in ((unit, "unit"), *((number, "others") for number in others or ())):
        if number is not None and not 1 <= number <= highest:
            raise ArgumentError(f"`{argument}` is {number}; write a whole number from 1 to {highest}", argument)
    place = place if unit is None else replace(place, unit=unit)
    if place.unit in (others or ()):
        raise ArgumentError(f"`others` has unit {place.unit}, which is that of the first PLC", "others")
    further = {number: document_of(one, None, files, limits) for number, one in (others or {}).items()}
    serving = Serving(place, speed, seconds, ready or _nothing, tell or _nothing)
    stated = None if map is None else stated_map(map, None, files, limits)
    return serve_document(document_of(source, name, files, limits), serving, reader_of(files), stated, further)


def _nobody(_at: float, _values: Mapping[str, str]) -> None:
    """Nobody watches the rows."""


def _nothing(_: str) -> None:
    """Nobody wants to know."""
