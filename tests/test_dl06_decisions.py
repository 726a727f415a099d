"""The engine's decisions are numbered without a gap, and each is named where it is carried out."""

from __future__ import annotations

from pathlib import Path

import pytest

from pidcfg.sim.controllers import dl06_decisions
from pidcfg.sim.controllers.dl06_decisions import ENGINE

SOURCE = Path(dl06_decisions.__file__).parents[2]


def test_numbers_go_on_without_a_gap():
    assert [decision.number for decision in ENGINE] == list(range(30, 30 + len(ENGINE)))


@pytest.mark.parametrize("decision", ENGINE, ids=lambda decision: f"D{decision.number}")
def test_a_decision_is_named_where_it_is_carried_out(decision):
    modules = [SOURCE / "encoders" / "dl06_setup.py", *sorted((SOURCE / "sim" / "controllers").glob("dl06*.py"))]
    text = "".join(m.read_text("utf-8") for m in modules if m.name != "dl06_decisions.py")

    assert f"D{decision.number}" in text
