"""DPIDE in program text: what its writer and its reader share.

Design. A program is one text of IEC 61131-3: settings that no variable holds in comments, declarations, and a call of
the instruction with all 21 operands by name. An operand is a number in the call, or a symbol; a symbol is declared with
its device and its initial value, as a row of ISPSoft's symbol table has it, and the names are those of that table.

- `st_write` prints an image: numbers where nothing else writes the operand and it has no device, else symbols.
- `st_units` takes a text apart into programs and function blocks, and their statements with the conditions around them.
- `st_scope` knows what is declared, and what an operand of a call is: a number, a symbol, or a device.
- `st_calls` takes the calls, directly or of a function block with the instruction inside, and what stands around them.
- `st_read` makes a listing of them: a loop a call, its devices and its first values. What an operand holds that no
  text says is looked up in a symbol table that is read together with the program (`symbol_read`).

What is not about DPIDE is left out, and its lines are named.
"""

from __future__ import annotations

from pidcfg.encoders.maps.dpide import DPIDE_TABLE, OUTSIDE, WRITTEN_BY_AUTOTUNE
from pidcfg.refs import Decision

D602 = Decision(
    602,
    "DPIDE in Structured Text is a call with its operands by name",
    "DPIDE(EN := …, PID_RUN := …, …, I_MV := …, MV => …), in the order of the manual's drawing. Programs by hand may "
    "also have 21 operands by position in this order, or 22 with EN before them; names and positions are not mixed, "
    "and none may be missing.",
    "The manual prints ladder alone, with the names of all inputs on the left and MV on the right. IEC 61131-3 "
    "has both forms; by name no two operands can be swapped. ISPSoft has not compiled it yet.",
)
D603 = Decision(
    603,
    "numbers stand in the call, what is written has a symbol",
    "Operands with a device, and those that the process, the instruction or its autotune may write, are symbols with "
    "device and initial value; all others are numbers. In a function block also what is VAR_IN_OUT.",
    "A number in the call reaches the PLC whatever an import does with initial values (D257). The manual allows no "
    "number for PID_MODE 1, and nothing can be written to a number.",
)
D604 = Decision(
    604,
    "the instruction is enabled by SM400 where nothing else is said",
    "EN := SM400; on the way back SM400, TRUE and no EN are the same. Another bit is `call.EN`. A condition that is no "
    "single bit is not carried over, and is named.",
    "SM400 is the contact before En in the manual's examples 4 and 5, where the instruction is always executed.",
)
D605 = Decision(
    605,
    "MOUT of a function block is VAR_IN_OUT",
    "The function block has PID_MODE, Kc_Kp, Ti_Ki, Td_Kd, Tf, I_MV, and MOUT as VAR_IN_OUT, MV as VAR_OUTPUT and the "
    "others as VAR_INPUT.",
    "The manual lists the first six. With MOUT_AUTO TRUE the instruction writes MOUT, too: a VAR_INPUT would take the "
    "old value again with the next call, and the output would jump when manual begins.",
)
D606 = Decision(
    606,
    "GPWM, TMRH and EI are called by position",
    "TMRH(enable, timer, ms), GPWM(enable, width, cycle, output), EI(). The width is REAL_TO_INT(MV); a timer that has "
    "called the instruction is assigned FALSE.",
    "The drawings of examples 3 to 5 have these operands in this order, without names that can be read; neither can "
    "the name of the conversion in example 3, nor the device of its pulses. The coil of example 4 resets the timer.",
)
D607 = Decision(
    607,
    "a whole number is no REAL in a call",
    "SV := 80 is refused, SV := 80.0 is meant; so is 1000.0 for a DINT. K80 and F80.0 count as 80 and 80.0. As initial "
    "value of a REAL 80 is 80.0.",
    "The operand table wants single-precision numbers; the bits of a whole number are another one (80 is 1.1e-43). "
    "Exports of symbol tables have 0 as initial value of a REAL (D257).",
)
D608 = Decision(
    608,
    "the inner drawing of example 4 has PID_RUN twice",
    "The input of the function block at PID_DIR is PID_DIR.",
    "The drawing repeats PID_RUN in its place; a loop that runs would then always heat. The call of the block in the "
    "same example has DPIDE_DIR at PID_DIR.",
)
D609 = Decision(
    609,
    "what a symbol holds is its initial value",
    "or the number that the program assigns to it without a condition. An operand of which neither the program nor a "
    "symbol table says that is FALSE or 0 (D255), and named; SV, CYCLE, the three coefficients and the limits must be "
    "known. Other assignments are named by line.",
    "A program says where operands stand, and only sometimes what they hold.",
)

INSTRUCTION, TIMER, PULSES, ENABLE_INTERRUPTS = "DPIDE", "TMRH", "GPWM", "EI"
EN = "EN"
ALWAYS = "SM400"
"""The bit that enables what is always executed (D604)."""
IN_OUT = (*WRITTEN_BY_AUTOTUNE, "MOUT", "I_MV")
"""What a function block has as VAR_IN_OUT (D605)."""
OPERANDS = tuple(row.name for row in DPIDE_TABLE.rows)
"""All operands in the manual's order."""
WITHOUT_NUMBER = frozenset(OUTSIDE)
"""Operands that cannot be numbers: the process or the instruction writes them."""
PROGRAM = "PidLoops"
WIDTH, INSTANCE = "WIDTH", "FB"
"""Suffixes of the variable with the width of the pulses, and of the instance of a function block."""
