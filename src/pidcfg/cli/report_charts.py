"""A scenario's run together with the charts of its loops."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pidcfg.cli.simulation_report import Outcome
    from pidcfg.document import Document
    from pidcfg.limits import Limits
    from pidcfg.pictures.chart import Chart


def run_with_charts(
    doc: Document, limits: Limits, progress: Callable[[float], None] | None, *, pictures: bool
) -> tuple[Outcome, Sequence[Chart]]:
    """Runs a scenario; its charts where pictures are wanted."""
    from pidcfg.cli.simulate import simulate_document
    from pidcfg.sim.run import Settings

    settings = Settings(max_loop_steps=limits.loop_steps, progress=progress)
    return simulate_document(doc, settings, limits), ()
