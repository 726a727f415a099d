"""A ring of masters is told at each of its loops, with the others alone."""

from __future__ import annotations

from case_messages import FOLDER
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document


def test_each_loop_of_a_ring_is_told_with_the_others():
    case = FOLDER / "GN833.yaml"
    found = check_document(read_document(case.read_bytes(), case.name)).findings
    rings = {d.loop: sorted(d.with_loops) for d in found if d.code == "GN833"}
    assert rings == {"A": ["B", "C"], "B": ["A", "C"], "C": ["A", "B"]}
