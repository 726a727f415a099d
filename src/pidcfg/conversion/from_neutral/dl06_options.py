"""Where the loops of a converted DL06 file go, and which CPU they are for."""

from __future__ import annotations

from pidcfg.encoders.dl06.files import DECODE_OPTIONS
from pidcfg.encoders.files import DecodeOption
from pidcfg.encoders.maps.dl06 import FORMATS

DATA_FORMATS = {name.replace(" ", "-"): name for name in FORMATS}

CONVERT_OPTIONS = (
    *(option for option in DECODE_OPTIONS if option.key in {"loop_table", "reset_decimals"}),
    DecodeOption(
        "data_format",
        "FORMAT",
        f"Data format of PV and output: {', '.join(DATA_FORMATS)}.",
        "15-bit-unipolar",
        lambda text: DATA_FORMATS.get(text.replace(" ", "-")),
    ),
    DecodeOption(
        "derivative",
        "error|pv",
        "What the rate term of the CPU acts on: pv on other CPUs of the family.",
        "error",
        {"error": "error", "pv": "pv"}.get,
    ),
)
