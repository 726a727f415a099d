"""The virtual PLC of a scenario for others to read and to operate: the result of `pidcfg.serve`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pidcfg.live.running import run
from pidcfg.live.server import serve
from pidcfg.live.virtual import VirtualPlc
from pidcfg.map_files import named_map, numbering_of
from pidcfg.results.findings import errors_in, findings_data
from pidcfg.scenario.load import load
from pidcfg.scenario.outcome import Outcome
from pidcfg.sim.run import UnusableError

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.document import Document
    from pidcfg.limits import Limits
    from pidcfg.live.address import Address
    from pidcfg.map_files import MapFile
    from pidcfg.reader import Reader
    from pidcfg.results.findings import Data


@dataclass(frozen=True, slots=True)
class ServeResult:
    """What happened while the PLC was served."""

    outcome: Outcome
    """The run's findings, and its report with every write in its events."""
    notes: tuple[str, ...] = field(default=())
    """That the simulation could not keep up, and writes that the report does not list."""

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        """What is wrong with the scenario or its configuration."""
        return tuple(self.outcome.findings)

    @property
    def ok(self) -> bool:
        """Whether the PLC was served."""
        return self.outcome.report is not None

    def to_json(self) -> Data:
        """The report as ``pidcfg simulate --format json`` has it; where nothing ran, the errors."""
        from pidcfg.results.runs import SimulateResult

        return SimulateResult(self.outcome).to_json() if self.ok else findings_data(errors_in(self.findings))


@dataclass(frozen=True, slots=True)
class Serving:
    """How a PLC is served: where, how fast, for how many seconds, and who is told what."""

    listen: Address
    speed: float
    seconds: float | None
    ready: Callable[[str], None]
    tell: Callable[[str], None]


def served(
    doc: Document, serving: Serving, limits: Limits, reader: Reader, stated: MapFile | None = None
) -> ServeResult:
    """Serves the scenario of a document until it is interrupted; raises `PlcError` where it cannot listen.

    ``stated``: the map, in place of the one that the configuration names; raises `UnusableMapError`.
    """
    loaded = load(doc, limits, reader)
    if loaded.scenario is None or loaded.image is None or loaded.vendor is None:
        return ServeResult(Outcome(doc.file, loaded.config, findings=loaded.findings, documents=loaded.documents))
    stated = stated or named_map(loaded.documents.get(loaded.config), reader, limits)
    numbering = numbering_of(loaded.vendor, stated, loaded.image, loaded.config)
    try:
        plc = VirtualPlc(loaded, numbering)
    except UnusableError as error:
        loaded.add(error.problems)
        return ServeResult(Outcome(doc.file, loaded.config, findings=loaded.findings, documents=loaded.documents))
    notes: list[str] = []

    def tell(text: str) -> None:
        notes.append(text)
        serving.tell(text)

    run(serve(plc, serving.listen, serving.speed, serving.seconds, serving.ready, tell))
    report = plc.report()
    loaded.add(report.problems)
    if plc.unlisted:
        notes.append(f"{plc.unlisted} more writes are not listed")
    outcome = Outcome(doc.file, loaded.config, report, [*loaded.findings, *loaded.config_errors], loaded.documents)
    return ServeResult(outcome, tuple(notes))
