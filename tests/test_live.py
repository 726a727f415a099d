"""A PLC is pulled and compared: what is read is what is there, and nothing is ever written."""

import ast
import asyncio
import io
import json
import re
import socket
import struct
import sys
import time
from dataclasses import replace
from itertools import count
from types import SimpleNamespace

import pytest

import pidcfg
from apart import apart
from live_rig import ASKED, CLICK, DL06, READS, ROOT, Registers, run, words_of
from pidcfg.encoders.codecs import single_bits
from pidcfg.encoders.image import Cell, Image
from pidcfg.encoders.maps.dl06 import LOOP_TABLE
from pidcfg.encoders.regmap import SINGLE, WORD
from pidcfg.live import link as link_module
from pidcfg.live.link import (
    Address,
    AddressError,
    Link,
    PlcError,
    Request,
    RetryPolicy,
    parse_address,
    parse_listen,
    serial_reason,
    unexpected_answer,
)
from pidcfg.live.pull import _operator_notes, _value_text, compare_with, read_plc, source_of
from pidcfg.live.reading import MAX_READINGS, implausible_contents
from pidcfg.live.reading import Registers as LoopRegisters

HOLDING, GAIN, SP, V7640 = "holding", 0o2010, 0o2002, 0o7640
NO_ANSWER = {"timeout": 0.05, "retries": 1}


@pytest.fixture(scope="module")
def memory():
    return {path: words_of(path) for path in (DL06, CLICK)}


@pytest.mark.parametrize("path", [DL06, CLICK], ids=["dl06", "click"])
def test_what_was_encoded_is_pulled(desk, memory, path):
    with desk.plc(Registers(memory[path])) as url:
        result = pidcfg.pull(url, like=path)
    assert result.ok
    encoded = pidcfg.encode(path).image
    held = {cell.number: cell.raw for cell in result.image.cells}
    assert held | encoded.words == held  # beside them is V7642 alone
    assert len(held) - len(encoded.words) in {0, 1}
    assert pidcfg.encode(result.text).image.words == encoded.words


def test_a_dl06_tells_its_own_table(desk, memory):
    table = range(0o2000, 0o2140)
    moved = {(t, n + 0o200 if n in table else n): raw for (t, n), raw in memory[DL06].items()}
    moved[HOLDING, V7640] = 0o2200
    with desk.plc(Registers(moved)) as url:
        result = pidcfg.pull(url, vendor="dl06")
        compared = pidcfg.compare(DL06, url)
    assert result.data["plc"]["loop_table"] == "V2200"
    assert len(result.data["loops"]) == 3
    assert {d.path for d in compared.findings if "the PLC has the loop at V2" in d.message} == {
        ("loops", 0),
        ("loops", 1),
        ("loops", 2),
    }


def test_a_table_that_the_plc_does_not_tell_is_asked_for(desk, memory):
    with desk.plc(Registers(memory[DL06] | {(HOLDING, V7640): 0})) as url:
        with pytest.raises(PlcError, match="V7640 holds 0x0000, which is no place of a loop table; give it with"):
            pidcfg.pull(url, vendor="dl06")
        assert len(pidcfg.pull(url, vendor="dl06", options={"loop_table": "V2000"}).data["loops"]) == 3
        assert "V7640" in " ".join(d.message for d in pidcfg.compare(DL06, url).findings)
    with (
        desk.plc(Registers(memory[DL06] | {(HOLDING, 0o7641): 0})) as url,
        pytest.raises(PlcError, match="V7641 holds 0x0000: the PLC calculates no loop"),
    ):
        pidcfg.pull(url, vendor="dl06")


@pytest.mark.parametrize(
    ("status", "requests", "mode"),
    [
        (0b010, 0b000, "auto"),
        (0b100, 0b010, "cascade"),
        (0b001, 0b010, "manual"),
        (0b000, 0b010, "auto"),
        (0b000, 0b001, "manual"),
        (0b000, 0b110, "manual"),
        (0b000, 0b000, "manual"),
    ],
)
def test_a_dl06_is_pulled_in_the_mode_that_its_words_say(desk, memory, status, requests, mode):
    held = memory[DL06]
    words = {(HOLDING, 0o2006): status, (HOLDING, 0o2000): held[HOLDING, 0o2000] & ~0b111 | requests}
    with desk.plc(Registers(held | words)) as url:
        assert pidcfg.pull(url, vendor="dl06").data["loops"][0]["mode"] == mode


def test_a_click_tells_no_mode_and_is_said_so(desk, memory):
    places = {"bits": "C101", "integers": "DS101", "floats": "DF101", "pwm_bit": "Y001"}
    with desk.plc(Registers(memory[CLICK])) as url:
        pulled, like = pidcfg.pull(url, vendor="click", options=places), pidcfg.pull(url, like=CLICK)
    assert pulled.data["loops"][0]["mode"] == "manual"
    assert any(note.startswith("mode is manual, as after each start") for note in pulled.notes)
    assert not any("mode is manual" in note for note in like.notes)


def test_the_mode_bits_of_a_click_are_told_and_no_difference(desk, memory):
    coil = ("coil", 16384 + 126)
    assert memory[CLICK][coil] == 0
    with desk.plc(Registers(memory[CLICK] | {coil: 1})) as url:
        pulled, compared = pidcfg.pull(url, like=CLICK), pidcfg.compare(CLICK, url)
        rows = io.StringIO()
        pidcfg.trend(url, rows, like=CLICK, seconds=0.0)
    assert [note for note in pulled.notes if note.startswith("TANK1: Auto by C127, unconfirmed (D952)")]
    assert compared.ok
    assert [line.split(",")[:2] for line in rows.getvalue().splitlines()] == [
        ["time", "TANK1.MODE"],
        ["0.000", "auto (unconfirmed)"],
    ]


def test_a_click_without_a_file_needs_its_places(desk, memory):
    places = {"bits": "C101", "integers": "DS101", "floats": "DF101", "pwm_bit": "Y001"}
    with desk.plc(Registers(memory[CLICK])) as url:
        with pytest.raises(PlcError, match="give --bits"):
            pidcfg.pull(url, vendor="click")
        data = pidcfg.pull(url, vendor="click", options=places).data
    assert data["loops"][0]["tuning"] == {"proportional_gain": 6, "reset_time": 150, "derivative_gain": 0}


def test_a_listing_of_a_plc_names_the_loops_that_its_words_tell(desk, memory):
    with desk.plc(Registers(memory[DL06])) as url:
        pulled = pidcfg.pull(url, vendor="dl06", format="csv")
    assert [entry["loop"] for entry in pulled.image.settings] == ["LOOP-1", "LOOP-2", "LOOP-3"]
    assert pulled.to_json().keys() == {"version", "vendor", "plc", "words"}


def test_remarks_of_the_differences_are_those_of_the_comparison():
    operated = SimpleNamespace(key="SP", unit="%", address="V1", word_after="0001", before=1, after=2)
    diff = SimpleNamespace(notes=("first",), loops=[SimpleNamespace(loop="L", operated=[operated])])
    assert list(_operator_notes(diff)) == [
        "first",
        "L: operated, and no difference: SP is 2 % (V1 0001), in the file 1",
    ]
    operated.unit = operated.address = ""
    assert list(_operator_notes(diff))[1] == "L: operated, and no difference: SP is 2, in the file 1"


def test_a_setting_that_differs_is_found_with_its_line_word_and_address(desk, memory):
    with desk.plc(Registers(memory[DL06] | {(HOLDING, GAIN): 0x0310})) as url:
        result = pidcfg.compare(DL06, url)
    (finding,) = result.findings
    assert not result.same
    assert "the PLC holds 3.1 %/% (V2010 0310), the file says 0.8 %/% (0080)" in finding.message
    assert DL06.read_text().splitlines()[finding.span.line - 1][finding.span.column - 1 :].startswith("0.80")
    assert finding.loop == "FIC-102"


def test_every_setting_word_counts_and_what_runs_does_not(desk, memory):
    """Each word of the loop table is spoiled; those that the PLC, the process or the operator writes do not differ."""
    checked = pidcfg.check_file(DL06)
    plc = source_of("modbus://127.0.0.1", checked, None, {})
    with desk.plc(Registers(memory[DL06])) as url:
        image = read_plc(source_of(url, checked, None, {}), RetryPolicy())
    alike = set()
    for row in LOOP_TABLE.words:
        cells = (replace(c, raw=c.raw ^ 0x0010) if c.number == 0o2040 + row.offset else c for c in image.cells)
        if compare_with(checked, plc, replace(image, cells=tuple(cells))).same:
            alike.add(row.name)
    running = {"setpoint", "pv", "bias", "output", "mode_and_alarm_status", "ramp_soak_flags"}
    assert alike == running, "an error of the ramp/soak table is none"


def test_a_loop_that_does_not_run_as_it_is_set_up_is_a_finding(desk, memory):
    with desk.plc(Registers(memory[DL06] | {(HOLDING, 0o2046): 0x1400})) as url:
        result = pidcfg.compare(DL06, url)
    assert [(d.code, d.loop, d.message.partition(": ")[2]) for d in result.findings] == [
        ("PID065", "TIC-101", "Alarm value programming error (V2046.10 1)"),
        ("PID065", "TIC-101", "an auto-tune is running (V2046.12 1)"),
    ]


def test_an_operated_set_point_is_told_and_no_difference(desk, memory):
    with desk.plc(Registers(memory[DL06] | {(HOLDING, 0o2102): 0x0700})) as url:
        result = pidcfg.compare(DL06, url)
    assert result.same
    assert any("operated, and no difference: setpoint.value" in note for note in result.notes)


def test_loops_that_only_one_side_has_are_differences(desk, memory):
    with desk.plc(Registers(memory[DL06] | {(HOLDING, 0o7641): 2})) as url:
        found = [d for d in pidcfg.compare(DL06, url).findings if "the PLC does not have this loop" in d.message]
    assert [d.path for d in found] == [("loops", 2)]


def test_settings_that_change_between_two_readings_are_read_again(desk, memory):
    numbers = count()

    def twice(registers):
        if next(numbers) == 2:  # the first request of the second reading
            registers.words[HOLDING, GAIN] = 0x0310

    registers = Registers(memory[DL06], twice)
    with desk.plc(registers) as url:
        assert [d.key for d in pidcfg.compare(DL06, url).findings] == ["tuning.gain"]
    requests = registers.requests
    registers = Registers(memory[DL06])
    with desk.plc(registers) as url:
        pidcfg.compare(DL06, url)
    assert requests > registers.requests


def test_settings_that_never_agree_are_refused_and_live_words_may_change(desk, memory):
    def restless(place):
        def change(registers):
            registers.words[place] = (registers.words[place] + 1) % 0x0100

        return change

    with (
        desk.plc(Registers(memory[DL06], restless((HOLDING, 0o2010)))) as url,
        pytest.raises(
            PlcError, match=f"settings changed during each of {MAX_READINGS} readings: V2010 of FIC-102; look"
        ),
    ):
        pidcfg.pull(url, like=DL06)
    with desk.plc(Registers(memory[DL06], restless((HOLDING, 0o2003)))) as url:
        assert pidcfg.compare(DL06, url).same

    def all_gains(registers):
        for number in (0o2010, 0o2011, 0o2012, 0o2050, 0o2051, 0o2052, 0o2110):
            restless((HOLDING, number))(registers)

    named = "V2010 of FIC-102, V2011 of FIC-102, V2012 of FIC-102, V2050 of TIC-101, V2051 of TIC-101, V2052 of TIC-101"
    with desk.plc(Registers(memory[DL06], all_gains)) as url, pytest.raises(PlcError, match=f"readings: {named}; look"):
        pidcfg.pull(url, like=DL06)


def test_what_is_no_number_is_named(desk, memory):
    low, high = struct.unpack("<HH", struct.pack("<f", float("nan")))
    df106 = 28672 + 2 * 105
    nan = memory[CLICK] | {(HOLDING, df106): low, (HOLDING, df106 + 1): high}
    with desk.plc(Registers(nan)) as url:
        (finding,) = pidcfg.compare(CLICK, url).findings
        assert "DF106" in finding.message
        assert "7FC00000" in pidcfg.pull(url, like=CLICK, format="csv").text
        with pytest.raises(ValueError, match="json"):
            pidcfg.pull(url, like=CLICK, format="json")


def test_formats_of_compare(desk, memory, tmp_path, monkeypatch):
    with desk.plc(Registers(memory[DL06] | {(HOLDING, GAIN): 0x0310})) as url:
        for fmt in ("text", "concise", "sarif", "github", "gitlab", "junit", "markdown", "json"):
            done = run("compare", DL06, "--plc", url, "--format", fmt)
            assert done.exit_code == 1, done
            assert "0310" in done.stdout, fmt
    assert json.loads(done.stdout)["findings"][0]["code"] == "PID065"
    with desk.plc(Registers(memory[DL06])) as url:
        assert run("compare", DL06, "--plc", url).exit_code == 0
        assert run("compare", DL06, CLICK, "--plc", url).exit_code == 2
        out = tmp_path / "out.yaml"
        monkeypatch.setenv("PIDCFG_PLC", url)
        assert run("pull", "--like", DL06, "-o", out).exit_code == 0
    assert pidcfg.encode(out).image.words == pidcfg.encode(DL06).image.words


# --- addresses --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("url", "address"),
    [
        ("modbus://plc-7", Address("plc-7")),
        ("modbus://10.0.0.5:1502?unit=3", Address("10.0.0.5", 1502, 3)),
        ("modbus://[::1]:5020/", Address("::1", 5020)),
        ("modbus+rtu:///dev/ttyS0?baud=9600&parity=odd", Address(device="/dev/ttyS0", baud=9600, parity="odd")),
        ("modbus+rtu:///COM3?stop_bits=2&unit=9", Address(device="COM3", stop_bits=2, unit=9)),
        ("modbus+rtu:///dev/ttyS0", Address("", 502, 1, "/dev/ttyS0", 19200, "even", 1)),
        ("modbus+rtu:///x?unit=1&baud=300&stop_bits=1", Address(device="/x", baud=300)),
        ("modbus+rtu:///x?unit=247&baud=4000000", Address(device="/x", unit=247, baud=4_000_000)),
        (" modbus://h?unit=0 ", Address("h", 502, 0)),
        ("modbus://h?unit=255", Address("h", unit=255)),
    ],
)
def test_addresses(url, address):
    assert parse_address(url) == address


@pytest.mark.parametrize(
    "url",
    [
        "10.0.0.5",
        "http://10.0.0.5",
        "modbus://",
        "modbus://h:99999",
        "modbus://h:0",
        "modbus://h/path",
        "modbus://u@h",
        "modbus://h#f",
        "modbus://h?unit=256",
        "modbus://h?unit=1&unit=2",
        "modbus://h?baud=9600",
        "modbus://h?unit=",
        "modbus://[::1",
        "modbus://a..b",
        "modbus+rtu://dev/ttyS0",
        "modbus+rtu:///",
        "modbus+rtu:///dev/ttyS0?parity=some",
        "modbus+rtu:///dev/ttyS0?unit=0",
        "modbus+rtu:///dev/ttyS0?baud=1e3",
        "modbus+rtu:///dev/ttyS0?baud=299",
        "modbus+rtu:///dev/ttyS0?baud=4000001",
        "modbus+rtu:///dev/ttyS0?unit=248",
        "modbus+rtu:///dev/ttyS0?stop_bits=0",
        "modbus+rtu:///dev/ttyS0?stop_bits=3",
    ],
)
def test_addresses_that_are_none(url):
    with pytest.raises(AddressError):
        parse_address(url)
    with pytest.raises(ValueError, match="plc"):
        pidcfg.pull(url, vendor="dl06")


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("modbus://::1", r"an IPv6 address stands in brackets, \[::1\]"),
        ("modbus://[::1", "an IPv6 address stands in brackets"),
        ("modbus://h:x", "the port is a whole number from 1 to 65535"),
        (" modbus://h:x", "' modbus://h:x': the port"),
    ],
)
def test_what_is_wrong_with_a_port_is_said_in_our_words(url, said):
    with pytest.raises(AddressError, match=said):
        parse_address(url)


def test_a_device_that_takes_no_baud_rate_is_one_line(monkeypatch):
    termios = pytest.importorskip("termios")

    def refuses(*_):
        raise termios.error(22, "Invalid argument")

    monkeypatch.setattr(termios, "tcsetattr", refuses)
    for words in (("compare", CLICK, "--plc"), ("serve", CLICK.with_name("tank.scenario.yaml"), "--listen")):
        done = run(*words, "modbus+rtu:///dev/ptmx")
        assert done.exit_code == 2
        said = r"Error: /dev/ptmx: [^\n]*the line cannot be set up: Invalid argument[^\n]*\n"
        assert re.fullmatch(said, done.stderr), done.stderr


def test_places_to_listen_on():
    assert parse_listen("[::1]:5020") == ("::1", 5020)
    for text in ("5020", "h", "h:x", "h:70000", "h:1/2", ":5020"):
        with pytest.raises(AddressError):
            parse_listen(text)


# --- lines that are out of order --------------------------------------------------------------------------------------


def mbap(request, pdu, tid=None, unit=None):
    """An answer to a request as the protocol wants it, or with another number or unit."""
    transaction = request[:2] if tid is None else tid
    return transaction + b"\0\0" + struct.pack(">H", len(pdu) + 1) + (request[6:7] if unit is None else unit) + pdu


def words(request, number):
    """An answer with so many registers."""
    return mbap(request, struct.pack(">BB", request[7], 2 * number) + bytes(2 * number))


def late(request):
    """The right answer, after everybody has gone."""
    time.sleep(0.12)
    return words(request, 3)


CABLE = r"; look at the cable and the unit number; here it is unit 1"
SERVER = "; look whether a Modbus server is there"
REFUSED = "; look at the set-up of Modbus in the PLC"
LINES = {
    "hangs up": (lambda _: None, "the connection was closed, tried 2 times; PLCs take few connections"),
    "is silent": (lambda _: b"", "no answer within 0.05 s, tried 2 times" + CABLE),
    "is late": (late, "no answer within 0.05 s, tried 2 times" + CABLE),
    "half a head": (lambda r: words(r, 3)[:5], "no answer within 0.05 s, but 5 bytes of one, tried 2 times" + SERVER),
    "half an answer": (lambda r: words(r, 3)[:9], "within 0.05 s, but 9 of 15 bytes of one, tried 2 times" + SERVER),
    "two of three": (lambda r: words(r, 2), "the answer holds 2 of 3 registers, tried 2 times" + SERVER),
    "another transaction": (
        lambda r: mbap(r, r[7:8] + b"\6" + bytes(6), tid=b"\x77\x77"),
        "no answer within 0.05 s, but one to another request, tried 2 times" + SERVER,
    ),
    "another unit": (
        lambda r: mbap(r, r[7:8] + b"\6" + bytes(6), unit=b"\x09"),
        "no answer within 0.05 s, but one of unit 9, tried 2 times" + SERVER,
    ),
    "another function": (
        lambda r: mbap(r, b"\4\6" + bytes(6)),
        "the answer is one to function 4, tried 2 times" + SERVER,
    ),
    "an empty frame": (
        lambda r: r[:4] + bytes(2) + r[6:],
        "within 0.05 s, but bytes that make none, tried 2 times" + SERVER,
    ),
    "no Modbus": (
        lambda _: b"HTTP/1.1 400 Bad Request\r\n\r\n",
        "no answer within 0.05 s, but bytes that are no Modbus, tried 2 times" + SERVER,
    ),
    **{
        f"exception {code}": (lambda r, code=code: mbap(r, bytes((r[7] | 0x80, code))), rf"exception {code} \({said}")
        for code, said in {
            1: r"illegal function\)" + REFUSED,
            2: r"illegal data address\): the PLC does not have all of them; look whether it is the PLC of the file",
            3: r"illegal data value\)" + REFUSED,
            4: r"device failure\)" + REFUSED,
            5: r"acknowledge: it takes long\), tried 2 times; look what the PLC is busy with",
            6: r"device busy\), tried 2 times; look what the PLC is busy with",
            77: r"not in the protocol\)" + REFUSED,
        }.items()
    },
}


@pytest.mark.parametrize("name", LINES)
def test_what_goes_wrong_is_one_line_with_host_function_and_register(desk, name, tmp_path):
    answer, said = LINES[name]
    out = tmp_path / "out.yaml"
    with desk.line(answer) as url:
        for _ in range(3):  # a busy machine may take longer than that to connect
            done = run("pull", "--plc", url, "--vendor", "dl06", "-o", out, "--timeout", "0.05", "--retries", "1")
            if "no connection" not in done.stderr:
                break
    assert (done.exit_code, done.stdout, out.exists()) == (2, "", False)
    where = url.removeprefix("modbus://")
    place = rf"{where}: read holding registers \(function 3\) 4000 to 4002, V7640 to V7642"
    assert re.fullmatch(rf"Error: {place}: .*{said}[^\n]*\n", done.stderr), done.stderr


def test_a_file_with_errors_is_told_and_nothing_is_read():
    text, nobody = DL06.read_text("utf-8").replace("gain: ", "gain: -", 1), "modbus://127.0.0.1:1"
    for done in (
        pidcfg.pull(nobody, like=text),
        pidcfg.compare(text, nobody),
        pidcfg.trend(nobody, io.StringIO(), like=text, seconds=0.0),
    ):
        assert not done.ok
        assert any("gain" in finding.message for finding in done.findings)


def test_values_are_shown_with_their_unit():
    assert [_value_text(value, " %") for value in (None, 5, [1, 2])] == ["none", "5 %", "[1, 2] %"]


def test_one_register_is_named_alone():
    assert [LoopRegisters._span_text(SimpleNamespace(name=str), run) for run in ([5], [5, 6])] == ["5", "5 to 6"]
    assert str(Request("coil", 5, 1, "C6")) == "read coils (function 1) 5, C6"
    assert str(Request("holding", 5, 2, "x")) == "read holding registers (function 3) 5 to 6, x"


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (None, "the device cannot be opened"),
        (ValueError("no such port"), "no such port"),
        (OSError("odd"), "it is no serial line"),
        (OSError(13, "x"), "Permission denied"),
    ],
)
def test_why_a_serial_line_cannot_be_opened(monkeypatch, error, said):
    def opened(device):
        assert device == "/dev/x"
        if error is not None:
            raise error
        return SimpleNamespace(close=lambda: None)

    monkeypatch.setitem(sys.modules, "serial", SimpleNamespace(Serial=opened))
    assert serial_reason("/dev/x") == said


SENT = bytes.fromhex("0007 0000 0006 01 03 0FA0 0003")


@pytest.mark.parametrize(
    ("came", "serial", "said"),
    [
        ("", False, ""),
        ("", True, ""),
        ("01 03 06", True, "3 bytes that make none"),
        ("48 54 54 50 2F", False, "bytes that are no Modbus"),
        ("0007 0001 0009 01 03", False, "bytes that are no Modbus"),
        ("0007 0000 0009 01", False, "7 bytes of one"),
        ("0007 0000 0009 01 03", False, "8 of 15 bytes of one"),
        ("0007 0000 0002 01 03", False, "bytes that make none"),
        ("0007 0000 0009 02 03", False, "one of unit 2"),
        ("0008 0000 0009 01 03", False, "one to another request"),
        ("0107 0000 0009 01 03", False, "one to another request"),
        ("0008 0000 0009 02 03", False, "one to another request"),
    ],
)
def test_what_came_instead_of_an_answer(came, serial, said):
    assert unexpected_answer(SENT, bytes.fromhex(came), is_serial=serial) == said


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ([1e-40, 2e-40, 5.0], "X0 1e-40, X1 2e-40 are next to 0: the two registers"),
        ([1e-40, 2e-40, 5.0, 6.0], ""),
        ([1e-40], ""),
        ([1e-40, 2e-30], ""),
        ([1e-40, 1e-30, 0.0], ""),
        ([1e-40, -2e-40, 3e-40, 0.0, 0.0, 0.0], "X0 1e-40, X1 -2e-40, X2 3e-40 are next to 0"),
        ([1e-40, 2e-40, 3e-40, 4e-40, 5e-40], "X0 1e-40, X1 2e-40, X2 3e-40 and 2 more are next to 0"),
    ],
)
def test_numbers_whose_registers_stand_in_the_other_order(values, said):
    cells = [Cell(f"X{i}", i, single_bits(value), "", kind=SINGLE) for i, value in enumerate(values)]
    cells += [Cell("W", 0, 1, "", kind=WORD)] * 5
    found = list(implausible_contents(Image("click", tuple(cells))))
    assert [text.startswith(said) for text in found] == ([True] if said else [])


def test_a_request_asks_for_what_the_protocol_allows():
    assert link_module.MAX_PER_REQUEST == {"coil": 2000, "discrete": 2000, "holding": 125, "input": 125}


def test_a_connection_that_is_not_made_is_closed(monkeypatch):
    closed = []

    async def connect():
        return False

    client = SimpleNamespace(ctx=SimpleNamespace(connect=connect), close=lambda: closed.append(True))
    monkeypatch.setattr(link_module, "_client_of", lambda *_: client)
    with pytest.raises(link_module._NoAnswer, match=r"^$"):
        apart(Link(Address("h"), RetryPolicy())._connect())
    assert closed == [True]


def test_an_error_without_a_code_is_an_exception_all_the_same():
    link = Link(Address("h"), RetryPolicy())
    with pytest.raises(
        PlcError, match=r"h:502: read coils .*: exception 0 \(not in the protocol\); look at the set-up"
    ):
        link._response_content(Request("coil", 1, 1, "C1"), SimpleNamespace(isError=lambda: True))


@pytest.mark.parametrize(("name", "pause"), [("hangs up", 0.0), ("exception 6", 0.1)])
def test_a_request_is_sent_again_at_once_and_to_a_busy_plc_a_little_later(desk, monkeypatch, name, pause):
    pauses, sleep = [], asyncio.sleep

    async def noted(seconds):
        pauses.append(seconds)
        await sleep(0)

    async def read(url):
        async with Link(parse_address(url), RetryPolicy(2.0, 2)) as link:
            monkeypatch.setattr(link_module.asyncio, "sleep", noted)
            with pytest.raises(PlcError, match="tried 3 times"):
                await link.read(Request("holding", 4000, 3, "V7640"))
            monkeypatch.undo()

    with desk.line(LINES[name][0]) as url:
        apart(read(url))
    assert pauses == [pause, pause]


def test_a_table_that_goes_between_two_readings_is_not_of_the_result(desk, memory):
    numbers = count()

    def unlinked(registers):
        if next(numbers) == registers.requests_of_one:
            registers.words[HOLDING, 0o2074] = 0

    counted = Registers(memory[DL06])
    with desk.plc(counted) as url:
        assert pidcfg.pull(url, like=DL06).data["loops"][1]["ramp_soak"]["steps"]
    registers = Registers(memory[DL06], unlinked)
    registers.requests_of_one = counted.requests // 2
    with desk.plc(registers) as url:
        assert pidcfg.pull(url, like=DL06).data["loops"][1]["ramp_soak"] == {"table": "V0"}


def test_a_busy_plc_is_asked_again(desk, memory):
    numbers = count()
    with desk.plc(Registers(memory[DL06], lambda _: 6 if next(numbers) == 0 else None)) as url:
        assert pidcfg.compare(DL06, url, **NO_ANSWER).same


def test_a_plc_that_goes_in_the_middle_leaves_nothing_behind(desk, memory, tmp_path):
    def answer(request):
        first = struct.unpack(">H", request[8:10])[0]
        if first != V7640:
            return None
        held = [memory[DL06][HOLDING, V7640 + k] for k in range(3)]
        return mbap(request, struct.pack(">BB3H", 3, 6, *held))

    out = tmp_path / "out.yaml"
    with desk.line(answer) as url:
        done = run("pull", "--plc", url, "--vendor", "dl06", "-o", out, "--timeout", "0.05", "--retries", "0")
    assert (done.exit_code, out.exists()) == (2, False)
    assert "1024 to 1119, V2000 to V2137 of LOOP-1, LOOP-2, LOOP-3: the connection was closed" in done.stderr


def test_registers_that_are_not_there_are_named(desk, memory):
    short = {place: raw for place, raw in memory[CLICK].items() if place != (HOLDING, 28672 + 2 * 120)}
    with desk.plc(Registers(short)) as url:
        done = run("compare", CLICK, "--plc", url)
    assert done.exit_code == 2
    assert "exception 2 (illegal data address)" in done.stderr
    assert "DF101 to DF125 of TANK1" in done.stderr


def test_no_plc_at_all(monkeypatch):
    with pytest.raises(PlcError, match=r"127\.0\.0\.1:1: read .* connection refused; look at the address and the port"):
        pidcfg.pull("modbus://127.0.0.1:1", vendor="dl06", retries=0)
    done = run("compare", DL06, "--plc", "modbus://127.0.0.1:1", "--format", "json", "--retries", "0")
    assert (done.exit_code, json.loads(done.stdout)["findings"][0]["code"]) == (2, "PID066")

    def unknown(*_, **__):
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    for device, said in {"/dev/null": "it is no serial line", "/dev/no-such": "No such file"}.items():
        with pytest.raises(PlcError, match=f"{device}: read .*: {said}.*; look at the name of the device"):
            pidcfg.pull(f"modbus+rtu://{device}", vendor="dl06", retries=0)
    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    with pytest.raises(PlcError, match="the name no-such-plc does not resolve"):
        pidcfg.pull("modbus://no-such-plc", vendor="dl06", retries=0)


def test_ipv6(desk, memory):
    with desk.plc(Registers(memory[DL06]), "::1") as url:
        assert pidcfg.compare(DL06, url).same


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"timeout": 0.0}, "^`timeout` is 0; write seconds above 0"),
        ({"timeout": 3600.5}, "^`timeout` is 3600.5; write seconds above 0 and up to 3600"),
        ({"retries": -1}, "^`retries` is -1; write a whole number from 0 to 100"),
        ({"retries": 101}, "^`retries` is 101;"),
        ({"format": "cdv"}, "format"),
        ({}, "like"),
    ],
)
def test_arguments_that_make_no_sense(arguments, said):
    family = {"vendor": "dl06"} if arguments else {}
    with pytest.raises(ValueError, match=said):
        pidcfg.pull("modbus://127.0.0.1:1", **family, **arguments)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("pull", "--vendor", "click", "--bits", "C1990", "--integers", "DS1", "--floats", "DF1"),
            "there is no C2001: ",
        ),
        (
            ("pull", "--vendor", "click", "--bits", "C1", "--integers", "DS4490", "--floats", "DF1"),
            "there is no DS4501: ",
        ),
        (("trend", "--vendor", "dl06", "--for", "-3"), "'-3' is no time; write it like 90 or '10 min'"),
        (("trend", "--vendor", "dl06", "--for", "1e3"), "'1e3' is no time"),
        (("trend", "--vendor", "dl06", "--interval", "0"), "--interval is 0; write seconds above 0"),
        (("pull", "--vendor", "dl06", "--timeout", "0"), "--timeout is 0"),
    ],
)
def test_options_that_make_no_sense_are_one_error(words, said):
    done = run(*words, "--plc", "modbus://127.0.0.1:1", "--retries", "0")
    assert (done.exit_code, done.stdout) == (2, "")
    assert said in done.stderr.splitlines()[-1]


def test_how_long_a_plc_is_served_makes_sense():
    done = run("serve", CLICK.with_name("tank.scenario.yaml"), "--for", "0")
    assert (done.exit_code, done.stderr.splitlines()[-1]) == (2, "Error: --for is 0; write seconds above 0")


# --- nothing is written -----------------------------------------------------------------------------------------------


CLIENT = {"ctx", "close", "read_coils", "read_discrete_inputs", "read_holding_registers", "read_input_registers"}
"""All that is ever taken of pymodbus' client."""


def taken_of_a_client(source):
    """What a module takes of something called a client, by name or as a whole."""
    taken = set()
    tree = ast.parse(source)
    owners = {id(n.value): n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
    for node in ast.walk(tree):
        name = node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""
        if name.strip("_") == "client" and isinstance(node.ctx, ast.Load) and id(node) in owners:
            taken.add(owners[id(node)])
        if isinstance(node, ast.Call):
            whole = [*node.args, *(k.value for k in node.keywords)]
            taken |= {"itself" for arg in whole if getattr(arg, "id", getattr(arg, "attr", "")).strip("_") == "client"}
    return taken


@pytest.mark.parametrize(
    "spoiled",
    [
        "client.write_register(0, 1)",
        "client.execute(False, pdu)",
        'getattr(self._client, "write" + "_coil")(1, True)',
        "asyncio.run(send(what=client))",
        "self._client.readwrite_registers()",
        "self._client.mask_write_register()",
    ],
)
def test_a_call_that_writes_would_be_seen(spoiled):
    assert not taken_of_a_client(spoiled) <= CLIENT


def test_no_module_that_reads_has_a_call_that_writes():
    """Of pymodbus' client no other methods are named than those that read; the client itself goes nowhere else."""
    assert taken_of_a_client((ROOT / "src/pidcfg/live/link.py").read_text("utf-8")) == CLIENT
    clients = [
        path.name
        for path in (ROOT / "src/pidcfg").rglob("*.py")
        if any(word in path.read_text("utf-8") for word in ("pymodbus.client", "pymodbus.pdu", "ClickClient"))
    ]
    assert clients == ["link.py"]


def test_no_server_was_asked_to_write(desk, memory):
    with desk.plc(Registers(memory[DL06])) as url:
        pidcfg.pull(url, vendor="dl06")
    assert ASKED
    assert ASKED <= READS
