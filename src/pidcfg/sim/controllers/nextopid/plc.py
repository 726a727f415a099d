"""The virtual NextoPID program: built from its parameters, operated as by its operator."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.parameters import Parameter, shortest
from pidcfg.schemas.iec import Wire
from pidcfg.sim.controllers.nextopid import modes, report, tune_results
from pidcfg.sim.controllers.nextopid.facts import Facts
from pidcfg.sim.controllers.nextopid.memory import SHOWN, number_of
from pidcfg.sim.controllers.nextopid.report import AUX_BITS, FLAG_BITS, MODES, REASONS, RESULT_FLAGS, TUNE_STATUS
from pidcfg.sim.controllers.nextopid.setting import SHORT, keys_of
from pidcfg.sim.expressions import FAULTS
from pidcfg.sim.named_settings import NamedKeys
from pidcfg.sim.notices import tell
from pidcfg.sim.plc import COUNTS, NoOptions

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, MutableSequence, Sequence

    from pidcfg.encoders.parameters import Content, Entry, Program
    from pidcfg.schemas.base import Quantity


OPERATED = ("SP", "ManualMV", "Manual", "CASC")
"""Inputs of a loop that are the operator's: a wire to one is his switch, or his panel."""
LONG = ("Tc", "Tlag", "DelayTime")
"""Parameters of blocks that are times for something to settle."""


class Nextopid(Facts):
    """A NextoPID program as loaded."""

    setpoint = SHORT["setpoint"]
    out_name = "MV"
    modes: Mapping[str, int] = MODES
    commands: Mapping[str, Sequence[str]] = {"ramp_soak": (), "autotune": ("start", "cancel", "accept"), "plc": ()}
    tuned_names = ("Kp", "Ti_Ki", "Td_Kd")
    flag_bits: Mapping[str, int] = FLAG_BITS
    aux_bits: Mapping[str, int] = AUX_BITS
    reasons: Mapping[int, str] = REASONS

    def __init__(self, image: Program) -> None:
        super().__init__(image)
        self.keys = {item.name: self._keys(item.name, item.type) for item in self.items}
        self.goals = [self._goal(loop) for loop in self.loops]
        self.scales = [self._scale(loop) for loop in self.loops]
        self.signals = self._names()
        self.wired = frozenset(loop for loop in self.loops if f"{loop}.PV" not in self.outside)
        """Loops whose PV comes from the program itself."""
        self.inputs = self._inputs()
        self.longest = self._longest()
        self.inlets = {loop: name for loop in self.wired if (name := self._inlet(f"{loop}.PV"))}

    def _wired(self, name: str) -> dict[str, str]:
        prefix = f"{name}."
        return {
            key.removeprefix(prefix): content.text
            for key, content in self.words.items()
            if key.startswith(prefix) and isinstance(content, Wire)
        }

    def _keys(self, name: str, kind: str) -> NamedKeys:
        return keys_of(kind, name, self._wired(name), independent=bool(self._value(name, "Indep")))

    def _slot(self, loop: str, row: str) -> int:
        return self.layout.numbers[f"{loop}.{row}"]

    def _value(self, loop: str, row: str) -> float:
        """A parameter before the first cycle, with the first values of what it is wired to."""
        number = self.layout.numbers.get(f"{loop}.{row}")
        place = next(at for at, i in enumerate(self.listed) if self.items[i].name == loop)
        return 0.0 if number is None else self.wired_value(place, number, self.sig)

    def _goal(self, loop: str) -> str:
        if self._value(loop, "Manual"):
            return "manual"
        return "cascade" if self._value(loop, "CASC") else "auto"

    def _scale(self, loop: str) -> tuple[float, float, int]:
        low, high = self._value(loop, "MinPV"), self._value(loop, "MaxPV")
        return low, high if high > low else low + 1.0, COUNTS

    def _names(self) -> list[str]:
        """Signals of the report: those from outside, what loops and blocks give, and what wires read."""
        shown = set(range(len(self.layout.signals)))
        for instance in self.layout.instances:
            for i, row in enumerate(instance.kind.table.rows):
                if instance.name in self.loops:
                    wanted = row.name in SHOWN or (row.access == "output" and instance.base + i in self.read)
                else:
                    wanted = row.access == "output" and row.name not in {"Error", "SampleTime", "Warning"}
                if wanted and "Bits." not in row.name:
                    shown.add(instance.base + i)
        name_of = {number: name for name, number in self.layout.numbers.items() if number in shown}
        name_of |= {self.cfg[i].sig_sp: f"{loop}.SP" for i, loop in enumerate(self.loops)}
        return [name_of.get(number, "") for number in range(len(self.sig))]

    def _inputs(self) -> dict[str, int]:
        """Signals from outside, and parameters of blocks that nothing is wired to."""
        inputs = {name: self.layout.numbers[name] for name in self.layout.signals}
        for item in self.items:
            if item.loop is None:
                for row in BLOCK_TYPES[item.type].inputs:
                    name = f"{item.name}.{row.name}"
                    if not isinstance(self.words.get(name), Wire):
                        inputs[name] = self.outside.get(name, self.layout.numbers[name])
        return inputs

    def _inlet(self, name: str) -> str | None:
        """Where a measurement comes into the program: followed back through wires and filters; None: nowhere alone."""
        for _ in range(2 * len(self.items) + 1):
            content = self.words.get(name)
            if name in self.inputs and not isinstance(content, Wire):
                return name
            if not isinstance(content, Wire) or content.text not in self.layout.numbers:
                return None
            name = content.text.replace(".OutVar", ".InVar")
        return None

    def _longest(self) -> float:
        """Time constants and delays of all blocks, as they stand before the first cycle."""
        names = (f"{item.name}.{row}" for item in self.items for row in LONG if item.loop is None)
        return max([0.0, *(self.sig[self.layout.numbers[name]] for name in names if name in self.layout.numbers)])

    def faults(self) -> Iterator[tuple[int, str, str]]:
        """Wires that had no value."""
        name_of = {number: name for name, number in self.layout.numbers.items()}
        for s in self.st:
            if s.fault:
                yield s.fault_at, name_of[s.fault_target], FAULTS[s.fault]

    # --- what the runner reads ---------------------------------------------------------------------------------------

    @property
    def rises(self) -> list[bool]:
        """Reverse action at the start: the PV rises with MV."""
        return [not self._value(loop, "Direct") for loop in self.loops]

    @property
    def periods(self) -> list[int]:
        """The sample time of each loop, in ticks; no event changes it."""
        return [c.period for c in self.cfg[: len(self.loops)]]

    @classmethod
    def mode(cls, status: int) -> str:
        """The mode that a status word tells; before the first call it is auto."""
        return next((name for name, bit in MODES.items() if status & bit), "auto")

    @classmethod
    def is_about_mode(cls, requested: int, reason: int) -> bool:  # noqa: ARG003 - every refused mode request does
        """Whether a mode was requested."""
        return requested != 0

    # --- signals and parameters --------------------------------------------------------------------------------------

    def check_input(self, name: str, value: object) -> float:
        """The value of a signal, or of a block's parameter, as `inputs` takes it."""
        owner, _, row = name.partition(".")
        if row:
            parameter = self.keys[owner].find((row,))
            return number_of(parameter.type, self.keys[owner].parse(parameter, value))
        signal = Parameter(name, self.layout.signals[name])
        return number_of(signal.type, NamedKeys({name: signal}, {}).parse(signal, value))

    def set_output(self, loop: int, value: Quantity, sig: MutableSequence[float]) -> str | None:
        """The MV that a loop in manual mode starts with; returns why it has no effect in the others."""
        return self.set(loop, ("output",), self.check_set(loop, ("output",), value), sig)

    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:
        """The content of a parameter; a ``PydanticCustomError`` says what is wrong."""
        return self.keys[self.loops[loop]].check(path, value)

    def period_set(self, loop: int, path: tuple[str, ...], value: Any) -> int:  # noqa: ARG002 - nothing to look at
        """No parameter is a sample time."""
        return 0

    def set(self, loop: int, path: tuple[str, ...], value: Any, sig: MutableSequence[float]) -> str | None:
        """Writes a parameter; returns why it has no effect yet, if so."""
        name, c = self.loops[loop], self.cfg[loop]
        row = self.keys[name].find(path)
        content: Content = value
        sig[self._slot(name, row.name)] = number_of(row.type, content)
        if row.name == "SP" and not self._of(loop, "CASC", sig):
            low, high, _ = self.scales[loop]
            sig[c.sig_sp] = min(max(sig[self._slot(name, "SP")], low), high)
        if row.name == "SP" and self._of(loop, "CASC", sig):
            return "the loop is in cascade mode and follows SP_CASC"
        if row.name == "ManualMV" and not self._of(loop, "Manual", sig):
            return "the loop is not in manual mode"
        return None

    def operated(self, image: Program) -> Program:
        """The program with the operator's inputs unwired, each at the first value of its wire."""
        names = {f"{loop}.{row}" for loop in self.loops for row in OPERATED}
        cells = (self._unwired(cell) if cell.address in names else cell for cell in image.cells)
        return replace(image, cells=tuple(cells))

    def _unwired(self, cell: Entry) -> Entry:
        if not isinstance(cell.raw, Wire):
            return cell
        loop, _, row = cell.address.partition(".")
        value = self._value(loop, row)
        return cell._replace(raw=value if cell.type.kind == "real" else int(value))

    def _of(self, loop: int, row: str, sig: Sequence[float]) -> float:
        number = self.layout.numbers.get(f"{self.loops[loop]}.{row}")
        return 0.0 if number is None else sig[number]

    # --- the operator ------------------------------------------------------------------------------------------------

    def request(self, loop: int, mode: str) -> None:
        """Manual and CASC are written (D690), unless the program wires them."""
        name, s, code = self.loops[loop], self.st[loop], self.request_code(mode)
        wired = self._wired(name)
        if mode == "cascade" and f"{name}.CASC" not in self.layout.numbers:
            tell(s, report.NO_CASCADE, code)
        elif "Manual" in wired:
            tell(s, report.IS_WIRED, code)
        elif mode in {"auto", "cascade"} and "CASC" in wired:
            tell(s, report.CASC_IS_WIRED, code)
        elif mode in {"tracking", "autotune"}:
            tell(s, report.COMES_ABOUT, code)
        else:
            modes.command(s, modes.MANUAL, on=mode == "manual")
            if mode != "manual" and f"{name}.CASC" in self.layout.numbers:
                modes.command(s, modes.CASCADE, on=mode == "cascade")

    def autotune(self, loop: int, command: str) -> None:
        """``start`` and ``cancel`` write AutoTune; ``accept`` copies the results over the gains and resets it."""
        name, s = self.loops[loop], self.st[loop]
        if f"{name}.AutoTune" not in self.layout.numbers:
            tell(s, report.NO_TUNE)
        elif "AutoTune" in self._wired(name):
            tell(s, report.TUNE_IS_WIRED)
        elif command == "accept" and s.tune_phase != tune_results.DONE:
            tell(s, report.NOTHING_TO_ACCEPT)
        else:
            s.command |= modes.ACCEPT if command == "accept" else 0
            modes.command(s, modes.TUNE, on=command == "start")

    def tuned(self, loop: int) -> Mapping[str, Any] | None:
        """How the last auto-tuning of a loop went; None where there was none."""
        s = self.st[loop]
        if s.tune_end == modes.NO_RUN:
            return None
        ended = s.tune_end in {modes.DONE, modes.FAILED}
        flags = [name for i, name in enumerate(RESULT_FLAGS) if s.result_flags >> i & 1 and ended]
        results = dict(zip(self.tuned_names, map(shortest, (s.result_kp, s.result_ti, s.result_td)), strict=True))
        return {
            "done": ended,
            "error": s.tune_end == modes.FAILED,
            "status": ", ".join(flags) or TUNE_STATUS[s.tune_end],
            "results": results if ended and any(results.values()) else {},
        }


def load(image: Program, options: NoOptions | None = None) -> Nextopid:  # noqa: ARG001 - there is nothing to choose
    """The virtual PLC of a program, before its first cycle."""
    return Nextopid(image)
