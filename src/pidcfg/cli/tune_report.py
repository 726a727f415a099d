"""The result of a tuning rule for people, with a picture of what was fitted to a record."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pidcfg.tuning.identify import Found, Record

WIDTH, HEIGHT = 72, 14
RECORDED, FITTED, BOTH = ".", "o", "@"
UNITS = {"gain": "", "ultimate_gain": ""}


def as_text(result: dict[str, Any], found: Found | None, record: Record | None) -> str:
    """Everything as lines."""
    lines = []
    if found is not None and record is not None:
        lines += [_identified(found), "", *picture(found, record), ""]
    process = ", ".join(f"{k.replace('_', ' ')} {v:.6g}{UNITS.get(k, ' s')}" for k, v in result["process"].items())
    lines += [f"{result['method']}, {result['form']}: {result['title']} ({result['basis']})", f"  {process}", ""]
    integral = result["integral_time"]
    own = result["independent"]
    times = "no integral term" if integral is None else f"Ti {integral:.6g} s"
    lines += [
        f"  dependent    Kp {result['gain']:.6g}  {times}  Td {result['derivative_time']:.6g} s",
        f"  independent  Kp {own['kp']:.6g}  Ki {own['ki']:.6g} /s  Kd {own['kd']:.6g} s",
    ]
    if "for" in result:
        lines += ["", *_for_vendor(result["for"])]
    lines += [f"warning: {text}" for text in result["warnings"]]
    return "\n".join(lines) + "\n"


def _for_vendor(found: dict[str, Any]) -> list[str]:
    action = found["action"] or "that of the process, which is not known without --gain"
    lines = [f"for {found['vendor']}: action {action}"]
    for value in found["values"]:
        if value["stored"] is None:
            lines.append(f"  {value['key']}: {value['problem']}")
            continue
        off = f"  ({value['error_percent']:+.3g} %)" if value["error_percent"] else ""
        unit = f" {value['unit']}" if value["unit"] else ""
        lines.append(f"  {value['key']}: {value['stored']:.9g}{unit}{off}")
    return lines


def _identified(found: Found) -> str:
    process = found.process
    return (
        f"identified: gain {process.gain:.5g}, time constant {process.time_constant:.5g} s, dead time "
        f"{process.dead_time:.5g} s\n  step of {found.step:.5g} at {found.at:g} s; noise {found.noise:.3g}; "
        f"what is left is {found.misfit * 100:.2g} % of the answer"
    )


def picture(found: Found, record: Record) -> list[str]:
    """Recorded and fitted PV over time, in characters."""
    begin, end = record.time[0], record.time[-1]
    fitted = [found.value(begin + (end - begin) * (c + 0.5) / WIDTH) for c in range(WIDTH)]
    low, high = min(*record.pv, *fitted), max(*record.pv, *fitted)
    rows = [[" "] * WIDTH for _ in range(HEIGHT)]

    def row(value: float) -> int:
        return HEIGHT - 1 - min(HEIGHT - 1, int((value - low) / (high - low) * HEIGHT)) if high > low else HEIGHT // 2

    for time, value in zip(record.time, record.pv, strict=True):
        rows[row(value)][min(WIDTH - 1, int((time - begin) / (end - begin) * WIDTH))] = RECORDED
    for column, value in enumerate(fitted):
        cell = rows[row(value)]
        cell[column] = BOTH if cell[column] == RECORDED else FITTED
    labels = {0: f"{high:.5g}", HEIGHT - 1: f"{low:.5g}"}
    lines = [f"{labels.get(i, ''):>10} |{''.join(cells).rstrip()}" for i, cells in enumerate(rows)]
    scale = f"{begin:g} s".ljust(WIDTH - len(f"{end:g} s")) + f"{end:g} s"
    return [*lines, f"{'':>10} +{'-' * WIDTH}", f"{'':>12}{scale}",
            f"{'':>12}{RECORDED} recorded PV   {FITTED} fitted   {BOTH} both"]  # fmt: skip
