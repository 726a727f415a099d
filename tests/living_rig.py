"""A small configuration with known findings, and the command called in this process."""

from __future__ import annotations

import sys

from pidcfg.cli.main import main

GOOD = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000, reset_decimals: 1}
loops:
  - name: A
    sample_rate: 1
    action: direct
    tuning: {gain: 1, reset: 10}
"""
TWICE = GOOD.replace("reset: 10}", "reset: 10}\n    alarms: {pv: {low_low: 15, low: 15, high: 15, high_high: 90}}")
"""Has DL242 twice and the info DL254 in line 9."""


class Outcome:
    """What a command printed, and its exit code."""

    def __init__(self, code, out, err):
        self.code, self.raw, self.err = code, out, err.decode()
        self.out = out.decode()


def run(monkeypatch, capsysbinary, *args):
    """``pidcfg validate`` with some arguments."""
    return call(monkeypatch, capsysbinary, "validate", *args)


def call(monkeypatch, capsysbinary, *args):
    """Any command with its arguments."""
    monkeypatch.setattr(sys, "argv", ["pidcfg", *map(str, args)])
    capsysbinary.readouterr()
    try:
        main()
    except SystemExit as end:
        captured = capsysbinary.readouterr()
        return Outcome(int(end.code), captured.out, captured.err)
    raise AssertionError("the command never ended")
