"""A connection to a PLC that can read and nothing else: this module calls no function that writes (D870)."""

from __future__ import annotations

import asyncio
import logging
import socket
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Literal, Self

from pidcfg.live.address import PARITIES
from pidcfg.live.errors import PlcError
from pidcfg.live.faults import TERMINAL_ERRORS, serial_reason, what_came
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from pidcfg.live.address import Address

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
FUNCTIONS: dict[str, tuple[int, str]] = {
    "coil": (1, "read coils"),
    "discrete": (2, "read discrete inputs"),
    "holding": (3, "read holding registers"),
    "input": (4, "read input registers"),
}
"""Number and name of the function that reads a table."""
MOST = {"coil": 2000, "discrete": 2000, "holding": 125, "input": 125}
"""What one request may ask for, by the protocol."""
EXCEPTIONS = {
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
WAITED_FOR = frozenset((5, 6))
NO_SUCH_REGISTER = 2
NO_SERVER = "look whether a Modbus server is there"
OTHER_DEVICE = "look at the name of the device, and who else has it open"


@dataclass(frozen=True, slots=True)
class Patience:
    """How long an answer may take in s, and how often a request is sent again."""

    timeout: float = 2.0
    retries: int = 2


@dataclass(frozen=True, slots=True)
class Request:
    """Registers that are read at once; ``what`` says in the vendor's words what they are."""

    table: Table
    first: int
    count: int
    what: str

    def __str__(self) -> str:
        """As messages name it: ``read holding registers (function 3) 1024 to 1055, V2000 to V2037 of TIC-101``."""
        number, name = FUNCTIONS[self.table]
        last = self.first + self.count - 1
        registers = f"{self.first} to {last}" if self.count > 1 else f"{self.first}"
        return f"{name} (function {number}) {registers}, {self.what}"


class Link:
    """A PLC at the other end of a line, as an asynchronous context; it is connected with the first request."""

    def __init__(self, address: Address, patience: Patience) -> None:
        if find_spec("pymodbus") is None or (address.device and find_spec("serial") is None):
            package = "pyserial" if find_spec("pymodbus") else "pymodbus"
            raise PlcError(f"{address}: {package} is not installed; install pidcfg with its extra `live`")
        self.address, self.patience = address, patience
        self._client: Any = None
        self._sent = self._came = b""
        self._lost = asyncio.Event()

    async def __aenter__(self) -> Self:
        """Nothing is sent yet."""
        return self

    async def __aexit__(self, *_: object) -> None:
        """Hangs up."""
        self._hang_up()

    async def read(self, request: Request) -> list[int]:
        """The content of the registers; raises `PlcError`, `NoRegistersError` where they are not there."""
        fault = _Unanswered("")
        for attempt in range(self.patience.retries + 1):
            try:
                if self._client is None:
                    await self._connect()
                return await self._answer(request)
            except _Unanswered as error:
                fault = error
                if error.is_dead:
                    self._hang_up()
                if attempt == self.patience.retries or error.is_last:
                    break
                await asyncio.sleep(error.pause)
        tries = f", tried {attempt + 1} times" if attempt else ""
        if self._client is None and not str(fault):
            fault = await self._reason()
        raise SilentError(f"{self.address}: {request}: {fault}{tries}; {fault.cure}")

    async def _answer(self, request: Request) -> list[int]:
        """One request, and its answer if it comes."""
        from pymodbus.exceptions import ModbusException

        self._lost.clear()
        self._came = b""
        client, unit = self._client, self.address.unit
        call: Callable[..., Awaitable[Any]] = {
            "coil": client.read_coils,
            "discrete": client.read_discrete_inputs,
            "holding": client.read_holding_registers,
            "input": client.read_input_registers,
        }[request.table]
        asked = asyncio.ensure_future(call(request.first, count=request.count, device_id=unit))
        lost = asyncio.ensure_future(self._lost.wait())
        try:
            done, _ = await asyncio.wait({asked, lost}, return_when=asyncio.FIRST_COMPLETED)
            if asked not in done:
                raise _Unanswered("the connection was closed", "PLCs take few connections: close other programs")
            response = asked.result()
        except ModbusException:
            instead = what_came(self._sent, self._came, is_serial=bool(self.address.device))
            said = f"no answer within {self.patience.timeout:g} s{instead and f', but {instead}'}"
            places = ("the cable", "the unit number", "the baud rate", "the parity")[
                : None if self.address.device else 2
            ]
            cure = f"look at {', '.join(places[:-1])} and {places[-1]}; here it is unit {unit}"
            raise _Unanswered(said, cure if self.address.device or not instead else NO_SERVER) from None
        finally:
            for task in (asked, lost):
                task.cancel()
            with suppress(asyncio.CancelledError, ModbusException):
                await asked
        return self._content(request, response)

    def _content(self, request: Request, response: Any) -> list[int]:
        """What an answer holds; an exception is refused, and an answer of another length."""
        if response.isError():
            code = int(getattr(response, "exception_code", 0))
            said = f"exception {code} ({EXCEPTIONS.get(code, 'not in the protocol')})"
            if code in WAITED_FOR:
                pause = min(0.1, self.patience.timeout)
                raise _Unanswered(said, "look what the PLC is busy with", is_dead=False, pause=pause)
            if code == NO_SUCH_REGISTER:
                why = "the PLC does not have all of them; look whether it is the PLC of the file"
                raise NoRegistersError(f"{self.address}: {request}: {said}: {why}")
            raise PlcError(f"{self.address}: {request}: {said}; look at the set-up of Modbus in the PLC")
        if response.function_code != FUNCTIONS[request.table][0]:
            raise _Unanswered(f"the answer is one to function {response.function_code}", NO_SERVER)
        is_bits = request.table in {"coil", "discrete"}
        content = [int(value) for value in (response.bits if is_bits else response.registers)]
        padded = -(-request.count // 8) * 8 if is_bits else request.count
        if len(content) != padded:
            raise _Unanswered(f"the answer holds {len(content)} of {padded} registers", NO_SERVER)
        return content[: request.count]

    async def _connect(self) -> None:
        """A connection; it is not made anew by itself."""
        logging.getLogger("pymodbus.logging").addHandler(logging.NullHandler())  # this module says what is wrong
        client = _client_of(self.address, self.patience, self._changed, self._seen)
        try:
            is_connected = await client.ctx.connect()  # the client's own `connect` sleeps for 0.1 s
        except TERMINAL_ERRORS as error:
            said = f"the line cannot be set up: {error.args[-1]}"
            raise _Unanswered(said, "look whether the device has this baud rate and parity", is_last=True) from None
        if not is_connected:
            client.close()
            raise _Unanswered("")  # why is asked after the last try
        self._client = client

    def _changed(self, is_connected: bool) -> None:  # noqa: FBT001 - how pymodbus calls it
        if not is_connected:
            self._lost.set()

    def _seen(self, is_sent: bool, data: bytes) -> bytes:  # noqa: FBT001 - how pymodbus calls it
        if is_sent:
            self._sent = data
        else:
            self._came = data
        return data

    def _hang_up(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None

    async def _reason(self) -> _Unanswered:
        """Why there is no connection, in words."""
        if self.address.device:
            reason = await asyncio.to_thread(serial_reason, self.address.device)
            return _Unanswered(reason, OTHER_DEVICE)
        try:
            connected = asyncio.open_connection(self.address.host, self.address.port)
            _, writer = await asyncio.wait_for(connected, self.patience.timeout)
        except socket.gaierror:
            return _Unanswered(
                f"the name {self.address.host} does not resolve", "write it otherwise, or the IP address"
            )
        except TimeoutError:
            said = f"no connection within {self.patience.timeout:g} s"
            return _Unanswered(said, "look at the cable, the address and the firewall")
        except OSError as error:
            is_refused = isinstance(error, ConnectionRefusedError)
            said = "connection refused" if is_refused else str(error.strerror or error)
            return _Unanswered(said, "look at the address and the port, and whether Modbus TCP is enabled")
        writer.close()
        return _Unanswered("no connection", "try again")


class SilentError(PlcError):
    """A line without an answer; whatever else is asked for would have none either."""


class NoRegistersError(PlcError):
    """Exception 2: the PLC does not have the registers."""


class _Unanswered(Exception):  # noqa: N818 - it is no error before the last try
    """A request without an answer; ``is_dead``: the connection is of no more use; ``is_last``: nor is another one."""

    def __init__(
        self, reason: str, cure: str = "", *, is_dead: bool = True, is_last: bool = False, pause: float = 0.0
    ) -> None:
        super().__init__(reason)
        self.cure, self.is_dead, self.is_last, self.pause = cure, is_dead, is_last, pause


def _client_of(
    address: Address, patience: Patience, changed: Callable[[bool], None], seen: Callable[[bool, bytes], bytes]
) -> Any:
    from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient

    common: dict[str, Any] = {
        "timeout": patience.timeout,
        "retries": 0,
        "reconnect_delay": 0,
        "trace_connect": changed,
        "trace_packet": seen,
    }
    if not address.device:
        return AsyncModbusTcpClient(address.host, port=address.port, **common)
    line: dict[str, Any] = {"baudrate": address.baud, "parity": PARITIES[address.parity], "stopbits": address.stop_bits}
    return AsyncModbusSerialClient(address.device, **line, **common)
