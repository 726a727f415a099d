"""Six good plants of eight loops, written as files of every vendor: what a checker should have little to say about.

Each plant is a table of loops; a vendor's writer puts them down as somebody would who knows that vendor: ranges, units,
limits and alarms given, gains that fit the sample time, cascades connected, PWM on heaters. Run as a script, it prints
the lines of text that `pidcfg validate` needs for each file, and what they are about.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Loop:
    """One loop; times in s, gain in % of output per % of PV, the set point and alarms in the PV's unit."""

    name: str
    text: str
    raises: bool
    low: float
    high: float
    unit: str
    sp: float
    gain: float
    ti: float
    td: float = 0
    sample: float = 1
    pulse: bool = False
    root: bool = False
    filtered: bool = False
    master: str = ""
    sp_limits: tuple[float, float] | None = None
    tune: str = ""
    bumpless: int = 2
    least: int = 0
    """Of the output, in %."""
    deadband: float = 0
    deviation: float = 0

    @property
    def span(self) -> float:
        return self.high - self.low

    @property
    def limits(self) -> tuple[float, float]:
        return self.sp_limits or (self.low + 0.1 * self.span, self.low + 0.8 * self.span)

    def at(self, share: float) -> str:
        """A value of the PV's range."""
        return f"{self.low + share * self.span:g}"


def heat(name, text, high, sp, *tuning, **more):
    return Loop(name, text, True, 0, high, "degC", sp, *tuning, filtered=True, sample=2, **more)


def cool(name, text, ends, sp, *tuning, **more):
    return Loop(name, text, False, *ends, "degC", sp, *tuning, sample=2, **more)


def flow(name, text, high, sp, **more):
    return Loop(name, text, True, 0, high, "m3/h", sp, 0.5, 6, sample=0.2, **more)


def level(name, text, sp, **more):
    return Loop(**({"raises": True} | more), name=name, text=text, low=0, high=100, unit="%", sp=sp, gain=2, ti=300)


def pressure(name, text, high, sp, **more):
    return Loop(name, text, True, 0, high, "bar", sp, 1.2, 8, sample=0.5, **more)


PLANTS: dict[str, list[Loop]] = {
    "waterworks": [
        flow("FIC101", "Raw water to the filters", 400, 260),
        flow("FIC102", "Backwash water", 600, 350),
        flow("FIC103", "Dosing of coagulant, by orifice", 2, 1.1, root=True),
        level("LIC104", "Filter bed", 60, deadband=0.5),
        level("LIC105", "Clear water tank, drained by the pumps", 70, raises=False, deadband=0.5),
        pressure("PIC106", "Network pressure by pump speed", 10, 5.5, bumpless=1, least=20),
        Loop("AIC107", "Chlorine by the dosing pump", True, 0, 2, "mg/l", 0.5, 0.8, 120, sample=5),
        Loop("QIC108", "Turbidity by the polymer pump", False, 0, 10, "NTU", 1.5, 0.4, 240, sample=5),
    ],
    "bakery": [
        heat("ZONE1", "Oven zone 1, electric", 350, 220, 6, 240, td=20, pulse=True, deviation=10),
        heat("ZONE2", "Oven zone 2, electric", 350, 240, 6, 240, td=20, pulse=True, deviation=10),
        heat("ZONE3", "Oven zone 3, electric", 350, 230, 6, 240, td=20, pulse=True, deviation=10),
        heat("ZONE4", "Oven zone 4, electric", 350, 200, 6, 240, td=20, pulse=True, deviation=10),
        heat("PROOF", "Proofing chamber", 60, 34, 8, 300, pulse=True),
        Loop("HUMID", "Humidity of the proofing chamber by steam", True, 0, 100, "%", 75, 1.5, 90, sample=2),
        pressure("STEAM", "Steam to the oven", 4, 1.5),
        cool("COOLER", "Cooling tunnel by chilled air", (-5, 40), 12, 3, 180),
    ],
    "reactor": [
        heat("TIC201", "Reactor temperature, outer loop", 200, 90, 2.5, 400, td=30, tune="closed"),
        heat("TIC202", "Jacket temperature, inner loop", 200, 100, 1.5, 60, master="TIC201", sp_limits=(0, 200)),
        flow("FIC203", "Feed of monomer", 10, 6.5),
        flow("FIC204", "Feed of catalyst, by orifice", 1, 0.4, root=True),
        level("LIC205", "Reactor level by the outlet valve", 55, raises=False),
        pressure("PIC206", "Nitrogen blanket", 2, 0.3),
        cool("TIC207", "Condenser by cooling water", (0, 80), 25, 2, 90),
        heat("TIC208", "Preheater of the feed", 150, 60, 3, 120),
    ],
    "extruder": [
        heat("ZONE1", "Barrel zone 1, feed", 400, 170, 4, 150, td=20, pulse=True, bumpless=1, deviation=8),
        heat("ZONE2", "Barrel zone 2", 400, 185, 4, 150, td=20, pulse=True, bumpless=1, deviation=8),
        heat("ZONE3", "Barrel zone 3", 400, 195, 4, 150, td=20, pulse=True, bumpless=1, deviation=8),
        heat("ZONE4", "Barrel zone 4", 400, 200, 4, 150, td=20, pulse=True, bumpless=1, deviation=8),
        heat("DIE", "Die", 400, 205, 5, 200, td=25, pulse=True, tune="open", bumpless=1),
        pressure("MELT", "Melt pressure by screw speed", 400, 180, bumpless=1, least=10),
        cool("BATH", "Water bath", (0, 60), 18, 2.5, 120, bumpless=1, deadband=0.2),
        Loop("HAUL", "Haul-off speed by the drive", True, 0, 60, "m/min", 22, 0.4, 5, sample=0.2, bumpless=1),
    ],
    "brewery": [
        heat("MASH", "Mash tun by steam", 120, 65, 4, 400, td=20, tune="open"),
        heat("KETTLE", "Wort kettle by steam", 120, 95, 6, 300),
        heat("HLT", "Hot liquor tank", 120, 80, 5, 600, pulse=True),
        cool("FERM1", "Fermenter 1 by glycol", (-5, 30), 18, 6, 900, deadband=0.1),
        cool("FERM2", "Fermenter 2 by glycol", (-5, 30), 12, 6, 900, deadband=0.1),
        cool("GLYCOL", "Glycol store", (-20, 20), -4, 3, 400, least=15),
        flow("SPARGE", "Sparge water", 20, 8),
        pressure("CO2", "Bright beer tank", 4, 1.2),
    ],
    "airhandling": [
        heat("SUPPLY", "Supply air, outer loop", 60, 24, 1.5, 240),
        heat("COIL", "Heating coil, inner loop", 90, 40, 2, 60, master="SUPPLY", sp_limits=(0, 90)),
        cool("CHILL", "Chilled water", (0, 30), 7, 3, 120),
        Loop("DUCT", "Duct pressure by fan speed", True, 0, 500, "Pa", 250, 0.6, 10, sample=0.5, least=20),
        Loop("STEAM", "Humidity by a steam humidifier", True, 0, 100, "%", 45, 1, 180, sample=2, deadband=1),
        Loop("ROOM", "Carbon dioxide by the fresh air", False, 0, 2000, "ppm", 800, 1, 300, sample=5, least=15),
        pressure("WATER", "Hot water circuit by pump speed", 6, 2.5, least=30),
        heat("FLOOR", "Floor heating", 60, 32, 2, 600, pulse=True),
    ],
}
WITHOUT_TRANSFER = {"extruder", "brewery", "airhandling"}
"""Plants whose ladder program moves PV and output, where another one has the DL06 do it."""


def loops_of(plant: str) -> list[Loop]:
    """The loops of a plant; a master's output has the range of its slave's PV, and is ten times as slow."""
    return PLANTS[plant]


def slave_of(loop: Loop, plant: list[Loop]) -> Loop | None:
    return next((other for other in plant if other.master == loop.name), None)


def num(value: float) -> str:
    return f"{value:g}"


def unit(text: str) -> str:
    return f'"{text}"' if text == "%" else text


def pv_alarms(loop: Loop) -> str:
    points = zip(("low_low", "low", "high", "high_high"), (0.02, 0.05, 0.9, 0.95), strict=True)
    return ", ".join(f"{key}: {loop.at(share)}" for key, share in points)


def dl06(plant: str) -> str:
    loops = [replace(loop, sample=20 if slave_of(loop, loops_of(plant)) else loop.sample) for loop in loops_of(plant)]
    rows = ["pidcfg: 1", "vendor: dl06", "plc: {loop_table: V2000, reset_decimals: 1}", "loops:"]
    for i, loop in enumerate(loops):
        slave = slave_of(loop, loops)
        scale = f"[{num(slave.low)}, {num(slave.high)}], unit: {unit(slave.unit)}" if slave else '[0, 100], unit: "%"'
        form = ", format: 15-bit unipolar" if loop.root else ""
        low, high = (loop.low, loop.high) if loop.root else loop.limits
        to_pv, to_output = (f", transfer: {{slot: {k + i // 4}, channel: {i % 4 + 1}}}" for k in (1, 3))
        pv = (", filter: 0.6" if loop.filtered else "") + (", square_root: true" if loop.root else "") + form
        out = (f", limits: [{loop.least}, 100]" if loop.least else "") + form
        if plant not in WITHOUT_TRANSFER:
            pv, out = pv + to_pv, out + ("" if slave else to_output)
        rows += [
            f"  - name: {loop.name}",
            f"    description: {loop.text}",
            f"    mode: {'cascade' if loop.master else 'auto'}",
            *([f"    cascade_from: {loop.master}"] if loop.master else []),
            f"    sample_rate: {num(loop.sample)}",
            f"    action: {'direct' if loop.raises else 'reverse'}",
            f"    bumpless: {'I' * loop.bumpless}",
            *([] if loop.least else ["    bias_freeze: true"]),
            f"    tuning: {{gain: {num(loop.gain)}, reset: {num(loop.ti)}, rate: {num(loop.td)}}}",
            *(["    derivative_gain_limit: 10"] if loop.td else []),
            f"    pv: {{range: [{num(loop.low)}, {num(loop.high)}], unit: {unit(loop.unit)}{pv}}}",
            f"    setpoint: {{value: {num(loop.sp)}, limits: [{num(low)}, {num(high)}]}}",
            f"    output: {{range: {scale}{out}}}",
            *([f"    error: {{deadband: {num(loop.deadband)}}}"] if loop.deadband else []),
        ]
        if not loop.root:
            two = f", deviation: {{yellow: {num(loop.deviation)}, red: {num(2 * loop.deviation)}}}"
            more = two if loop.deviation else ""
            rows += [f"    alarms: {{pv: {{{pv_alarms(loop)}}}{more}, hysteresis: {num(loop.span / 200)}}}"]
        if loop.tune:
            rows += [f"    autotune: {{method: {loop.tune}, type: PI{'D' if loop.td else ''}}}"]
    return "\n".join(rows) + "\n"


def click(plant: str) -> str:
    rows = ["pidcfg: 1", "vendor: click", "loops:"]
    for i, loop in enumerate(loops_of(plant), start=1):
        low, high = loop.limits
        pulse = f", pwm: {{bit: Y10{i}, period: 10 s}}" if loop.pulse else ""
        points = f"high: {num(loop.deviation)}, high_high: {num(2 * loop.deviation)}"
        deviation = f", deviation: {{{points}}}" if loop.deviation else ""
        rows += [
            f"  - name: {loop.name}",
            f"    description: {loop.text}",
            f"    bits: C{i}01",
            f"    integers: DS{i}01",
            f"    floats: DF{26 * i - 25}",
            "    mode: auto",
            f"    action: {'direct' if loop.raises else 'reverse'}",
            "    action_verified: true",
            f"    sample_rate: {num(loop.sample)} s",
            f"    bumpless: {loop.bumpless}",
            "    freeze_bias: true",
            f"    tuning: {{proportional_gain: {num(loop.gain)}, reset_time: {num(loop.ti)}"
            + (f", derivative_gain: {num(loop.td)}}}" if loop.td else "}"),
            *(["    derivative_gain_limit: 10"] if loop.td else []),
            f"    pv: {{range: [{num(loop.low)}, {num(loop.high)}], unit: {unit(loop.unit)}"
            + (", filter: 60}" if loop.filtered else "}"),
            f"    setpoint: {{value: {num(loop.sp)}, lower_limit: {num(low)}, upper_limit: {num(high)}}}",
            f'    output: {{limits: [{loop.least}, 100], unit: "%"{pulse}}}',
            *([f"    error: {{deadband: {num(loop.deadband)}}}"] if loop.deadband else []),
            f"    alarms: {{pv: {{{pv_alarms(loop)}}}{deviation}, hysteresis: {num(loop.span / 200)}}}",
        ]
        if loop.tune:
            rows += [f"    autotune: {{method: {loop.tune}, type: PI{'D' if loop.td else ''}, hysteresis: 1}}"]
    return "\n".join(rows) + "\n"


def ezlogix(plant: str) -> str:
    rows = ["pidcfg: 1", "vendor: ezlogix", "plc: {process_when_stopped: true}", "loops:"]
    for i, loop in enumerate(loops_of(plant)):
        low, high = loop.limits
        limits = "" if loop.root else f", limits: [{num(low)}, {num(high)}]"
        algorithm = "velocity" if loop.td else "position"
        least = f", limits: [{loop.least}, 100], offset: {loop.least}" if loop.least else ""
        pulse = f", pulse: {{tag: O{i + 1}, cycle_time: 20, min_on: 0.5, min_off: 0.5}}" if loop.pulse else ""
        rows += [
            f"  - name: {loop.name}",
            f"    description: {loop.text}",
            f"    registers: R{101 + 32 * i}",
            f"    discretes: S{101 + 8 * i}",
            "    mode: auto",
            f"    algorithm: {algorithm}",
            f"    action: {'reverse' if loop.raises else 'direct'}",
            f"    sample_rate: {num(min(loop.sample, loop.ti / 20))}",
            f"    tuning: {{proportional_gain: {num(loop.gain)}, integral_time: {num(loop.ti)}"
            + (f", derivative_time: {num(loop.td)}}}" if loop.td else "}"),
            f"    pv: {{tag: IR{i + 1}, range: [{num(loop.low)}, {num(loop.high)}], unit: {unit(loop.unit)}"
            + (", square_root: true}" if loop.root else "}"),
            f"    setpoint: {{value: {num(loop.sp)}{limits}}}",
            f'    output: {{tag: OR{i + 1}, range: [0, 100], unit: "%"{least}{pulse}}}',
            *([f"    deadband: {num(loop.deadband)}"] if loop.deadband else []),
            f"    autotune: {{type: PI{'D' if loop.td else ''}, timeout: {num(max(60, 8 * loop.ti))}}}",
        ]
    return "\n".join(rows) + "\n"


def nextopid(plant: str) -> str:
    loops = loops_of(plant)
    wires = [f"  {loop.name}_CASC: true" for loop in loops if loop.master]
    rows = ["pidcfg: 1", "vendor: nextopid", "plc: {sample_time: 0.2}", *(["signals:", *wires] if wires else [])]
    pulsed = [loop.name for loop in loops if loop.pulse]
    if pulsed:
        rows += ["blocks:"]
        rows += [
            f"  - {{name: {name}_PWM, type: ControlPWM, MV: {name}.MV, MaxMV: 100.0, MinMV: 0.0, Period: 100}}"
            for name in pulsed
        ]
    rows += ["loops:"]
    for loop in loops:
        slave = slave_of(loop, loops)
        per_unit = loop.gain * (slave.span if slave else 100) / loop.span
        rows += [
            f"  - name: {loop.name}",
            "    type: PIDA_REAL",
            f"    description: {loop.text}",
            f"    SP: {num(loop.sp)}",
            *([f"    SP_CASC: {loop.master}.MV", f"    CASC: {loop.name}_CASC"] if loop.master else []),
            f"    Direct: {'false' if loop.raises else 'true'}",
            f"    Kp: {num(per_unit)}",
            f"    Ti_Ki: {num(loop.ti)}",
            f"    Td_Kd: {num(loop.td)}",
            *([f"    Tfd: {num(loop.td / 8)}"] if loop.td else []),
            f"    MinMV: {num(slave.low if slave else loop.least)}",
            f"    MaxMV: {num(slave.high if slave else 100)}",
            f"    MinPV: {num(loop.low)}",
            f"    MaxPV: {num(loop.high)}",
        ]
        if slave:
            rows += [f"    TRK_VAL: {slave.name}.PV", f"    TRK_IN: {slave.name}.TRK_OUT"]
            rows += [f"    Windup_{side}_IN: {slave.name}.Windup_{side}_OUT" for side in "HL"]
        rows += [f"    pv: {{unit: {unit(loop.unit)}}}"]
        rows += [
            f"    output: {{range: [0, 100], unit: {unit('%')}}}"
            if not slave
            else f"    output: {{unit: {slave.unit}}}"
        ]
    return "\n".join(rows) + "\n"


def dpide(plant: str) -> str:
    rows = ["pidcfg: 1", "vendor: dpide", "loops:"]
    for i, loop in enumerate(loops_of(plant)):
        operands = {"PID_RUN": "M100", "PID_MAN": f"M{101 + i}", "SV": f"D{300 + 10 * i}"}
        operands |= {"PV": f"D{302 + 10 * i}", "MV": f"D{304 + 10 * i}", "MOUT": f"D{306 + 10 * i}"}
        per_unit = loop.gain * 100 / loop.span
        rows += [
            f"  - name: {loop.name}",
            f"    description: {loop.text}",
            f"    device: D{1000 + 30 * i}",
            "    devices: {" + ", ".join(f"{key}: {device}" for key, device in operands.items()) + "}",
            f"    SV: {num(loop.sp)}",
            "    MOUT_AUTO: true",
            f"    CYCLE: {num(1000 * min(loop.sample, loop.ti / 20))} ms",
            "    PID_EQ: true",
            f"    Kc_Kp: {num(per_unit)}",
            f"    Ti_Ki: {num(loop.ti)} s",
            f"    Td_Kd: {num(loop.td)} s" if loop.td else "    Td_Kd: 0",
            *([f"    Tf: {num(loop.td / 8)} s", "    PID_DE: true"] if loop.td else []),
            *([f"    ERR_DBW: {num(loop.deadband)}"] if loop.deadband else []),
            f"    PID_DIR: {'true' if loop.raises else 'false'}",
            "    MV_MAX: 100",
            f"    MV_MIN: {loop.least}",
            f"    pv: {{range: [{num(loop.low)}, {num(loop.high)}], unit: {unit(loop.unit)}}}",
            '    output: {range: [0, 100], unit: "%"}',
        ]
    return "\n".join(rows) + "\n"


def generic(plant: str) -> str:
    loops = loops_of(plant)
    rows = ["pidcfg: 1", "vendor: generic", "loops:"]
    for loop in loops:
        slave = slave_of(loop, loops)
        out = f"[{num(slave.low)}, {num(slave.high)}], unit: {unit(slave.unit)}" if slave else '[0, 100], unit: "%"'
        pulse = ", pulse: {period: 20 s, min_on: 0.5 s, min_off: 0.5 s}" if loop.pulse else ""
        low, high = loop.limits
        least = f", limits: [{loop.least}, 100]" if loop.least else ""
        source = f"source: {loop.master}" if loop.master else f"value: {num(loop.sp)}"
        rows += [
            f"  - name: {loop.name}",
            f"    description: {loop.text}",
            f"    mode: {'cascade' if loop.master else 'auto'}",
            f"    output_raises_pv: {'true' if loop.raises else 'false'}",
            f"    sample_time: {num(min(loop.sample, loop.ti / 20))} s",
            f"    tuning: {{gain: {num(loop.gain)}, integral_time: {num(loop.ti)} s"
            + (f", derivative_time: {num(loop.td)} s, derivative_filter: {num(loop.td / 8)} s}}" if loop.td else "}"),
            f"    pv: {{range: [{num(loop.low)}, {num(loop.high)}], unit: {unit(loop.unit)}}}",
            f"    setpoint: {{{source}, limits: [{num(low)}, {num(high)}]}}",
            f"    output: {{range: {out}{least}{pulse}}}",
            f"    alarms: {{pv: {{low: {loop.at(0.05)}, high: {loop.at(0.9)}}}, hysteresis: {num(loop.span / 200)}}}",
        ]
    return "\n".join(rows) + "\n"


WRITERS = {"dl06": dl06, "click": click, "ezlogix": ezlogix, "nextopid": nextopid, "dpide": dpide, "generic": generic}


def good_files() -> list[tuple[str, str, str]]:
    """Vendor, plant and text of every file."""
    return [(vendor, plant, write(plant)) for vendor, write in WRITERS.items() for plant in PLANTS]


def text_lines(text: str) -> tuple[list[str], list[object]]:
    """What `pidcfg validate` shows of a file on a terminal, line by line, and its findings."""
    from pidcfg.cli.formats.findings import findings_text as as_text
    from pidcfg.cli.formats.findings import summary_line
    from pidcfg.text.source import read_document
    from pidcfg.validate.engine import check_document

    doc = read_document(text.encode(), "plant.yaml")
    findings = list(check_document(doc).findings)
    shown = as_text(findings, {doc.file: doc}, brief=True) + summary_line(findings, 1)
    return shown.splitlines(), findings


def main(*show: str) -> None:
    """A line a file; of those that are named, such as ``dl06/bakery``, what the command prints."""
    for vendor, plant, text in good_files():
        lines, findings = text_lines(text)
        codes = " ".join(dict.fromkeys(f"{d.severity.label} {d.code}" for d in findings))
        sys.stdout.write(f"{vendor:9} {plant:12} {len(findings):3} findings {len(lines):3} lines  {codes}\n")
        if f"{vendor}/{plant}" in show:
            sys.stdout.write("\n".join([text, *lines, ""]))


if __name__ == "__main__":
    main(*sys.argv[1:])
