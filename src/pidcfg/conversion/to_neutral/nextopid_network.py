"""Blocks and signals of a NextoPID configuration that no loop of another PLC has: what they do, for the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.conversion.builder import NeutralBuilder
    from pidcfg.conversion.to_neutral.nextopid_wires import Network

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


def _is_kept(network: Network, kept: set[int], i: int, key: str) -> bool:
    """Whether a parameter that reads a signal goes over, with the signal's value or as the process's."""
    if i < network.first_loop:
        return i in kept and key in FILTERED
    return key in SETTINGS
