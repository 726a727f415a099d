"""What the signals of a loop are that takes the root of its PV, beside every file that has them."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from click.testing import CliRunner

from pidcfg.cli.main import cli

CONFIG = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000}
loops:
  - name: FIC
    sample_rate: 1
    action: direct
    mode: auto
    tuning: {gain: 0.5, reset: 5}
    pv: {range: [0, 100], unit: m3/h, square_root: ROOT}
    setpoint: {value: 50}
  - {name: TIC, sample_rate: 1, action: direct, tuning: {gain: 0.5}}
"""
SCENARIO = """\
pidcfg: 1
scenario: Flow
config: c.yaml
duration: 30
plants: {FIC: {model: first_order, time_constant: 2, gain: 0.03}, TIC: {model: first_order, time_constant: 2}}
"""
REMARK = "PV and SP are before the root: 25.01 at the end stands for 50.01 m3/h"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """A command in a folder with the scenario; `root` says whether FIC takes the root of its PV."""
    monkeypatch.chdir(tmp_path)

    def run(*args, root="true"):
        Path("c.yaml").write_text(CONFIG.replace("ROOT", root), "utf-8")
        Path("s.yaml").write_text(SCENARIO, "utf-8")
        return CliRunner().invoke(cli, args, catch_exceptions=False)

    return run


def test_a_trend_comes_with_a_note(run):
    assert f"t.csv: FIC: {REMARK}\n" in run("simulate", "s.yaml", "--trend", "t.csv").stderr
    assert "root" not in run("simulate", "s.yaml", "--trend", "t.csv", "--force", root="false").stderr
    assert "root" not in run("simulate", "s.yaml", "--trend", "t.csv", "--force", "--quiet").stderr


@pytest.mark.parametrize("page", [(), ("-o", "r.html")])
def test_the_table_of_signals_has_a_remark(run, page):
    run("report", "s.yaml", "--tables", "t", *page)
    with Path("t/signals.csv").open(encoding="utf-8-sig", newline="") as file:
        remarks = {row["Signal"]: row["Remark"] for row in csv.DictReader(file)}
    assert remarks == {
        "FIC.PV": REMARK,
        "FIC.SP": REMARK,
        "FIC.OUT": "",
        "FIC.BIAS": "",
        "TIC.PV": "",
        "TIC.SP": "",
        "TIC.OUT": "",
        "TIC.BIAS": "",
    }
