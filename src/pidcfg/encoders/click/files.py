"""The files that a CLICK image is written to and read from."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from pidcfg.encoders.click.dataview import read_dataview, write_dataviews
from pidcfg.encoders.click.dump import merge_dump, read_dump, write_dump
from pidcfg.encoders.click.nickname_csv import HEADER, write_nicknames
from pidcfg.encoders.click.nickname_loops import read_nicknames
from pidcfg.encoders.click.nickname_merge import merge_nicknames
from pidcfg.encoders.files import FileKind, listings
from pidcfg.encoders.maps.click import SPACE
from pidcfg.encoders.modbus import Place
from pidcfg.encoders.spaces import NoRegisterError
from pidcfg.encoders.tables import columns, first_line

if TYPE_CHECKING:
    from pidcfg.schemas.click import ClickFile

COIL_BANK = "C"


class Numbering:
    """C bits are coils; DS and DF are holding registers, a DF two of them, as pyclickplc knows them."""

    @staticmethod
    def place(number: int) -> Place:
        """Where an address is; raises `NoRegisterError` behind the end of its bank."""
        from pyclickplc import plc_to_modbus

        bank, n = SPACE.place(number)
        if not bank.first <= n <= bank.last:
            raise NoRegisterError(f"there is no {bank.name(n)}: the last one is {bank.name(bank.last)}")
        register, width = plc_to_modbus(bank.prefix, n)
        return Place("coil" if bank.prefix == COIL_BANK else "holding", register, width)

    @staticmethod
    def find(table: str, register: int) -> tuple[int, int] | None:
        """The address of a coil or holding register."""
        from pyclickplc import modbus_to_plc
        from pyclickplc.modbus import modbus_to_plc_register

        if table == "coil":
            coil = modbus_to_plc(register, is_coil=True)
            address = None if coil is None else (*coil, 0)
        else:
            address = modbus_to_plc_register(register) if table == "holding" else None
        if address is None or address[0] not in {bank.prefix for bank in SPACE.banks}:
            return None
        return SPACE.number(address[0], address[1]), address[2]


NUMBERING = Numbering()
FORMATS = listings(SPACE, "register listing", NUMBERING) | {
    "nickname-csv": FileKind(
        "nickname-csv",
        "nicknames with initial values (CSV)",
        write_nicknames,
        read_nicknames,
        lambda text: {name.lower() for name in HEADER} <= set(columns(text)),
        merge=merge_nicknames,
        carries_comments=False,
        whole=False,
    ),
    "cdv": FileKind(
        "cdv",
        "DataViews with new values",
        write_dataviews,
        read_dataview,
        lambda text: re.fullmatch(r"(-1|0),[0-9]+,[0-9]+", first_line(text)) is not None,
        encoding="utf-16-le",
        partial=True,
        carries_comments=False,
        whole=False,
    ),
    "data-dump": FileKind(
        "data-dump",
        "data for Write Data into PLC",
        write_dump,
        read_dump,
        lambda text: re.fullmatch(r"<[A-Z]{1,3}=START>", first_line(text)) is not None,
        merge=merge_dump,
        needs_into=True,
        carries_comments=False,
        whole=False,
    ),
}


NEVER_WRITTEN = (
    "write the values into the PLC after the download (Write Data into PLC, or the DataView's new values): registers "
    "that were never written are the first cause of PID errors"
)


def checklist(config: ClickFile) -> tuple[str, ...]:
    """What no file can set or prove."""
    items = [NEVER_WRITTEN]
    open_loops = [f"{loop.name} ({loop.action})" for loop in config.loops if not loop.action_verified]
    if open_loops:
        items.append(
            f"verify Forward/Reverse in the PID window before Auto: {', '.join(open_loops)}; direct is Forward, where "
            "the PV rises with the output; then state `action_verified: true`"
        )
    pulsed = [f"{loop.name} ({loop.output.pwm.bit})" for loop in config.loops if loop.output.pwm is not None]
    if pulsed:
        items.append(f"enable PWM in the PID window, and its bit address: {', '.join(pulsed)}; no register holds them")
    return tuple(items)
