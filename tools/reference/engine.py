"""What the engine makes of a scenario, base step by base step: what its controllers measured and what they show."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from types import SimpleNamespace

from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.engine.run import Settings, simulate
from pidcfg.study.scenario import load_scenario
from pidcfg.text.reader import DEFAULT, Texts
from pidcfg.text.source import read_document

CONFIGURATION, SCENARIO = "case.yaml", "case.scenario.yaml"
CONTROLLER = ("Options", "Config", "State", "load", "INLINED", "COST")
"""What the runner wants of a controller beside its scan."""


@dataclass
class Inputs:
    """What reaches the controllers: the same for the engine and for a reference.

    ``rows``: of each base step the measurement of each loop as ``LOOP.PV`` in engineering units, before any rounding,
    and every signal of the PLC's program that comes from outside, by its name. Base steps are ``step`` microseconds
    apart; ``lead`` of them come before time 0, where a scenario begins steady.
    """

    step: int = 0
    lead: int = 0
    rows: list[dict[str, float]] = field(default_factory=list)

    def due(self, scenario, row):
        """The events of a scenario that take effect at a base step, in the order of the file (D82)."""
        return [e for e in scenario.get("events", ()) if self.lead - (-round(e["at"] * TICKS) // self.step) == row]


def first_outputs(scenario):
    """The output that each loop starts with, where a scenario says so."""
    initial = scenario.get("initial", {})
    return initial if isinstance(initial, dict) else {}


def texts_of(configuration, scenario):
    """A case as the texts of two files; JSON is YAML, too."""
    head = {"pidcfg": 1, "scenario": "case", "config": CONFIGURATION}
    return {CONFIGURATION: json.dumps(configuration), SCENARIO: json.dumps(head | scenario)}


def trace(configuration, scenario):
    """Runs a scenario on the engine: its `Inputs`, and of each base step what the PLC shows.

    That is every signal of the PLC by its name, ``LOOP.mode``, every alarm and flag as ``LOOP.pv_high``, and all of
    them as the numbers ``LOOP.status`` and ``LOOP.aux_status``. Both arguments are plain data as `json` writes them;
    times are seconds.
    """
    texts = texts_of(configuration, scenario)
    loaded = load_scenario(read_document(texts[SCENARIO].encode(), SCENARIO, DEFAULT), Texts(texts))
    assert loaded.image is not None, [f"{d.code} {d.message}" for d in loaded.findings]
    plc = loaded.new_plc()
    inputs, samples = Inputs(), []
    bits = [*plc.alarm_bits.items(), *plc.flag_bits.items()]

    def scan(tick, configs, states, aux, signal_values):
        if tick == 0:  # once more, where a network has not settled
            inputs.rows.clear()
            samples.clear()
        measured = {f"{loop}.PV": signal_values[c.in_slot] for loop, c in zip(plc.loops, configs, strict=False)}
        inputs.rows.append(measured | {name: signal_values[slot] for name, slot in plc.inputs.items()})
        loaded.controller.scan(tick, configs, states, aux, signal_values)
        shown = {name: signal_values[slot] for slot, name in enumerate(plc.signals) if name}
        for loop, s in zip(plc.loops, states, strict=False):
            shown |= {f"{loop}.status": s.status, f"{loop}.aux_status": s.aux_status}
            shown |= {f"{loop}.{name}": s.status & mask != 0 for name, mask in bits}
            shown[f"{loop}.mode"] = plc.mode(s.status)
        samples.append(shown)

    controller = SimpleNamespace(**{name: getattr(loaded.controller, name) for name in CONTROLLER}, scan=scan)
    report = simulate(loaded.scenario, loaded.new_plc, controller, Settings("python"))
    inputs.step = round(report.step * TICKS)
    inputs.lead = len(samples) - report.steps
    assert inputs.lead == 0 or scenario.get("initial") == "steady"
    return inputs, samples
