"""CLICK configurations to C, DS and DF registers and back; here what a listing does not say of a loop."""

from __future__ import annotations

from collections.abc import Callable

from pidcfg.encoders import Option, read_per_loop

# --- What CLICK listings do not say of a loop, and where the blocks of converted loops begin --------------------------

FORMATS = ("text", "csv", "json", "modbus", "nickname-csv", "cdv", "data-dump")


def _read_block_address(key: str) -> Callable[[str], str]:
    """A reader of addresses of the bank that a block is in."""

    def address(text: str) -> str:
        from pidcfg.schemas.click import BITS, FLOATS, INTEGERS

        bank = {"bits": BITS, "integers": INTEGERS, "floats": FLOATS}[key]
        return f"{bank.prefix}{bank.parse(text)}"

    return address


def _read_pwm_bit(text: str) -> dict[str, str] | None:
    from pidcfg.schemas.click import parse_output_bit

    return None if text == "none" else {"bit": parse_output_bit(text)}


# fmt: off
DECODE_OPTIONS = (
    Option("bits", "C,C…", "Where each loop's C bits begin.", "C101,C201",
           read_per_loop(_read_block_address("bits")), needed=True),
    Option("integers", "DS,DS…", "Where each loop's DS registers begin.", "DS101,DS201",
           read_per_loop(_read_block_address("integers")), needed=True),
    Option("floats", "DF,DF…", "Where each loop's DF registers begin.", "DF101,DF201",
           read_per_loop(_read_block_address("floats")), needed=True),
    Option("pwm_bit", "Y|none,…", "The discrete output of each loop's PWM; none: an analog output.", "Y001,none",
           read_per_loop(_read_pwm_bit), needed=True),
)
# fmt: on
CONVERT_OPTIONS = DECODE_OPTIONS
