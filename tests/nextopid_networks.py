"""Two networks of NextoPID blocks for tests, and where their programs stand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pidcfg.encoders.decoding import decode_listing
from pidcfg.encoders.listing import Listing, ListingError
from pidcfg.schemas.nextopid import NextopidFile
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable

DATA = Path(__file__).parent / "data" / "nextopid"
FULL = {"MinMV": 0, "MaxMV": 100, "MinPV": 0, "MaxPV": 100}

FEED_FORWARD = {
    "pidcfg": 1,
    "vendor": "nextopid",
    "name": "Heat exchanger (hot water)",
    "description": "Steam flow follows inflow Fi and its temperature Ti before PV does (* 16.5 *)",
    "plc": {"sample_time": "100 ms", "program": "HeatExchanger"},
    "signals": {"Fi": 2.0, "Ti": 20.0, "Feedback": False, "K": 2.0},
    "blocks": [
        {
            "name": "ViaSteam",
            "type": "ControlDelayLag",
            "InVar": "TIC.MV",
            "DelayTime": 1,
            "InitDelayedVar": 30,
            "Gs": 1,
            "Tc": 10,
            "Init_OutVar": 30,
            "Min_OutVar": -1000,
            "Max_OutVar": 1000,
        },
        {
            "name": "ViaTi",
            "type": "ControlDelayLag",
            "InVar": "Ti",
            "DelayTime": 2,
            "InitDelayedVar": 20,
            "Gs": 1,
            "Tc": 5,
            "Init_OutVar": 20,
            "Min_OutVar": -1000,
            "Max_OutVar": 1000,
        },
        {
            "name": "ViaFi",
            "type": "ControlDelayLag",
            "InVar": "1 / max(Fi, 1)",
            "DelayTime": 1.5,
            "InitDelayedVar": 0.5,
            "Gs": 1,
            "Tc": 4,
            "Init_OutVar": 0.5,
            "Min_OutVar": -1000,
            "Max_OutVar": 1000,
        },
        {"name": "LateTi", "type": "ControlDelay", "InVar": "Ti", "DelayTime": 1, "InitDelayedVar": 20},
        {
            "name": "LeadTi",
            "type": "ControlLeadLag",
            "InVar": "LateTi.OutVar",
            "G": 1,
            "Tlead": 10,
            "Tlag": 5,
            "Min_OutVar": -1000,
            "Max_OutVar": 1000,
        },
        {"name": "LateFi", "type": "ControlDelay", "InVar": "max(Fi, 1)", "DelayTime": 0.5, "InitDelayedVar": 2},
        {
            "name": "LeadFi",
            "type": "ControlLeadLag",
            "InVar": "LateFi.OutVar",
            "G": 1,
            "Tlead": 10,
            "Tlag": 4,
            "Min_OutVar": -1000,
            "Max_OutVar": 1000,
        },
    ],
    "loops": [
        {
            "name": "TIC",
            "type": "PIDA_TUNE_REAL",
            "SP": 50,
            "PV": "ViaSteam.OutVar * K * ViaFi.OutVar + ViaTi.OutVar",
            "Kp": 1,
            "Ti_Ki": "10 s",
            "Td_Kd": 0.525,
            "BIAS": "(TIC.SP - LeadTi.OutVar) * LeadFi.OutVar / 2",
            **FULL,
            "Manual": "Feedback",
            "pv": {"unit": "°C"},
            "output": {"range": [0, 100], "unit": "%"},
            "AutoTuneParam": {"PercAmpMV": 5, "PercHystPV": 0.1, "PercMaxPeakPV": 10, "NumCycles": 3, "Mode": "PID"},
        },
    ],
}
"""Disturbances of a heat exchanger act on the steam before they reach its outlet; the process is simulated."""

OVERRIDE = {
    "pidcfg": 1,
    "vendor": "nextopid",
    "plc": {"sample_time": 0.1},
    "signals": {"PT_1": 0.0, "FT_1": 1234, "SEL_MV": 5, "Hold": True},
    "blocks": [
        {"name": "SEL", "type": "ControlSelectMin", "MV1": "PIC.MV", "MV2": "FIC.MV * 100 / 30000"},
        {
            "name": "SPLIT",
            "type": "ControlSplitRange",
            "MV": "max(min(SEL.MV, 100, SEL_MV), 0)",
            "SPLIT": 40,
            "Mode": 2,
        },
        {"name": "PULSES", "type": "ControlPWM", "MV": "SPLIT.MV1", "MaxMV": "SPLIT.SPLIT + 60", "Period": 50},
    ],
    "loops": [
        {
            "name": "PIC",
            "type": "PIDA_REAL",
            "SP": 4.5,
            "PV": "PT_1",
            "Kp": 2,
            "Ti_Ki": 20,
            "Td_Kd": 0,
            **FULL,
            "OVERR": "SEL.OVERR1",
            "TRK_VAL": "SEL.MV",
            "TRK_IN": "Hold",
        },
        {
            "name": "FIC",
            "type": "PIDA_INT",
            "SP": 1500,
            "PV": "FT_1",
            "Kp": 1.5,
            "Ti_Ki": 8,
            "Td_Kd": 0,
            "MinMV": 0,
            "MaxMV": 30000,
            "MinPV": 0,
            "MaxPV": 30000,
            "OVERR": "SEL.OVERR2",
            "TRK_VAL": "SEL.MV * 300",
            "BIAS": "(- 1)",
            "Direct": True,
            "sample_time": "500 ms",
            "description": "feed */ (* or *) not",
        },
        {"name": "HEAT", "type": "ControlON_OFF", "SP": "FIC.SP / 100", "DeadBand": 0.5, "MinPV": -20, "MaxPV": 120},
    ],
}
"""Two controllers and one valve, then two valves; a loop that is called in every fifth cycle."""

NETWORKS = {"feed_forward": FEED_FORWARD, "override": OVERRIDE}


def network(name: str) -> NextopidFile:
    """One of the networks as a configuration."""
    return NextopidFile.model_validate(NETWORKS[name])


def fault(read: Callable[[str], Listing], text: str) -> ListingError | None:
    """Why a text is refused; None: it is a listing with a configuration."""
    try:
        decode_listing(read(text), VENDORS["nextopid"], {})
    except ListingError as error:
        return error
    return None
