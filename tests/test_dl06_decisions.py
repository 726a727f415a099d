"""The engine's decisions are numbered without a gap, and each is named where it is carried out."""

from __future__ import annotations

from pathlib import Path

import pytest

from pidcfg.sim.controllers import dl06 as dl06_decisions
from pidcfg.sim.controllers.dl06 import ENGINE

SOURCE = Path(dl06_decisions.__file__).parents[3]


def test_numbers_go_on_without_a_gap():
    assert [decision.number for decision in ENGINE] == [*range(30, 69)]


@pytest.mark.parametrize("decision", ENGINE, ids=lambda decision: f"D{decision.number}")
def test_a_decision_is_named_where_it_is_carried_out(decision):
    modules = [SOURCE / "encoders" / "dl06" / "image.py", *sorted(Path(dl06_decisions.__file__).parent.glob("*.py"))]
    text = "".join(m.read_text("utf-8") for m in modules if m.name != "__init__.py")

    assert f"D{decision.number}" in text
