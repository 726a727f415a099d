"""Mistakes that people make, one a row: what is changed in an example, and what a clear answer has.

A row of a file is its example, what stands there, the mistake, and texts of the answer: the value, and what to do. The
answer also names the line of the mistake; a text such as ``@4`` names another one. A row of `SHEETS` changes `SHEET`;
a row of a command is its words and texts of the answer. ``python tests/clear_messages.py`` prints the answers that are
not clear, and how many are.
"""

from __future__ import annotations

import shlex
import shutil
import tempfile
from contextlib import chdir
from pathlib import Path
from typing import TYPE_CHECKING

from pidcfg.cli.main import Exit
from shell import captured, pidcfg

if TYPE_CHECKING:
    from collections.abc import Sequence

EXAMPLES = Path(__file__).parents[1] / "examples"
# fmt: off
KEYS = (
    # file          sound                             mistake                                    must have
    ("dl06/flow", "gain: 0.60", "Gain: 0.60", "Gain", "gain"),
    ("dl06/flow", "gain: 0.60", "gain_percent: 0.60", "gain_percent", "gain"),
    ("dl06/flow", "rate: 0}", "rate: 0, filter: 2}", "filter", "tuning"),
    ("dl06/flow", "sample_rate: 250 ms", "samplerate: 250 ms", "samplerate", "sample_rate"),
    ("dl06/flow", "sample_rate: 250 ms", "scan_time: 250 ms", "scan_time", "sample_rate"),
    ("dl06/flow", "bumpless: I ", "bumples: I ", "bumples", "bumpless"),
    ("dl06/flow", "square_root: true", "sqrt: true", "sqrt", "square_root"),
    ("dl06/flow", "hysteresis: 2", "hysterese: 2", "hysterese", "hysteresis"),
    ("dl06/flow", "limits: [0, 110]}", "low_limit: 0, high_limit: 110}", "low_limit", "limits"),
    ("dl06/flow", "loop_table: V10000", "looptable: V10000", "looptable", "loop_table"),
    ("dl06/flow", "action: direct", "acting: direct", "acting", "action"),
    ("dl06/flow", "name: FIC-301", "tag: FIC-301", "tag", "name"),
    ("click/tank", "freeze_bias: true", "anti_windup: true", "anti_windup", "freeze_bias"),
    ("click/tank", "reset_time: 150", "integral_time: 150", "integral_time", "reset_time"),
    ("click/tank", "proportional_gain: 6", "gain: 6", "gain", "proportional_gain"),
    ("click/tank", "floats: DF101", "float: DF101", "float", "floats"),
    ("click/tank", "sample_rate: 500 ms", "sample_time: 500 ms", "sample_time", "sample_rate"),
    ("click/tank", "lower_limit: 70", "low: 70", "low", "lower_limit"),
    ("ezlogix/oven", "process_when_stopped: true", "run_when_stopped: true", "run_when_stopped"),
    ("ezlogix/oven", "anti_windup: true", "freeze_bias: true", "freeze_bias", "anti_windup"),
    ("ezlogix/oven", "integral_time: 140.0", "reset: 140.0", "reset", "integral_time"),
    ("ezlogix/oven", "cycle_time: 10.0", "period: 10.0", "period", "cycle_time"),
    ("dpide/oven", "Ti_Ki: 600.0", "Ti: 600.0", "Ti", "Ti_Ki"),
    ("dpide/oven", "MV_MAX: 4000", "MVMAX: 4000", "MVMAX", "MV_MAX"),
    ("dpide/oven", "PID_DIR: true", "direction: true", "direction", "PID_DIR"),
    ("dpide/oven", "SV: 80.0", "SP: 80.0", "SP", "SV"),
    ("nextopid/heatexchanger", "    Ti_Ki: 10.0 ", "    Ti: 10.0 ", "Ti", "Ti_Ki"),
    ("nextopid/heatexchanger", "MinPV: 0.0", "PVMin: 0.0", "PVMin", "MinPV"),
    ("nextopid/heatexchanger", "type: PIDA_REAL", "typ: PIDA_REAL", "typ", "type"),
    ("generic/boiler", "derivative_filter: 3 s", "derivative_lag: 3 s", "derivative_lag", "derivative_filter"),
    ("generic/boiler", "max_rate: 10", "rate_limit: 10", "rate_limit", "max_rate"),
)
VALUES = (
    ("dl06/flow", "gain: 0.60", "gain: 0,60", "0,60", "0.60"),
    ("dl06/flow", "gain: 0.60", "gain: 1/2", "1/2", "number"),
    ("dl06/flow", "gain: 0.60", "gain: sixty", "sixty", "number"),
    ("dl06/flow", "gain: 0.60", "gain: 250", "250", "99.99"),
    ("dl06/flow", "reset: 3.0", "reset: -3.0", "-3.0", "0"),
    ("dl06/flow", "sample_rate: 250 ms", "sample_rate: 250 us", "250 us", "ms"),
    ("dl06/flow", "sample_rate: 250 ms", "sample_rate: 4 Hz", "4 Hz", "s"),
    ("dl06/flow", "sample_rate: 250 ms", "sample_rate: 0.25s ms", "0.25s ms"),
    ("dl06/flow", "sample_rate: 250 ms", "sample_rate: 0", "0", "0.05"),
    ("dl06/flow", "value: 75,", "value: 75 m3/s,", "75 m3/s", "m3/h"),
    ("dl06/flow", "value: 75,", "value: 750,", "750", "110"),
    ("dl06/flow", "range: [0, 120]", "range: [120, 0]", "[120, 0]", "lower end first"),
    ("dl06/flow", "range: [0, 120]", "range: 0-120", "0-120", "["),
    ("dl06/flow", "range: [0, 120]", "range: [0, 120, 10]", "3", "2"),
    ("dl06/flow", "range: [0, 120]", "range: [0 120]", "0 120", ","),
    ("dl06/flow", "square_root: true", "square_root: ja", "ja", "true"),
    ("dl06/flow", "square_root: true", "square_root: 1", "1", "true"),
    ("dl06/flow", "action: direct", "action: heating", "heating", "direct"),
    ("dl06/flow", "action: direct", "action: forward", "forward", "direct"),
    ("dl06/flow", "mode: auto", "mode: automatic", "automatic", "auto"),
    ("dl06/flow", "algorithm: velocity", "algorithm: incremental", "incremental", "velocity"),
    ("dl06/flow", "address: V400", "address: V408", "V408", "octal"),
    ("dl06/flow", "address: V400", "address: 400", "400", "V400"),
    ("dl06/flow", "loop_table: V10000", "loop_table: D10000", "D10000", "V"),
    ("dl06/flow", "limits: [8, 100]", "limits: [100, 8]", "100", "8"),
    ("dl06/flow", "low: 8, high", "low: 2, high", "2", "3"),
    ("click/tank", "bits: C101", "bits: X101", "X101", "C"),
    ("click/tank", "bits: C101", "bits: C1990", "C1990", "C2000"),
    ("click/tank", "floats: DF101", "floats: DF490", "DF490", "DF500"),
    ("click/tank", "bit: Y001", "bit: Y1", "Y1", "Y001"),
    ("click/tank", "sample_rate: 500 ms", "sample_rate: 50 ms", "0.05 s", "0.1 to 30 s"),
    ("click/tank", "bumpless: 2 ", "bumpless: 3 ", "3", "2"),
    ("click/tank", "bumpless: 2 ", "bumpless: II ", "II", "write 2"),
    ("click/tank", "value: 140,", "value: 140 C,", "140 C", "degF"),
    ("click/tank", "filter: 80", "filter: 180", "180", "100"),
    ("click/tank", "rate_of_change: 120 /min", "rate_of_change: 120 /h", "120 /h", "/min"),
    ("click/tank", "type: PI, hysteresis: 2}", "type: PD, hysteresis: 2}", "PD", "PI"),
    ("ezlogix/oven", "registers: R133", "registers: R120", "R120", "R101 to R132", "26:16", "@10"),
    ("ezlogix/oven", "registers: R101", "registers: V101", "V101", "R"),
    ("ezlogix/oven", "sample_rate: 0.50", "sample_rate: 0.005", "0.005"),
    ("ezlogix/oven", "counts: [0, 4095]", "counts: [0, 99999]", "99999"),
    ("ezlogix/oven", "derivative_time: off", "derivative_time: none", "none", "off"),
    ("ezlogix/oven", "min_on: 0.5", "min_on: 50", "50", "10"),
    ("dpide/oven", "MV_MIN: 0", "MV_MIN: 5000", "5000", "4000"),
    ("dpide/oven", "PID_MODE: 0 ", "PID_MODE: auto ", "auto", "0 automatic, 1 autotune"),
    ("dpide/oven", "CYCLE: 1000", "CYCLE: 0.5", "0.5", "0.5 s if seconds are meant"),
    ("dpide/chiller", "Ti_Ki: 0.05", "Ki: 0.05", "Ki", "did you mean Ti_Ki?"),
    ("click/tank", "filter: 80", "filter: 0.8", "0.8", "without decimals", "percentage"),
    ("nextopid/cascade", "SP_CASC: TIC_1.MV", "SP_CASC: TIC_1.OUT", "TIC_1.OUT", "did you mean 'TIC_1.MV'?"),
    ("nextopid/cascade", "Ti_Ki: 40.0", "Ti_Ki: T#40s", "T", "write the seconds"),
    ("nextopid/cascade", "sample_time: 0.2", "sample_time: 200", "200 s", "a bare number is in s"),
    ("nextopid/pump", "Direct: true", "Direct: wahr", "wahr", "write true"),
    ("nextopid/furnace", "SP: 17500 ", "SP: 350.5 ", "350.5", "round it"),
    ("dpide/oven", "SV: D100", "SV: DX100", "DX100", "D"),
    ("dpide/chiller", "PV: D202", "PV: D200", "D200", "SV", "the PV is measured"),
    ("dpide/oven", "output: Y0.0", "output: Q0.0", "Q0.0", "Y"),
    ("nextopid/heatexchanger", "type: PIDA_REAL", "type: PID_REAL", "PID_REAL", "PIDA_REAL"),
    ("nextopid/heatexchanger", "ControlLeadLag, InVar: D_I", "LeadLag, InVar: D_I", "LeadLag", "ControlLeadLag"),
    ("nextopid/heatexchanger", "InVar: Flow,", "InVar: Flw,", "Flw", "Flow"),
    ("nextopid/heatexchanger", "Flow: 2.0 ", "Flow: two ", "two"),
    ("nextopid/heatexchanger", "Inlet: 20.0 ", "In-let: 20.0 ", "In-let"),
    ("nextopid/heatexchanger", "OutVar) * LL_Flow", "OutVar)) * LL_Flow", ")"),
    ("generic/boiler", "source: TIC-1,", "source: TIC-9,", "TIC-9", "did you mean TIC-"),
    ("generic/boiler", "mode: cascade", "mode: remote", "remote", "cascade"),
    ("generic/boiler", "limits: [40, 110]", "limits: [90, 110]", "85", "90"),
)
YAML = (
    ("dl06/flow", "vendor: dl06", "vendor dl06", "vendor dl06", ":"),
    ("dl06/flow", "vendor: dl06", "vendor:dl06", "no space", "write 'vendor: dl06'"),
    ("dl06/flow", "    mode: auto", "\tmode: auto", "tab"),
    ("dl06/flow", "    mode: auto", "     mode: auto", "mode"),
    ("dl06/flow", "    mode: auto", "   mode: auto", "mode"),
    ("dl06/flow", "reset: 3.0, rate: 0}", "reset: 3.0, rate: 0", "}", "line 15, column 13", "@16"),
    ("dl06/flow", "{gain: 0.60, reset: 3.0, rate: 0}", "{gain: 0.60; reset: 3.0; rate: 0}", ";", ","),
    ("dl06/flow", "{gain: 0.60, reset: 3.0, rate: 0}", "{gain=0.60, reset=3.0, rate=0}", "=", ":"),
    ("dl06/flow", "{gain: 0.60,", "{gain:0.60,", "no space", "write 'gain: 0.60'"),
    ("dl06/flow", "  - name: FIC-301", "  -name: FIC-301", "no space", "write '- name: FIC-301'"),
    ("dl06/flow", "  - name: FIC-301", "  * name: FIC-301", "*", "-"),
    ("dl06/flow", "name: Cooling water header", "name: 'Cooling water header", "'"),
    ("dl06/flow", "name: Cooling water header", "name: Cooling: water header", "Cooling", "quot"),
    ("dl06/flow", "name: Cooling water header", "name: Cooling water header\nname: Twice", "name", "@5"),
    ("dl06/flow", "unit: m3/h", "unit: %", "%", "quot"),
    ("dl06/flow", "range: [0, 120]", "range: (0, 120)", "(0, 120)", "["),
    ("dl06/flow", "pidcfg: 1", "pidcfg: 2", "2", "1"),
    ("dl06/flow", "pidcfg: 1", "---\npidcfg: 1\n---\nvendor: dl06", "---", "@4"),
    ("dl06/flow", "name: Cooling water header", "name: @header", "@", "quot"),
    ("dl06/flow", "vendor: dl06", "vendor: dl06;", "dl06;", "dl06"),
)
SCENARIOS = (
    ("click/tank.scenario", "duration: 40 min", "duration: -40 min", "-40", "0"),
    ("click/tank.scenario", "config: tank.yaml", "config: tnak.yaml", "tnak.yaml", "tank.yaml"),
    ("click/tank.scenario", "model: first_order", "model: firstorder", "firstorder", "first_order"),
    ("click/tank.scenario", "  TANK1: {model", "  TANK2: {model", "TANK2", "TANK1"),
    ("click/tank.scenario", "input: TANK1.PWM * 100", "input: TANK1.PWM x 100", "x"),
    ("click/tank.scenario", "input: TANK1.PWM * 100", "input: TANK1.OUT * 100", "TANK1.OUT", "TANK1.CO"),
    ("click/tank.scenario", "time_constant: 420", "time_constant: 0", "0", "above"),
    ("click/tank.scenario", "at: 20 min, loop: TANK1, disturb", "at: 50 min, loop: TANK1, disturb", "50", "40"),
    ("click/tank.scenario", "disturb: {load: 45}", "disturb: {laod: 45}", "laod", "load"),
    ("click/tank.scenario", "alarm: pv_high, never", "alarm: high, never", "high", "pv_high"),
    ("click/tank.scenario", "signal: TANK1.PV, min: 134", "signal: TANK1.PV, minimum: 134", "minimum", "min"),
    ("click/tank.scenario", "from: 15 min, until: 34 min", "from: 35 min, until: 34 min", "35", "34"),
    ("click/tank.scenario", "step: 100 ms ", "step: 0 ms ", "0", "above"),
    ("click/tank.scenario", "expect:", "expects:", "expects", "expect"),
    ("click/tank.scenario", "duration: 40 min", "duration: 40m", "40m", "min"),
    ("click/tank.scenario", "min: 134, max: 146", "min: 146, max: 134", "146", "134", "smaller number as min"),
    ("dpide/chiller.scenario", "share: 90 %", "share: 0.9", "0.9 can be 90 % or 0.9 %", "write 90 %"),
    ("dl06/flow.scenario", "band: 5 %", "band: 0.05", "0.05 can be 5 % or 0.05 %", "write 5 %"),
    ("dpide/oven.scenario", "duration: 90 min", "tolerance: {OVEN: 200 %}\nduration: 90 min", "200 %", "than 100 %"),
    ("dpide/chiller.scenario", "share: 90 %", "share: 1", "1 can be 100 % or 1 %", "write 1 %, or what"),
)
COMMANDS = (
    # command                                                must have
    ("validat dl06/flow.yaml", "validat", "validate"),
    ("validate dl06/flw.yaml", "dl06/flw.yaml", "flow.yaml"),
    ("validate dl06/flow.yaml --fomat json", "--fomat", "--format"),
    ("validate dl06/flow.yaml --format xml", "xml", "sarif"),
    ("encode dl06/flow.yaml --format hex", "hex", "ihex"),
    ("convert dl06/flow.yaml --to clik", "clik", "click"),
    ("convert dl06/flow.yaml", "--to", "click"),
    ("decode dl06/flow.yaml --vendor dl06", "dl06/flow.yaml", "listing"),
    ("decode dl06/golden/flow.json", "--vendor"),
    ("diff dl06/flow.yaml", "AFTER"),
    ("diff - -", "read only once", "BEFORE"),
    ("simulate dl06/flow.scenario.yaml --every 0", "0", "1"),
    ("certify dl06/flow.yaml", "flow.yaml", "init --scenario"),
    ("tune --method ziegler", "ziegler", "zn-open"),
    ("tune --method simc --gain 2", "--time-constant"),
    ("tune --method simc --gain 2,5 --time-constant 10 --dead-time 1", "2,5", "2.5"),
    ("validate mistakes/typed.txt", "memory listing", "pidcfg decode"),
    ("serve dl06/flow.yaml --for 1", "is a configuration", "init --scenario dl06/flow.yaml"),
    ("whatif dl06/flow.yaml -o w.html", "no scenario", "init --scenario"),
    ("tune --method simc --gain 2 --time-constant '10 min' --dead-time 1", "10 min", "write 600", "in s"),
    ("simulate dl06/flow.scenario.yaml --every 0.5", "0.5", "whole number"),
    ("explain V99999999", "V99999999", "explain"),
    ("rule DL999", "DL999"),
    ("init --vendor siemens", "siemens", "dl06"),
    ("compare dl06/flow.yaml --plc 10.0.0.5", "10.0.0.5", "modbus://"),
    ("export dl06/flow.yaml -o flow.pdf", "flow.pdf", ".csv"),
)
SHEETS = (
    # sound       mistake           must have, beside `loops.csv`
    (",2.5,", ",2..5,", "row 2, cell B2 (gain)", "2..5", "as in 2.5"),
    (",2.5,", ",=A1*2,", "row 2, cell B2 (gain)", "=A1*2", "as in 2.5"),
    (",2.5,", ",#REF!,", "row 2, cell B2 (gain)", "#REF!", "as in 2.5"),
    (",60,", ",1 Stunde,", "row 2", "1 Stunde", "min"),
    (",direct", ",fwd", "row 2, cell I2 (action)", "fwd", "direct, reverse"),
    (",0,200,", ",200,0,", "row 2", "[200, 0]", "[0, 200]"),
    (",degC,", ",", "row 2, cell H2 (setpoint)", "'direct'", "number"),
    ("gain,", "gian,", "row 1, cell B1", "gian", "did you mean gain?"),
    ("gain,", "Proportionalband,", "row 1, cell B1", "Proportionalband", "100 / band is the gain in %"),
    ("gain,", "Xp [%],", "row 1, cell B1", "Xp", "100 / band is the gain in %"),
    ("TIC-1,", ",", "row 2", "name is missing", "add name"),
    ("0.5\n", "0.5\nTIC-1,2,60,0,0,9,K,8,direct,1\n", "row 3, cell A3", "TIC-1", "give each its own"),
    ("TIC-1,2.5,60,0,0,200,degC,85,direct,0.5", "", "no loops below"),
)
SHEET = (
    "tag,gain,reset,rate,range low,range high,unit,setpoint,action,sample\n"
    "TIC-1,2.5,60,0,0,200,degC,85,direct,0.5\n"
)
# fmt: on

FILES = (*KEYS, *VALUES, *YAML, *SCENARIOS)


def lacks_of_file(root: Path, file: str, sound: str, mistake: str, *texts: str) -> tuple[list[str], str]:
    """What the answer to a mistake in a file lacks, and the answer."""
    path = root / f"{file}.yaml"
    text = path.read_text("utf-8")
    before, found, after = text.partition(sound)
    assert found, f"{file} has no {sound!r}"
    line = next((t[1:] for t in texts if t[0] == "@" and t[1:].isdigit()), str(before.count("\n") + 1))
    path.write_text(f"{before}{mistake}{after}", "utf-8")
    try:
        code, answer, _ = captured(pidcfg, ["validate", f"{file}.yaml"])
    finally:
        path.write_text(text, "utf-8")
    wanted = [f"{file}.yaml:{line}:", *(t for t in texts if t[0] != "@" or not t[1:].isdigit())]
    return _lacks(code, answer, wanted), answer


def lacks_of_sheet(root: Path, sound: str, mistake: str, *texts: str) -> tuple[list[str], str]:
    """What the answer to a mistake in a sheet of loops lacks, and the answer."""
    before, found, after = SHEET.partition(sound)
    assert found, f"the sheet has no {sound!r}"
    (root / "loops.csv").write_text(f"{before}{mistake}{after}", "utf-8")
    code, answer, _ = captured(pidcfg, ["init", "--from", "loops.csv", "--vendor", "dl06"])
    return _lacks(code, answer, ["loops.csv", *texts]), answer


def lacks_of_command(command: str, *texts: str) -> tuple[list[str], str]:
    """What the answer to a mistake in a command lacks, and the answer."""
    code, answer, _ = captured(pidcfg, shlex.split(command))
    return _lacks(code, answer, texts), answer


def _lacks(code: int, answer: str, wanted: Sequence[str]) -> list[str]:
    lacking = [text for text in wanted if text not in answer]
    told = code in {Exit.FINDINGS, Exit.UNUSABLE} or " warning " in answer
    return lacking + ([] if told else ["an error or a warning"])


def main() -> None:
    """Prints the answers that are not clear."""
    clear = 0
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "examples"
        shutil.copytree(EXAMPLES, root)
        with chdir(root):
            answers = [(row, lacks_of_file(root, *row)) for row in FILES]
            answers += [(row, lacks_of_sheet(root, *row)) for row in SHEETS]
            answers += [(row, lacks_of_command(*row)) for row in COMMANDS]
            for row, (lacking, answer) in answers:
                clear += not lacking
                if lacking:
                    print(f"{row[:3]}: {lacking}\n{answer}")  # noqa: T201
    print(f"{clear} of {len(answers)} are clear")  # noqa: T201


if __name__ == "__main__":
    main()
