"""What random cases of all vendors have in common: sample rates, plants, events."""

from __future__ import annotations

BASES = (0.05, 0.1, 0.2, 0.25, 0.5, 1.0)


def chance(rng, share):
    """Whether something that happens in a share of all cases happens in this one."""
    return rng.random() < share


def number(rng, low, high, digits=2):
    """A number with a few digits, as people write them."""
    return round(rng.uniform(low, high), digits)


def rates(rng, loops, bases=BASES):
    """A base step in s, and a sample rate for each loop that is a multiple of it."""
    base = rng.choice(bases)
    return base, [round(base * rng.choice((1, 1, 1, 2, 3, 4)), 4) for _ in range(loops)]


def within(rng, ends, low=0.0, high=1.0, digits=2):
    """A value between two shares of a range; a whole number where the range is one of counts."""
    digits = 0 if isinstance(ends, Counts) else digits
    value = ends[0] + rng.uniform(low, high) * (ends[1] - ends[0])
    return round(value, digits) if digits else round(value)


class Counts(list):
    """A range of raw counts, which are written as whole numbers."""


def plant(rng, pv_range, out_range, rate, *, rises=True):
    """A plant that takes the PV through much of its range, and sometimes beyond it."""
    span = pv_range[1] - pv_range[0]
    width = out_range[1] - out_range[0]
    gain = rng.uniform(0.5, 1.8) * span / width * (1 if rises else -1)
    kind = rng.choice(("first_order", "first_order", "second_order", "integrator", "dead_time"))
    made = {"model": kind, "initial": within(rng, pv_range, digits=4)}
    if kind == "integrator":
        made["gain"] = round(gain / (rate * rng.uniform(5, 40)), 5) or 0.001
        made["load"] = round(-made["gain"] * (out_range[0] + rng.uniform(0.2, 0.8) * width), 4)
        made["limits"] = [round(pv_range[0] - span / 20, 3), round(pv_range[1] + span / 20, 3)]
    else:
        made["gain"] = round(gain, 4) or 0.001
        bottom = pv_range[0] if rises else pv_range[1]
        made["load"] = round(bottom - made["gain"] * out_range[0] + rng.uniform(-0.3, 0.2) * span, 4)
    if kind == "first_order":
        made["time_constant"] = round(rate * rng.uniform(1, 25), 3)
    elif kind == "second_order":
        made["time_constants"] = [round(rate * rng.uniform(1, 15), 3), round(rate * rng.uniform(0.5, 5), 3)]
    if kind == "dead_time" or chance(rng, 0.3):
        made["dead_time"] = round(rate * rng.randint(1, 6), 4)
    if chance(rng, 0.3):
        made["noise"] = round(span * rng.choice((0.0005, 0.002, 0.01)), 5) or 0.0001
    return made


def sensor_events(rng, loop, pv_range, duration):
    """A plant that is disturbed, a sensor that breaks."""
    events = []
    if chance(rng, 0.2):
        shown = within(rng, pv_range, -0.2, 1.2)
        events.append(
            {"at": number(rng, 0, duration), "loop": loop, "pv": shown, "for": number(rng, 0.1, duration / 3)}
        )
    if chance(rng, 0.3):
        load = within(rng, pv_range, -0.5, 0.5)
        events.append({"at": number(rng, 0, duration), "loop": loop, "disturb": {"load": load}})
    return events


def stands_at(rng, loop, values, base, duration, share=0.35):
    """A sensor that in some cases stands at one of several values after the other, from base step to base step."""
    if not chance(rng, share):
        return []
    events, step, last = [], rng.randint(0, 10), round(duration / base) - 1
    while step < last:
        length = rng.choice((1, 1, 2, 3, 6))
        shown = {"at": round(step * base, 4), "loop": loop, "pv": rng.choice(values), "for": round(length * base, 4)}
        events.append(shown)
        step += length
    return events


def halves(value):
    """Plain data with every fraction rounded to a half, so that sums and differences of them are exact."""
    if isinstance(value, dict):
        return {key: halves(part) for key, part in value.items()}
    if isinstance(value, list):
        return [halves(part) for part in value]
    return round(2 * value) / 2 if isinstance(value, float) else value


def moment(rng, base, duration):
    """A time, as often as not that of a base step."""
    at = rng.uniform(0, duration)
    return round(at // base * base, 4) if chance(rng, 0.5) else round(at, 2)


def in_order(events):
    """Events by their times; those of one time stay as they are."""
    return sorted(events, key=lambda event: event["at"])
