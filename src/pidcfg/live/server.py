"""A Modbus server in front of a virtual PLC, which is moved on in real time meanwhile."""

from __future__ import annotations

import asyncio
import logging
import socket
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from pidcfg.live.address import PARITIES, Address, endpoint
from pidcfg.live.errors import PlcError
from pidcfg.live.faults import TERMINAL_ERRORS, serial_reason
from pidcfg.sim.registers import RegisterError

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.live.virtual import VirtualPlc

TABLES = {1: "coil", 2: "discrete", 3: "holding", 4: "input", 5: "coil", 6: "holding", 15: "coil", 16: "holding"}
TABLES |= {22: "holding", 23: "holding"}
"""The table that a function reads or writes."""
SLICE = 0.02
"""Seconds for which requests may have to wait for the PLC."""
BEHIND = 1.0
"""Seconds behind its time after which the PLC is said not to keep up."""
MOST_WAITING, HEAD, LONGEST = 16, 6, 254
"""Requests of a client that may wait, by the protocol; bytes before the length of one, and what it is at most."""


def context_of(plc: VirtualPlc, unit: int | None = None) -> Any:
    """The PLC as pymodbus' servers know one; without a ``unit`` it answers whichever one is asked for."""
    from pymodbus.constants import ExcCodes
    from pymodbus.datastore import ModbusBaseDeviceContext, ModbusServerContext

    class Context(ModbusBaseDeviceContext):
        """Every request goes to the PLC as it is at that moment."""

        def getValues(self, func_code: int, address: int, count: int = 1) -> Any:  # noqa: N802 - pymodbus' name
            try:
                return plc.read(TABLES.get(func_code, ""), address, count)
            except RegisterError as error:
                return ExcCodes(error.code)

        def setValues(self, func_code: int, address: int, values: Any) -> Any:  # noqa: N802 - pymodbus' name
            try:
                plc.write(TABLES.get(func_code, ""), address, values)
            except RegisterError as error:
                return ExcCodes(error.code)
            return None

    devices = Context() if unit is None else {unit: Context()}
    return ModbusServerContext(devices, single=unit is None)  # type: ignore[no-untyped-call]


async def serve(
    plc: VirtualPlc,
    listen: Address,
    speed: float,
    seconds: float | None,
    ready: Callable[[str], None],
    tell: Callable[[str], None],
) -> None:
    """Serves until it is cancelled, or for so many seconds; raises `PlcError` where it cannot listen."""
    logging.getLogger("pymodbus.logging").addHandler(logging.NullHandler())
    server = _server_of(plc, listen)
    try:
        is_listening = await server.listen()
    except TERMINAL_ERRORS as error:
        raise PlcError(f"{listen}: the line cannot be set up: {error.args[-1]}") from None
    if not is_listening:
        raise PlcError(f"{listen}: {_reason(listen)}")
    try:
        ready(_place(server, listen))
        moving = _move(plc, speed, tell)
        await (moving if seconds is None else asyncio.wait_for(moving, seconds))
    except (asyncio.CancelledError, TimeoutError):
        pass
    finally:
        await server.shutdown()


def _server_of(plc: VirtualPlc, listen: Address) -> Any:
    from pymodbus.server import ModbusSerialServer

    if not listen.device:
        return _tcp_server(plc, listen)
    line: dict[str, Any] = {
        "port": listen.device,
        "baudrate": listen.baud,
        "parity": PARITIES[listen.parity],
        "stopbits": listen.stop_bits,
    }
    return ModbusSerialServer(context_of(plc, listen.unit), ignore_missing_devices=True, **line)


def is_flood(data: bytes) -> bool:
    """Whether more requests of a client wait than it may have under way."""
    at = 0
    for _ in range(MOST_WAITING):
        at += HEAD + min(int.from_bytes(data[at + HEAD - 2 : at + HEAD], "big"), LONGEST)
    return at < len(data)


def _tcp_server(plc: VirtualPlc, listen: Address) -> Any:
    """A server that hangs up on who asks without end and on who takes no answer, so that all others get theirs."""
    from pymodbus.server import ModbusTcpServer
    from pymodbus.server.requesthandler import ServerRequestHandler

    class Connection(ServerRequestHandler):
        """One client."""

        def data_received(self, data: bytes) -> None:
            """Requests that have come since the last time."""
            if is_flood(data):
                self.transport.abort()  # type: ignore[attr-defined]
            else:
                super().data_received(data)

        def pause_writing(self) -> None:
            """Called when more answers wait than a client has taken for long."""
            self.transport.abort()  # type: ignore[attr-defined]

    class Server(ModbusTcpServer):
        """One listener for all of them."""

        def callback_new_connection(self) -> Connection:
            """As the library has it."""
            return Connection(self, self.trace_packet, self.trace_pdu, self.trace_connect)  # type: ignore[no-untyped-call]

    return Server(context_of(plc), address=(listen.host, listen.port))


def _place(server: Any, listen: Address) -> str:
    """Where it listens, as a URL without its scheme; a port 0 has become one of the system's choice."""
    if listen.device:
        return listen.device
    return endpoint(listen.host, server.transport.sockets[0].getsockname()[1])


def _reason(listen: Address) -> str:
    """Why nobody can listen there."""
    if listen.device:
        return serial_reason(listen.device)
    try:
        family, kind, number, _, place = socket.getaddrinfo(listen.host, listen.port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, number) as probe:
            probe.bind(place)
    except OSError as error:
        return f"cannot listen: {error.strerror or error}"
    return "cannot listen"


async def _move(plc: VirtualPlc, speed: float, tell: Callable[[str], None]) -> None:
    """Moves the PLC on, ``speed`` times as fast as the clock."""
    begin, first, is_late = time.monotonic(), plc.steps, False
    while True:
        due = first + int((time.monotonic() - begin) * speed / plc.dt)
        stop = time.monotonic() + SLICE
        while plc.steps < due and time.monotonic() < stop:
            plc.advance(1)
        behind = (due - plc.steps) * plc.dt / speed
        if behind > BEHIND:
            reached = (plc.steps - first) * plc.dt / (time.monotonic() - begin)
            if not is_late:
                tell(f"the simulation cannot keep up: {reached:.3g} times real time instead of {speed:g}")
            begin, first, is_late = time.monotonic(), plc.steps, True
        with suppress(asyncio.TimeoutError):
            await asyncio.sleep(0 if plc.steps < due else min(plc.dt / speed, SLICE))
