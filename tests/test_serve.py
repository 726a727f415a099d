"""The virtual PLC behind its register map: what others read is what it calculates, and they operate it."""

import asyncio
import io
import json
import random
import shutil
import signal
import socket
import struct
import subprocess
from contextlib import ExitStack, contextmanager, suppress
from itertools import count
from threading import Event, Thread, get_ident
from time import sleep
from types import SimpleNamespace

import pytest

pytest.importorskip("pymodbus", reason="the extra `live` is not installed")
from pymodbus.client import AsyncModbusTcpClient

import pidcfg
from apart import apart
from live_rig import CLICK, DL06, run
from pidcfg.encoders.codecs import bcd_word
from pidcfg.live import serving as server_module
from pidcfg.live import serving as serving_module
from pidcfg.live import trend as trend_module
from pidcfg.live.link import Address, PlcError
from pidcfg.live.serving import (
    MAX_LISTED_WRITES,
    MAX_SPEED,
    MAX_WAITING_REQUESTS,
    VirtualPlc,
    _run_in_real_time,
    _server_of,
    is_flood,
    serve_plcs,
)
from pidcfg.live.trend import TrendOptions, _readings
from pidcfg.sim.controllers.settings import RegisterError
from pidcfg.study.scenario import load_scenario
from pidcfg.text.reader import DEFAULT, reader_of
from pidcfg.validate.engine import document_of
from pidcfg.vendors import VENDORS

SCENARIOS = {"dl06": DL06.with_name("reactor.scenario.yaml"), "click": CLICK.with_name("tank.scenario.yaml")}
DF101, DF106, DF109, DF113, C116, C117 = 28872, 28882, 28888, 28896, 16499, 16500
LIC = 0o2100
"""The third loop of the reactor: in Auto, and of no cascade."""
MANUAL, AUTO = 1, 2
LOOPBACK = Address("127.0.0.1", 0)


def virtual(vendor):
    """The virtual PLC of an example."""
    loaded = load_scenario(document_of(SCENARIOS[vendor], None, None, DEFAULT), reader_of(None))
    return VirtualPlc(loaded, VENDORS[vendor].load("numbering"))


def number(plc, register):
    """A single-precision number, the low word first."""
    low, high = plc.read("holding", register, 2)
    return struct.unpack("<f", struct.pack("<HH", low, high))[0]


def halves(value):
    """The two words of a number."""
    return struct.unpack("<HH", struct.pack("<f", value))


@contextmanager
def served(desk, plc, speed=1000.0, listen=LOOPBACK):
    """The port at which a PLC is served, or several by their units, and what it says."""
    said, ready = [], Event()
    where = []
    plcs = plc if isinstance(plc, dict) else {listen.unit: plc}

    async def start():
        return asyncio.ensure_future(
            serve_plcs(plcs, listen, speed, None, lambda place: (where.append(place), ready.set()), said.append)
        )

    task = desk.do(start())
    assert ready.wait(10)
    try:
        yield int(where[0].rpartition(":")[2] or 0) if listen is LOOPBACK else 0, said
    finally:
        desk.loop.call_soon_threadsafe(task.cancel)
        desk.do(gathered(task))


async def gathered(task):
    """The end of a task."""
    await asyncio.wait([task], timeout=10)


@pytest.mark.parametrize("vendor", SCENARIOS)
def test_a_fresh_plc_holds_what_was_encoded(vendor):
    plc = virtual(vendor)
    encoded = pidcfg.encode({"dl06": DL06, "click": CLICK}[vendor]).image
    numbering = VENDORS[vendor].load("numbering")
    running = {"pv", "raw_pv", "output", "bias", "mode_and_alarm_status", "alarm_low", "alarm_low_low", "setpoint"}
    running |= {"manual_indication"}
    for cell in encoded.cells:
        place = numbering.place(cell.number)
        held = plc.read(place.table, place.register, place.width)
        raw = sum(content << 16 * k for k, content in enumerate(held))
        assert raw == cell.raw or cell.field in running, cell
    assert plc.steps == 0


def test_a_click_shows_its_mode_in_the_bits_that_may_tell_it():
    plc = virtual("click")
    assert plc.read("coil", C116 + 10, 2) == [1, 0]
    plc.advance(500)
    assert plc.read("coil", C116 + 10, 2) == [0, 1]


def test_signals_and_registers_say_the_same():
    plc = virtual("click")
    plc.advance(500)
    signals, names = plc.run.net.signal_values, plc.run.net.slots
    assert number(plc, DF113) == pytest.approx(signals[names["TANK1.PV"]], rel=1e-6)
    assert number(plc, DF109) == pytest.approx(signals[names["TANK1.CO"]], rel=1e-6)
    assert number(plc, DF101) == 140
    plc = virtual("dl06")
    plc.advance(500)
    (counts,) = plc.read("holding", LIC + 3, 1)
    name = plc.run.plc.loops[2]
    low, high, span = plc.run.plc.scales[2]
    assert low + counts * (high - low) / span == pytest.approx(
        plc.run.net.signal_values[plc.run.net.slots[f"{name}.PV"]]
    )
    assert plc.read("holding", LIC + 6, 1) == [AUTO]


def test_an_operator_of_a_click():
    plc = virtual("click")
    plc.advance(200)
    plc.write("holding", DF101, halves(150.5))
    assert number(plc, DF101) == 150.5
    with pytest.raises(RegisterError, match="read-only unless the loop is in Manual") as error:
        plc.write("holding", DF109, halves(20.0))
    assert error.value.code == 4
    plc.write("coil", C116, [1])
    plc.advance(10)
    assert plc.read("coil", C116, 1) == [0]
    plc.write("holding", DF109, halves(20.0))
    plc.advance(10)
    assert number(plc, DF109) == 20
    plc.write("coil", C117, [1])
    plc.advance(10)
    report = plc.report()
    assert [change.mode for change in report.loops["TANK1"].modes] == ["auto", "manual", "auto"]
    assert [note.text for note in report.events] == [
        "set setpoint.value to 150.5",
        "request mode manual",
        "set state.output to 20.0",
        "request mode auto",
    ]


def test_writes_do_what_the_same_events_of_a_scenario_do():
    """A write between two base steps is the event at that time, to the bit."""
    text = SCENARIOS["click"].read_text("utf-8")
    plc = virtual("click")
    plc.advance(3000)
    plc.write("holding", DF101, halves(120.0))
    plc.advance(500)
    plc.write("coil", C116, [1])
    plc.advance(100)
    plc.write("holding", DF109, halves(20.0))
    plc.advance(300)
    events = """events:
  - {at: 300, loop: TANK1, set: {setpoint: 120}}
  - {at: 350, loop: TANK1, mode: manual}
  - {at: 360, loop: TANK1, set: {output: 20}}
"""
    changed = text.replace("events:\n", events)
    assert changed != text
    other = load_scenario(document_of(changed, SCENARIOS["click"].as_posix(), None, DEFAULT), reader_of(None))
    twin = VirtualPlc(other, VENDORS["click"].load("numbering"))
    twin.advance(3900)
    assert twin.run.net.signal_values == plc.run.net.signal_values


def test_an_output_that_is_written_reaches_the_plant_as_that_of_an_event_does():
    plc = virtual("dl06")
    name, (setting,) = plc.run.plc.loops[2], plc.read("holding", LIC, 1)
    plc.advance(100)
    plc.write("holding", LIC, [setting | MANUAL])
    plc.advance(50)
    plc.write("holding", LIC + 5, [1024])
    plc.advance(40)
    first = f"  - {{at: 20, loop: {name}, mode: manual}}"
    events = f"events:\n{first}\n  - {{at: 30, loop: {name}, set: {{output: 1024 counts}}}}\n"
    changed = SCENARIOS["dl06"].read_text("utf-8").replace("events:\n", events)
    other = load_scenario(document_of(changed, SCENARIOS["dl06"].as_posix(), None, DEFAULT), reader_of(None))
    twin = VirtualPlc(other, VENDORS["dl06"].load("numbering"))
    twin.advance(190)
    assert [note.text for note in twin.report().events][:2] == ["request mode manual", "set output to 1024 counts"]
    assert twin.run.net.signal_values == plc.run.net.signal_values


def test_an_operator_of_a_dl06():
    plc = virtual("dl06")
    plc.advance(100)
    plc.write("holding", LIC + 2, [0x0900])
    assert plc.read("holding", LIC + 2, 1) == [0x0900]
    (setting,) = plc.read("holding", LIC, 1)
    plc.write("holding", LIC, [setting | MANUAL])
    plc.advance(2)
    assert plc.read("holding", LIC, 1) == [setting]
    assert plc.read("holding", LIC + 6, 1) == [MANUAL]
    plc.write("holding", LIC + 5, [0x0400])
    plc.advance(5)
    assert plc.read("holding", LIC + 5, 1) == [0x0400]
    plc.write("holding", LIC + 0o10, [bcd_word(250)])
    assert plc.run.plc.states[2].gain == 2.5
    plc.write("holding", LIC, [setting ^ 0x0010])
    assert plc.run.plc.configs[2].reverse == int(bool((setting ^ 0x0010) & 0x0010))


@pytest.mark.parametrize(
    ("vendor", "table", "register", "contents", "code"),
    [
        ("click", "holding", 500, [0], 2),
        ("click", "coil", DF101, [0], 2),
        ("click", "input", DF101, [0], 2),
        ("click", "holding", DF113, [0, 0], 2),
        ("click", "holding", 100, [1], 2),
        ("click", "holding", DF101, [0, 0x7FC0], 3),
        ("dl06", "coil", 1024, [0], 2),
        ("dl06", "holding", 0o7642, [0], 2),
        ("dl06", "holding", LIC + 3, [0], 2),
        ("dl06", "holding", LIC + 6, [0], 2),
        ("dl06", "holding", LIC + 0o10, [0x00A0], 3),
        ("dl06", "holding", LIC + 2, [0x1000], 3),
        ("dl06", "holding", 0o7641, [0x000F], 3),
        ("dl06", "holding", 0o2077, [0, 0, 0, 0], 2),
    ],
)
def test_what_the_plc_refuses_is_an_exception_and_changes_nothing(vendor, table, register, contents, code):
    plc = virtual(vendor)
    before = {place: plc.read(*place, 1) for place in plc._map}
    with pytest.raises(RegisterError) as error:
        plc.write(table, register, contents)
    assert error.value.code == code
    assert {place: plc.read(*place, 1) for place in plc._map} == before
    assert not plc.report().events


def test_each_function_reads_or_writes_its_table():
    done = []

    def write(table, *where):
        done.append((table, *where))
        if table == "holding":
            raise RegisterError(3, "no")

    def read(table, first, number):
        if table in {"coil", "input"}:
            raise RegisterError(2, "no")
        return [f"{table} {first}"] * number

    context = server_module.context_of({7: SimpleNamespace(read=read, write=write)})[7]
    assert [context.getValues(code, 5, 1) for code in (1, 2, 3, 4, 22, 23)] == [
        2, ["discrete 5"], ["holding 5"], 2, ["holding 5"], ["holding 5"]
    ]  # fmt: skip
    assert [context.setValues(code, 5, [1]) for code in (5, 6, 15, 16, 22, 23)] == [None, 3, None, 3, 3, 3]
    assert done == [(table, 5, [1]) for table in ("coil", "holding") * 2 + ("holding",) * 2]


def test_a_plc_that_was_never_moved_has_a_report():
    plc = virtual("click")
    report = plc.report()
    assert (plc.run.last, report.duration, plc.unlisted_writes) == (0, 0.0, 0)
    plc = virtual("click")
    plc.advance(5)
    plc.report()
    assert plc.run.last == 4


def test_a_set_point_that_is_written_begins_a_step_and_nothing_else_does(monkeypatch):
    plc, begun = virtual("click"), []
    monkeypatch.setattr(type(plc.run.agenda), "begin_step", lambda _, *step: begun.append(step))
    plc.advance(3)
    before = number(plc, DF101)
    plc.write("holding", DF106, halves(3.25))
    plc.write("holding", DF101, halves(before))
    assert begun == []
    plc.write("holding", DF101, halves(before + 5))
    assert begun == [(3, 0, before)]
    plc.advance(17)
    plc.write("holding", DF101, halves(before + 7))
    assert plc.run.agenda.past_events[-1].at == pytest.approx(20 * plc.dt)
    assert plc.dt != 1.0
    assert [trend_module.is_mapped(VENDORS["click"].load("numbering"), place) for place in (101, -7)] == [True, False]


def test_a_panel_that_writes_all_the_time_does_not_fill_the_memory():
    plc = virtual("click")
    for k in range(MAX_LISTED_WRITES + 50):
        plc.write("holding", DF101, halves(100.0 + k % 2))
    assert plc.unlisted_writes == 50
    assert len(plc.report().events) == MAX_LISTED_WRITES


def test_a_dl06_is_served_and_compared_and_goes_on(desk):
    plc = virtual("dl06")
    with served(desk, plc) as (port, _):
        url = f"modbus://127.0.0.1:{port}"
        assert pidcfg.compare(DL06, url).same
        pulled = pidcfg.pull(url, vendor="dl06")
        assert [loop["name"] for loop in pulled.data["loops"]] == ["LOOP-1", "LOOP-2", "LOOP-3"]
        seen = plc.steps
        assert pidcfg.compare(DL06, url).same
        assert plc.steps > seen


def test_a_trend_has_what_the_registers_say(desk):
    plc = virtual("dl06")
    plc.advance(100)
    out, rows = io.StringIO(), []
    with served(desk, plc, speed=1e-6) as (port, _):
        url = f"modbus://127.0.0.1:{port}"
        result = pidcfg.trend(url, out, like=DL06, seconds=0.0, taken=lambda _, values: rows.append(values))
    header, line = (row.split(",") for row in out.getvalue().splitlines())
    values = dict(zip(header, line, strict=True))
    assert result.rows == 1
    assert {name: text for name, text in values.items() if name != "time"} == rows[0]
    signals, names = plc.run.net.signal_values, plc.run.net.slots
    for loop in plc.run.plc.loops:
        assert float(values[f"{loop}.PV"]) == pytest.approx(signals[names[f"{loop}.PV"]], abs=0.05)
        assert float(values[f"{loop}.OUT"]) == pytest.approx(signals[names[f"{loop}.OUT"]], abs=0.05)
    assert [values[f"{loop}.MODE"] for loop in plc.run.plc.loops] == ["cascade", "auto", "auto"]


def test_an_interrupt_keeps_the_rows_of_a_trend(desk):
    out = io.StringIO()

    def interrupt(at, values):
        del at, values
        if out.getvalue().count("\n") == 4:
            asyncio.current_task().cancel()

    with served(desk, virtual("click"), speed=1.0) as (port, _):
        result = pidcfg.trend(f"modbus://127.0.0.1:{port}", out, like=CLICK, interval=0.001, taken=interrupt)
    assert result.rows == 3
    assert len(out.getvalue().splitlines()) == 4


def test_a_plc_that_goes_leaves_the_rows_of_a_trend(desk, tmp_path):
    out = tmp_path / "run.csv"
    plc = virtual("click")
    reads = count()

    def gone(registers, *place):
        if next(reads) > 40:
            raise RegisterError(1, "no longer")
        return VirtualPlc.read(registers, *place)

    plc.read = gone.__get__(plc)
    with served(desk, plc, speed=1.0) as (port, _):
        arguments = ("trend", "--plc", f"modbus://127.0.0.1:{port}", "--like", CLICK, "--interval", "0.001", "-o", out)
        done = run(*arguments)
        again = run(*arguments)
    assert (done.exit_code, again.exit_code) == (2, 2)
    assert "exception 1" in done.stderr
    assert len(out.read_text("utf-8").splitlines()) > 5
    missing = tmp_path / "missing.csv"
    assert (
        run("trend", "--plc", "modbus://127.0.0.1:1", "--like", CLICK, "--retries", "0", "-o", missing).exit_code == 2
    )
    assert not missing.exists()


def test_it_says_when_it_cannot_keep_up(desk):
    with served(desk, virtual("click"), speed=1e6) as (port, said):
        for _ in range(200):
            if said:
                break
            assert pidcfg.pull(f"modbus://127.0.0.1:{port}", like=CLICK).ok
    assert "cannot keep up" in said[0]
    assert len(said) == 1


class Clock:
    """A clock that goes on only when somebody sleeps or works; it ends what sleeps too often."""

    def __init__(self, monkeypatch, module, jumps=(), most=60):
        self.now, self.slept, self.jumps, self.most = 0.0, [], [*jumps], most
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: self.now))
        monkeypatch.setattr(asyncio, "sleep", self.sleep)

    async def sleep(self, seconds):
        """Notes it, and goes on by as much, or by the next jump."""
        self.slept.append(round(seconds, 6))
        if len(self.slept) > self.most:
            raise asyncio.CancelledError
        self.now += self.jumps.pop(0) if self.jumps else seconds


def moved(monkeypatch, *, dt, speed, cost, jumps=(), most=60):
    """The steps of a PLC, of which each costs time, what it said and the pauses in between."""
    said = []
    clock = Clock(monkeypatch, server_module, jumps, most)
    plc = SimpleNamespace(dt=dt, steps=3)

    def advance(steps):
        plc.steps += steps
        clock.now += cost

    plc.advance = advance
    with suppress(asyncio.CancelledError):
        apart(_run_in_real_time(plc, speed, said.append))
    return plc.steps - 3, said, clock.slept[:most]


def test_it_goes_as_fast_as_the_clock_times_the_speed(monkeypatch):
    assert moved(monkeypatch, dt=0.5, speed=1.0, cost=0.0) == (2, [], [0.02] * 60)
    assert moved(monkeypatch, dt=0.5, speed=50.0, cost=0.0) == (60, [], [0.01] * 60)


def test_how_far_it_is_behind_is_said_once(monkeypatch):
    """A step of 1 s costs half a second: at 4 s it has done one of four, and is 3 s behind at most one is allowed."""
    text = "the simulation cannot keep up: {} times real time instead of {}"
    _, said, slept = moved(monkeypatch, dt=1.0, speed=1.0, cost=0.5, jumps=[4.0, 0.0, 9.0])
    assert said == [text.format("0.222", 1)]
    assert slept[:4] == [0.02, 0.0, 0.02, 0.0]
    assert moved(monkeypatch, dt=1.0, speed=1.0, cost=0.5, jumps=[2.0])[1] == []
    assert moved(monkeypatch, dt=0.5, speed=10.0, cost=0.5, jumps=[1.0], most=1)[1] == []
    assert moved(monkeypatch, dt=1.0, speed=10.0, cost=0.5, jumps=[1.3])[1] == [text.format("0.556", 10)]


def test_rows_of_a_trend_that_are_late_are_left_out(monkeypatch):
    clock, took, times = Clock(monkeypatch, trend_module), [0.25, 2.5, 2.0, 0.0, 0.0, 0.0], []

    async def words(link, numbers):
        clock.now += took.pop(0)
        return link, numbers

    async def read():
        registers, recording = SimpleNamespace(read_words=words), TrendOptions(None, 1.0, 7.0, None)
        async for at, _ in _readings(None, registers, [], recording):
            times.append(at)

    apart(read())
    assert times == [0.0, 3.25, 5.75, 5.75, 6.75]
    assert clock.slept == [0.0, 0.75, 0.5, 0.0, 1.0]


def test_malformed_frames_and_many_clients_do_not_stop_it(desk):
    source = random.Random(20)
    with served(desk, virtual("dl06"), speed=1.0) as (port, _):
        for _ in range(60):
            with socket.create_connection(("127.0.0.1", port), 5) as line:
                for _ in range(5):
                    frame = source.randbytes(source.randrange(1, 300))
                    if source.random() < 0.5:  # a sound head, so that what is behind it is looked at
                        body = source.randbytes(source.randrange(1, 30))
                        frame = source.randbytes(2) + b"\0\0" + struct.pack(">H", len(body) + 1) + b"\1" + body
                    try:
                        line.sendall(frame)
                    except OSError:
                        break
        lines = [socket.create_connection(("127.0.0.1", port), 5) for _ in range(100)]
        for line in lines:
            line.sendall(bytes.fromhex("000700000006010304000001"))
        answers = [line.recv(260) for line in lines]
        for line in lines:
            line.close()
    assert {answer[:8] for answer in answers} == {bytes.fromhex("0007000000050103")}


READ = bytes.fromhex("000700000006010304000001")


def answer(line):
    """One answer on a line; nothing once it is cut off."""
    try:
        return line.recv(260)
    except ConnectionError:
        return b""


def test_who_asks_without_end_is_hung_up_on_and_the_others_are_answered(desk):
    with served(desk, virtual("dl06"), speed=1.0) as (port, _), ExitStack() as lines:
        floods = [lines.enter_context(socket.create_connection(("127.0.0.1", port), 5)) for _ in range(20)]
        for line in floods:
            with suppress(ConnectionError):
                line.sendall(READ * 20_000)
        honest = lines.enter_context(socket.create_connection(("127.0.0.1", port), 5))
        for _ in range(20):
            honest.sendall(READ)
            assert answer(honest)[:8] == bytes.fromhex("0007000000050103")
        for line in floods:
            while answer(line):
                pass


def test_as_many_requests_as_the_protocol_allows_may_be_under_way(desk):
    with (
        served(desk, virtual("dl06"), speed=1.0) as (port, _),
        socket.create_connection(("127.0.0.1", port), 5) as line,
    ):
        for _ in range(3):
            line.sendall(READ * MAX_WAITING_REQUESTS)
            assert answer(line)
        line.sendall(READ * (MAX_WAITING_REQUESTS + 1))
        while answer(line):
            pass


def test_what_is_no_request_is_a_flood_by_its_length_alone():
    longest = bytes.fromhex("00070000 00fe") + bytes(254)
    assert not is_flood(longest * MAX_WAITING_REQUESTS)
    assert is_flood(longest * MAX_WAITING_REQUESTS + b"\0")
    for junk in (b"\xff", b"\0", b"GET / HTTP/1.1\r\n"):
        assert not is_flood(junk)
        assert is_flood(junk * 5000)


def test_who_takes_no_answer_is_hung_up_on(desk):
    async def connection():
        return _server_of({1: virtual("dl06")}, LOOPBACK).callback_new_connection()

    handler = desk.do(connection())
    hung_up = []
    handler.transport = SimpleNamespace(abort=lambda: hung_up.append(True))
    handler.pause_writing()
    assert hung_up == [True]


def test_a_place_that_is_taken_is_said(desk):
    with (
        served(desk, virtual("click"), speed=1.0) as (port, _),
        pytest.raises(PlcError, match="cannot listen: Address already in use"),
    ):
        pidcfg.serve(SCENARIOS["click"], listen=f"127.0.0.1:{port}", seconds=0.1)


@pytest.mark.usefixtures("heeding_interrupts")
@pytest.mark.parametrize("unit", [None, 3, 255])
def test_it_answers_its_own_unit_and_no_other(unit):
    asked = {}

    def ask(place):
        for number in (0, 1, 2, 3, 255):
            try:
                pidcfg.pull(f"modbus://{place}?unit={number}", like=CLICK, timeout=0.5, retries=0)
            except PlcError as error:
                asked[number] = str(error)

    def started(place):
        clients.append(Thread(target=ask_and_end, args=(place,)))
        clients[0].start()

    def ask_and_end(place):
        try:
            ask(place)
        finally:  # the serving thread is interrupted; where that cannot be, it ends by itself
            if hasattr(signal, "pthread_kill"):
                signal.pthread_kill(server, signal.SIGINT)

    clients, server = [], get_ident()
    pidcfg.serve(SCENARIOS["click"], listen="127.0.0.1:0", unit=unit, ready=started, seconds=10)
    clients[0].join()
    assert set(asked) == {0, 1, 2, 3, 255} - {1 if unit is None else unit}
    assert all("gateway" in said for said in asked.values())


@pytest.mark.parametrize(
    ("listen", "unit", "allowed"),
    [
        ("127.0.0.1:0", 256, "1 to 255"),
        ("127.0.0.1:0", 0, "1 to 255"),
        ("modbus+rtu:///dev/ttyUSB0", 0, "1 to 247"),
        ("modbus+rtu:///dev/ttyUSB0", 248, "1 to 247"),
    ],
)
def test_a_unit_that_is_none_is_refused(listen, unit, allowed):
    with pytest.raises(ValueError, match=f"`unit` is {unit}; write a whole number from {allowed}"):
        pidcfg.serve(SCENARIOS["click"], listen=listen, unit=unit)


INF = float("inf")


@pytest.mark.parametrize(
    "arguments",
    [{"speed": 0.0}, {"speed": 1.01 * MAX_SPEED}, {"seconds": -1.0}, {"seconds": 0.0}, {"seconds": INF},
     {"listen": "nowhere"}],
)  # fmt: skip
def test_arguments_that_make_no_sense(arguments):
    with pytest.raises(ValueError, match=next(iter(arguments))):
        pidcfg.serve(SCENARIOS["click"], **arguments)


@pytest.mark.parametrize("arguments", [{"interval": 0.0}, {"interval": INF}, {"seconds": -1.0}, {"seconds": INF}])
def test_arguments_of_a_trend_that_make_no_sense(arguments):
    with pytest.raises(ValueError, match=next(iter(arguments))):
        pidcfg.trend("modbus://127.0.0.1:1", io.StringIO(), like=CLICK, **arguments)


def test_the_command_says_who_can_come_and_ends_with_the_report():
    done = run("serve", SCENARIOS["click"], "--listen", "127.0.0.1:0", "--for", "0.1", "--speed", "1000")
    assert done.exit_code == 0
    assert "for this machine only" in done.stderr
    assert "What happened" in done.stdout
    done = run("serve", SCENARIOS["click"], "--listen", "0.0.0.0:0", "--for", "0.1", "--format", "json")
    assert "FOR EVERYBODY WHO REACHES THIS ADDRESS" in done.stderr
    assert json.loads(done.stdout)["scenario"]
    assert run("serve", CLICK, "--for", "0.1").exit_code == 2


def test_what_is_seen_when_the_plants_are_made_is_a_finding():
    scenario = SCENARIOS["click"].read_text("utf-8").replace("noise: 0.05", "noise: 0.05, limits: [0, 900]")
    scenario = scenario.replace("first_order", "second_order").replace(
        "time_constant: 420", "time_constants: [420, 0.001]"
    )
    place = str(SCENARIOS["click"])
    found = pidcfg.serve(scenario, name=place, listen="127.0.0.1:0", seconds=0.05).findings
    assert [f.message.partition(", the")[0] for f in found] == ["the shortest lag of TANK1 is 0.001 s"]


def test_several_plcs_are_units_of_one_address(desk):
    """As behind a gateway: each is itself, a foreign client that writes to one changes no other, and 3 is nobody."""
    plcs = {1: virtual("click"), 7: virtual("dl06"), 9: virtual("dl06")}

    async def operate(port):
        async with AsyncModbusTcpClient("127.0.0.1", port=port) as client:
            await client.write_register(LIC, MANUAL, device_id=7)
            await client.write_registers(DF101, [*halves(150.5)], device_id=1)
            setpoint = await client.read_holding_registers(DF101, count=2, device_id=1)
            nobody = await client.read_holding_registers(DF101, count=2, device_id=3)
            return client.convert_from_registers(setpoint.registers, client.DATATYPE.FLOAT32, "little"), nobody

    with served(desk, plcs, speed=50.0) as (port, _):
        setpoint, nobody = apart(operate(port))
        for _ in range(100):
            modes = [plcs[unit].run.plc.mode(plcs[unit].run.plc.states[2].status) for unit in (7, 9)]
            if modes == ["manual", "auto"]:
                break
            sleep(0.02)
        assert pidcfg.compare(DL06, f"modbus://127.0.0.1:{port}?unit=9").same
        assert not pidcfg.compare(CLICK, f"modbus://127.0.0.1:{port}?unit=1").findings
    assert setpoint == 150.5
    assert nobody.exception_code == 11
    assert modes == ["manual", "auto"]
    assert [bool([note for note in plc.report().events if "request" in note.text]) for plc in plcs.values()] == [
        False, True, False,
    ]  # fmt: skip


def test_several_scenarios_of_a_command_have_a_unit_and_a_report_each():
    both = (SCENARIOS["click"], SCENARIOS["dl06"], "--listen", "127.0.0.1:0", "--for", "0.1", "--speed", "1000")
    done = run("serve", *both, "--unit", "3,7")
    assert done.exit_code == 0, done.stderr
    assert f"{SCENARIOS['click']} as unit 3, {SCENARIOS['dl06']} as unit 7 at 127.0.0.1:" in done.stderr
    assert done.stdout.count("What happened") == 2
    done = run("serve", *both, "--format", "json")
    assert f"{SCENARIOS['dl06']} as unit 2" in done.stderr
    assert [one["file"] for one in json.loads(done.stdout)["runs"]] == [str(place) for place in both[:2]]


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (("--unit", "3"), "--unit names 1 units for 2 scenarios; name one for each"),
        (("--unit", "3,3"), "--unit names a unit twice"),
        (("--unit", "3,x"), "'x' is not a"),
        (("--unit", "3,0"), "0 is not in the range"),
        (("--unit", "3,256"), "--unit is 256; write a whole number from 1 to 255"),
        (("--map", str(CLICK)), "--map is of one PLC; name the map of each in its configuration"),
    ],
)
def test_units_that_do_not_fit_the_scenarios_are_refused(more, says):
    done = run("serve", SCENARIOS["click"], SCENARIOS["dl06"], "--listen", "127.0.0.1:0", "--for", "0.1", *more)
    assert done.exit_code == 2
    assert says in " ".join(done.stderr.split())


def test_the_unit_of_a_further_plc_is_its_own_and_one_fault_serves_none():
    with pytest.raises(ValueError, match="`others` has unit 1, which is that of the first PLC"):
        pidcfg.serve(SCENARIOS["click"], others={1: SCENARIOS["dl06"]}, listen="127.0.0.1:0")
    broken = SCENARIOS["dl06"].read_text("utf-8").replace("plants:", "plunts:")
    result = pidcfg.serve(SCENARIOS["click"], others={2: broken}, listen="127.0.0.1:0", seconds=0.1)
    assert not result.ok
    assert "plunts" in result.findings[0].message


@pytest.mark.skipif(shutil.which("mbpoll") is None, reason="mbpoll, a client in C, is not installed")
def test_mbpoll_reads_and_writes(desk):
    plc = virtual("click")
    with served(desk, plc, speed=50.0) as (port, _):

        def mbpoll(register, *more, kind="4:float"):
            line = ("mbpoll", "-m", "tcp", "-p", str(port), "-0", "-1", "-q", "-t", kind, "-r", str(register))
            return subprocess.run([*line, "127.0.0.1", *more], capture_output=True, text=True, check=False).stdout

        assert "[28872]: \t140" in mbpoll(DF101)
        mbpoll(DF101, "150.5")
        assert "[28872]: \t150.5" in mbpoll(DF101)
        mbpoll(C116, "1", kind="0")
    assert "request mode manual" in [note.text for note in plc.report().events]


@pytest.mark.parametrize(("unlisted", "tell"), [(3, None), (0, [].append)])
def test_notes_of_a_plc_that_was_served(monkeypatch, unlisted, tell):
    async def ended(plcs, _listen, _speed, _seconds, _ready, told):
        plcs[1].unlisted_writes = unlisted
        told("it cannot keep up")

    monkeypatch.setattr(serving_module, "serve_plcs", ended)
    result = pidcfg.serve(SCENARIOS["click"], tell=tell, speed=MAX_SPEED)
    assert result.notes == ("it cannot keep up", *(["3 more writes are not listed"] if unlisted else []))
    assert tell is None or tell.__self__ == ["it cannot keep up"]
