"""Blocks and signals of a NextoPID configuration that no loop of another PLC has: what they do, for the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.nextopid.bumpless import bumpless_moves
from pidcfg.schemas.iec import Wire

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.conversion.builder import NeutralBuilder
    from pidcfg.conversion.to_neutral.nextopid_wires import Network
    from pidcfg.schemas.nextopid import Move

TERMS = ("SP", "PV", "Kp", "Ti_Ki", "Td_Kd", "Tfd", "ManualMV", "DeadBand")
ENDS = ("MaxVarMV", "MaxMV", "MinMV", "MaxPV", "MinPV")
SWITCHES = ("Indep", "DisableP", "DerivEr", "CASC", "Manual", "Direct")
SETTINGS = frozenset((*TERMS, *ENDS, *SWITCHES))
"""Parameters of a loop whose signals are taken at their first value, or belong to the process."""
FILTERED = frozenset(("InVar", "Tc", "Period"))
"""Parameters of a block that the neutral loop has, likewise."""


def blocks_and_signals(network: Network, builders: Sequence[NeutralBuilder]) -> None:
    """Drops every block and signal that no loop has, in the report of the loop that it works for."""
    kept = network.kept()
    for j in range(network.first_loop):
        if j in kept:
            continue
        item = network.items[j].item
        wired = ", ".join(f"{key} {text}" for key, text in network.expressions(j))
        note = f"of {wired}: program it beside the controller" if wired else "program it beside the controller"
        builder = builders[network.owner_of(j) - network.first_loop]
        builder.drop(f"blocks.{item.name}", network.items[j].kind.name, note)
    for name, value in network.config.signals.items():
        lost = next(((i, key) for i, key in network.readers(name) if not _is_kept(network, kept, i, key)), None)
        if lost is not None:
            i, key = lost
            owner = i if i >= network.first_loop else network.owner_of(i)
            note = f"read by {network.items[i].item.name}.{key}, which has no twin"
            builders[owner - network.first_loop].drop(f"signals.{name}", value, note)


MOVED = "copy it in the program: "
STAYS = "the output stays on the way to Manual; see operation.manual where the target's does not"


def moves(network: Network, builders: Sequence[NeutralBuilder]) -> None:
    """The moves of figure 16-1 go with their loops; every other one is dropped with the loop that it writes."""
    known: set[int] = set()
    for i, builder in zip(network.loops, builders, strict=True):
        found = bumpless_moves(network.encoding, i)
        if found.holds_mv is not None:
            builder.loop.beside[f"moves.{found.holds_mv}"] = STAYS
        if found.follows_pv is not None:
            path = f"moves.{found.follows_pv}"
            builder.put(path, _text(network, found.follows_pv), "setpoint.follows_pv", True)  # noqa: FBT003
        known |= {number for number in found if number is not None}
    for number, move in enumerate(network.config.moves):
        if number not in known:
            builders[_owner(network, move.to)].drop(f"moves.{number}", _text(network, number), MOVED + _when(move))


def _owner(network: Network, name: str) -> int:
    """The loop that a target is of, or that reads it; else the first."""
    block = name.partition(".")[0]
    owners = [i for i in network.loops if network.items[i].item.name == block]
    if not owners and name in network.config.signals:
        owners = [i for i, _ in network.readers(name) if i in network.loops]
    return (owners or [network.first_loop])[0] - network.first_loop


def _text(network: Network, number: int) -> str:
    move = network.config.moves[number]
    value = move.move.text if isinstance(move.move, Wire) else str(move.move).upper()
    return f"{value} to {move.to}"


def _when(move: Move) -> str:
    when = move.when.text if isinstance(move.when, Wire) else "never"
    return "in every cycle" if move.when is True else f"when {when}"


def _is_kept(network: Network, kept: set[int], i: int, key: str) -> bool:
    """Whether a parameter that reads a signal goes over, with the signal's value or as the process's."""
    if i < network.first_loop:
        return i in kept and key in FILTERED
    return key in SETTINGS
