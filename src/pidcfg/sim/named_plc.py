"""A PLC whose loops are rows of one table of named parameters: how it begins, and what ``set`` may write.

A vendor derives its own from `NamedPlc` and says how a loop's parameters become its records.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

from pidcfg.sim.plc import Plc
from pidcfg.sim.problems import NoValue

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.encoders.named import NamedLoops
    from pidcfg.encoders.parameters import Program
    from pidcfg.sim.named_settings import NamedKeys
    from pidcfg.sim.plc import ScanOptions


class NamedPlc(Plc):
    """A PLC as loaded from a program's parameters; its base step is the runner's."""

    options = ("scan_time",)
    named: ClassVar[NamedLoops]
    """The table of its parameters."""
    keys: ClassVar[NamedKeys]
    """What can be set while it runs."""
    sample_key: ClassVar[str]
    """The parameter that is the time between two samples."""
    config: ClassVar[type[Any]]
    state: ClassVar[type[Any]]
    """The records of a loop."""
    slots: ClassVar[Mapping[str, str]]
    """Signals of a loop by their slots in ``config``."""

    def __init__(self, program: Program, options: ScanOptions | None = None) -> None:  # noqa: ARG002 - as above
        self.loops = [str(entry["loop"]) for entry in program.settings] or self.named.loop_names(program.words)
        self._settings: Sequence[Mapping[str, Any]] = program.settings or [{}] * len(self.loops)
        found = [self.contents_of(program.words, loop) for loop in self.loops]
        self._contents = [contents for contents, _ in found]
        self.problems = [NoValue(i, text) for i, (_, problems) in enumerate(found) for text in problems]
        self.place_loops(self.config, self.state, self.slots)
        self._file = program.plc
        self.prepare()
        for i, c in enumerate(self.cfg):
            self.begin(i)
            c.period = self.st[i].period
        self.goals = [self.mode(s.status) for s in self.st]

    @abstractmethod
    def contents_of(self, words: Mapping[str, Any], loop: str) -> tuple[dict[str, Any], list[str]]:
        """The contents of a loop's parameters by name, and which are missing or no value of their type."""

    def prepare(self) -> None:
        """What all loops need before the first of them begins."""

    @abstractmethod
    def begin(self, loop: int) -> None:
        """What a loop starts with."""

    @abstractmethod
    def sample_ticks(self, value: Any) -> int:
        """The time between two samples in ticks, of a content of ``sample_key``; 0: that has no effect."""

    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:  # noqa: ARG002 - all loops are alike
        """The content that a ``set`` event makes of its parameter; a ``PydanticCustomError`` says what is wrong."""
        return self.keys.check(path, value)

    def period_set(self, loop: int, path: tuple[str, ...], value: Any) -> int:  # noqa: ARG002 - all loops are alike
        """The time between two samples that a value for this key makes, in ticks; 0: another key, or without effect."""
        return self.sample_ticks(value) if self.keys.find(path).name == self.sample_key else 0
