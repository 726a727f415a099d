"""Where a PLC is: ``modbus://host[:502][?unit=1]``, ``modbus+rtu:///dev/ttyS0?baud=9600&parity=odd``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, unquote, urlsplit

from pidcfg.live.errors import AddressError

if TYPE_CHECKING:
    from urllib.parse import SplitResult

TCP, RTU = "modbus", "modbus+rtu"
PORT = 502
HIGHEST_UNIT = 255
BAUD, PARITY = 19_200, "even"
"""Of a serial line that says nothing else."""
PARITIES = {"none": "N", "odd": "O", "even": "E"}
HOW = f"write {TCP}://HOST[:{PORT}][?unit=1] or {RTU}:///DEVICE?baud=9600&parity=odd"


@dataclass(frozen=True, slots=True)
class Address:
    """One PLC: ``device`` of a serial line, or ``host`` and ``port``; and its ``unit`` there.

    Without more words a serial line is that of the Modbus standard: 19200 baud, even parity, one stop bit.
    """

    host: str = ""
    port: int = PORT
    unit: int = 1
    device: str = ""
    baud: int = BAUD
    parity: str = PARITY
    stop_bits: int = 1

    def __str__(self) -> str:
        """As messages name it: ``10.0.0.5:502``, ``/dev/ttyS0``."""
        return self.device or endpoint(self.host, self.port)


def endpoint(host: str, port: int) -> str:
    """Host and port in one word, as a URL has them."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def parse_address(url: str) -> Address:
    """The PLC that a URL names; raises `AddressError`."""
    parts, port = _split(url, url.strip(), HOW)
    if parts.scheme not in {TCP, RTU}:
        raise AddressError(f"{url!r} begins with neither {TCP}:// nor {RTU}://; {HOW}")
    if parts.username is not None or parts.fragment:
        raise AddressError(f"{url!r}: Modbus knows no users and no fragments; {HOW}")
    return _tcp(url, parts, port) if parts.scheme == TCP else _rtu(url, parts)


def _split(text: str, url: str, how: str) -> tuple[SplitResult, int | None]:
    """The parts of a URL and its port."""
    brackets = "an IPv6 address stands in brackets, [::1]"
    try:
        parts = urlsplit(url)
    except ValueError:
        raise AddressError(f"{text!r}: {brackets}; {how}") from None
    try:
        return parts, parts.port
    except ValueError:
        cause = brackets if parts.netloc.count(":") > 1 else "the port is a whole number from 1 to 65535"
        raise AddressError(f"{text!r}: {cause}; {how}") from None


def _tcp(url: str, parts: SplitResult, port: int | None) -> Address:
    if not parts.hostname or parts.path not in {"", "/"}:
        raise AddressError(f"{url!r} names no host, or more than a host; {HOW}")
    if port == 0:
        raise AddressError(f"{url!r}: port 0 is none to be reached; {HOW}")
    try:
        parts.hostname.encode("idna")
    except UnicodeError:
        raise AddressError(f"{url!r}: {parts.hostname!r} is no name of a host; {HOW}") from None
    values = _query(url, parts, ("unit",))
    return Address(unquote(parts.hostname), port or PORT, _number(url, values, "unit", 1, 0, HIGHEST_UNIT))


def _rtu(url: str, parts: SplitResult) -> Address:
    device = unquote(parts.path)
    if parts.netloc or not device.strip("/"):
        raise AddressError(f"{url!r} names no device, which stands behind three slashes; {HOW}")
    values = _query(url, parts, ("unit", "baud", "parity", "stop_bits"))
    parity = values.get("parity", PARITY)
    if parity not in PARITIES:
        raise AddressError(f"{url!r}: the parity is one of {', '.join(PARITIES)}")
    is_windows = device.upper().startswith("/COM")
    return Address(
        unit=_number(url, values, "unit", 1, 1, 247),
        device=device[1:] if is_windows else device,
        baud=_number(url, values, "baud", BAUD, 300, 4_000_000),
        parity=parity,
        stop_bits=_number(url, values, "stop_bits", 1, 1, 2),
    )


def _query(url: str, parts: SplitResult, known: tuple[str, ...]) -> dict[str, str]:
    pairs = parse_qsl(parts.query, keep_blank_values=True)
    for key, _ in pairs:
        if key not in known:
            raise AddressError(f"{url!r}: {key!r} is none of {', '.join(known)}")
    if len(dict(pairs)) < len(pairs):
        raise AddressError(f"{url!r} says one thing twice")
    return dict(pairs)


def _number(url: str, values: dict[str, str], key: str, otherwise: int, low: int, high: int) -> int:
    text = values.get(key)
    if text is None:
        return otherwise
    if not (text.isascii() and text.isdecimal() and len(text) <= len(str(high)) and low <= int(text) <= high):
        raise AddressError(f"{url!r}: {key} is a whole number from {low} to {high}")
    return int(text)


def parse_listen(text: str) -> tuple[str, int]:
    """Host and port to listen on, ``127.0.0.1:5020`` or ``[::1]:5020``; raises `AddressError`."""
    how = "write HOST:PORT, such as 127.0.0.1:5020"
    parts, port = _split(text, f"//{text.strip()}", how)
    if not parts.hostname or port is None or parts.path or parts.query or parts.fragment or parts.username is not None:
        raise AddressError(f"{text!r} is no place to listen on; {how}")
    return parts.hostname, port
