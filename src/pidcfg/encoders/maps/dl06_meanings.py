"""What the DL06's flags, requests and status bits mean for the plant: tables only.

Keys are the register's name and the lowest bit of the row in the register map; names and bits stand there.
"""

from __future__ import annotations

from pidcfg.encoders.maps.dl06 import CPU, D04, FLAGS, WRITTEN
from pidcfg.encoders.meanings import Meaning
from pidcfg.refs import DL06
from pidcfg.schemas.octal import v_name

ERROR_FLAGS = DL06.at("PID Error Flags, V7642")
MODES = DL06.at("Mode / Alarm Monitoring Word (Addr + 06)")
TROUBLE = DL06.at("Troubleshooting Tips")
ALARM_ERROR = DL06.at("Alarm Programming Error")
TUNING = DL06.at("Auto Tuning error")
RAMP_ERRORS = DL06.at("Ramp/Soak Table Programming Error Flags (Addr + 35)")

NO_LOOP = "The loop task does not run: no loop is calculated, in any mode."
STOPS = "This stops the machine: in Program mode the outputs are off and the loops that follow the CPU are in Manual."
AGAIN = f"Then change the CPU from Program to Run: it looks at V7640 and V7641 only at that moment. {STOPS}"
NEW_TABLE = "Put an address of 32 free words of user memory into +34, then change the CPU from Program to Run. " + STOPS
LOWER, UPPER = (f"{v_name(first)} to {v_name(last)}" for first, last in (CPU.lower, CPU.upper))
SEGMENT_KEY = "Look at +35 when the profile does not start."
PV_ALARM = "A loop in Manual does not go to Automatic while it is on."
PV_CURE = (
    "Look at the plant and the sensor first. It goes off when the PV is back across the limit by the hysteresis (+22)."
)
WAIT = "Set it for one moment and let go; the CPU clears it when it has read it. +06 shows the mode that was reached."

# fmt: off
BITS = {
    ("error_flags", 0): Meaning(
        f"{NO_LOOP} V7640 holds an address below {v_name(CPU.upper[0])} that is not within {LOWER}.",
        f"Put the start of the loop table into V7640: {LOWER}, or {UPPER}. {AGAIN}", ("DL201",), ERROR_FLAGS),
    ("error_flags", 1): Meaning(
        f"{NO_LOOP} V7640 holds an address above {v_name(CPU.upper[1])}.",
        f"Put the start of the loop table into V7640: {UPPER}, or {LOWER}. {AGAIN}", ("DL202",), ERROR_FLAGS),
    ("error_flags", 2): Meaning(
        f"{NO_LOOP} V7641 asks for more than {CPU.loops} loops, or is no BCD number.",
        f"Put the number of loops into V7641, 0 to {CPU.loops} in BCD. {AGAIN}", ("DL203",), ERROR_FLAGS),
    ("error_flags", 3): Meaning(
        f"{NO_LOOP} The table begins below {v_name(CPU.lower_end)} and would run past it into the system's words.",
        f"Start the table closer to {v_name(CPU.lower[0])} (V7640; each loop takes 40 octal words), or calculate fewer "
        f"loops (V7641). {AGAIN}", ("DL204",), ERROR_FLAGS),

    ("mode_setting_1", 0): Meaning("Asks for Manual: the output then stays where it is put.", WAIT, (), D04),
    ("mode_setting_1", 1): Meaning("Asks for Automatic. Refused while a PV alarm or the alarm programming error is on, "
                                   "or while the minor loop of a cascade is not in Cascade.", WAIT, (), TROUBLE),
    ("mode_setting_1", 2): Meaning("Asks for Cascade: the set point then comes from the word that +32 points at.",
                                   WAIT, (), D04),
    ("mode_setting_2", 7): Meaning("Starts the auto-tune: it takes the output over and moves the plant. Off again when "
                                   "it is done.", "Stay at the plant while it runs; bits 12 and 13 of +06 tell how it "
                                   "goes.", (), DL06.at("PID Mode Setting 2 Bit Descriptions (Addr + 01)")),
    ("mode_setting_2", 8): Meaning("The CPU's own clock; nothing to do with the plant."),

    ("mode_and_alarm_status", 0): Meaning(
        "The loop is in Manual: it does not control, the output (+05) stands where the operator or the program puts it.",
        "To control, set bit 1 of +00 for a moment. If the loop stays in Manual, look at bits 3 to 6 and 10, "
        "and, of a major loop, whether its minor loop is in Cascade.", (), TROUBLE),
    ("mode_and_alarm_status", 1): Meaning(
        "The loop is in Automatic: it works the output (+05) out from its own set point (+02) and the PV (+03).", "", (), MODES),
    ("mode_and_alarm_status", 2): Meaning(
        "The loop is in Cascade: its set point is the word that +32 points at, the output of another loop.", "", (), MODES),
    ("mode_and_alarm_status", 3): Meaning(f"The PV is below the low-low limit in +13. {PV_ALARM}", PV_CURE, ("DL248",), TROUBLE),
    ("mode_and_alarm_status", 4): Meaning(f"The PV is below the low limit in +14. {PV_ALARM}", PV_CURE, ("DL248",), TROUBLE),
    ("mode_and_alarm_status", 5): Meaning(f"The PV is above the high limit in +15. {PV_ALARM}", PV_CURE, ("DL248",), TROUBLE),
    ("mode_and_alarm_status", 6): Meaning(f"The PV is above the high-high limit in +16. {PV_ALARM}", PV_CURE, ("DL248",), TROUBLE),
    ("mode_and_alarm_status", 7): Meaning(
        "The PV is further from the set point than the yellow limit in +17.",
        "Normal for a while after a change of the set point; else look at the output, the actuator and the load.", (), MODES),
    ("mode_and_alarm_status", 8): Meaning(
        "The PV is further from the set point than the red limit in +20.",
        "The loop does not hold its set point: look whether the output is at a limit, and at actuator and sensor.", (), MODES),
    ("mode_and_alarm_status", 9): Meaning(
        "The PV changed by more counts within one sample than +21 allows. The hysteresis does not apply to it.",
        "A broken sensor or wire jumps like this; if the signal is only noisy, filter it (+24) or raise +21.", ("DL247",), MODES),
    ("mode_and_alarm_status", 10): Meaning(
        "The alarm limits are not in their order. The loop does not go to Automatic, and one that was there is put "
        "into Manual.",
        "Put +13 < +14 < +15 < +16 (low-low, low, high, high-high) and +17 < +20 (yellow, red), each at least one count "
        "apart. The CPU reads them when the alarm's enable bit goes from 0 to 1: switch bit 12 or 13 of +00 off and on.",
        ("DL242", "DL244"), ALARM_ERROR),
    ("mode_and_alarm_status", 11): Meaning(
        "The calculation gave a number that does not fit its word. The output is not to be trusted, and the loop goes "
        "to Manual.",
        "Look at the gains (+10 to +12 are BCD, not binary), at the data format (+01) and at the PV, then ask for "
        "Automatic again.", (), MODES),
    ("mode_and_alarm_status", 12): Meaning("The auto-tune has the output and moves the plant.",
                                           "Wait, and stay at the plant.", (), TUNING),
    ("mode_and_alarm_status", 13): Meaning(
        "The auto-tune has not started, or was given up, and the gains are the old ones; or the relay of the closed loop "
        "went to the ends of the output's range, and the gains are new all the same (D29): compare +10 to +12.",
        "Open loop (bit 5 of +01 on): the PV must be at least 205 counts of a 12-bit format, 5 % of full scale, below "
        "the SP of a direct-acting loop, above that of a reverse-acting one (D28). Closed loop: bring PV and SP within 5 % "
        "of full scale, and narrow the output limits (+30 and +31), between which the relay switches. Then start again "
        "(bit 7 of +01); the manual contradicts itself, so try the other reading if the bit comes back.",
        ("DL299", "DL501"), TUNING),

    ("ramp_soak_flags", 0): Meaning(f"Asks for start (1), hold (2), resume (4) or jog to the next segment (8) of the "
                                    f"profile. {SEGMENT_KEY}", "Set one of bits 0 to 3 for a moment. The generator "
                                    "must be on (bit 11 of +00), and the loop not in Cascade.", ("DL281",), TROUBLE),
    ("ramp_soak_flags", 4): Meaning("The profile has run to its end; the set point stays at its last value.", "", (), FLAGS),
    ("ramp_soak_flags", 5): Meaning("The PV is further from the set point of the profile than the deviation of its soak "
                                    "segment allows.", "Look whether the plant can follow: output at a limit, slope too steep.", (), FLAGS),
    ("ramp_soak_flags", 6): Meaning("The profile stands still.", "Set the resume bit (bit 2) to go on.", (), FLAGS),
    ("ramp_soak_flags", 8): Meaning("Two hexadecimal digits: 01 to 10 are segments 1 to 16; odd ones are ramps, even ones soaks. 00: the profile is not running.", "", (), FLAGS),

    ("ramp_soak_errors", 0): Meaning(
        f"The ramp/soak table does not lie in the user's V-memory below {v_name(CPU.upper[0])}; the profile does not start.",
        NEW_TABLE, ("DL274",), RAMP_ERRORS),
    ("ramp_soak_errors", 1): Meaning(
        f"The ramp/soak table does not lie in the user's V-memory above {v_name(CPU.upper[0])}; the profile does not start.",
        NEW_TABLE, ("DL274",), RAMP_ERRORS),
    ("ramp_soak_errors", 4): Meaning(
        f"The ramp/soak table starts among the system's words {v_name(CPU.system[0])} to {v_name(CPU.system[1])}; the "
        "profile does not start, and a download of the table would overwrite the set-up of all loops.",
        NEW_TABLE, ("DL275",), RAMP_ERRORS),
}
# fmt: on
"""By the name of the register and the lowest bit of the row."""
WORDS = {
    "error_flags": Meaning(
        "Tells what is wrong with V7640 and V7641. All bits 0 in Run mode: nothing is wrong with them.",
        "",
        (),
        ERROR_FLAGS,
    ),
    "pv": Meaning(
        "The measurement, from the ladder program or by auto transfer (+36). A value that stands still "
        "although the plant moves: the program does not write it here.",
        "",
        (),
        TROUBLE,
    ),
    "bias": Meaning(
        "The integral: the part of the output that holds the set point at rest. Somebody else may write it "
        "too (feedforward)."
    ),
    "output": Meaning(
        "What the loop gives to the actuator. 0 in Automatic is right while the PV of a heating loop is "
        "above its SP (cooling: below).",
        "If it stays 0 on the other side too, look whether the upper limit in +31 is 0, then whether the "
        "direction (bit 4 of +00) fits the process. Never change bit 4 before a small step of the output in "
        "Manual has shown which way the PV goes: the wrong direction is a runaway.",
        ("DL226",),
        TROUBLE,
    ),
    "mode_and_alarm_status": Meaning(
        "Tells the mode and the alarms of one loop; the CPU writes it at each calculation, nobody else should.",
        "",
        (),
        MODES,
    ),
    "mode_setting_1": Meaning("Sixteen switches of the loop: mode requests, direction of control, equation, alarms."),
    "mode_setting_2": Meaning("More switches of the loop: data formats, filter, limits, auto-tune."),
    "ramp_soak_flags": Meaning("Starts and stops the ramp/soak profile, and tells where it is."),
    "ramp_soak_errors": Meaning(
        "Tells what is wrong with the address of the ramp/soak table in +34. 0: nothing.", "", (), RAMP_ERRORS
    ),
}
"""By the name of a register that the configuration does not set."""
WRITERS = {row.name: row.by for row in reversed(WRITTEN) if row.name in {"pv", "bias", "output"}}
"""Who writes a word that is not the PLC's alone."""
