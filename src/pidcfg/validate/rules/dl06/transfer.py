"""Auto transfer of PV and output, and loops that run while the CPU is in Program mode."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

from pidcfg.encoders.dl06.encode import LOOP_SIZE
from pidcfg.encoders.maps.dl06 import CPU, D03, LOOP_TABLE
from pidcfg.refs import DL06, Decision
from pidcfg.schemas.octal import v_name
from pidcfg.validate.ideas.duplicates import at_both, in_words, sharing
from pidcfg.validate.rule import Finding, Findings, checklist, error, info, per_loop, warning
from pidcfg.validate.rules.dl06.ramp_soak import tables
from pidcfg.validate.rules.dl06.setup import between

if TYPE_CHECKING:
    from pidcfg.schemas.dl06 import Transfer
    from pidcfg.validate.rules.dl06.context import Dl06Context, LoopView

MODES = DL06.at("CPU Modes and Loop Modes")
TRANSFER = DL06.at("Auto Transfer to Analog I/O")
FROM_MEMORY = DL06.at("PV Auto Transfer (Addr + 36) from V-memory Option")
SOURCES = DL06.at("Data Sources")
SELECT = DL06.at("Step 4: Select I/O Modules")

D660 = Decision(
    660,
    "loops that read one channel",
    "Two loops may fetch their PV from one channel or word: a heating and a cooling loop do. Two of the same action "
    "are an info.",
    "The manual forbids two sources of one variable, not two readers of one source.",
)


def channel_of(transfer: Transfer | None) -> tuple[int, int] | None:
    """Slot and channel of a transfer that goes to a module."""
    if transfer is None or transfer.slot is None or transfer.channel is None:
        return None
    return transfer.slot, transfer.channel


def source_of(transfer: Transfer | None) -> str | None:
    """Where a transfer fetches the PV, in words."""
    if transfer is not None and transfer.address is not None:
        return v_name(transfer.address)
    place = channel_of(transfer)
    return None if place is None else f"slot {place[0]}, channel {place[1]}"


@warning(
    "DL289", MODES, "the loop is independent of the CPU mode, but {missing}: in Program mode nothing moves {words}"
)
def independent_loop_without_transfer(context: Dl06Context) -> Findings:
    """A loop is to run while the CPU is in Program mode, without direct access to the channels of PV and output.

    Why: in Program mode the ladder program stands still, and with it the copying of analog values. The loop would go on
    calculating from a frozen PV, or into a word that no module reads. A PV fetched from V-memory is frozen as well: the
    ladder program, or the pointer method that it runs, writes that word. The output of a major loop needs no transfer.

    Fix: add `pv.transfer` and `output.transfer` (slot and channel), or remove `independent_of_cpu_mode`.
    """
    majors = set(context.majors)
    for view in context.loops:
        loop = view.loop
        if not loop.independent_of_cpu_mode:
            continue
        missing = [] if loop.pv.transfer else ["pv"]
        if loop.output.transfer is None and view.index not in majors:
            missing.append("output")
        absent = " and ".join(f"{key}.transfer" for key in missing)
        reasons = [f"{absent} {'is' if len(missing) == 1 else 'are'} not given"] if missing else []
        if loop.pv.transfer and loop.pv.transfer.address is not None:
            reasons.append(f"pv.transfer reads {v_name(loop.pv.transfer.address)}, which the ladder program writes")
            missing.insert(0, "pv")
        if reasons:
            words = " and ".join(view.v(key) for key in missing)
            yield view.at("independent_of_cpu_mode", missing=" and ".join(reasons), words=words)


@per_loop
@error("DL290", FROM_MEMORY, "the PV's source {address} is outside {allowed}")
def transfer_source_outside_memory(view: LoopView) -> Findings:
    """The PV is transferred from a V-memory word that the manual does not allow.

    Why: the transfer reads V400-V677, V1200-V7377 and V10000-V17777 only; elsewhere lie timers, system words and words
    kept in non-volatile memory. An address that is read wrongly is a PV that stands still.

    Fix: copy the value to a word inside these ranges and transfer it from there.
    """
    transfer = view.loop.pv.transfer
    if transfer is None or transfer.address is None:
        return
    if not any(low <= transfer.address <= high for low, high in CPU.transfer_sources):
        yield view.at(
            "pv",
            "transfer",
            "address",
            address=v_name(transfer.address),
            allowed=", ".join(between(ends) for ends in CPU.transfer_sources),
        )


@per_loop
@error("DL291", TRANSFER, "output.transfer names {address}, but {word} holds slot and channel only")
def output_transferred_to_memory(view: LoopView) -> Findings:
    """The output is to be transferred to a V-memory word.

    Why: a V-memory address is an option of the PV's word (+36) alone. In the output's word (+37) its digits would be
    read as base, slot and channel.

    Fix: give slot and channel, or leave the transfer out and let the ladder program read the output word.
    """
    transfer = view.loop.output.transfer
    if transfer is not None and transfer.address is not None:
        yield view.at("output", "transfer", "address", address=v_name(transfer.address), word=view.v("output_transfer"))


@error("DL292", SOURCES, "slot {slot}, channel {channel} is also the output of {others}")
def output_channel_written_twice(context: Dl06Context) -> Findings:
    """Two loops transfer their outputs to the same channel.

    Why: the loop that is calculated last wins; the actuator jumps between two outputs, and neither loop controls.

    Fix: correct the slot or channel of one of them.
    """
    rows = ((channel_of(view.loop.output.transfer), view) for view in context.loops)
    for (slot, channel), view, others in sharing((place, view) for place, view in rows if place is not None):
        finding = view.at_key("output", "transfer", slot=slot, channel=channel, others=in_words(others))
        yield finding.shared_with(*others)


@info("DL520", D660, "{place} is also the PV of {others}, and both are {action}-acting")
def channel_read_twice(context: Dl06Context) -> Findings:
    """Two loops read their PV from the same channel or word and act in the same direction.

    Why: two integral terms on one PV share the work in any proportion, and drift against each other. Often the transfer
    was copied with the rest of the loop, and one of them controls what it does not measure.

    Fix: give each loop its own channel. A direct-acting and a reverse-acting loop on one PV are not reported.
    """
    rows = ((source_of(view.loop.pv.transfer), view) for view in context.loops)
    keyed = (((place, view.loop.action), view) for place, view in rows if place is not None)
    for (place, action), view, others in sharing(keyed):
        finding = view.at_key("pv", "transfer", place=place, action=action, others=in_words(others))
        yield finding.shared_with(*others)


@info(
    "DL293",
    SELECT,
    "slot {slot}, channel {channel} is the PV of {reader} and the output of {writer}: right only for a combined "
    "input/output module",
)
def channel_read_and_written(context: Dl06Context) -> Findings:
    """An output goes to the slot and channel from which a PV is read.

    Why: a module either measures or drives, except for the combination modules, which count inputs and outputs from 1
    each. With any other module one of the two transfers reaches nothing.

    Fix: check the module in this slot.
    """
    for reader, writer in product(context.loops, repeat=2):
        place = channel_of(reader.loop.pv.transfer)
        if place is None or place != channel_of(writer.loop.output.transfer):
            continue
        values = {"slot": place[0], "channel": place[1], "reader": reader.name, "writer": writer.name}
        at_writer, at_reader = writer.at_key("output", "transfer"), reader.at_key("pv", "transfer")
        if reader is writer:
            yield at_writer.quoting(**values)
        else:
            yield from at_both(writer, at_writer, reader, at_reader, **values)


@warning("DL294", SOURCES, "the PV's source {address} is {what}")
def pv_source_in_pid_table(context: Dl06Context) -> Findings:
    """The PV is transferred from a word of the loop table or of a ramp/soak table.

    Why: those words are settings or results of loops, not measurements. Usually the word that the analog module writes
    was meant; its own +03 as a source would leave the PV as it is for ever.

    Fix: give the word that holds the measured value, or slot and channel.
    """
    for view in context.loops:
        transfer = view.loop.pv.transfer
        if transfer is not None and transfer.address is not None and (what := _in_tables(context, transfer.address)):
            yield view.at("pv", "transfer", "address", address=v_name(transfer.address), what=what)


def _in_tables(context: Dl06Context, address: int) -> str:
    """Which word of which table an address is; empty when it is outside them."""
    first, last = context.table
    if first <= address <= last:
        index, offset = divmod(address - first, LOOP_SIZE)
        word = next(word for word in LOOP_TABLE.words if word.offset == offset)
        return f"word +{offset:02o} ({word.title}) of loop {index + 1}"
    owner = next((view for view, start, end in tables(context) if start <= address <= end), None)
    return "" if owner is None else f"in the ramp/soak table of {owner.name}"


@per_loop
@checklist(
    "DL295",
    D03,
    "{word} holds {digits}: slot {slot} by the manual's table (1 to 4), but its text counts slots from 0{hexadecimal}",
)
def slot_counted_two_ways(view: LoopView) -> Findings:
    """The manual counts the slots of the option cards in two ways.

    Why: its table says 1 to 4; its text says that slot 1 is the second slot and slot 0 is adjacent to the CPU. The file
    is encoded by the table. Channels from 10 on are stored as hexadecimal digits, which the manual leaves open.
    All channels of a module that is used this way are closed to the pointer method.

    Fix: see that the PV follows the right terminal.
    """
    if _channels(view):
        yield _slot(view)


def _channels(view: LoopView) -> list[tuple[str, tuple[int, int]]]:
    """What of a loop is transferred from or to a channel, with its slot and channel."""
    transfers = (("pv", view.loop.pv.transfer), ("output", view.loop.output.transfer))
    return [(key, channel) for key, transfer in transfers if (channel := channel_of(transfer)) is not None]


def _slot(view: LoopView) -> Finding:
    """What the word of a loop's first channel holds."""
    key, (slot, channel) = _channels(view)[0]
    word = view.block.encoded.words[LOOP_TABLE.offset(f"{key}_transfer")]
    shown = "" if channel <= 9 else f", and channel {channel} is stored as {channel:02X} hex"
    return view.at_key(
        key, "transfer", word=view.v(f"{key}_transfer"), digits=f"{word:04X}", slot=slot, hexadecimal=shown
    )
