"""What holds on which plants, of robust gains, as lines for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.cli.formats.certification_text import figure

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.results.confirm import Confirmation
    from pidcfg.results.robust import RobustGains

SECONDS = ("time_constant", "time_constant_2", "dead_time")


def robust_lines(gains: RobustGains, reason: str) -> Iterator[str]:
    """The loop, the plants, and what holds on them."""
    data, found = gains.to_json(), gains.found
    filtered = "no PV filter" if data["pv_share"] == 1 else f"PV filter {data['pv_share']:.4g} per sample"
    yield f"  rule         holds: {reason}"
    yield f"  loop         samples every {data['sample_time']:g} s, {filtered}"
    yield f"  plants       {_plants(gains, data['plants'])}"
    lowest = _where(data["worst_ms_plant"], gains)
    yield f"  worst Ms     {data['worst_ms']:.4f} of at most {data['ms_limit']:g}{lowest}"
    margin, angle = data["gain_margin"], data["phase_margin"]
    shown = "unlimited" if margin is None else f"{margin:.3g}"
    yield f"  there        gain margin {shown}  phase margin {'unlimited' if angle is None else f'{angle:.3g}°'}"
    slowest = _where(data["worst_iae_plant"], gains)
    yield f"  worst IAE    {data['worst_iae']:.4g} after a step of 1 at the output{slowest}"
    if found.words:
        yield from _words(data)
    if gains.confirmed is not None:
        yield f"  certified    {_certified(gains.confirmed)}"
    for text in gains.assumed:
        yield f"  assumed      {text}"


def _plants(gains: RobustGains, count: int) -> str:
    """How many there are, and what they differ by."""
    spreads = gains.found.spreads
    if not spreads:
        return "the process alone; --vary says what is uncertain"
    corners = 2 ** len(spreads)
    ends = ", ".join(_ends(spread.name, spread.low, spread.high, negative=gains.negative) for spread in spreads)
    return f"{count}: the process, {corners} combinations of ends, {count - corners - 1} samples between; {ends}"


def _words(data: dict[str, Any]) -> Iterator[str]:
    """What the grid of the PLC costs."""
    real = data["real"]
    tried = "the best of all words" if data["every_word"] else "the best words around the best real numbers"
    rate = f", Td {real['derivative_time']:.5g} s" if real["derivative_time"] else ""
    yield f"  words        {tried}; they cost {_cost(data['cost_percent'])} against real numbers"
    yield f"               (Kp {real['gain']:.5g}, Ti {real['integral_time']:.5g} s{rate}: IAE {real['worst_iae']:.4g})"


def _certified(done: Confirmation) -> str:
    """What the samples show."""
    kept = f"{done.held} of {done.samples} samples on a virtual {done.plc} keep the IAE"
    sure = f"so at least {figure(done.bound)} % of the plants between these ends, at 95 % confidence"
    return f"{'' if done.passed else 'NOT CONFIRMED: '}{kept}, {sure}"


def _cost(percent: float) -> str:
    """A share of the IAE; what is below the search's own steps counts as nothing."""
    return "nothing" if percent < 0.005 else f"{percent:.2f} % IAE"


def _ends(name: str, low: float, high: float, *, negative: bool) -> str:
    unit = " s" if name != "gain" else ""
    if name == "gain" and negative:
        low, high = -high, -low
    return f"{name.replace('_', ' ')} {low:.5g} to {high:.5g}{unit}"


def _where(plant: dict[str, float], gains: RobustGains) -> str:
    """The numbers of a plant that vary."""
    names = {spread.name.replace("second_time_constant", "time_constant_2") for spread in gains.found.spreads}
    signed = {**plant, "gain": -plant["gain"]} if gains.negative else plant
    shown = [f"{k.replace('_', ' ')} {v:.5g}{' s' if k in SECONDS else ''}" for k, v in signed.items() if k in names]
    return f" ({', '.join(shown)})" if shown else ""
