"""The result of a run as data; the command line prints it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, NotRequired, TypedDict

from pidcfg.text.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.sim.engine.expressions import Problem

# --- Alarms and flags in the words of a trend; files and JSON keep the names ------------------------------------------

# fmt: off
FLAG_WORDS = {
    "pv_low_low":               "PV low-low",
    "pv_low":                   "PV low",
    "pv_high":                  "PV high",
    "pv_high_high":             "PV high-high",
    "low_low":                  "PV low-low",
    "low":                      "PV low",
    "high":                     "PV high",
    "high_high":                "PV high-high",
    "deviation_yellow":         "deviation yellow",
    "deviation_red":            "deviation red",
    "deviation_high":           "deviation high",
    "deviation_high_high":      "deviation high-high",
    "rate_of_change":           "PV rate of change",
    "out_limited":              "output limited",
    "mv_limited":               "MV limited",
    "saturation":               "output saturated",
    "rate_limited":             "output rate limited",
    "in_deadband":              "in the deadband",
    "in_dead_band":             "in the dead band",
    "pid_error":                "PID error",
    "autotune_running":         "auto-tune running",
    "autotune_error":           "auto-tune error",
    "ramp_soak_complete":       "profile complete",
    "ramp_soak_deviation":      "profile deviation",
    "ramp_soak_hold":           "profile held",
    "WarnBits.PV_MaxPV":        "PV above MaxPV",
    "WarnBits.PV_MinPV":        "PV below MinPV",
    "WarnBits.SP_MaxPV":        "SP above MaxPV",
    "WarnBits.SP_MinPV":        "SP below MinPV",
    "WarnBits.SP_CASC_MaxPV":   "SP_CASC above MaxPV",
    "WarnBits.SP_CASC_MinPV":   "SP_CASC below MinPV",
    "WarnBits.MV_MaxMV":        "MV at MaxMV",
    "WarnBits.MV_MinMV":        "MV at MinMV",
    "WarnBits.MV_P_MaxVarMV":   "MV rising by MaxVarMV",
    "WarnBits.MV_N_MaxVarMV":   "MV falling by MaxVarMV",
}
# fmt: on
UPPER_FLAGS = frozenset({"out_limited", "mv_limited", "saturation", "WarnBits.MV_MaxMV"})
LOWER_FLAGS = frozenset({"out_limited", "mv_limited", "saturation", "WarnBits.MV_MinMV"})
"""Flags that say that an output is at its upper or its lower limit."""


def flag_words(name: str) -> str:
    """What people call an alarm or a flag; the other names of parameters stay as the manual writes them."""
    return FLAG_WORDS.get(name) or (name if "." in name else name.replace("_", " "))


# --- The result of a run as data; the command line prints it ----------------------------------------------------------

STANDING_KINDS = (
    "not-in-mode",
    "set-up-error",
    "pv-not-driven",
    "saturated",
    "error-stands",
    "out-of-range",
    "oscillates",
    "alarm-stands",
    "not-settled",
    "no-better",
)
"""What a standing expectation can find, in the order of the report."""
ACCEPTED_KIND = "differs-from-accepted"
"""What is found beside that where a person has accepted a run."""
ASSUMED_KIND = "wrong-action"
"""What is left open beside that where the sign of a plant is taken from the loop's own action."""
SIGN_TEXT = "the sign of the plant is assumed from it"

VerdictWord = Literal["proven", "failed", "not-proven", "not-judged"]
VERDICT_WORDS: Mapping[VerdictWord, str] = {
    "proven": "passed",
    "failed": "FAILED",
    "not-proven": "NOT PROVEN",
    "not-judged": "not judged",
}


class ScanTime(NamedTuple):
    """Average scan time with PID loops, in seconds."""

    minimum: float
    typical: float
    maximum: float


@frozen
class Alarm:
    """An alarm with its times in s; ``cleared`` None: still on at the end."""

    alarm: str
    at: float
    cleared: float | None = None


@frozen
class Period:
    """How long something lasted, in s: a step of a set-point profile, or a flag; ``until`` None: to the end."""

    name: str
    at: float
    until: float | None = None


@frozen
class ModeChange:
    """A mode reached, or a request refused (``mode`` is then the old one), with the reason."""

    at: float
    requested: str | None
    mode: str
    reason: str | None


@frozen
class Range:
    """How far a signal went, and where it ended."""

    low: float
    high: float
    final: float


@frozen
class Verdict:
    """An expectation in words, whether it holds, and what was measured instead."""

    text: str
    passed: bool
    value: Any
    loop: str | None = None
    """The loop that it is about, if any."""
    at: float | None = None
    """The time in s that it is about, if any."""


@frozen
class Standing:
    """What a standing expectation says of a loop, in words.

    What is not proven fails a run as what has failed does; what is not judged does not, and ``text`` says why.
    """

    kind: str
    loop: str
    """Empty: the PLC."""
    verdict: VerdictWord
    text: str
    at: float | None = None
    """Since when, in s."""
    allowed: str | None = None
    """The reason for which the scenario allows it."""
    accepted: bool = False
    """It is proven since a person accepted a run that shows as much."""

    @property
    def passed(self) -> bool:
        """Whether nothing speaks against the loop."""
        return self.verdict in {"proven", "not-judged"}

    @property
    def is_judged(self) -> bool:
        """Whether the loop is not exempt."""
        return self.verdict != "not-judged"

    @property
    def fails(self) -> bool:
        """Whether it fails the run."""
        return not self.passed and self.allowed is None

    @property
    def word(self) -> str:
        """The verdict: ``passed``, ``accepted``, ``FAILED``, ``NOT PROVEN``, ``allowed`` or ``not judged``."""
        if self.accepted:
            return "accepted"
        return "allowed" if not self.passed and not self.fails else VERDICT_WORDS[self.verdict]

    @property
    def why(self) -> str:
        """What it says, with the reason for which it is allowed."""
        return self.text if self.allowed is None else f"{self.text} (allowed: {self.allowed})"


@frozen
class Note:
    """Something that happened and needs saying: a parameter that has no effect yet, an expression without a value."""

    at: float
    loop: str | None
    text: str
    error: bool = False


class TuneReport(TypedDict):
    """How an auto-tune of the PLC went."""

    done: bool
    error: bool
    status: str
    """In the PLC's words."""
    results: Mapping[str, float]
    """By the vendor's names of the parameters; nothing unless it is done."""
    rule: NotRequired[str]
    """What the results rest on where no manual prints it."""


@dataclass(slots=True)
class LoopReport:
    """What became of one loop. A flag is true when it was on at any time; ``unlisted`` counts what lists leave out."""

    verdict: VerdictWord = "not-judged"
    """Whether the run proves that the loop controls."""
    missing: str = ""
    """What keeps it from being proven."""
    metrics: Mapping[str, float | None] = field(default_factory=dict)
    until: float | None = None
    """When the next event ended the metrics of the last step of the set point, in s; None: they go on to the end."""
    time_in_control: float = 0.0
    """How long the loop was in Auto or Cascade, in s."""
    alarms: list[Alarm] = field(default_factory=list)
    modes: list[ModeChange] = field(default_factory=list)
    first_mode: str = ""
    """The mode before the first change."""
    unit: str = ""
    """Of its PV; empty where it is not known."""
    steps: list[Period] = field(default_factory=list)
    """Steps of a ramp/soak profile, in order."""
    conditions: list[Period] = field(default_factory=list)
    """When each of the flags was on."""
    notes: list[Note] = field(default_factory=list)
    """What else the controller had to say: of ramp/soak, of auto-tune."""
    flags: dict[str, bool] = field(default_factory=dict)
    autotune: TuneReport | None = None
    unlisted: int = 0


@dataclass(slots=True)
class Report:
    """The results of a run."""

    scenario: str
    step: float
    steps: int
    duration: float
    engine: str
    plc_flags: Mapping[str, str]
    """Error registers by name, as the vendor writes them."""
    running: bool = True
    """Whether the set-up lets the loop task run."""
    loops: dict[str, LoopReport] = field(default_factory=dict)
    signals: dict[str, Range] = field(default_factory=dict)
    expectations: list[Verdict] = field(default_factory=list)
    standing: list[Standing] = field(default_factory=list)
    """What is expected of every run."""
    events: list[Note] = field(default_factory=list)
    """The events of the scenario in words, as they took effect."""
    notes: list[Note] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)
    settled: float | None = None
    """How long the pre-roll to the steady state took, in s; None: there was none."""

    scan_time: ScanTime | None = None
    """How long the PLC's scan becomes with the loops; None where the scenario gives no scan time."""

    @property
    def passed(self) -> bool:
        """Whether every expectation holds and nothing went wrong in the run itself."""
        return (
            all(verdict.passed for verdict in self.expectations)
            and not any(verdict.fails for verdict in self.standing)
            and not any(note.error for note in self.notes)
            and not any(problem.severity == "error" for problem in self.problems)
        )


@frozen
class Tally:
    """How many standing expectations hold, fail, are not proven, are allowed to be so, and are not judged."""

    held: int
    failed: int
    unproven: int
    allowed: int
    unjudged: int

    @classmethod
    def count(cls, verdicts: Sequence[Standing]) -> Tally:
        """Of the verdicts of a run."""
        judged = [v for v in verdicts if v.is_judged]
        return cls(
            held=sum(v.passed for v in judged),
            failed=sum(v.fails and v.verdict == "failed" for v in judged),
            unproven=sum(v.fails and v.verdict == "not-proven" for v in judged),
            allowed=sum(v.allowed is not None for v in judged),
            unjudged=len(verdicts) - len(judged),
        )

    @property
    def judged_count(self) -> int:
        """How many are judged."""
        return self.held + self.failed + self.unproven + self.allowed

    def summary_text(self) -> str:
        """``20 of 21 always checked, 1 allowed, 3 not judged``."""
        rest = [f"{n} {what}" for n, what in ((self.allowed, "allowed"), (self.unjudged, "not judged")) if n]
        return ", ".join([f"{self.held} of {self.judged_count} always checked", *rest])


def summarise_verdicts(verdicts: Sequence[Standing]) -> list[tuple[str, str, str]]:
    """What is not simply so, by loop: its `Standing.word`, the kinds, and why."""
    rows: dict[tuple[str, str, str], list[str]] = {}
    for v in verdicts:
        if v.word != "passed":
            rows.setdefault((v.word, v.loop, v.why), []).append(v.kind)
    kind_count = len(STANDING_KINDS)
    return [
        (word, f"{loop} {', '.join(kinds) if len(kinds) < kind_count else 'as a whole'}".strip(), why)
        for (word, loop, why), kinds in rows.items()
    ]


def ten_digits(value: float) -> float:
    """Ten significant digits: what a reader or a comparison can use."""
    return float(f"{value:.10g}")
