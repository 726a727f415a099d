"""A connection to a PLC that can read and nothing else, where a PLC is, and work that goes on in the background."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import socket
import threading
from contextlib import suppress
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar
from urllib.parse import parse_qsl, unquote, urlsplit

from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Coroutine
    from types import FrameType
    from urllib.parse import SplitResult

    from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient
    from pymodbus.pdu import ModbusPDU

    from pidcfg.text.paths import Data

# --- What goes wrong between here and a PLC ---------------------------------------------------------------------------


class PlcError(ConnectionError):
    """A PLC that cannot be reached, or does not give what was asked for: one line with host, function and register."""


class AddressError(ValueError):
    """An address that no PLC can be reached at, or listened on; the message says how to write one."""


# --- What is wrong with a line, in words: bytes that are no answer, and devices that cannot be opened -----------------

TERMINAL_ERRORS: tuple[type[Exception], ...] = ()
"""What a system raises for a device that takes no baud rate or parity; it is no `OSError`."""
with suppress(ImportError):  # Windows has no such thing
    import termios

    TERMINAL_ERRORS = (termios.error,)

HEADER_BYTES = 8
"""Bytes from which on a frame of Modbus TCP tells whose answer it is: transaction, protocol, length, unit, function."""
PROTOCOL_BYTES, LENGTH_BYTES, UNIT_BYTE = slice(2, 4), slice(4, 6), 6


def unexpected_answer(sent: bytes, received: bytes, *, is_serial: bool) -> str:
    """What came instead of the answer to a request; empty: nothing."""
    count = len(received)
    if not received or is_serial:
        return f"{count} bytes that make none" if received else ""
    if any(received[PROTOCOL_BYTES]):
        return "bytes that are no Modbus"
    if count < HEADER_BYTES:
        return f"{count} bytes of one"
    if received[:2] != sent[:2] or received[UNIT_BYTE] != sent[UNIT_BYTE]:
        return f"one of unit {received[UNIT_BYTE]}" if received[:2] == sent[:2] else "one to another request"
    length = int.from_bytes(received[LENGTH_BYTES]) + LENGTH_BYTES.stop
    return f"{count} of {length} bytes of one" if count < length else "bytes that make none"


def serial_reason(device: str) -> str:
    """What the system says of a serial device."""
    import serial

    try:
        serial.Serial(device).close()
    except OSError as error:
        return os.strerror(error.errno) if error.errno else "it is no serial line"
    except ValueError as error:
        return str(error)
    return "the device cannot be opened"


# --- Where a PLC is: ``modbus://host[:502][?unit=1]``, ``modbus+rtu:///dev/ttyS0?baud=9600&parity=odd`` ---------------

TCP, RTU = "modbus", "modbus+rtu"
DEFAULT_PORT = 502
MAX_UNIT, MAX_SERIAL_UNIT = 255, 247
DEFAULT_BAUD, DEFAULT_PARITY = 19_200, "even"
"""Of a serial line that says nothing else."""
PARITIES = {"none": "N", "odd": "O", "even": "E"}
URL_FORMS = f"write {TCP}://HOST[:{DEFAULT_PORT}][?unit=1] or {RTU}:///DEVICE?baud=9600&parity=odd"
"""What an address that cannot be read should look like; ends a message."""


@frozen
class Address:
    """One PLC: ``device`` of a serial line, or ``host`` and ``port``; and its ``unit`` there.

    Without more words a serial line is that of the Modbus standard: 19200 baud, even parity, one stop bit.
    """

    host: str = ""
    port: int = DEFAULT_PORT
    unit: int = 1
    device: str = ""
    baud: int = DEFAULT_BAUD
    parity: str = DEFAULT_PARITY
    stop_bits: int = 1

    def __str__(self) -> str:
        """As messages name it: ``10.0.0.5:502``, ``/dev/ttyS0``."""
        return self.device or endpoint(self.host, self.port)


def endpoint(host: str, port: int) -> str:
    """Host and port in one word, as a URL has them."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def parse_address(url: str) -> Address:
    """The PLC that a URL names; raises `AddressError`."""
    parts, port = _split_url(url, url.strip(), URL_FORMS)
    if parts.scheme not in {TCP, RTU}:
        raise AddressError(f"{url!r} begins with neither {TCP}:// nor {RTU}://; {URL_FORMS}")
    if parts.username is not None or parts.fragment:
        raise AddressError(f"{url!r}: Modbus knows no users and no fragments; {URL_FORMS}")
    return _tcp_address(url, parts, port) if parts.scheme == TCP else _serial_address(url, parts)


def _split_url(text: str, url: str, cure: str) -> tuple[SplitResult, int | None]:
    """The parts of a URL and its port."""
    brackets = "an IPv6 address stands in brackets, [::1]"
    try:
        parts = urlsplit(url)
    except ValueError:
        raise AddressError(f"{text!r}: {brackets}; {cure}") from None
    try:
        return parts, parts.port
    except ValueError:
        cause = brackets if parts.netloc.count(":") > 1 else "the port is a whole number from 1 to 65535"
        raise AddressError(f"{text!r}: {cause}; {cure}") from None


def _tcp_address(url: str, parts: SplitResult, port: int | None) -> Address:
    if not parts.hostname or parts.path not in {"", "/"}:
        raise AddressError(f"{url!r} names no host, or more than a host; {URL_FORMS}")
    if port == 0:
        raise AddressError(f"{url!r}: port 0 is none to be reached; {URL_FORMS}")
    try:
        parts.hostname.encode("idna")
    except UnicodeError:
        raise AddressError(f"{url!r}: {parts.hostname!r} is no name of a host; {URL_FORMS}") from None
    values = _query_values(url, parts, ("unit",))
    return Address(unquote(parts.hostname), port or DEFAULT_PORT, _query_number(url, values, "unit", 1, 0, MAX_UNIT))


def _serial_address(url: str, parts: SplitResult) -> Address:
    device = unquote(parts.path)
    if parts.netloc or not device.strip("/"):
        raise AddressError(f"{url!r} names no device, which stands behind three slashes; {URL_FORMS}")
    values = _query_values(url, parts, ("unit", "baud", "parity", "stop_bits"))
    parity = values.get("parity", DEFAULT_PARITY)
    if parity not in PARITIES:
        raise AddressError(f"{url!r}: the parity is one of {', '.join(PARITIES)}")
    is_windows = device.upper().startswith("/COM")
    return Address(
        unit=_query_number(url, values, "unit", 1, 1, MAX_SERIAL_UNIT),
        device=device[1:] if is_windows else device,
        baud=_query_number(url, values, "baud", DEFAULT_BAUD, 300, 4_000_000),
        parity=parity,
        stop_bits=_query_number(url, values, "stop_bits", 1, 1, 2),
    )


def _query_values(url: str, parts: SplitResult, keys: tuple[str, ...]) -> dict[str, str]:
    pairs = parse_qsl(parts.query, keep_blank_values=True)
    for key, _ in pairs:
        if key not in keys:
            raise AddressError(f"{url!r}: {key!r} is none of {', '.join(keys)}")
    if len(dict(pairs)) < len(pairs):
        raise AddressError(f"{url!r} says one thing twice")
    return dict(pairs)


def _query_number(url: str, values: dict[str, str], key: str, default: int, low: int, high: int) -> int:
    text = values.get(key)
    if text is None:
        return default
    if not (text.isascii() and text.isdecimal() and len(text) <= len(str(high)) and low <= int(text) <= high):
        raise AddressError(f"{url!r}: {key} is a whole number from {low} to {high}")
    return int(text)


def parse_listen(text: str) -> tuple[str, int]:
    """Host and port to listen on, ``127.0.0.1:5020`` or ``[::1]:5020``; raises `AddressError`."""
    cure = "write HOST:PORT, such as 127.0.0.1:5020"
    parts, port = _split_url(text, f"//{text.strip()}", cure)
    if not parts.hostname or port is None or parts.path or parts.query or parts.fragment or parts.username is not None:
        raise AddressError(f"{text!r} is no place to listen on; {cure}")
    return parts.hostname, port


# --- A connection to a PLC that can read and nothing else: this module calls no function that writes (D870) -----------

D870 = Decision(
    870,
    "a PLC is only read",
    "`pull`, `compare` and `trend` send the functions 1 to 4 and no other; there is no call that writes, and no option "
    "that would make one.",
    "A tool that compares must never be the reason for a difference.",
)
D871 = Decision(
    871,
    "an answer that does not come is asked for again, a refusal is not",
    "A request that gets no answer, half of one or one that is meant for somebody else is sent again on a new "
    "connection, `retries` times. Of Modbus exceptions only 5 (acknowledge) and 6 (busy) are waited for.",
    "Both come with the line; the other exceptions are the PLC's last word.",
)

Table = Literal["coil", "discrete", "holding", "input"]
READ_FUNCTIONS: dict[str, tuple[int, str]] = {
    "coil": (1, "read coils"),
    "discrete": (2, "read discrete inputs"),
    "holding": (3, "read holding registers"),
    "input": (4, "read input registers"),
}
"""Number and name of the function that reads a table."""
MAX_PER_REQUEST = {"coil": 2000, "discrete": 2000, "holding": 125, "input": 125}
"""What one request may ask for, by the protocol."""
EXCEPTION_TEXTS = {
    1: "illegal function",
    2: "illegal data address",
    3: "illegal data value",
    4: "device failure",
    5: "acknowledge: it takes long",
    6: "device busy",
    8: "memory parity error",
    10: "no path through the gateway",
    11: "no answer behind the gateway",
}
BUSY_EXCEPTIONS = frozenset((5, 6))
NO_SUCH_REGISTER = 2
NO_SERVER_CURE = "look whether a Modbus server is there"
DEVICE_CURE = "look at the name of the device, and who else has it open"


@frozen
class RetryPolicy:
    """How long an answer may take in s, and how often a request is sent again."""

    timeout: float = 2.0
    retries: int = 2


@frozen
class Request:
    """Registers that are read at once; ``what`` says in the vendor's words what they are."""

    table: Table
    first: int
    count: int
    description: str

    def __str__(self) -> str:
        """As messages name it: ``read holding registers (function 3) 1024 to 1055, V2000 to V2037 of TIC-101``."""
        number, name = READ_FUNCTIONS[self.table]
        last = self.first + self.count - 1
        registers = f"{self.first} to {last}" if self.count > 1 else f"{self.first}"
        return f"{name} (function {number}) {registers}, {self.description}"


class Link:
    """A PLC at the other end of a line, as an asynchronous context; it is connected with the first request."""

    def __init__(self, address: Address, policy: RetryPolicy) -> None:
        if find_spec("pymodbus") is None or (address.device and find_spec("serial") is None):
            package = "pyserial" if find_spec("pymodbus") else "pymodbus"
            raise PlcError(f"{address}: {package} is not installed; install pidcfg with its extra `live`")
        self.address, self.policy = address, policy
        self._client: Any = None
        self._request_bytes = self._received = b""
        self._closed = asyncio.Event()

    async def __aenter__(self) -> Self:
        """Nothing is sent yet."""
        return self

    async def __aexit__(self, *_: object) -> None:
        """Hangs up."""
        self._hang_up()

    async def read(self, request: Request) -> list[int]:
        """The content of the registers; raises `PlcError`, `NoRegistersError` where they are not there."""
        fault = _NoAnswer("")
        for attempt in range(self.policy.retries + 1):
            try:
                if self._client is None:
                    await self._connect()
                return await self._send_request(request)
            except _NoAnswer as error:
                fault = error
                if error.is_dead:
                    self._hang_up()
                if attempt == self.policy.retries or error.is_last:
                    break
                await asyncio.sleep(error.pause)
        tries = f", tried {attempt + 1} times" if attempt else ""
        if self._client is None and not str(fault):
            fault = await self._failure_reason()
        raise SilentError(f"{self.address}: {request}: {fault}{tries}; {fault.cure}")

    async def _send_request(self, request: Request) -> list[int]:
        """One request, and its answer if it comes."""
        from pymodbus.exceptions import ModbusException

        self._closed.clear()
        self._received = b""
        client, unit = self._client, self.address.unit
        call: Callable[..., Awaitable[ModbusPDU]] = {
            "coil": client.read_coils,
            "discrete": client.read_discrete_inputs,
            "holding": client.read_holding_registers,
            "input": client.read_input_registers,
        }[request.table]
        response_task = asyncio.ensure_future(call(request.first, count=request.count, device_id=unit))
        closed_task = asyncio.ensure_future(self._closed.wait())
        try:
            done, _ = await asyncio.wait({response_task, closed_task}, return_when=asyncio.FIRST_COMPLETED)
            if response_task not in done:
                raise _NoAnswer("the connection was closed", "PLCs take few connections: close other programs")
            response = response_task.result()
        except ModbusException:
            other_answer = unexpected_answer(self._request_bytes, self._received, is_serial=bool(self.address.device))
            reason = f"no answer within {self.policy.timeout:g} s{other_answer and f', but {other_answer}'}"
            suspects = ("the cable", "the unit number", "the baud rate", "the parity")[
                : None if self.address.device else 2
            ]
            cure = f"look at {', '.join(suspects[:-1])} and {suspects[-1]}; here it is unit {unit}"
            raise _NoAnswer(reason, cure if self.address.device or not other_answer else NO_SERVER_CURE) from None
        finally:
            for task in (response_task, closed_task):
                task.cancel()
            with suppress(asyncio.CancelledError, ModbusException):
                await response_task
        return self._response_content(request, response)

    def _response_content(self, request: Request, response: ModbusPDU) -> list[int]:
        """What an answer holds; an exception is refused, and an answer of another length."""
        if response.isError():
            code = int(getattr(response, "exception_code", 0))
            reason = f"exception {code} ({EXCEPTION_TEXTS.get(code, 'not in the protocol')})"
            if code in BUSY_EXCEPTIONS:
                pause = min(0.1, self.policy.timeout)
                raise _NoAnswer(reason, "look what the PLC is busy with", is_dead=False, pause=pause)
            if code == NO_SUCH_REGISTER:
                cause = "the PLC does not have all of them; look whether it is the PLC of the file"
                raise NoRegistersError(f"{self.address}: {request}: {reason}: {cause}")
            raise PlcError(f"{self.address}: {request}: {reason}; look at the set-up of Modbus in the PLC")
        if response.function_code != READ_FUNCTIONS[request.table][0]:
            raise _NoAnswer(f"the answer is one to function {response.function_code}", NO_SERVER_CURE)
        is_bits = request.table in {"coil", "discrete"}
        content = [int(value) for value in (response.bits if is_bits else response.registers)]
        expected_count = -(-request.count // 8) * 8 if is_bits else request.count
        if len(content) != expected_count:
            raise _NoAnswer(f"the answer holds {len(content)} of {expected_count} registers", NO_SERVER_CURE)
        return content[: request.count]

    async def _connect(self) -> None:
        """A connection; it is not made anew by itself."""
        logging.getLogger("pymodbus.logging").addHandler(logging.NullHandler())  # this module says what is wrong
        client = _client_of(self.address, self.policy, self._note_connection, self._note_packet)
        try:
            is_connected = await client.ctx.connect()  # the client's own `connect` sleeps for 0.1 s
        except TERMINAL_ERRORS as error:
            reason = f"the line cannot be set up: {error.args[-1]}"
            raise _NoAnswer(reason, "look whether the device has this baud rate and parity", is_last=True) from None
        if not is_connected:
            client.close()
            raise _NoAnswer("")  # why is asked after the last try
        self._client = client

    def _note_connection(self, is_connected: bool) -> None:  # noqa: FBT001 - how pymodbus calls it
        if not is_connected:
            self._closed.set()

    def _note_packet(self, is_sent: bool, data: bytes) -> bytes:  # noqa: FBT001 - how pymodbus calls it
        if is_sent:
            self._request_bytes = data
        else:
            self._received = data
        return data

    def _hang_up(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None

    async def _failure_reason(self) -> _NoAnswer:
        """Why there is no connection, in words."""
        if self.address.device:
            reason = await asyncio.to_thread(serial_reason, self.address.device)
            return _NoAnswer(reason, DEVICE_CURE)
        try:
            connected = asyncio.open_connection(self.address.host, self.address.port)
            _, writer = await asyncio.wait_for(connected, self.policy.timeout)
        except socket.gaierror:
            return _NoAnswer(f"the name {self.address.host} does not resolve", "write it otherwise, or the IP address")
        except TimeoutError:
            reason = f"no connection within {self.policy.timeout:g} s"
            return _NoAnswer(reason, "look at the cable, the address and the firewall")
        except OSError as error:
            is_refused = isinstance(error, ConnectionRefusedError)
            reason = "connection refused" if is_refused else str(error.strerror or error)
            return _NoAnswer(reason, "look at the address and the port, and whether Modbus TCP is enabled")
        writer.close()
        return _NoAnswer("no connection", "try again")


class SilentError(PlcError):
    """A line without an answer; whatever else is asked for would have none either."""


class NoRegistersError(PlcError):
    """Exception 2: the PLC does not have the registers."""


class _NoAnswer(Exception):  # noqa: N818 - it is no error before the last try
    """A request without an answer; ``is_dead``: the connection is of no more use; ``is_last``: nor is another one."""

    def __init__(
        self, reason: str, cure: str = "", *, is_dead: bool = True, is_last: bool = False, pause: float = 0.0
    ) -> None:
        super().__init__(reason)
        self.cure, self.is_dead, self.is_last, self.pause = cure, is_dead, is_last, pause


def _client_of(
    address: Address,
    policy: RetryPolicy,
    note_connection: Callable[[bool], None],
    note_packet: Callable[[bool, bytes], bytes],
) -> AsyncModbusTcpClient | AsyncModbusSerialClient:
    from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient

    common_options: Data = {
        "timeout": policy.timeout,
        "retries": 0,
        "reconnect_delay": 0,
        "trace_connect": note_connection,
        "trace_packet": note_packet,
    }
    if not address.device:
        return AsyncModbusTcpClient(address.host, port=address.port, **common_options)
    line: Data = {"baudrate": address.baud, "parity": PARITIES[address.parity], "stopbits": address.stop_bits}
    return AsyncModbusSerialClient(address.device, **line, **common_options)


# --- Asynchronous work from synchronous calls, also where a loop runs already, as in a notebook -----------------------

R = TypeVar("R")

END_SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""Signals that somebody sends who wants the work to end."""


def run_async(work: Coroutine[object, object, R]) -> R:
    """The result of the work, in an event loop of its own.

    Ctrl-C and SIGTERM cancel the work, which may come to an end with what it has; otherwise they do what they did
    before. A signal that is ignored, or whose default nobody has changed, stays as it is.
    """
    signals = _EndSignals()
    cancellable = signals.cancellable(work)
    try:
        return signals.run(lambda: _run_in_thread(cancellable) if _has_running_loop() else asyncio.run(cancellable))
    finally:  # where no loop can be made, neither has begun
        cancellable.close()
        work.close()


def _has_running_loop() -> bool:
    """Whether an event loop runs in this thread, as in a notebook."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


def _run_in_thread(work: Coroutine[object, object, R]) -> R:
    """The result of the work in a thread of its own."""
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, work).result()


class _EndSignals:
    """What signals do while work is running: the first one cancels it, the next one is none of ours."""

    def __init__(self) -> None:
        self._handlers: dict[int, Callable[[int, FrameType | None], object]] = {}
        self._cancel: Callable[[], object] | None = None
        self._received: int | None = None

    def run(self, work: Callable[[], R]) -> R:
        """What the work gives; a signal that ended it without a result does what it would have done."""
        self._install_handlers()
        try:
            return work()
        except asyncio.CancelledError:
            if self._received is not None:
                self._handlers[self._received](self._received, None)
            raise
        finally:
            for number, handler in self._handlers.items():
                signal.signal(number, handler)

    def _install_handlers(self) -> None:
        """Takes the signals that have a handler, in the one thread that may."""
        if threading.current_thread() is not threading.main_thread():
            return
        for number in END_SIGNALS:
            handler = signal.getsignal(number)
            if callable(handler):
                self._handlers[number] = handler
                signal.signal(number, self._handle_signal)

    def _handle_signal(self, number: int, frame: FrameType | None) -> None:
        if self._received is not None:
            self._handlers[number](number, frame)
            return
        self._received = number
        if self._cancel is not None:
            with suppress(RuntimeError):  # its loop has just been closed
                self._cancel()

    async def cancellable(self, work: Coroutine[object, object, R]) -> R:
        """The work, which a signal cancels while it is running, or as it begins."""
        loop, task = asyncio.get_running_loop(), asyncio.ensure_future(_silence_loop(work))
        self._cancel = partial(loop.call_soon_threadsafe, task.cancel)  # wakes a loop that waits
        if self._received is not None:
            task.cancel()
        try:
            return await task
        finally:
            self._cancel = None


async def _silence_loop(work: Coroutine[object, object, R]) -> R:
    """What a malformed answer breaks inside of the library is told by the request that gets none."""
    asyncio.get_running_loop().set_exception_handler(lambda _loop, _context: None)
    return await work
