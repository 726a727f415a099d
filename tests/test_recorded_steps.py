"""Recordings as loggers, SCADA systems and spreadsheets save them, each made from a process that is known.

Every variant is either identified within 3 % of the truth, or refused with its place, the reason and the cure.
"""

from __future__ import annotations

import math
import random
from datetime import datetime, timedelta, timezone
from itertools import pairwise

import pytest

from pidcfg.text.reader import DEFAULT
from pidcfg.tuning.identify import identify, identify_record
from pidcfg.tuning.response import Record, RecordError, Request, Segment, first_order_response
from pidcfg.tuning.sheet import UnreadableRecordError, seconds_of
from record_rig import remembering

GAIN, CONSTANT, DEAD = 1.5, 20.0, 4.0
WITHIN = 0.03
AT, END, EVERY = 20.0, 180.0, 0.5
LOW, STEP, BASE = 40.0, 10.0, 80.0
MORNING = datetime(2026, 3, 9, 8, 0, 0)  # noqa: DTZ001 - loggers write no zone


def answer(past: float) -> float:
    """The share of the final rise, so long after the step."""
    return 1 - math.exp(-(past - DEAD) / CONSTANT) if past > DEAD else 0.0


def samples(
    *, noise=0.0, drift=0.0, at=AT, end=END, every=EVERY, gain=GAIN, start=0.0, pv=None, output=None, digits=3, seed=3
):
    """Rows of time, output, PV of a step."""
    chance, rows = random.Random(seed), []
    for i in range(round((end - start) / every) + 1):
        t = start + i * every
        u = output(t) if output else LOW + (STEP if t >= at - 1e-9 else 0.0)
        y = pv(t) if pv else BASE + gain * STEP * answer(t - at)
        rows.append((t, u, round(y + drift * t + chance.gauss(0, noise), digits)))
    return rows


def table(rows, *, header="time,output,pv", order=(0, 1, 2), sep=",", end="\n", cell=lambda x: f"{x:g}", time=None):
    """Rows as text; ``time`` writes the time otherwise, perhaps in several cells."""
    lines = [] if header is None else [header]
    for row in rows:
        cells = [time(row[0]) if time else cell(row[0]), cell(row[1]), cell(row[2])]
        lines.append(sep.join(cells[i] for i in order))
    return end.join([*lines, ""])


def point(x):
    """Three decimals."""
    return f"{x:.3f}"


def comma(x):
    return point(x).replace(".", ",")


def stamp(form, *, zone=None):
    """A writer of times as dates."""
    return lambda t: (MORNING.replace(tzinfo=zone) + timedelta(seconds=t)).strftime(form)


def iso(t):
    return (MORNING + timedelta(seconds=t)).isoformat(timespec="milliseconds")


def us(t):
    """Month first, no leading zeros, AM and PM."""
    at = MORNING + timedelta(seconds=t)
    return f"{at.month}/{at.day}/{at.year} {at.hour}:{at.minute:02}:{at.second:02} AM"


def excel(t):
    return f"{46090 + (8 * 3600 + t) / 86400:.8f}"


def over_midnight(t):
    at = datetime(2026, 3, 9, 23, 59, 0) + timedelta(seconds=t)  # noqa: DTZ001 - as above
    return at.strftime("%H:%M:%S.") + f"{at.microsecond // 1000:03}"


STEP_ROWS = samples()
SECOND_ROWS = samples(every=1.0)
GOOD = {
    "plain": (table(STEP_ROWS), {}),
    "no header": (table(STEP_ROWS, header=None), {}),
    "no header, pv second": (table(STEP_ROWS, header=None, order=(0, 2, 1)), {}),
    "other order": (table(STEP_ROWS, header="pv,time,output", order=(2, 0, 1)), {}),
    "semicolons": (table(STEP_ROWS, header="time;output;pv", sep=";"), {}),
    "tabs": (table(STEP_ROWS, header="time\toutput\tpv", sep="\t"), {}),
    "blanks": (table(STEP_ROWS, header="time output pv", sep="   "), {}),
    "bars": (table(STEP_ROWS, header="time|output|pv", sep="|"), {}),
    "decimal comma, semicolons": (table(STEP_ROWS, header="Zeit;Stellgröße;Istwert", sep=";", cell=comma), {}),
    "decimal comma, tabs": (table(STEP_ROWS, header="Zeit\tStellwert\tIstwert", sep="\t", cell=comma), {}),
    "decimal comma, blanks": (table(STEP_ROWS, header="t u pv", sep="  ", cell=comma), {}),
    "decimal comma, quotes": (table(STEP_ROWS, cell=lambda x: f'"{comma(x)}"'), {}),
    "thousands": (
        table(
            [(t, u, y + 4000) for t, u, y in STEP_ROWS], sep=";", header="time;output;pv", cell=lambda x: f"{x:,.3f}"
        ),
        {},
    ),
    "crlf and mark": ("\ufeff" + table(STEP_ROWS, end="\r\n"), {}),
    "windows-1252": (table(STEP_ROWS, header="time [s];output [%];pv [°C]", sep=";").encode("cp1252"), {}),
    "utf-16": (table(STEP_ROWS).encode("utf-16"), {}),
    "empty columns behind": (table(STEP_ROWS, header="time;output;pv;;", sep=";").replace("\n", ";;\n"), {}),
    "lines above the header": (
        "Export of trend 7\nStation;North\n\n" + table(STEP_ROWS, header="time;output;pv", sep=";"),
        {},
    ),
    "units in the header": (table(STEP_ROWS, header="Time (s),Valve (%),Temperature (°C)"), {}),
    "units below the header": (table(STEP_ROWS, header="Time,Valve,Temperature\ns,%,°C"), {}),
    "units in the cells": (
        table(STEP_ROWS, sep=";", header="time;output;pv", cell=lambda x: f"{x:g} %", time=lambda t: f"{t:g} s"),
        {},
    ),
    "minutes": (
        table([(t / 60, u, y) for t, u, y in STEP_ROWS], header="time [min],output,pv", cell=lambda x: f"{x:.5f}"),
        {},
    ),
    "milliseconds": (table([(t * 1000, u, y) for t, u, y in STEP_ROWS], header="time_ms,output,pv", cell=point), {}),
    "seconds since 1970": (table([(t + 1.77e9, u, y) for t, u, y in STEP_ROWS], cell=point), {}),
    "milliseconds since 1970": (table([((t + 1.77e9) * 1000, u, y) for t, u, y in STEP_ROWS], cell=point), {}),
    "days of a spreadsheet": (table(STEP_ROWS, header="Timestamp,output,pv", time=excel), {}),
    "iso": (table(STEP_ROWS, time=iso), {}),
    "iso, utc": (table(STEP_ROWS, time=lambda t: iso(t) + "Z"), {}),
    "iso, blank": (table(STEP_ROWS, time=lambda t: iso(t).replace("T", " ")), {}),
    "offset from utc": (table(SECOND_ROWS, time=stamp("%Y-%m-%dT%H:%M:%S%z", zone=timezone(timedelta(hours=2)))), {}),
    "german date": (
        table(SECOND_ROWS, header="Zeitstempel;Ventil;Istwert", sep=";", cell=comma, time=stamp("%d.%m.%Y %H:%M:%S")),
        {},
    ),
    "american date": (table(SECOND_ROWS, time=us), {}),
    "named month": (table(SECOND_ROWS, time=stamp("%d-%b-%Y %H:%M:%S")), {}),
    "date and time apart": (table(SECOND_ROWS, header="Date,Time,CV,PV", time=stamp("%Y-%m-%d,%H:%M:%S")), {}),
    "date and time apart, later": (
        table(
            SECOND_ROWS,
            header="PV;Datum;Uhrzeit;Ventil",
            order=(2, 0, 1),
            sep=";",
            cell=comma,
            time=stamp("%d.%m.%Y;%H:%M:%S"),
        ),
        {},
    ),
    "clock over midnight": (table(STEP_ROWS, time=over_midnight), {}),
    "minutes and seconds": (
        table(SECOND_ROWS, header="Time [mm:ss],output,pv", time=lambda t: f"{int(t) // 60:02}:{int(t) % 60:02}"),
        {},
    ),
    "newest first": (table(STEP_ROWS[::-1]), {}),
    "newest first, stamps": (table(SECOND_ROWS[::-1], time=stamp("%Y-%m-%d %H:%M:%S")), {}),
    "equal stamps": (table(STEP_ROWS, time=stamp("%H:%M:%S")), {}),
    "rows twice": (table([r for i, row in enumerate(STEP_ROWS) for r in [row] * (1 + (i % 7 == 0))]), {}),
    "gap": (table([r for r in STEP_ROWS if not 60 < r[0] < 75]), {}),
    "missing values": (table(STEP_ROWS).replace("\n33,50,", "\n33,50,NaN\n33.2,50,"), {}),
    "a set point beside": (table(STEP_ROWS, header="time,TIC1.SP,TIC1.OUT,TIC1.PV", time=lambda t: f"{t:g},95"), {}),
    "names of tags": (table(STEP_ROWS, header="time,FV101,TT101"), {}),
    "text beside": (table(STEP_ROWS, header="time,Status,output,pv", time=lambda t: f"{t:g},Good"), {}),
    "step at the first sample": (table([r for r in STEP_ROWS if r[0] >= AT]), {"rest": LOW}),
    "columns by number": (
        table([(t, u, y) for t, u, y in STEP_ROWS], header="a,b,c,d", time=lambda t: f"7,{t:g}"),
        {"columns": "time=2,output=3,pv=4"},
    ),
    "columns by name": (table(STEP_ROWS, header="x,y,z"), {"columns": "pv=z,time=x,output=Y"}),
    "two columns by name": (
        table(SECOND_ROWS, header="a,b,c,d", time=stamp("%Y-%m-%d,%H:%M:%S")),
        {"columns": "time=a+b,output=c,pv=d"},
    ),
    "a window in seconds": (table(samples(end=260, output=lambda t: LOW + STEP * (AT <= t < 200))), {"until": "199"}),
    "a window by stamps": (
        table(samples(every=1, end=260, output=lambda t: LOW + STEP * (AT <= t < 200)), time=stamp("%H:%M:%S")),
        {"start": "08:00:05", "until": "08:03:19"},
    ),
    "a window with a unit": (
        table(samples(end=260, output=lambda t: LOW + STEP * (AT <= t < 200))),
        {"until": "3.3 min"},
    ),
    "step down": (
        table(samples(output=lambda t: LOW - STEP * (t >= AT), pv=lambda t: BASE - GAIN * STEP * answer(t - AT))),
        {},
    ),
    "noise": (table(samples(noise=0.15, every=0.25)), {}),
    "drift": (table(samples(drift=0.01)), {}),
    "drift and noise": (table(samples(drift=0.02, noise=0.05, at=60, end=240)), {}),
    "coarse resolution": (table(samples(digits=1)), {}),
    "jitter of the output": (table(samples(output=lambda t: LOW + STEP * (t >= AT) + 0.1 * math.sin(t * 37))), {}),
    "two steps": (
        table(
            samples(
                output=lambda t: LOW + STEP * (t >= AT) + STEP * (t >= 90),
                pv=lambda t: BASE + GAIN * STEP * (answer(t - AT) + answer(t - 90)),
            )
        ),
        {},
    ),
    "one sample before": (table([r for r in STEP_ROWS if r[0] >= AT - 0.6]), {}),
    "few samples": (table(samples(every=4)), {}),
}


def ramp(t):
    """The PV after a ramp of the output over 20 s from `AT` on."""
    slope, out = STEP / 20, 0.0
    for start, way in ((AT, 1), (AT + 20, -1)):
        past = t - start - DEAD
        if past > 0:
            out += way * slope * (past - CONSTANT * (1 - math.exp(-past / CONSTANT)))
    return BASE + GAIN * out


GOOD["ramp of the output"] = (
    table(samples(output=lambda t: LOW + min(STEP, max(0, (t - AT) * STEP / 20)), pv=ramp)),
    {},
)
SLOPE = 0.02
INTEGRATING = {
    "integrating": (table(samples(pv=lambda t: BASE + SLOPE * STEP * max(0, t - AT - DEAD))), {}),
    "integrating, noise": (table(samples(pv=lambda t: BASE + SLOPE * STEP * max(0, t - AT - DEAD), noise=0.05)), {}),
    "integrating, not balanced before": (
        table(samples(pv=lambda t: BASE - 0.05 * t + SLOPE * STEP * max(0, t - AT - DEAD), noise=0.02)),
        {},
    ),
    "integrating, pulse": (
        table(
            samples(
                output=lambda t: LOW + STEP * (AT <= t < 60),
                pv=lambda t: BASE + SLOPE * STEP * min(40, max(0, t - AT - DEAD)),
            )
        ),
        {},
    ),
}


def request(said) -> Request:
    return Request(**said)


def read(text, said, name="step.csv"):
    """What is identified in a text."""
    data = text if isinstance(text, bytes) else text.encode()
    with remembering():
        return identify_record(data, name, DEFAULT, request(said))[0]


def test_there_are_enough_variants():
    assert len(GOOD) + len(INTEGRATING) >= 60
    assert len({repr(variant) for variant in GOOD.values()}) == len(GOOD)


@pytest.mark.parametrize("variant", GOOD)
def test_a_record_of_a_known_process_is_identified(variant):
    found = read(*GOOD[variant])
    process = found.process
    assert not found.integrating
    assert process.gain == pytest.approx(GAIN, rel=WITHIN)
    assert process.time_constant == pytest.approx(CONSTANT, rel=WITHIN)
    assert process.dead_time == pytest.approx(DEAD, abs=WITHIN * (CONSTANT + DEAD))
    assert found.remarks[0].startswith("columns (")
    assert "output" in found.remarks[0]


@pytest.mark.parametrize("variant", INTEGRATING)
def test_an_integrating_process_is_named_and_has_a_slope(variant):
    found = read(*INTEGRATING[variant])
    assert found.integrating
    assert found.process.gain == pytest.approx(SLOPE, rel=WITHIN)
    assert found.process.dead_time == pytest.approx(DEAD, abs=WITHIN * (CONSTANT + DEAD))


# --- what is refused -------------------------------------------------------------------------------------------------


def inverse(t):
    """A PV that goes down before it goes up."""
    return BASE + STEP * GAIN * (answer(t - AT) - 0.6 * max(0.0, t - AT) * math.exp(-max(0.0, t - AT) / 5) / 5)


def swinging(t):
    past = max(0.0, t - AT - DEAD)
    return BASE + GAIN * STEP * (1 - math.exp(-past / 40) * math.cos(past / 4))


def beyond(t):
    """An answer with one overshoot."""
    past = max(0.0, t - AT - DEAD)
    return BASE + GAIN * STEP * (1 - math.exp(-past / 8) + 1.2 * past / 10 * math.exp(-past / 10))


BAD = {
    "step at the first sample": (
        table([r for r in STEP_ROWS if r[0] >= AT]),
        {},
        r"step.csv: the output never changes, it is 50; .*give the output before it with --rest \(columns \(by",
    ),
    "swapped": (table(STEP_ROWS), {"columns": "time=1,output=3,pv=2"}, r"columns \(as given\): .* output 3 'pv'"),
    "inverse": (table(samples(pv=inverse)), {}, r"first goes the wrong way, by .* \(inverse response\)"),
    "oscillation": (table(samples(pv=swinging)), {}, r"swings about its end with a period of about 25\..? s"),
    "overshoot": (table(samples(pv=beyond)), {}, r"goes beyond its end by .* and comes back \(overshoot\)"),
    "not settled": (table(samples(end=40)), {}, r"step.csv:82: the PV has not settled"),
    "not at rest": (
        table([(t, u, y + 4 * (t < 10)) for t, u, y in STEP_ROWS]),
        {},
        r"step.csv:2: the PV was not at rest before the step: it moved by 4",
    ),
    "swings before": (
        table([(t, u, y + 1.5 * math.sin(t)) for t, u, y in STEP_ROWS]),
        {},
        r"not at rest before the step: it swung by 2\.9.* with a period of about 6\.\d+ s",
    ),
    "lost in noise": (table(samples(noise=6)), {}, r"the PV answers by .*, with noise of [56]"),
    "closed loop": (
        table(samples(output=lambda t: LOW + STEP * math.sin(t / 5) * (t > AT))),
        {},
        r"the output turns round \d+ times, as in a closed loop",
    ),
    "disturbance": (
        table([(t, u, y - 8 * (t > 70) * (1 - math.exp(-(t - 70) / 30)) * (t < 200)) for t, u, y in STEP_ROWS]),
        {},
        r"goes beyond its end|unexplained|wrong way",
    ),
    "both decimal signs": (
        table(STEP_ROWS, header="time;output;pv", sep=";", cell=point).replace(";80.000\n", ";80,000\n", 1),
        {},
        r"step.csv:2:3: '80,000' has a decimal comma, and '0.000' a decimal point",
    ),
    "commas in and between": (
        table(STEP_ROWS, cell=comma),
        {},
        r"step.csv:2: 6 cells stand under 3 names: commas between cells and within numbers cannot be told apart",
    ),
    "a cell short": (
        table(STEP_ROWS).replace("\n33,50,", "\n33,"),
        {},
        r"step.csv:68: 2 cells where the others have 3",
    ),
    "a text": (
        table(STEP_ROWS).replace("\n33,50,", "\n33,on,"),
        {},
        r"step.csv:68:2: 'on' in column 2 'output' is not",
    ),
    "time goes back": (
        table([*STEP_ROWS[:50], STEP_ROWS[10], *STEP_ROWS[50:]]),
        {},
        r"step.csv:52: the time does not go on \(5 after 24.5 s\)",
    ),
    "one time": (table([(3, u, y) for _, u, y in STEP_ROWS]), {}, r"step.csv:2: all samples have the same time"),
    "no such date": (
        table(SECOND_ROWS, time=stamp("%Y-%m-%d %H:%M:%S")).replace("2026-03-09 08:00:30", "2026-02-30 08:00:30"),
        {},
        r"step.csv:32:1: '2026-02-30 08:00:30' is not a time",
    ),
    "day and month change places": (
        table(SECOND_ROWS, time=stamp("19/%m/%Y %H:%M:%S")).replace("19/03/2026 08:00:30", "03/19/2026 08:00:30"),
        {},
        r"step.csv:32:1: there is no such date",
    ),
    "two outputs": (
        table(STEP_ROWS, header="time,TIC1.OUT,TIC2.OUT,TIC1.PV", time=lambda t: f"{t:g},30"),
        {},
        r"which column is the output cannot be told \(2 columns are named so\); there are 1 'time', 2 'TIC1.OUT'",
    ),
    "many columns": (
        table(STEP_ROWS, header=None, time=lambda t: f"{t:g},{t % 7:g},{t % 5:g}"),
        {},
        r"which column is the output cannot be told \(4 columns could be it\)",
    ),
    "no such column": (table(STEP_ROWS), {"columns": "pv=TT1"}, r"there is no column 'TT1' for pv; there are 1 'time'"),
    "column 9": (table(STEP_ROWS), {"columns": "pv=9"}, r"there is no column '9' for pv"),
    "columns": (table(STEP_ROWS), {"columns": "1,2,3"}, r"columns '1,2,3'; write time=…,output=…,pv=…"),
    "columns twice": (table(STEP_ROWS), {"columns": "pv=1,pv=2"}, r"pv is given twice"),
    "values missing": (
        table([(t, u, y) for t, u, y in STEP_ROWS]).replace(",50,", ",,"),
        {},
        r"step.csv:42: \d+ of \d+ rows lack a value \(columns",
    ),
    "empty window": (table(STEP_ROWS), {"start": "900"}, r"no sample lies between --from and --until; .* 0 to 180 s"),
    "a window of words": (table(STEP_ROWS), {"until": "noon"}, r"--until 'noon' is no time of the record"),
    "rest of the same": (
        table([r for r in STEP_ROWS if r[0] >= AT]),
        {"rest": LOW + STEP},
        r"the output never changes, it is 50",
    ),
    "nothing": ("", {}, "step.csv holds no samples"),
    "header only": ("time,output,pv\n", {}, "step.csv holds no samples"),
    "too few after": (
        table([r for r in samples(every=4) if r[0] < 60]),
        {},
        r"changes after 5 and before 10 samples",
    ),
}


@pytest.mark.parametrize("variant", BAD)
def test_a_record_that_tells_no_process_is_refused_with_its_reason(variant):
    text, said, message = BAD[variant]
    with pytest.raises(UnreadableRecordError, match=message) as refused:
        read(text, said)
    assert "\n" not in str(refused.value)


# --- what is said ----------------------------------------------------------------------------------------------------


SAID = {
    "other order": "columns (by their names): time 2 'time', output 3 'output', PV 1 'pv'",
    "no header, pv second": "columns (by their content): time 1, output 3, PV 2",
    "names of tags": "columns (by their names and by their content): time 1 'time', output 2 'FV101', PV 3 'TT101'",
    "columns by number": "columns (as given): time 2 'b', output 3 'c', PV 4 'd'",
    "date and time apart, later": "columns (by their names): time 2 'Datum' and 3 'Uhrzeit', output 4 'Ventil', "
    "PV 1 'PV'",
    "decimal comma, tabs": "numbers have a decimal comma, cells are separated by tabs",
    "windows-1252": "the file is not UTF-8; it was read as Windows-1252",
    "newest first": "the record has its newest sample first and was turned round",
    "equal stamps": "several samples have the same time; they are put evenly between the times",
    "rows twice": "52 rows that stand twice count once",
    "gap": "a gap of 15 s ends in line 123",
    "missing values": "1 rows without a value were left out, the first in line 68",
    "minutes": "times in min are shown in s",
    "plain": "the time has no unit and is taken for s",
    "iso": "the time counts from 2026-03-09T08:00:00.000",
    "american date": "the time counts from 3/9/2026 8:00:00 AM",
    "clock over midnight": "the times go on over midnight",
    "minutes and seconds": "times are read as minutes:seconds",
    "drift": "the PV drifts by 0.01 per s; the drift was fitted and taken out of the gain",
    "one sample before": "1 samples before the change: that the PV was at rest is not shown",
    "a window in seconds": "399 of 521 samples count, 0 to 199 s",
}


@pytest.mark.parametrize("variant", SAID)
def test_what_was_read_as_what_is_said(variant):
    assert SAID[variant] in read(*GOOD[variant]).remarks


@pytest.mark.parametrize("seed", range(4))
def test_the_confidence_holds_the_truth(seed):
    """95 % confidence, of which one in twenty may fail; twice of it holds it always."""
    found = read(table(samples(noise=0.3, seed=seed)), {})
    truth = (GAIN, CONSTANT, DEAD)
    values = (found.process.gain, found.process.time_constant, found.process.dead_time)
    for value, wanted, wide in zip(values, truth, found.confidence, strict=True):
        assert abs(value - wanted) < 2 * wide
        assert wide < 0.2 * wanted


@pytest.mark.parametrize("seed", range(3))
def test_a_drift_that_noise_hides_makes_the_numbers_less_sure(seed):
    """The fit alone would be sure within 0.2 %, and the gain 4 % off."""
    found = read(table(samples(noise=0.3, drift=0.004, seed=seed)), {})
    assert abs(found.process.gain - GAIN) < 2 * found.confidence[0]
    assert found.confidence[0] < 0.2 * GAIN


def test_a_drift_that_only_a_longer_rest_would_tell_is_refused():
    with pytest.raises(UnreadableRecordError, match="the PV moves again, and the output does not"):
        read(table(samples(drift=0.02, start=18)), {})


SMALL = table(
    samples(every=4), header="Date;Time;Valve [%];TT101 [°C]", sep=";", cell=comma, time=stamp("%d.%m.%Y;%H:%M:%S")
)


@pytest.mark.parametrize("seed", range(60))
def test_a_mutilated_record_is_identified_or_refused_but_never_crashes(seed):
    chance = random.Random(seed)
    at, length = chance.randrange(len(SMALL)), chance.randrange(1, 30)
    rubbish = "".join(chance.choice('";,.\n\r\t09:-+eE%xÄ\0\x1c\u2028') for _ in range(length))
    text = SMALL[:at] + rubbish + SMALL[at + length * chance.randrange(2) :]
    message = "step.csv"
    try:
        assert math.isfinite(read(text, {}).process.gain)
    except UnreadableRecordError as error:
        message = str(error)
    assert message.startswith("step.csv")


@pytest.mark.parametrize(
    ("texts", "apart"),
    [
        (["3/9/2026 11:59:59 AM", "3/9/2026 12:00:01 PM", "3/9/2026 1:00:01 PM"], [2, 3600]),
        (["12:00:00 AM", "1:00:00 AM"], [3600]),
        (["01/02/2026 23:59:59", "02/02/2026 00:00:01"], [2]),
        (["02/01/2026 23:59:59", "02/02/2026 00:00:01"], [2]),
    ],
)
def test_times_are_so_far_apart(texts, apart):
    times, _ = seconds_of(texts)
    assert [b - a for a, b in pairwise(times)] == apart


def test_a_set_point_is_no_output():
    rows = table(STEP_ROWS, header="time,Valve setpoint,Valve position,pv", time=lambda t: f"{t:g},{t % 3:g}")
    assert "output 3 'Valve position'" in read(rows, {}).remarks[0]


def test_an_integrator_follows_a_ramp():
    assert first_order_response([10.0], [Segment(0.0, 0.0, 1.0)], 0.0, math.inf) == [50.0]


# --- what no process does ---------------------------------------------------------------------------------------------


def lagged(t, gain=20.0, constant=30.0):
    """A lag's answer to a step at 40 s with 5 s of dead time."""
    return 50 + gain * (1 - math.exp(-(t - 45) / constant)) if t > 45 else 50.0


def recorded(pv):
    times = [float(i) for i in range(300)]
    return Record(times, [20.0 + 10 * (t >= 40) for t in times], [pv(t) for t in times])


def test_spikes_are_named_with_their_place_and_not_taken_for_a_swing():
    rng = random.Random(20)
    spiky = recorded(lambda t: lagged(t) + rng.gauss(0, 0.1) + 25 * (t in {100, 180, 250}))
    with pytest.raises(RecordError, match=r"for one sample at 100 s and back \(spike, and 2 more\)") as error:
        identify(spiky)
    assert (error.value.row, error.value.cure) == (100, "remove the rows")
    with pytest.raises(RecordError, match=r"at 20 s and back \(spike\)"):
        identify(recorded(lambda t: lagged(t) - 5 * (t == 20)))


def test_a_sensor_at_its_end_is_named():
    for end in (62.0, 68.0):
        with pytest.raises(RecordError, match=f"stops at once at {end:g} and stands still"):
            identify(recorded(lambda t, end=end: min(lagged(t), end)))


@pytest.mark.parametrize("quantum", [0.01, 0.1, 0.5, 1.0, 2.0])
def test_a_coarse_pv_that_comes_to_rest_is_no_sensor_at_its_end(quantum):
    found = identify(recorded(lambda t: round(lagged(t) / quantum) * quantum))
    assert found.process.gain == pytest.approx(2, rel=0.06)


@pytest.mark.parametrize("constant", [0.2, 1.0, 3.0])
def test_a_fast_process_has_no_spike_and_no_stop(constant):
    assert identify(recorded(lambda t: lagged(t, constant=constant))).process.gain == pytest.approx(2, rel=0.01)


def test_most_numbers_lie_within_their_confidence():
    """12 records with other noise, ± 95 %: by chance fewer than 9 within would be one case in 450."""
    hits, most = [0, 0, 0], [0.0, 0.0, 0.0]
    for seed in range(12):
        rng = random.Random(seed)
        found = identify(recorded(lambda t, rng=rng: lagged(t) + rng.gauss(0, 0.3)))
        numbers = (found.process.gain, found.process.time_constant, found.process.dead_time)
        for i, (number, true, wide) in enumerate(zip(numbers, (2, 30, 5), found.confidence, strict=True)):
            hits[i] += abs(number - true) <= wide
            most[i] = max(most[i], abs(number - true) / wide)
            assert abs(number - true) < 2 * wide
            assert wide < 0.2 * true
    assert min(hits) >= 9
    assert min(most) > 0.35, "as wide as they need to be, and not wider"
