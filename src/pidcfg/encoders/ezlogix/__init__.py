"""EZLogix configurations to registers and discretes and back; here what a listing does not say of a loop."""

from __future__ import annotations

from collections.abc import Callable

from pidcfg.encoders import Option, read_choice, read_per_loop

# --- What EZLogix listings do not say of a loop, and where blocks and tags of converted loops go ----------------------

FORMATS = ("text", "csv", "json", "tags", "modbus-map")


def _read_block_address(key: str) -> Callable[[str], str]:
    """A reader of addresses of the bank that a block is in."""

    def address(text: str) -> str:
        from pidcfg.schemas.ezlogix import DISCRETES, REGISTERS

        bank = {"registers": REGISTERS, "discretes": DISCRETES}[key]
        return f"{bank.prefix}{bank.parse(text)}"

    return address


def _read_tag(*prefixes: str) -> Callable[[str], str]:
    """A reader of tags with one of these prefixes."""

    def tag(text: str) -> str:
        from pidcfg.schemas.ezlogix import parse_tag

        return parse_tag(*prefixes)(text)

    return tag


def _read_output_tag(text: str) -> dict[str, str] | None:
    return None if text == "none" else {"tag": _read_tag("O")(text)}


def _read_counts(text: str) -> tuple[int, int]:
    from pidcfg.schemas.ezlogix import parse_counts

    low, _, high = text.partition("-")
    return parse_counts([int(low), int(high)])


# fmt: off
BLOCK_OPTIONS = (
    Option("registers", "R,R…", "Where each loop's registers begin.", "R100,R132",
           read_per_loop(_read_block_address("registers")), needed=True),
    Option("discretes", "S,S…", "Where each loop's discretes begin.", "S100,S108",
           read_per_loop(_read_block_address("discretes")), needed=True),
)
DIALOG_OPTIONS = (
    Option("action", "direct|reverse,…", "Each loop's controller action; reverse is heating.", "reverse",
           read_per_loop(read_choice("direct", "reverse")), needed=True),
    Option("algorithm", "position|velocity,…", "Each loop's algorithm.", "position",
           read_per_loop(read_choice("position", "velocity")), needed=True),
)
TAG_OPTIONS = (
    Option("pv_tag", "IR|R,…", "The tag of each loop's PV.", "IR1,IR2",
           read_per_loop(_read_tag("IR", "R")), needed=True),
    Option("cv_tag", "OR|R,…", "The tag of each loop's CV.", "OR1,OR2",
           read_per_loop(_read_tag("OR", "R")), needed=True),
    Option("output_tag", "O|none,…", "The tag of each loop's control output; none: not enabled.", "O1,none",
           read_per_loop(_read_output_tag)),
)
PV_COUNTS = Option("pv_counts", "LOW-HIGH,…", "Counts at both ends of each loop's PV range.", "0-32767",
                   read_per_loop(_read_counts))
# fmt: on
DECODE_OPTIONS = (*BLOCK_OPTIONS, *DIALOG_OPTIONS, *TAG_OPTIONS)
CONVERT_OPTIONS = (*BLOCK_OPTIONS, *TAG_OPTIONS, PV_COUNTS)
