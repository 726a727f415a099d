"""The public functions of the package."""

from __future__ import annotations

from pathlib import Path

import pytest

import pidcfg

REACTOR = Path(__file__).parents[1] / "examples" / "dl06" / "reactor.yaml"


def test_a_file_gives_its_findings_and_its_words():
    checked = pidcfg.check_file(REACTOR)
    assert not checked.failed
    assert checked.encoding.image.words[0o2007] == 0x0020


def test_text_with_a_mistake_gives_a_finding_and_no_exception():
    checked = pidcfg.check_text("pidcfg: 1\nvendor: dl06\nplc: {loop_table: V2008}\nloops: []\n")
    assert [(d.code, d.span.line) for d in checked.findings] == [("PID029", 3)]
    assert checked.encoding is None


def test_words_come_back_as_data():
    words = pidcfg.check_file(REACTOR).encoding.image.words
    assert pidcfg.decode_words("dl06", words).data["loops"][0]["tuning"]["gain"] == 0.8


def test_unknown_names_are_attribute_errors():
    with pytest.raises(AttributeError):
        _ = pidcfg.nothing
