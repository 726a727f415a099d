"""Live commands: endings, charts, the Modbus programs of others, and our CLICK values written and read by them."""

from __future__ import annotations

import asyncio
import csv
import errno
import gc
import importlib.util
import io
import json
import os
import shutil
import signal
import socket
import subprocess
import threading
import time
import warnings
from contextlib import asynccontextmanager
from itertools import count
from pathlib import Path

import pytest

pytest.importorskip("pyclickplc")

import pymodbus
from hypothesis import HealthCheck, Phase, given, settings
from pyclickplc import BANKS, ClickClient
from pyclickplc.server import ClickServer, MemoryDataProvider
from pymodbus.client import AsyncModbusTcpClient, ModbusSerialClient

import pidcfg
from apart import apart
from click_strategies import configurations
from live_rig import CLICK, DL06, Registers, run, words_of
from pidcfg.cli import interrupts
from pidcfg.cli.commands import trend as live_chart
from pidcfg.cli.commands.trend import REDRAW_SECONDS, LiveChart, chart_for
from pidcfg.encoders.click.files import FORMATS
from pidcfg.encoders.click.image import encode
from pidcfg.encoders.codecs import single_bits
from pidcfg.encoders.maps.click import BLOCKS, SPACE
from pidcfg.live.link import Address, Link, PlcError, Request, RetryPolicy, parse_address
from pidcfg.schemas.click import ClickFile
from pidcfg.text.source import read_document
from test_serve import served, virtual

# --- Ctrl-C and SIGTERM: what is to end with a result ends with it, and everything else as any command does -----------

SCENARIO = CLICK.with_name("tank.scenario.yaml")
BOTH = [signal.SIGINT, signal.SIGTERM]


@pytest.fixture
def handlers(monkeypatch):
    """The handlers of the command line, which are there again after the work."""
    before = {number: signal.getsignal(number) for number in BOTH}
    running = asyncio._get_running_loop()
    asyncio._set_running_loop(None)  # that of a browser, if a test before this one has begun it
    monkeypatch.setattr(os, "register_at_fork", lambda **_: None)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    interrupts.begin_command()
    installed = {number: signal.getsignal(number) for number in BOTH}
    yield
    assert {number: signal.getsignal(number) for number in BOTH} == installed
    for number, handler in before.items():
        signal.signal(number, handler)
    asyncio._set_running_loop(running)


@pytest.mark.usefixtures("handlers")
@pytest.mark.parametrize("number", BOTH)
def test_a_server_that_is_ended_gives_its_report(number):
    result = pidcfg.serve(SCENARIO, listen="127.0.0.1:0", ready=lambda _: signal.raise_signal(number))
    assert result.ok
    assert result.outcome.report is not None


@pytest.mark.usefixtures("handlers")
def test_a_server_in_a_notebook_is_ended_by_ctrl_c():
    main = threading.main_thread().ident

    async def cell():
        ready = lambda _: signal.pthread_kill(main, signal.SIGINT)  # noqa: E731
        return pidcfg.serve(SCENARIO, listen="127.0.0.1:0", ready=ready)

    assert asyncio.run(cell()).outcome.report is not None


def test_where_no_loop_can_be_made_the_error_is_all_that_is_told(monkeypatch):
    def refuse(*_, **__):
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(asyncio.events, "new_event_loop", refuse)
    monkeypatch.setattr(asyncio, "_get_running_loop", lambda: None)
    with warnings.catch_warnings(record=True, action="always") as told:
        with pytest.raises(OSError, match="Too many"):
            pidcfg.serve(SCENARIO, listen="127.0.0.1:0")
        gc.collect()
    assert [str(one.message) for one in told] == []


@pytest.mark.usefixtures("handlers")
def test_ctrl_c_before_the_work_has_begun_ends_it_in_a_notebook_too(monkeypatch):
    from concurrent.futures import ThreadPoolExecutor

    submit = ThreadPoolExecutor.submit

    def late(pool, *work):
        signal.raise_signal(signal.SIGINT)
        return submit(pool, *work)

    async def cell():
        return pidcfg.serve(SCENARIO, listen="127.0.0.1:0", seconds=20)

    monkeypatch.setattr(ThreadPoolExecutor, "submit", late)
    with warnings.catch_warnings(record=True, action="always") as told:
        with pytest.raises(KeyboardInterrupt):
            asyncio.run(cell())
        gc.collect()
    assert told == []


@pytest.mark.usefixtures("handlers")
@pytest.mark.parametrize("number", BOTH)
def test_a_trend_that_is_ended_keeps_its_rows(desk, number):
    out = io.StringIO()

    def taken(*_):
        if out.getvalue().count("\n") == 3:
            signal.raise_signal(number)

    with desk.plc(Registers(words_of(CLICK))) as url:
        result = pidcfg.trend(url, out, like=CLICK, interval=0.001, taken=taken)
    assert (result.rows, out.getvalue().count("\n")) == (2, 3)


@pytest.mark.usefixtures("handlers")
@pytest.mark.parametrize(
    ("number", "ending"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, interrupts.Terminated)]
)
def test_a_reading_that_is_ended_is_no_result(desk, number, ending):
    with desk.plc(Registers(words_of(CLICK), lambda _: os.kill(os.getpid(), number))) as url, pytest.raises(ending):
        pidcfg.pull(url, like=CLICK)


@pytest.mark.usefixtures("handlers")
def test_the_command_ends_with_the_report(monkeypatch):
    monkeypatch.setattr("pidcfg.cli.commands.plc._exposure_text", lambda _: signal.raise_signal(signal.SIGINT))
    done = run("serve", SCENARIO, "--listen", "127.0.0.1:0")
    assert done.exit_code == 0, done
    assert "in steps of 0.1 s" in done.stdout
    assert any(line.startswith("nothing was expected of this run") for line in done.stdout.splitlines())
    assert max(map(len, done.stdout.splitlines())) < 120, "a signal that was never seen has no 300 digits"


# --- The loops of a PLC are drawn while they are recorded: for a person, and for nobody else --------------------------


class Terminal(io.StringIO):
    """A stream that says it is one."""

    encoding = "ascii"

    def isatty(self):
        """Yes."""
        return True


@pytest.fixture
def chart(monkeypatch):
    """A chart that takes rows and draws nothing."""
    chart = LiveChart(600.0)
    monkeypatch.setattr(chart, "_draw", lambda: None)
    for i in range(30):
        values = {f"L{k}.{signal}": str(10 * k + i) for k in range(8) for signal in ("SP", "OUT", "PV")}
        chart.add_row(float(i), {**values, "L0.MODE": "auto"})
    return chart


def test_as_many_loops_as_there_is_room_for(chart):
    for height, loops in ((24, 1), (60, 4), (130, 8)):
        text = chart.text(80, height, ascii_only=True)
        assert text.isascii()
        assert sum(f"L{k}" in text for k in range(8)) == loops
        assert len(text.splitlines()) <= height
        assert max(map(len, text.splitlines())) <= 80
        left = f"; {8 - loops} more loops are recorded" if loops < 8 else ""
        assert text.splitlines()[-1] == f"29 of 600 s, 30 rows{left}"
    assert "L0, auto" in text


def test_a_value_that_is_none_is_left_out(chart):
    chart.add_row(30.0, {"L0.PV": "", "L0.SP": "5", "L0.OUT": "5"})
    assert len(chart.signals["L0.PV"]) == 30
    assert len(chart.signals["L0.SP"]) == 31
    assert "30 of 600 s, 31 rows" in chart.text(80, 24, ascii_only=True)


def test_only_a_person_sees_it(monkeypatch):
    monkeypatch.setattr(live_chart.LINE, "silent", False)
    assert chart_for("run.csv", None) is None
    monkeypatch.setattr("sys.stderr", Terminal())
    monkeypatch.setattr(live_chart, "is_watched", lambda: True)
    monkeypatch.setattr(live_chart.LINE, "silent", False)
    assert chart_for("run.csv", None) is not None
    monkeypatch.setattr(live_chart.LINE, "silent", True)
    assert chart_for("run.csv", None) is None
    monkeypatch.setattr(live_chart.LINE, "silent", False)
    monkeypatch.setattr("sys.stdout", Terminal())
    assert chart_for(None, None) is None, "the rows themselves are there"


def test_it_is_drawn_and_its_last_picture_stays(monkeypatch):
    stream = Terminal()
    monkeypatch.setattr("sys.stderr", stream)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("LINES", "24")
    chart = LiveChart(None)
    chart.add_row(0.0, {"L.PV": "1", "L.SP": "1", "L.OUT": "1"})
    for i in range(1, 5):
        monkeypatch.setattr(chart, "_last_drawn", chart._last_drawn - REDRAW_SECONDS)
        chart.add_row(float(i), {"L.PV": str(i), "L.SP": "1", "L.OUT": "1"})
    chart.close()
    pictures = stream.getvalue().count("until Ctrl-C")
    assert pictures >= 5
    assert "4 s, until Ctrl-C, 5 rows" in stream.getvalue().splitlines()[-2]


def test_a_row_that_comes_late_has_the_time_of_its_values(desk):
    numbers = count()

    def slow(registers):
        if next(numbers) == 12:
            time.sleep(0.3)
            registers.words["holding", 0o2003] = 0x0123

    out = io.StringIO()
    with desk.plc(Registers(words_of(DL06), slow)) as url:
        pidcfg.trend(url, out, like=DL06, seconds=0.2, interval=0.05)
    rows = [row.split(",") for row in out.getvalue().splitlines()]
    column, first = rows[0].index("FIC-102.PV"), rows[1]
    assert float(first[0]) == 0
    assert float(next(row[0] for row in rows[1:] if row[column] != first[column])) > 0.25


# --- Programs that nobody here wrote: pyclickplc as server and client, clickplc, and a serial line by socat -----------

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


@pytest.mark.skipif(shutil.which("socat") is None, reason="socat, which makes a serial line, is not installed")
@pytest.mark.skipif(shutil.which("mbpoll") is None, reason="mbpoll, a client in C, is not installed")
@pytest.mark.skipif(importlib.util.find_spec("serial") is None, reason="pyserial is not installed")
def test_foreign_clients_reach_each_unit_of_a_serial_line(desk, tmp_path):
    ends = [tmp_path / "plc", tmp_path / "here"]
    line = subprocess.Popen(["socat", *(f"pty,raw,echo=0,link={end}" for end in ends)])
    try:
        for _ in range(100):
            if all(map(Path.exists, ends)):
                break
            time.sleep(0.02)
        listen = parse_address(f"modbus+rtu://{ends[0]}?baud=38400&parity=none&unit=3")
        with served(desk, {3: virtual("dl06"), 5: virtual("click")}, 1.0, listen):

            def mbpoll(unit, register, *more, kind):
                words = ("mbpoll", "-m", "rtu", "-b", "38400", "-P", "none", "-a", str(unit), "-0", "-1", "-q")
                line = (*words, "-t", kind, "-r", str(register), str(ends[1]), *more)
                return subprocess.run(line, capture_output=True, text=True, check=False).stdout

            assert "[28872]: \t140" in mbpoll(5, 28872, kind="4:float")
            mbpoll(5, 28872, "150.5", kind="4:float")
            assert "[28872]: \t150.5" in mbpoll(5, 28872, kind="4:float")
            assert "[4001]: \t3" in mbpoll(3, 4001, kind="4")
            assert "[4001]" not in mbpoll(4, 4001, kind="4")
            with ModbusSerialClient(str(ends[1]), baudrate=38400, parity="N", timeout=1) as client:
                assert client.read_holding_registers(4001, count=1, device_id=3).registers == [3]
                found = client.read_holding_registers(28872, count=2, device_id=5).registers
            assert client.convert_from_registers(found, client.DATATYPE.FLOAT32, "little") == 150.5
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
            async with Link(Address("127.0.0.1", int(url.rpartition(":")[2])), RetryPolicy()) as link:
                return await link.read(Request("coil", 16484, 40, "C101 to C140"))

        assert len(apart(read())) == 40


# --- Our CLICK values written to a simulated PLC by real Modbus clients, and read back from it, bit for bit -----------


ROOT = Path(__file__).parents[1]
FILES = sorted(
    path for path in (ROOT / "examples" / "click").glob("*.yaml") if not path.name.endswith(".scenario.yaml")
)
STARTER = ROOT / "src" / "pidcfg" / "cli" / "starters" / "click.yaml"
HOST = "127.0.0.1"
FEW = settings(
    max_examples=6,
    deadline=None,
    phases=[Phase.generate],
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)  # each example starts a server and sends hundreds of telegrams


def image_of(path: Path):
    """The image of a configuration file."""
    return encode(ClickFile.model_validate(read_document(path.read_bytes(), path.name).data)).image


def a_free_port() -> int:
    """A port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        return probe.getsockname()[1]


@asynccontextmanager
async def simulated():
    """The memory of a simulated PLC, and its port."""
    memory, port = MemoryDataProvider(), a_free_port()
    async with ClickServer(memory, host=HOST, port=port):
        yield memory, port


def native(cell):
    """A cell as pyclickplc has values: a switch is a bool, a DS a signed number, a DF a float."""
    return float(cell.value) if cell.address.startswith("DF") else cell.value


async def by_address(image) -> dict[int, int]:
    """Writes every cell by its address, and reads the blocks of every loop as ranges."""
    async with simulated() as (_, port), ClickClient(HOST, port) as plc:
        for cell in image.cells:
            await plc.addr.write(cell.address, native(cell))
        found = {}
        for entry in image.settings:
            for key, (_, table) in BLOCKS.items():
                first = SPACE.parse(entry[key])
                last = SPACE.name(first + table.size - 1)
                for address, value in (await plc.addr.read(f"{entry[key]}-{last}")).items():
                    found[SPACE.parse(address)] = SPACE.kind_of(first).read(value)
        return found


async def by_register(text: str) -> dict[int, int]:
    """Writes the rows of our Modbus map one by one, and tells what the PLC then holds."""
    async with simulated() as (memory, port):
        client = AsyncModbusTcpClient(HOST, port=port)
        assert await client.connect()
        addresses = set()
        for row in csv.DictReader(line for line in text.splitlines() if not line.startswith("#")):
            register, value = int(row["register"]), int(row["value"])
            if row["table"] == "coil":
                answer = await client.write_coil(register, bool(value))
            else:
                answer = await client.write_register(register, value)
            assert not answer.isError(), row
            addresses.add(row["address"])
        client.close()
        return {SPACE.parse(a): SPACE.kind_of(SPACE.parse(a)).read(memory.read(a)) for a in addresses}


@pytest.mark.parametrize("path", [STARTER, *FILES], ids=lambda path: path.name)
def test_a_client_reads_back_what_we_encoded(path):
    image = image_of(path)
    assert apart(by_address(image)) == image.words


@pytest.mark.parametrize("path", [STARTER, *FILES], ids=lambda path: path.name)
def test_the_modbus_map_written_register_by_register_is_the_same_memory(path):
    image = image_of(path)
    assert apart(by_register(FORMATS["modbus"].write(image, ()))) == image.words


@FEW
@given(configurations())
def test_any_configuration_reaches_the_plc_bit_for_bit(config):
    image = encode(config).image
    assert apart(by_address(image)) == image.words
    assert apart(by_register(FORMATS["modbus"].write(image, ()))) == image.words


def test_a_float_in_the_wrong_word_order_would_be_seen():
    """The comparison has teeth: the words of DF106 exchanged are another number."""
    image = image_of(STARTER)
    text = FORMATS["modbus"].write(image, ())
    gain = next(c for c in image.cells if c.field == "proportional_gain")
    low, high = gain.raw & 0xFFFF, gain.raw >> 16
    lines = text.splitlines(keepends=True)
    at = next(i for i, line in enumerate(lines) if ",proportional_gain, low word" in line.replace('"', ""))
    lines[at] = lines[at].replace(f",{low},", f",{high},")
    lines[at + 1] = lines[at + 1].replace(f",{high},", f",{low},")
    found = apart(by_register("".join(lines)))
    assert found[gain.number] == high | low << 16 != gain.raw
    assert {n: raw for n, raw in found.items() if n != gain.number} == {
        n: raw for n, raw in image.words.items() if n != gain.number
    }


def test_the_address_space_is_that_of_the_simulated_plc():
    for bank in SPACE.banks:
        assert (BANKS[bank.prefix].min_addr, BANKS[bank.prefix].max_addr) == (bank.first, bank.last)


def test_extreme_floats_survive_the_way():
    """The largest, the smallest normal and a negative zero's neighbour, through one register pair."""

    async def exchange(raws):
        async with simulated() as (_, port), ClickClient(HOST, port) as plc:
            found = []
            for raw in raws:
                await plc.df.write(500, SPACE.kind_of(SPACE.parse("DF500")).show(raw))
                found.append(single_bits(await plc.df[500]))
            return found

    raws = [0x7F7FFFFF, 0xFF7FFFFF, 0x00800000, 0x80000001, 0x3DCCCCCD]
    assert apart(exchange(raws)) == raws
