"""A key with another name: where it may be renamed, and what an alias shares."""

from __future__ import annotations

import pytest

from pidcfg.text.source import read_document
from pidcfg.validate.schema import _rename, of_key, of_value


def test_a_mapping_that_an_alias_shares_is_renamed_by_either_path():
    shared = {"gian": 1}
    data = {"a": shared, "b": shared}
    assert _rename(data, ("a", "gian"), "gain") is True
    assert _rename(data, ("b", "gian"), "gain") is True
    assert data == {"a": {"gain": 1}, "b": {"gain": 1}}


@pytest.mark.parametrize("mapping", [{"gian": 1, "gain": 2}, {"gian": None}, {"other": 1}])
def test_a_key_that_is_taken_or_has_no_value_or_is_not_there_is_not_renamed(mapping):
    data = {"a": {**mapping}}
    assert _rename(data, ("a", "gian"), "gain") is False
    assert data == {"a": mapping}


TEXT = """\
plain: 1
'quoted': &here [2, 3]
? long
: 4
&mark named: 5
text: "a
  b"
"""


@pytest.mark.parametrize(
    ("path", "key", "value"),
    [
        (("plain",), ("new", 1, 1), ("x", 1, 8)),
        (("quoted",), ("'new'", 2, 1), None),
        ((), None, None),
        (("named",), None, ("x", 5, 14)),
        (("text",), ("new", 6, 1), None),
        (("missing",), None, None),
    ],
)
def test_an_edit_is_for_one_line_without_an_anchor(path, key, value):
    doc = read_document(TEXT.encode(), "a.yaml")

    def shown(edits):
        return next(((edit.text, edit.span.line, edit.span.column) for edit in edits), None)

    assert (shown(of_key(doc, path, "new")), shown(of_value(doc, path, "x"))) == (key, value)
