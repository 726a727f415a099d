"""The decisions of the virtual EZLogix are numbered without a gap, and each is named where it is carried out."""

from __future__ import annotations

from pathlib import Path

import pytest

from pidcfg.sim.controllers import ezlogix as ezlogix_decisions
from pidcfg.sim.controllers.ezlogix import ENGINE

FOLDER = Path(ezlogix_decisions.__file__).parent


def test_numbers_go_on_without_a_gap():
    assert [decision.number for decision in ENGINE] == [*range(160, 180), 623, 670, 672]


@pytest.mark.parametrize("decision", ENGINE, ids=lambda decision: f"D{decision.number}")
def test_a_decision_is_named_where_it_is_carried_out(decision):
    text = "".join(m.read_text("utf-8") for m in sorted(FOLDER.glob("*.py")) if m.name != "decisions.py")

    assert f"D{decision.number}" in text
