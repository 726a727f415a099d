"""Programs that nobody here wrote: pyclickplc as server and client, clickplc, and a serial line by socat."""

import asyncio
import importlib.util
import json
import os
import shutil
import subprocess
import time
from pathlib import Path

import pymodbus
import pytest
from pyclickplc import ClickClient
from pyclickplc.server import ClickServer, MemoryDataProvider
from pymodbus.client import AsyncModbusTcpClient

import pidcfg
from apart import apart
from live_rig import CLICK, DL06, Registers, words_of
from pidcfg.live.link import Address, Link, Patience, PlcError, Request, parse_address
from test_serve import served, virtual

ANOTHER = os.environ.get("PIDCFG_ANOTHER_PYMODBUS", "")
"""A Python with another version of pymodbus, which `.ci/run` makes."""
ANOTHERS_SERVER = """
import asyncio, json, sys
from pymodbus import __version__
from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
from pymodbus.server import ModbusTcpServer

async def main():
    coils, holding = [0] * 65536, [0] * 65536
    for table, register, content in json.load(sys.stdin):
        (coils if table == "coil" else holding)[register] = content
    blocks = {"co": ModbusSequentialDataBlock(0, coils), "hr": ModbusSequentialDataBlock(0, holding)}
    slaves = ModbusSlaveContext(**blocks, zero_mode=True)
    server = ModbusTcpServer(ModbusServerContext(slaves=slaves), address=("127.0.0.1", 0))
    serving = asyncio.create_task(server.serve_forever())
    while server.transport is None:
        await asyncio.sleep(0.01)
    print(__version__, server.transport.sockets[0].getsockname()[1], flush=True)
    await serving

asyncio.run(main())
"""


def free_port(desk):
    """A port that nobody listens on."""

    async def ask():
        server = await asyncio.start_server(lambda *_: None, "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        server.close()
        await server.wait_closed()
        return port

    return desk.do(ask())


def test_a_click_of_pyclickplc_is_pulled(desk):
    """Its client writes the encoded values into its server; what is pulled are the same words."""
    image = pidcfg.encode(CLICK).image
    memory, port = MemoryDataProvider(), free_port(desk)
    for cell in image.cells:
        memory.set(cell.address, cell.value)
    server = ClickServer(memory, host="127.0.0.1", port=port)
    desk.do(server.start())
    try:
        url = f"modbus://127.0.0.1:{port}"
        assert {c.number: c.raw for c in pidcfg.pull(url, like=CLICK).image.cells} == image.words
        assert pidcfg.compare(CLICK, url).same
        memory.set("DF106", 7.5)
        (finding,) = pidcfg.compare(CLICK, url).findings
        assert "the PLC holds 7.5 %/degF (DF106 7.5), the file says 6 %/degF" in finding.message
    finally:
        desk.do(server.stop())


@pytest.mark.skipif(not ANOTHER, reason="PIDCFG_ANOTHER_PYMODBUS names no Python with another pymodbus")
@pytest.mark.parametrize("path", [CLICK, DL06], ids=lambda path: path.parent.name)
def test_a_server_of_another_pymodbus_is_pulled(path):
    rows = [(table, register, content) for (table, register), content in words_of(path).items()]
    there = subprocess.Popen([ANOTHER, "-c", ANOTHERS_SERVER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        json.dump(rows, there.stdin)
        there.stdin.close()
        version, port = there.stdout.readline().split()
        assert version != pymodbus.__version__
        url = f"modbus://127.0.0.1:{port}"
        pulled = {cell.number: cell.raw for cell in pidcfg.pull(url, like=path).image.cells}
        assert pidcfg.encode(path).image.words.items() <= pulled.items()
        assert pidcfg.compare(path, url).same
    finally:
        there.kill()
        there.wait()
        there.stdout.close()


def test_the_client_of_pyclickplc_reads_and_operates_a_served_click(desk):
    plc = virtual("click")

    async def operate(port):
        async with ClickClient("127.0.0.1", port) as client:
            before = await client.addr.read("DF101")
            await client.addr.write("DF101", 151.25)
            return before, await client.addr.read("DF101"), await client.addr.read("DS106")

    with served(desk, plc, speed=1.0) as (port, _):
        before, after, rate = apart(operate(port))
    assert (next(iter(before.values())), next(iter(after.values()))) == (140, 151.25)
    assert next(iter(rate.values())) == 500


def test_clickplc_reads_a_served_click(desk):
    clickplc = pytest.importorskip("clickplc")

    async def read(port):
        plc = clickplc.ClickPLC("127.0.0.1")
        plc.client = AsyncModbusTcpClient("127.0.0.1", port=port)  # its own port is fixed
        async with plc:
            return await plc.get("df101"), await plc.get("ds106"), await plc.get("c101")

    with served(desk, virtual("click"), speed=1.0) as (port, _):
        setpoint, rate, lower = apart(read(port))
    assert (setpoint, rate, lower) == (140, 500, True)


@pytest.mark.skipif(shutil.which("socat") is None, reason="socat, which makes a serial line, is not installed")
@pytest.mark.skipif(importlib.util.find_spec("serial") is None, reason="pyserial is not installed")
def test_a_serial_line(desk, tmp_path):
    ends = [tmp_path / "plc", tmp_path / "here"]
    line = subprocess.Popen(["socat", *(f"pty,raw,echo=0,link={end}" for end in ends)])
    try:
        for _ in range(100):
            if all(map(Path.exists, ends)):
                break
            time.sleep(0.02)
        query = "?baud=38400&parity=none"
        listen = parse_address(f"modbus+rtu://{ends[0]}{query}&unit=3")
        with served(desk, virtual("dl06"), 1.0, listen):
            assert pidcfg.compare(DL06, f"modbus+rtu://{ends[1]}{query}&unit=3", timeout=1.0).same
            with pytest.raises(PlcError, match=r"no answer within 0.1 s; look at .* the parity; here it is unit 4"):
                pidcfg.pull(f"modbus+rtu://{ends[1]}{query}&unit=4", vendor="dl06", timeout=0.1, retries=0)
    finally:
        line.terminate()
        line.wait()


def test_every_request_fits_into_the_protocol(desk):
    """Eight loops of a CLICK: three reads a loop at most, and none that is too long."""
    registers = Registers(words_of(CLICK))
    with desk.plc(registers) as url:
        pidcfg.pull(url, like=CLICK)
        assert registers.requests == 6  # three blocks, read twice

        async def read():
            async with Link(Address("127.0.0.1", int(url.rpartition(":")[2])), Patience()) as link:
                return await link.read(Request("coil", 16484, 40, "C101 to C140"))

        assert len(apart(read())) == 40
