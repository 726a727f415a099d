"""The public calls that speak to a PLC: `pidcfg.pull`, `pidcfg.compare`, `pidcfg.trend`. They only read it.

As with the other calls, results are frozen and nothing is printed. A PLC that cannot be reached, or does not give what
is asked for, is a `PlcError`, which is a `ConnectionError` of one line with host, function and register.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.limits import DEFAULT, Limits
from pidcfg.live.address import parse_address
from pidcfg.live.errors import AddressError
from pidcfg.live.link import Patience
from pidcfg.results.arguments import ArgumentError, vendor_named
from pidcfg.results.exact import exact
from pidcfg.results.sources import checked_of
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.live.address import Address
    from pidcfg.live.compare import CompareResult
    from pidcfg.live.pull import PullResult
    from pidcfg.live.pull import Source as Plc
    from pidcfg.reader import Files
    from pidcfg.results.sources import Source
    from pidcfg.validate.engine import Checked
    from pidcfg.vendors import Vendor


@exact
def pull(
    plc: str,
    *,
    like: Source | None = None,
    vendor: str | None = None,
    format: str = "yaml",  # noqa: A002 - as in `encode`
    options: Mapping[str, object] | None = None,
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
    from pidcfg.live.pull import pulled

    other = None if like is None else checked_of(like, None, files, limits)
    if other is None and vendor is None:
        raise ArgumentError("name a configuration (`like`) or the PLC family (`vendor`)", "like", "vendor")
    family = vendor_named(vendor) if vendor is not None else None
    source = source_of(plc, other, family, options or {})
    return pulled(source, format, patience_of(timeout, retries), limits)


@exact
def compare(
    source: Source,
    plc: str,
    *,
    timeout: float = 2.0,
    retries: int = 2,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> CompareResult:
    """A configuration against the PLC at a URL: ``same``, or a finding for each setting that differs.

    What runs is left out, and a set point that the operator has changed is told in ``notes``. Raises as `pull`.
    """
    from pidcfg.live.compare import read_and_compared

    checked = checked_of(source, name, files, limits)
    return read_and_compared(checked, source_of(plc, checked, None, {}), patience_of(timeout, retries), limits)


def source_of(plc: str, like: Checked | None, vendor: Vendor | None, options: Mapping[str, object]) -> Plc:
    """The PLC at a URL and what is known about it; raises `ArgumentError`."""
    from pidcfg.live.pull import Source as Plc

    family = vendor or (None if like is None else like.vendor)
    if like is not None and like.vendor is not None and family is not like.vendor:
        raise ArgumentError(f"`like` is a file of {like.vendor.title}, not of `vendor`", "like", "vendor")
    family = family or VENDORS["dl06"]  # a file that names no vendor has findings, and nothing is read
    try:
        numbering = family.load("numbering")
    except LookupError:
        raise ArgumentError(f"`plc`: {family.title} has no Modbus map of its own", "plc") from None
    return Plc(address_of(plc), family, numbering, like, options)


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
