"""PLCs on the loopback of this machine: registers that a Modbus server gives out, and lines that are out of order."""

import asyncio
import threading
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("pymodbus", reason="the extra `live` is not installed")
from pymodbus.constants import ExcCodes
from pymodbus.datastore import ModbusBaseDeviceContext, ModbusServerContext
from pymodbus.server import ModbusTcpServer

import pidcfg
from pidcfg.vendors import VENDORS
from shell import captured
from shell import pidcfg as command

ROOT = Path(__file__).parents[1]
DL06, CLICK = ROOT / "examples/dl06/reactor.yaml", ROOT / "examples/click/tank.yaml"
READS = {1, 2, 3, 4}
TABLES = {1: "coil", 2: "discrete", 3: "holding", 4: "input"}
ASKED = set()
"""Every function code that any of the servers was ever asked for."""


def run(*words):
    """The command in this process: its exit code, what it prints, and what stands on the terminal besides."""
    code, terminal, out = captured(command, [str(word) for word in words])
    return SimpleNamespace(exit_code=code, stdout=out, stderr=terminal.replace(out, "") if out else terminal)


class Registers(ModbusBaseDeviceContext):
    """Registers by table and number; one that is not there is exception 2. ``before`` is called at every request."""

    def __init__(self, words, before=None):
        self.words, self.before, self.requests, self.writes = dict(words), before, 0, 0

    def getValues(self, func_code, address, count=1):  # noqa: N802 - pymodbus' name
        """What a client reads."""
        ASKED.add(func_code)
        self.requests += 1
        if self.before is not None and (code := self.before(self)) is not None:
            return ExcCodes(code)
        places = [(TABLES[func_code], address + k) for k in range(count)]
        return [self.words[p] for p in places] if all(p in self.words for p in places) else ExcCodes.ILLEGAL_ADDRESS

    def setValues(self, func_code, address, values):  # noqa: N802 - pymodbus' name
        """Nobody has any business here."""
        del address, values
        ASKED.add(func_code)
        self.writes += 1
        return ExcCodes.ILLEGAL_FUNCTION


def words_of(path, numbering=None):
    """The registers of an encoded configuration, by table and number."""
    result = pidcfg.encode(path)
    numbering = numbering or VENDORS[result.vendor].load("numbering")
    words = {}
    for cell in result.image.cells:
        place = numbering.place(cell.number)
        for k in range(place.width):
            words[place.table, place.register + k] = cell.raw >> place.shift(k) & 0xFFFF
    if result.vendor == "dl06":
        words["holding", 0o7642] = 0
    return words


class Desk:
    """An event loop in a thread of its own, and the servers on it."""

    def __init__(self):
        self.loop = asyncio.new_event_loop()
        self.thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        self.thread.start()

    def do(self, work):
        """The result of a coroutine on the desk's loop."""
        return asyncio.run_coroutine_threadsafe(work, self.loop).result(10)

    def close(self):
        """Everything is hung up."""

        async def end():
            talks = asyncio.all_tasks() - {asyncio.current_task()}
            for talk in talks:
                talk.cancel()
            await asyncio.gather(*talks, return_exceptions=True)
            await asyncio.sleep(0)

        self.do(end())
        self.loop.call_soon_threadsafe(self.loop.stop)
        self.thread.join()
        self.loop.close()

    @contextmanager
    def plc(self, registers, host="127.0.0.1"):
        """The URL of a PLC with these registers, to which nobody may have written in the end."""

        async def start():
            server = ModbusTcpServer(ModbusServerContext(registers, single=True), address=(host, 0))
            await server.serve_forever(background=True)
            return server, server.transport.sockets[0].getsockname()[1]

        server, port = self.do(start())
        try:
            yield f"modbus://{f'[{host}]' if ':' in host else host}:{port}"
            assert not registers.writes
        finally:
            self.do(server.shutdown())

    @contextmanager
    def line(self, answer):
        """The URL of something that answers each request of bytes with bytes; None hangs up."""

        async def talk(reader, writer):
            try:
                while head := await reader.read(260):
                    ASKED.add(head[7])
                    reply = answer(head)
                    if reply is None:
                        break
                    writer.write(reply)
                    await writer.drain()
            except OSError:
                pass
            finally:
                writer.close()

        server = self.do(asyncio.start_server(talk, "127.0.0.1", 0))
        try:
            yield f"modbus://127.0.0.1:{server.sockets[0].getsockname()[1]}"
        finally:
            self.loop.call_soon_threadsafe(server.close)
