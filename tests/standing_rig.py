"""A sound run of each vendor, a heated tank with one loop, to be spoiled by replacing what stands in its texts."""

from __future__ import annotations

from dataclasses import dataclass

from pidcfg.api import simulate

SCENARIO = """\
pidcfg: 1
scenario: A heated tank
config: tank.yaml
duration: 200
step: 100 ms
plants:
  TANK: {model: first_order, gain: 1, load: 20, time_constant: 20, dead_time: 1, initial: 40}
events:
  - {at: 80, loop: TANK, set: {setpoint: 65}}
"""


@dataclass(frozen=True)
class Side:
    """A vendor's configuration, and how its keys spell what the tests change."""

    config: str
    action: tuple[str, str]
    gain: tuple[str, str]
    """As it is, and so high that the loop swings for ever."""
    soft: str
    """A gain that leaves most of the work to the integral."""
    slow: tuple[str, str]
    """The integral time, and one that is far too long."""
    off: str
    """No integral."""
    alarms: tuple[str, str] | None = None
    """Where alarms are written, and narrow ones."""


SIDES = {
    "dl06": Side(
        """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000}
loops:
  - name: TANK
    mode: auto
    sample_rate: 0.5
    action: direct
    bumpless: II
    tuning: {gain: 2.00, reset: 20.0, rate: 0}
    pv: {range: [0, 100]}
    setpoint: {value: 60}
    output: {range: [0, 100]}
""",
        ("action: direct", "action: reverse"),
        ("gain: 2.00", "gain: 60.00"),
        "gain: 0.50",
        ("reset: 20.0", "reset: 900.0"),
        "reset: off",
        ("    output:", "    alarms: {deviation: {yellow: 5, red: 10}, hysteresis: 2 counts}\n    output:"),
    ),
    "click": Side(
        """\
pidcfg: 1
vendor: click
loops:
  - name: TANK
    bits: C101
    integers: DS101
    floats: DF101
    mode: auto
    action: direct
    action_verified: true
    sample_rate: 500 ms
    bumpless: 2
    freeze_bias: true
    tuning: {proportional_gain: 2, reset_time: 20}
    pv: {range: [0, 100]}
    setpoint: {value: 60}
    output: {limits: [0, 100]}
""",
        ("action: direct", "action: reverse"),
        ("proportional_gain: 2", "proportional_gain: 80"),
        "proportional_gain: 0.5",
        ("reset_time: 20", "reset_time: 3000"),
        "reset_time: 6000",
        ("    output:", "    alarms: {deviation: {high: 5, high_high: 10}, hysteresis: 0.1}\n    output:"),
    ),
    "ezlogix": Side(
        """\
pidcfg: 1
vendor: ezlogix
loops:
  - name: TANK
    registers: R101
    discretes: S101
    mode: auto
    algorithm: position
    action: reverse
    sample_rate: 0.50
    tuning: {proportional_gain: 2.00, integral_time: 20.0, derivative_time: off}
    pv: {tag: IR1, range: [0, 100]}
    setpoint: {value: 60, limits: [0, 100]}
    output: {tag: OR1, range: [0, 100]}
    anti_windup: true
""",
        ("action: reverse", "action: direct"),
        ("proportional_gain: 2.00", "proportional_gain: 80.00"),
        "proportional_gain: 0.50",
        ("integral_time: 20.0", "integral_time: 3000.0"),
        "integral_time: off",
    ),
    "nextopid": Side(
        """\
pidcfg: 1
vendor: nextopid
plc: {sample_time: 0.5}
signals: {Hold: false}
loops:
  - name: TANK
    type: PIDA_REAL
    SP: 60.0
    Kp: 2.0
    Ti_Ki: 20.0
    Td_Kd: 0.0
    MinMV: 0.0
    MaxMV: 100.0
    MinPV: 0.0
    MaxPV: 100.0
    TRK_IN: Hold
""",
        ("    SP:", "    Direct: true\n    SP:"),
        ("Kp: 2.0", "Kp: 80.0"),
        "Kp: 0.5",
        ("Ti_Ki: 20.0", "Ti_Ki: 3000.0"),
        "Ti_Ki: 0.0",
    ),
    "dpide": Side(
        """\
pidcfg: 1
vendor: dpide
loops:
  - name: TANK
    device: D500
    SV: 60.0
    CYCLE: 500
    PID_EQ: true
    Kc_Kp: 2.0
    Ti_Ki: 20.0
    Td_Kd: 0.0
    PID_DIR: true
    MV_MAX: 100
    MV_MIN: 0
    pv: {range: [0, 100]}
""",
        ("PID_DIR: true", "PID_DIR: false"),
        ("Kc_Kp: 2.0", "Kc_Kp: 80.0"),
        "Kc_Kp: 0.5",
        ("Ti_Ki: 20.0", "Ti_Ki: 3000.0"),
        "Ti_Ki: 0.0",
    ),
    "generic": Side(
        """\
pidcfg: 1
vendor: generic
loops:
  - name: TANK
    output_raises_pv: true
    sample_time: 500 ms
    tuning: {gain: 2, integral_time: 20 s}
    pv: {range: [0, 100]}
    setpoint: {value: 60}
    output: {range: [0, 100]}
""",
        ("output_raises_pv: true", "output_raises_pv: false"),
        ("gain: 2,", "gain: 80,"),
        "gain: 0.5,",
        ("integral_time: 20 s", "integral_time: 3000 s"),
        "integral_time: 0 s",
        ("    output:", "    alarms: {deviation: {high: 5, high_high: 10}}\n    output:"),
    ),
}


def outcome(vendor, *edits, config=(), more="", **how):
    """The result of a vendor's run; ``edits`` are replacements in the scenario, ``config`` in the configuration."""
    scenario, text = SCENARIO, SIDES[vendor].config
    for old, new in edits:
        assert old in scenario, old
        scenario = scenario.replace(old, new)
    for old, new in config:
        assert old in text, old
        text = text.replace(old, new)
    return simulate(scenario + more, name="tank.scenario.yaml", files={"tank.yaml": text}, **how)


def failures(result):
    """The kinds by which a run fails, but for what it only does not prove."""
    assert result.report is not None, [d.message for d in result.findings]
    return {v.kind for v in result.report.standing if v.fails and v.verdict == "failed"}


def unproven(result):
    """The kinds that a run does not prove."""
    return {v.kind for v in result.report.standing if v.fails and v.verdict == "not-proven"}


def verdict(result, kind, loop="TANK"):
    """One verdict."""
    return next(v for v in result.report.standing if (v.kind, v.loop) == (kind, loop))
