"""What the writer writes is read back as it was."""

from __future__ import annotations

import pytest

from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text


@pytest.mark.parametrize(
    "text",
    [
        "0?",
        "a?b",
        "?x",
        "?",
        "? x",
        "it's?",
        "a?\tb",
        "0:",
        ": x",
        "0#",
        "a #b",
        "0,",
        "a, b",
        "{",
        "]",
        "&a",
        "*a",
        "!a",
        "%a",
        ":",
        ":a",
        "a:b",
        "a::b",
        "a :b",
        "@a",
        "`a",
        "- a",
        "|",
        ">",
        '"a',
        "'a",
        "a'?",
        "\u00b0C?",
    ],
)
def test_a_text_comes_back_in_short_mappings_and_in_long_ones(text):
    data = {"name": text, "loops": [{"name": "A", "pv": {"unit": text}, "list": [text, text], "description": text}]}
    document = read_document(yaml_text(data).encode(), "x.yaml")

    assert document.problems == ()
    assert document.data == data
