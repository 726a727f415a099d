"""The loops of a PLC are drawn while they are recorded: for a person, and for nobody else."""

import io
import time
from itertools import count

import pytest

import pidcfg
from live_rig import DL06, Registers, words_of
from pidcfg.cli.commands import trend as live_chart
from pidcfg.cli.commands.trend import EVERY, LiveChart, chart_for


class Terminal(io.StringIO):
    """A stream that says it is one."""

    encoding = "ascii"

    def isatty(self):
        """Yes."""
        return True


@pytest.fixture
def chart(monkeypatch):
    """A chart that takes rows and draws nothing."""
    chart = LiveChart(600.0)
    monkeypatch.setattr(chart, "_draw", lambda: None)
    for i in range(30):
        values = {f"L{k}.{signal}": str(10 * k + i) for k in range(8) for signal in ("SP", "OUT", "PV")}
        chart.row(float(i), {**values, "L0.MODE": "auto"})
    return chart


def test_as_many_loops_as_there_is_room_for(chart):
    for height, loops in ((24, 1), (60, 4), (130, 8)):
        text = chart.text(80, height, ascii_only=True)
        assert text.isascii()
        assert sum(f"L{k}" in text for k in range(8)) == loops
        assert len(text.splitlines()) <= height
        assert max(map(len, text.splitlines())) <= 80
        left = f"; {8 - loops} more loops are recorded" if loops < 8 else ""
        assert text.splitlines()[-1] == f"29 of 600 s, 30 rows{left}"
    assert "L0, auto" in text


def test_a_value_that_is_none_is_left_out(chart):
    chart.row(30.0, {"L0.PV": "", "L0.SP": "5", "L0.OUT": "5"})
    assert len(chart.signals["L0.PV"]) == 30
    assert len(chart.signals["L0.SP"]) == 31
    assert "30 of 600 s, 31 rows" in chart.text(80, 24, ascii_only=True)


def test_only_a_person_sees_it(monkeypatch):
    monkeypatch.setattr(live_chart.LINE, "silent", False)
    assert chart_for("run.csv", None) is None
    monkeypatch.setattr("sys.stderr", Terminal())
    monkeypatch.setattr(live_chart, "watched", lambda: True)
    monkeypatch.setattr(live_chart.LINE, "silent", False)
    assert chart_for("run.csv", None) is not None
    monkeypatch.setattr(live_chart.LINE, "silent", True)
    assert chart_for("run.csv", None) is None
    monkeypatch.setattr(live_chart.LINE, "silent", False)
    monkeypatch.setattr("sys.stdout", Terminal())
    assert chart_for(None, None) is None, "the rows themselves are there"


def test_it_is_drawn_and_its_last_picture_stays(monkeypatch):
    stream = Terminal()
    monkeypatch.setattr("sys.stderr", stream)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("LINES", "24")
    chart = LiveChart(None)
    chart.row(0.0, {"L.PV": "1", "L.SP": "1", "L.OUT": "1"})
    for i in range(1, 5):
        monkeypatch.setattr(chart, "_drawn", chart._drawn - EVERY)
        chart.row(float(i), {"L.PV": str(i), "L.SP": "1", "L.OUT": "1"})
    chart.close()
    pictures = stream.getvalue().count("until Ctrl-C")
    assert pictures >= 5
    assert "4 s, until Ctrl-C, 5 rows" in stream.getvalue().splitlines()[-2]


def test_a_row_that_comes_late_has_the_time_of_its_values(desk):
    numbers = count()

    def slow(registers):
        if next(numbers) == 12:
            time.sleep(0.3)
            registers.words["holding", 0o2003] = 0x0123

    out = io.StringIO()
    with desk.plc(Registers(words_of(DL06), slow)) as url:
        pidcfg.trend(url, out, like=DL06, seconds=0.2, interval=0.05)
    rows = [row.split(",") for row in out.getvalue().splitlines()]
    column, first = rows[0].index("FIC-102.PV"), rows[1]
    assert float(first[0]) == 0
    assert float(next(row[0] for row in rows[1:] if row[column] != first[column])) > 0.25
