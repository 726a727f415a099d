"""The virtual PLC of a scenario behind its register map, for others to read and to operate: `pidcfg.serve`."""

from __future__ import annotations

import asyncio
import logging
import socket
import time
from contextlib import suppress
from copy import deepcopy
from dataclasses import field, replace
from decimal import Decimal
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.live.link import (
    MAX_SERIAL_UNIT,
    MAX_UNIT,
    PARITIES,
    RTU,
    TERMINAL_ERRORS,
    Address,
    AddressError,
    PlcError,
    endpoint,
    parse_address,
    parse_listen,
    run_async,
    serial_reason,
)
from pidcfg.output.arguments import ArgumentError, check_arguments
from pidcfg.output.findings import errors_in, findings_data, short_repr
from pidcfg.sim.controllers.settings import NO_REGISTER, RegisterError
from pidcfg.sim.engine.run import Settings, UnusableError, begin_run
from pidcfg.sim.judgement.report import Note, ten_digits
from pidcfg.study.outcome import Outcome
from pidcfg.study.scenario import load_scenario
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import DEFAULT, Limits, reader_of
from pidcfg.validate.engine import document_of
from pidcfg.validate.map_files import map_of_source, named_map, numbering_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from pymodbus.constants import ExcCodes
    from pymodbus.datastore import ModbusServerContext

    from pidcfg.encoders.listing import Places
    from pidcfg.sim.controllers.settings import Registers, WriteResult
    from pidcfg.sim.judgement.report import Report
    from pidcfg.study.scenario import LoadedScenario
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Data
    from pidcfg.text.reader import Files, Reader
    from pidcfg.validate.engine import Source
    from pidcfg.validate.map_files import MapFile

# --- The virtual PLC of a scenario behind its vendor's register map: read, written to, and moved on in time -----------

RegisterPlace = tuple[str, int]
"""A table and the number of a register in it."""
WORD_MASK = 0xFFFF


class ValuePart(NamedTuple):
    """What a register has of a value: the bits of ``mask`` behind ``shift``, at its own bit ``bit``."""

    number: int
    shift: int
    mask: int
    bit: int
    loop: int


ENDLESS_SECONDS = Decimal(10) ** 9
"""Seconds of a run that ends when somebody ends it."""
MAX_LISTED_WRITES = 1000
"""Writes that the report lists; so that a panel that writes all the time does not fill the memory."""


class VirtualPlc:
    """A run that goes on for as long as it is wanted. Nothing is expected of it: somebody else has a hand in it."""

    def __init__(self, loaded: LoadedScenario, numbering: Places) -> None:
        if loaded.scenario is None or loaded.vendor is None:
            raise ValueError(f"{loaded.document.file} could not be loaded")
        scenario = loaded.scenario.model_copy(update={"duration": ENDLESS_SECONDS, "expect": (), "allow": ()})
        self.run = begin_run(
            scenario, loaded.new_plc, loaded.controller, Settings(engine="python", with_verdicts=False)
        )
        self.registers: Registers = loaded.vendor.load("virtual")(self.run.plc)
        self.unlisted_writes = 0
        self._progress: Iterator[int] = self.run.steps_to_end()
        self._step = self.run.start_step
        self._map: dict[RegisterPlace, list[ValuePart]] = {}
        for number, loop in self.registers.loops_by_register().items():
            with suppress(LookupError):  # no client reads what the map does not have
                place = numbering.place(number)
                for half in range(place.width):
                    shift, mask = (place.shift(half), WORD_MASK) if place.bit is None else (0, 1)
                    part = ValuePart(number, shift, mask, place.bit or 0, loop)
                    parts = self._map.setdefault((place.table, place.register + half), [])
                    if all(
                        other.mask != WORD_MASK and other.bit != part.bit for other in parts
                    ):  # one device, several names
                        parts.append(part)
        self._contents: dict[int, Mapping[int, int]] = {}

    @property
    def steps(self) -> int:
        """Base steps so far."""
        return self._step - self.run.start_step

    @property
    def dt(self) -> float:
        """The base step in s."""
        return self.run.dt

    def advance(self, steps: int) -> None:
        """Base steps, as fast as they go."""
        end = self._step + steps
        self._contents.clear()
        while self._step < end:
            self.run.chunk_steps = end - self._step
            self._step = next(self._progress)

    def read(self, table: str, first: int, count: int) -> list[int]:
        """Registers as they are now; raises `RegisterError` where one is not there."""
        return [self._register_content(table, first + k) for k in range(count)]

    def _register_content(self, table: str, register: int) -> int:
        content = 0
        for part in self._find_parts(table, register):
            content |= (self._raw_value(part) >> part.shift & part.mask) << part.bit
        return content

    def _raw_value(self, part: ValuePart) -> int:
        """What a value holds now."""
        if part.loop not in self._contents:
            self._contents[part.loop] = self.registers.contents(part.loop, self.run.net.signal_values)
        return self._contents[part.loop][part.number]

    def _find_parts(self, table: str, register: int) -> list[ValuePart]:
        parts = self._map.get((table, register))
        if parts is None:
            raise RegisterError(NO_REGISTER, f"{table} {register} is no register of this PLC")
        return parts

    def write(self, table: str, first: int, contents: Sequence[int]) -> None:
        """Registers one after the other, halves of a value together; raises `RegisterError` where one is refused."""
        raws: dict[int, tuple[int, int]] = {}
        for k, content in enumerate(contents):
            for part in self._find_parts(table, first + k):
                raw, written = raws.get(part.number, (self._raw_value(part), int(content) >> part.bit & part.mask))
                if part.mask == WORD_MASK or written != raw:  # of the switches in a register those that change
                    raw = raw & ~(part.mask << part.shift) | (int(content) >> part.bit & part.mask) << part.shift
                    raws[part.number] = (raw, part.loop)
        for number, (raw, loop) in raws.items():
            self._write_value(number, raw, loop)

    def _write_value(self, number: int, raw: int, loop: int) -> None:
        """One value, with everything that an event of the scenario brings about."""
        signals = self.run.net.signal_values
        before = list(signals)
        effect = self.registers.write(number, raw, signals)
        self._contents.clear()
        self.run.machine.hold_signals(before)
        if loop >= 0:
            self._note_write(loop, effect)
            slot = self.run.plc.configs[loop].sp_slot
            if signals[slot] != before[slot]:
                self.run.agenda.begin_step(self.steps, loop, before[slot])

    def _note_write(self, loop: int, effect: WriteResult) -> None:
        run = self.run
        if effect.mode is not None:
            run.journal.requested_modes[loop] = effect.mode
        if len(run.agenda.past_events) < MAX_LISTED_WRITES:
            run.agenda.past_events.append(Note(ten_digits(self.steps * self.dt), run.plc.loops[loop], effect.text))
        else:
            self.unlisted_writes += 1

    def report(self) -> Report:
        """What has happened so far; the run is over then."""
        self.run.last = max(self.steps - 1, 0)
        return self.run.finish()


# --- A Modbus server in front of a virtual PLC, which is moved on in real time meanwhile ------------------------------

TABLES = {1: "coil", 2: "discrete", 3: "holding", 4: "input", 5: "coil", 6: "holding", 15: "coil", 16: "holding"}
TABLES |= {22: "holding", 23: "holding"}
"""The table that a function reads or writes."""
SLICE_SECONDS = 0.02
"""Seconds for which requests may have to wait for the PLC."""
MAX_LAG_SECONDS = 1.0
"""Seconds behind its time after which the PLC is said not to keep up."""
MAX_WAITING_REQUESTS, MBAP_BYTES, MAX_REQUEST_BYTES = 16, 6, 254
"""Requests of a client that may wait, by the protocol; bytes before the length of one, and what it is at most."""


def context_of(plcs: Mapping[int, VirtualPlc]) -> ModbusServerContext:
    """The PLCs as pymodbus' servers know them, each of which answers as its unit alone."""
    from pymodbus.constants import ExcCodes
    from pymodbus.datastore import ModbusBaseDeviceContext, ModbusServerContext

    class Context(ModbusBaseDeviceContext):
        """Every request goes to the PLC as it is at that moment."""

        def __init__(self, plc: VirtualPlc) -> None:
            self.plc = plc

        def getValues(self, func_code: int, address: int, count: int = 1) -> list[int] | ExcCodes:  # noqa: N802 - pymodbus' name
            try:
                return self.plc.read(TABLES.get(func_code, ""), address, count)
            except RegisterError as error:
                return ExcCodes(error.code)

        def setValues(self, func_code: int, address: int, values: Sequence[int]) -> ExcCodes | None:  # noqa: N802 - pymodbus' name
            try:
                self.plc.write(TABLES.get(func_code, ""), address, values)
            except RegisterError as error:
                return ExcCodes(error.code)
            return None

    return ModbusServerContext(  # type: ignore[no-untyped-call]
        {unit: Context(plc) for unit, plc in plcs.items()}, single=False
    )


async def serve_plcs(
    plcs: Mapping[int, VirtualPlc],
    listen: Address,
    speed: float,
    seconds: float | None,
    on_ready: Callable[[str], None],
    tell: Callable[[str], None],
) -> None:
    """Serves PLCs, each as its unit, until it is cancelled or for so many seconds.

    Raises `PlcError` where it cannot listen.
    """
    logging.getLogger("pymodbus.logging").addHandler(logging.NullHandler())
    server = _server_of(plcs, listen)
    try:
        is_listening = await server.listen()
    except TERMINAL_ERRORS as error:
        raise PlcError(f"{listen}: the line cannot be set up: {error.args[-1]}") from None
    if not is_listening:
        raise PlcError(f"{listen}: {_listen_failure(listen)}")
    try:
        on_ready(_listen_place(server, listen))
        runs = asyncio.gather(*(_run_in_real_time(plc, speed, tell) for plc in plcs.values()))
        await (runs if seconds is None else asyncio.wait_for(runs, seconds))
    except (asyncio.CancelledError, TimeoutError):
        pass
    finally:
        await server.shutdown()


def _server_of(plcs: Mapping[int, VirtualPlc], listen: Address) -> Any:
    from pymodbus.server import ModbusSerialServer

    if not listen.device:
        return _tcp_server(plcs, listen)
    line: Data = {
        "port": listen.device,
        "baudrate": listen.baud,
        "parity": PARITIES[listen.parity],
        "stopbits": listen.stop_bits,
    }
    return ModbusSerialServer(context_of(plcs), ignore_missing_devices=True, **line)


def is_flood(data: bytes) -> bool:
    """Whether more requests of a client wait than it may have under way."""
    offset = 0
    for _ in range(MAX_WAITING_REQUESTS):
        offset += MBAP_BYTES + min(
            int.from_bytes(data[offset + MBAP_BYTES - 2 : offset + MBAP_BYTES], "big"), MAX_REQUEST_BYTES
        )
    return offset < len(data)


def _tcp_server(plcs: Mapping[int, VirtualPlc], listen: Address) -> object:
    """A server that hangs up on who asks without end and on who takes no answer, so that all others get theirs."""
    from pymodbus.server import ModbusTcpServer
    from pymodbus.server.requesthandler import ServerRequestHandler

    class Connection(ServerRequestHandler):
        """One client."""

        def data_received(self, data: bytes) -> None:
            """Requests that have come since the last time."""
            if is_flood(data):
                self.hang_up()
            else:
                super().data_received(data)

        def pause_writing(self) -> None:
            """Called when more answers wait than a client has taken for long."""
            self.hang_up()

        def hang_up(self) -> None:
            """Ends the connection, whatever waits."""
            transport: Any = self.transport
            transport.abort()

    class Server(ModbusTcpServer):
        """One listener for all of them."""

        def callback_new_connection(self) -> Connection:
            """As the library has it."""
            return Connection(self, self.trace_packet, self.trace_pdu, self.trace_connect)  # type: ignore[no-untyped-call]

    return Server(context_of(plcs), address=(listen.host, listen.port))


def _listen_place(server: Any, listen: Address) -> str:
    """Where it listens, as a URL without its scheme; a port 0 has become one of the system's choice."""
    if listen.device:
        return listen.device
    return endpoint(listen.host, server.transport.sockets[0].getsockname()[1])


def _listen_failure(listen: Address) -> str:
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


async def _run_in_real_time(plc: VirtualPlc, speed: float, tell: Callable[[str], None]) -> None:
    """Moves the PLC on, ``speed`` times as fast as the clock."""
    begin, first, is_late = time.monotonic(), plc.steps, False
    while True:
        due_step = first + int((time.monotonic() - begin) * speed / plc.dt)
        stop = time.monotonic() + SLICE_SECONDS
        while plc.steps < due_step and time.monotonic() < stop:
            plc.advance(1)
        lag = (due_step - plc.steps) * plc.dt / speed
        if lag > MAX_LAG_SECONDS:
            rate = (plc.steps - first) * plc.dt / (time.monotonic() - begin)
            if not is_late:
                tell(f"the simulation cannot keep up: {rate:.3g} times real time instead of {speed:g}")
            begin, first, is_late = time.monotonic(), plc.steps, True
        with suppress(asyncio.TimeoutError):
            await asyncio.sleep(0 if plc.steps < due_step else min(plc.dt / speed, SLICE_SECONDS))


# --- The virtual PLC of a scenario for others to read and to operate: the result of `pidcfg.serve` --------------------


@frozen
class ServeResult:
    """What happened while the PLC was served."""

    __repr__ = short_repr

    outcome: Outcome
    """The run's findings, and its report with every write in its events."""
    notes: tuple[str, ...] = field(default=())
    """That the simulation could not keep up, and writes that the report does not list."""
    others: Mapping[int, Outcome] = field(default_factory=dict)
    """The same of each further PLC, by its unit."""

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        """Those of all PLCs, in the order in which they were named."""
        return (self.outcome, *self.others.values())

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        """What is wrong with the scenarios or their configurations."""
        return tuple(finding for outcome in self.outcomes for finding in outcome.findings)

    @property
    def ok(self) -> bool:
        """Whether the PLCs were served."""
        return all(outcome.report is not None for outcome in self.outcomes)

    def to_json(self) -> Data:
        """The reports as ``pidcfg simulate --format json`` has them; where nothing ran, the errors."""
        from pidcfg.output.runs import runs_data

        return deepcopy(runs_data(list(self.outcomes))) if self.ok else findings_data(errors_in(self.findings))


@frozen
class ServeOptions:
    """How a PLC is served: where, how fast, for how many seconds, and who is told what."""

    listen: Address
    speed: float
    seconds: float | None
    on_ready: Callable[[str], None]
    tell: Callable[[str], None]


def serve_document(
    doc: Document,
    options: ServeOptions,
    reader: Reader,
    map_file: MapFile | None = None,
    others: Mapping[int, Document] | None = None,
) -> ServeResult:
    """Serves the scenario of a document until it is interrupted; raises `PlcError` where it cannot listen.

    ``map_file``: the map, in place of the one that the configuration names; raises `UnusableMapError`. ``others``:
    further scenarios, by the units that they answer as.
    """
    first = _prepare_plc(doc, reader, map_file)
    other_plcs = {unit: _prepare_plc(plc_doc, reader, None) for unit, plc_doc in (others or {}).items()}
    if any(plc is None for _, plc in (first, *other_plcs.values())):
        return ServeResult(
            _outcome_without_run(first[0]),
            others={unit: _outcome_without_run(loaded) for unit, (loaded, _) in other_plcs.items()},
        )
    units = {options.listen.unit: first, **other_plcs}
    notes: list[str] = []

    def tell(text: str) -> None:
        notes.append(text)
        options.tell(text)

    plcs = {unit: plc for unit, (_, plc) in units.items() if plc is not None}
    run_async(serve_plcs(plcs, options.listen, options.speed, options.seconds, options.on_ready, tell))
    outcomes = [_finish_outcome(*plc_doc, notes) for plc_doc in units.values()]
    return ServeResult(outcomes[0], tuple(notes), dict(zip(other_plcs, outcomes[1:], strict=True)))


def _prepare_plc(doc: Document, reader: Reader, map_file: MapFile | None) -> tuple[LoadedScenario, VirtualPlc | None]:
    """A scenario and its PLC; None where its findings say why there is none."""
    loaded = load_scenario(doc, reader)
    if loaded.scenario is None or loaded.image is None or loaded.vendor is None:
        return loaded, None
    map_file = map_file or named_map(loaded.documents.get(loaded.config), reader)
    numbering = numbering_of(loaded.vendor, map_file, loaded.image, loaded.config)
    try:
        return loaded, VirtualPlc(loaded, numbering)
    except UnusableError as error:
        loaded.add_problems(error.problems)
        return loaded, None


def _outcome_without_run(loaded: LoadedScenario) -> Outcome:
    file = loaded.document.file
    return Outcome(file, loaded.config, findings=loaded.findings, documents=loaded.documents)


def _finish_outcome(loaded: LoadedScenario, plc: VirtualPlc | None, notes: list[str]) -> Outcome:
    """What has happened to a PLC."""
    if plc is None:
        return _outcome_without_run(loaded)
    report = plc.report()
    loaded.add_problems(report.problems)
    if plc.unlisted_writes:
        notes.append(f"{plc.unlisted_writes} more writes are not listed")
    findings = [*loaded.findings, *loaded.config_errors]
    return Outcome(loaded.document.file, loaded.config, report, findings, loaded.documents)


MAX_SPEED = 1e6
"""Times real time."""


@check_arguments
def serve(
    source: Source,
    *,
    listen: str = "127.0.0.1:5020",
    unit: int | None = None,
    others: Mapping[int, Source] | None = None,
    map: Path | str | bytes | None = None,
    speed: float = 1.0,
    seconds: float | None = None,
    ready: Callable[[str], None] | None = None,
    tell: Callable[[str], None] | None = None,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> ServeResult:
    """Serves the virtual PLC of a scenario over Modbus, ``speed`` times as fast as the clock, until Ctrl-C.

    ``listen``: host and port, of which 0 is one of the system's choice, or the URL of a serial line. ``unit``: the unit
    that it answers as, and no other; 1 where nothing says it. ``others``: scenarios of further PLCs at the same place,
    by their units, as behind a gateway. ``map``: as in `pull`, of the first one. ``seconds``: ends by itself. ``ready``
    is called with the place once clients can come, ``tell`` when the simulation cannot keep up. The scenario's duration
    and expectations do not count: whoever operates the PLC decides. Raises `PlcError` where nobody can listen.
    """
    if not 0 < speed <= MAX_SPEED:
        raise ArgumentError(f"`speed` is {speed:g}; write a number above 0 and up to {MAX_SPEED:g}", "speed")
    if seconds is not None and not 0 < seconds < float("inf"):
        raise ArgumentError(f"`seconds` is {seconds:g}; write seconds above 0", "seconds")
    try:
        address = parse_address(listen) if listen.startswith(RTU) else Address(*parse_listen(listen))
    except AddressError as error:
        raise ArgumentError(f"`listen`: {error}", "listen") from None
    max_unit = MAX_SERIAL_UNIT if address.device else MAX_UNIT
    for number, argument in ((unit, "unit"), *((number, "others") for number in others or ())):
        if number is not None and not 1 <= number <= max_unit:
            raise ArgumentError(f"`{argument}` is {number}; write a whole number from 1 to {max_unit}", argument)
    address = address if unit is None else replace(address, unit=unit)
    if address.unit in (others or ()):
        raise ArgumentError(f"`others` has unit {address.unit}, which is that of the first PLC", "others")
    other_docs = {number: document_of(one, None, files, limits) for number, one in (others or {}).items()}
    options = ServeOptions(address, speed, seconds, ready or _ignore_text, tell or _ignore_text)
    map_file = None if map is None else map_of_source(map, None, files, limits)
    return serve_document(document_of(source, name, files, limits), options, reader_of(files), map_file, other_docs)


def _ignore_text(_: str) -> None:
    """Nobody wants to know."""
