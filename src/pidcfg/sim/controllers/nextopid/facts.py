"""What verdicts on a run ask of a NextoPID program: modes, limits and wires, from the signals that blocks share."""

from __future__ import annotations

from collections import defaultdict
from functools import cached_property
from typing import TYPE_CHECKING

from pidcfg.schemas.expressions import CONSTANT, SIGNAL
from pidcfg.sim.controllers.nextopid import slots
from pidcfg.sim.controllers.nextopid import state as bits
from pidcfg.sim.controllers.nextopid.actions import LEAST_TI
from pidcfg.sim.controllers.nextopid.memory import Memory
from pidcfg.sim.controllers.nextopid.report import ERRORS
from pidcfg.sim.controllers.nextopid.wires import ROW, ROWS, value_of
from pidcfg.sim.dependence import depends
from pidcfg.sim.plc import TICKS

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

MODE_KEYS = ("Manual", "CASC", "TRK_IN", "AutoTune")
"""The inputs that choose the mode of a loop."""
SELECTORS = (slots.SELECT_MAX, slots.SELECT_MIN)
SELECTED = [(slots.PLACES["ControlSelectMax"][f"MV{i}"], slots.PLACES["ControlSelectMax"][f"OVERR{i}"]) for i in (1, 2)]
"""The inputs of a selector, and what tells the controller behind each that it is left out."""
PWM = slots.PLACES["ControlPWM"]


class Facts(Memory):
    """A program's answers for the standing expectations."""

    error_flags = tuple(ERRORS)
    mode_keys = MODE_KEYS

    def wires_of(self, place: int) -> Iterator[tuple[int, list[int]]]:
        """The wires of a block: the parameter that each renews, and the signals that it reads."""
        c, aux = self.cfg[place], self.aux
        for row in range(ROWS + ROW * c.wires, ROWS + ROW * c.wires_end, ROW):
            code = range(int(aux[row + 2]), int(aux[row + 3]), 2)
            yield int(aux[row]), [int(aux[at + 1]) for at in code if aux[at] == SIGNAL]

    @property
    def flow(self) -> Sequence[tuple[int, int]]:
        """Moves, wires, and from each input of a block to its outputs."""
        return self._all_flow

    @cached_property
    def _all_flow(self) -> Sequence[tuple[int, int]]:
        """The program's, which no event changes."""
        return tuple(self._flow())

    def _flow(self) -> Iterator[tuple[int, int]]:
        for copy in self.copies:
            for part in (copy.value, copy.when):
                yield from ((source, copy.target) for source in (part.signals if part else ()))
        for place, i in enumerate(self.listed):
            for target, sources in self.wires_of(place):
                yield from ((source, target) for source in sources if self.follows(place, target, source, sources))
            rows = list(enumerate(self.layout.instances[i].kind.table.rows, self.layout.instances[i].base))
            outputs = [slot for slot, row in rows if row.access == "output"]
            for slot, row in rows:
                if row.access == "input":
                    yield from ((slot, output) for output in outputs)
                if row.name in {"SP", "SP_CASC"} and self.items[i].loop is not None:
                    yield slot, self.cfg[place].sig_sp

    def follows(self, place: int, target: int, source: int, sources: list[int]) -> bool:
        """Whether a wire's value follows a signal that it reads."""
        c, aux = self.cfg[place], self.aux
        rows = range(ROWS + ROW * c.wires, ROWS + ROW * c.wires_end, ROW)
        at = next(row for row in rows if int(aux[row]) == target)
        first, last = int(aux[at + 2]), int(aux[at + 3])
        if CONSTANT not in {int(op) for op in aux[first:last:2]}:
            return True

        def value(sig: Sequence[float]) -> float | None:
            found = value_of(aux, first, last, sig)
            return None if aux[int(aux[0])] else found

        return depends(value, self.sig, sources, source)

    @property
    def masters(self) -> list[int]:
        """The loop whose MV comes in at SP_CASC, by whatever blocks."""
        outs = {c.sig_out: i for i, c in enumerate(self.cfg[: len(self.loops)])}
        sources = defaultdict(list)
        for source, target in self.flow:
            sources[target].append(source)
        found = []
        for i, c in enumerate(self.cfg[: len(self.loops)]):
            waiting, seen, master = [c.base + slots.SP_CASC] if c.kind != slots.ON_OFF else [], set(), -1
            while waiting and master < 0:
                slot = waiting.pop(0)
                master = outs.get(slot, -1) if outs.get(slot, i) != i else -1
                if slot not in seen and slot not in outs:
                    seen.add(slot)
                    waiting += sources[slot]
            found.append(master)
        return found

    def intended_mode(self, loop: int, sig: Sequence[float]) -> str:
        """What Manual and CASC say, or what they are wired to."""
        if self.value_of(loop, "Manual", sig):
            return "manual"
        return "cascade" if self.value_of(loop, "CASC", sig) else "auto"

    def value_of(self, loop: int, row: str, sig: Sequence[float]) -> float:
        """The value of a parameter, or of what it is wired to; 0 where the loop has none."""
        number = self.layout.numbers.get(f"{self.loops[loop]}.{row}")
        return 0.0 if number is None else self.wired_value(loop, number, sig)

    def wired_value(self, place: int, number: int, sig: Sequence[float]) -> float:
        """What a parameter of a block has at its next call: its value, or that of its wire where it has one."""
        c = self.cfg[place]
        for at in range(ROWS + ROW * c.wires, ROWS + ROW * c.wires_end, ROW):
            if int(self.aux[at]) == number:
                value = value_of(self.aux, int(self.aux[at + 2]), int(self.aux[at + 3]), sig)
                return sig[number] if self.aux[int(self.aux[0])] else value
        return sig[number]

    def given_set_point(self, loop: int, sig: Sequence[float]) -> float:
        """SP, or what it is wired to."""
        return self.value_of(loop, "SP", sig)

    def mode_inputs(self, loop: int) -> set[int]:
        """What the wires of its mode inputs read."""
        base = self.cfg[loop].base
        kind = self.layout.instances[self.listed[loop]].kind
        places = {base + i for i, row in enumerate(kind.table.rows) if row.name in MODE_KEYS}
        return {slot for target, sources in self.wires_of(loop) if target in places for slot in sources}

    def output_limits(self, loop: int, sig: Sequence[float]) -> tuple[float, float]:
        """MinMV and MaxMV; of ControlON_OFF off and on."""
        if self.only_switches(loop):
            return 0.0, 1.0
        base = self.cfg[loop].base
        return sig[base + slots.MIN_MV], sig[base + slots.MAX_MV]

    def only_switches(self, loop: int) -> bool:
        """Whether the loop is a ControlON_OFF."""
        return bool(self.cfg[loop].kind == slots.ON_OFF)

    def integrates(self, loop: int, sig: Sequence[float]) -> bool:
        """Whether Ti_Ki is given; a time below 0.001 s is none."""
        if self.only_switches(loop):
            return False
        base = self.cfg[loop].base
        ti_ki = sig[base + slots.TI_KI]
        return bool(ti_ki > 0.0 if sig[base + slots.INDEP] else ti_ki >= LEAST_TI)

    def dead_band(self, loop: int, sig: Sequence[float]) -> float:
        """DeadBand."""
        return 0.0 if self.only_switches(loop) else sig[self.cfg[loop].base + slots.DEAD_BAND]

    def pulse_cycle(self, loop: int) -> float:
        """The period of a ControlPWM that reads the loop's MV."""
        for place, c in enumerate(self.cfg):
            reads = any(self.cfg[loop].sig_out in sources for _, sources in self.wires_of(place))
            if c.kind == slots.PWM and reads:
                return float(self.sig[c.base + PWM["Period"]] * c.period / TICKS)
        return 0.0

    def program_errors(self, sig: Sequence[float]) -> Iterator[str]:
        """Blocks whose output Error was on at some time; loops have ErrBits."""
        for place, i in enumerate(self.listed):
            if self.st[place].erred:
                now = "is" if sig[self.cfg[place].error] else "was"
                yield f"{self.layout.instances[i].name}.Error {now} on"

    def windup_input(self, loop: int, sig: Sequence[float]) -> bool:
        """Windup_H_IN or Windup_L_IN."""
        base = self.cfg[loop].base
        return not self.only_switches(loop) and bool(sig[base + slots.WINDUP_H_IN] or sig[base + slots.WINDUP_L_IN])

    def left_out(self, loop: int, sig: Sequence[float], own: Collection[int], rivals: Collection[int]) -> bool:
        """Whether a selector behind its MV takes a rival; where there is no selector, whether OVERR is on."""
        behind = False
        for place, c in enumerate(self.cfg):
            wired = dict(self.wires_of(place)) if c.kind in SELECTORS else {}
            inputs = [set(wired.get(c.base + value, ())) for value, _ in SELECTED]
            for (_, out), lost, taken in zip(SELECTED, inputs, reversed(inputs), strict=True):
                behind = behind or bool(lost & set(own))
                if sig[c.base + out] and lost & set(own) and taken & set(rivals):
                    return True
        return not behind and bool(self.st[loop].status & bits.OVERRIDDEN)
