"""What the battery found: of each loop the differences that nothing explains, and those that a line names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pidcfg.conversion.ledger import Change
    from pidcfg.pictures.chart import Chart
    from pidcfg.verification.comparison import Difference


@dataclass(frozen=True, slots=True)
class Named:
    """A difference, and the line of the report that says why; None: several do, and none of them alone."""

    difference: Difference
    line: Change | None


@dataclass(frozen=True, slots=True)
class Failure:
    """A difference that nothing explains, and the key of the target that does where one is found."""

    difference: Difference
    key: str = ""


@dataclass(frozen=True, slots=True)
class Untried:
    """A stage that shows nothing, and the mode that it asks for and the source does not go to."""

    stage: str
    mode: str


@dataclass(frozen=True, slots=True)
class Verified:
    """One loop's two sides in the battery, and how far they lie apart in its step and its disturbance."""

    loop: str
    pv_percent: float
    """The PVs at most, in % of the range, with the source as it is."""
    output_percent: float
    iae_ratio: float | None
    chart: Chart
    stages: tuple[str, ...] = ()
    """Those that were run."""
    untried: tuple[Untried, ...] = ()
    failures: tuple[Failure, ...] = ()
    named: tuple[Named, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether everything that differs is named by a line of the report."""
        return not self.failures
