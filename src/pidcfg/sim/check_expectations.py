"""What an expectation may say: one subject with the keys that go with it, names that exist, bounds that can be met."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.schemas.scenario_fields import Never
from pidcfg.sim.problems import Problem, unknown

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.paths import Path
    from pidcfg.schemas.scenario import Expectation, Scenario
    from pidcfg.schemas.scenario_fields import Bound
    from pidcfg.sim.plc import Plc

SUBJECTS = {
    "metric": {"loop", "metric", "band", "min", "max"},
    "signal": {"signal", "min", "max", "final", "tolerance", "from", "until"},
    "alarm": {"loop", "alarm", "never", "at", "tolerance", "before", "after"},
    "flag": {"loop", "flag", "is"},
    "autotune": {"loop", "autotune", "min", "max", "is"},
    "mode": {"loop", "mode", "at"},
}
"""What an expectation can be about, and the keys that go with it."""
UNITS = {
    "overshoot": ("", "%"),
    "settling_time": ("", "s"),
    "rise_time": ("", "s"),
    "oscillation_period": ("", "s"),
}
"""Units that the bounds of a metric may carry; none by default."""


def check_expectation(path: Path, wanted: Expectation, scenario: Scenario, plc: Plc) -> Iterator[Problem]:
    """One subject with the keys that go with it, and a bound."""
    fields = type(wanted).model_fields
    present = {fields[name].alias or name for name in wanted.model_fields_set}
    subjects = [key for key in SUBJECTS if key in present]
    if len(subjects) != 1:
        what = f"an expectation about {' and '.join(subjects)}" if subjects else "an expectation about nothing"
        yield Problem(path, what, help=f"one of {', '.join(SUBJECTS)} is expected", key=True)
        return
    subject = subjects[0]
    for key in sorted(present - SUBJECTS[subject] - {"share"}):
        keys = ", ".join(sorted(SUBJECTS[subject]))
        yield Problem((*path, key), f"{key} does not go with {subject}", help=f"known keys here: {keys}", key=True)
    yield from _check_names(path, subject, wanted, plc, scenario)
    yield from _check_bounds(path, subject, wanted, present)
    if wanted.share is not None and not 0 < wanted.share < 100:
        cure = "without share no sample may fail" if wanted.share >= 100 else "write it like 99 %"
        yield Problem((*path, "share"), f"samples cannot show a share of {wanted.share:f} %", "value", help=cure)
    times = {
        "at": wanted.at,
        "before": wanted.before,
        "after": wanted.after,
        "from": wanted.start,
        "until": wanted.until,
    }
    for key, time in times.items():
        if time is not None and not 0 <= time <= scenario.duration:
            yield Problem(
                (*path, key), f"{key} {time:f} s is outside the scenario (0 to {scenario.duration:f} s)", "value"
            )


def _check_names(path: Path, subject: str, wanted: Expectation, plc: Plc, scenario: Scenario) -> Iterator[Problem]:
    """Names of loops, signals, alarms, modes and flags."""
    if wanted.loop is not None and wanted.loop not in plc.loops:
        yield unknown((*path, "loop"), "loop", wanted.loop, plc.loops)
    elif wanted.loop is None and subject not in {"signal", "flag"}:
        yield Problem((*path, subject), f"{subject} needs a loop", help="add 'loop: …'", key=True)
    plants = [text.name for text in scenario.plants.values() if text.name]
    known = {
        "signal": [name for name in plc.signals if name] + [*scenario.signals, *plants],
        "alarm": list(plc.alarm_bits),
        "mode": list(plc.modes),
        "flag": list(plc.flags) if wanted.loop is None else [*plc.flag_bits, *plc.aux_bits],
        "autotune": ["done", "error", *plc.tuned_names],
    }.get(subject)
    name = getattr(wanted, subject)
    if isinstance(name, Never):
        name, path = name.mode, (*path, "mode")
        subject = "never"
    if known is not None and name not in known:
        yield unknown(
            (*path, subject), {"autotune": "result of auto-tune", "never": "mode"}.get(subject, subject), name, known
        )


def _check_bounds(path: Path, subject: str, wanted: Expectation, present: set[str]) -> Iterator[Problem]:
    """Something must be demanded, in a unit that fits, and not the impossible."""
    needs = {"metric": {"min", "max"}, "signal": {"min", "max", "final"}, "alarm": {"never", "at", "before", "after"}}
    if subject in needs and not needs[subject] & present:
        yield Problem(
            path, f"nothing is expected of the {subject}", help=f"add {' or '.join(sorted(needs[subject]))}", key=True
        )
    if subject == "autotune" and wanted.autotune in {"done", "error"} and {"min", "max"} & present:
        yield Problem(path, f"{wanted.autotune} is true or false", help="use 'is: true'", key=True)
    if ("final" in present) != ("tolerance" in present) and subject == "signal":
        yield Problem(path, "final and tolerance belong together", help="final: 50, tolerance: 0.5", key=True)
    if (
        subject == "alarm"
        and "never" in present
        and ({"at", "after"} & present or ("before" in present and not wanted.never))
    ):
        yield Problem((*path, "never"), "an alarm that never comes has no time; 'before' may limit it", key=True)
    if isinstance(wanted.mode, Never) and "at" in present:
        yield Problem((*path, "at"), "a mode that never comes has no time", key=True)
    if wanted.band is not None and not (wanted.metric == "settling_time" and 0 < wanted.band < 100):
        yield Problem(
            (*path, "band"), "band is the share (above 0 %, below 100 %) of the step in settling_time", key=True
        )
    units: tuple[str, ...] = UNITS.get(wanted.metric or "", ("",))
    for key in ("min", "max"):
        bound: Bound | None = getattr(wanted, key)
        if bound is not None and bound.unit not in units:
            has = " or ".join(unit or "a plain number" for unit in units)
            yield Problem(
                (*path, key),
                f"{key} of {wanted.metric or subject} cannot be in {bound.unit}",
                "value",
                help=f"write {has}",
            )
    if wanted.min is not None and wanted.max is not None and wanted.min.value > wanted.max.value:
        yield Problem((*path, "min"), "min is above max: no value passes", "value")
    if wanted.start is not None and wanted.until is not None and wanted.start > wanted.until:
        yield Problem((*path, "from"), "from comes after until", "value")
