"""A loop that cannot be read hides nothing that is wrong with the others, and makes nothing up."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

import pidcfg

EXAMPLES = Path(__file__).parents[1] / "examples"
REMARK = "PID038"


@cache
def json_of(path: Path) -> str:
    """A file as JSON."""
    return json.dumps(YAML(typ="safe", pure=True).load(path))


def plain(path: Path) -> dict[str, Any]:
    """A file's data, to be changed."""
    data: dict[str, Any] = json.loads(json_of(path))
    return data


def loops_of(path: Path) -> int:
    """How many loops a configuration has, by the dashes below its key."""
    text = path.read_text("utf-8")
    below = re.split(r"^loops:.*\n", text, flags=re.MULTILINE)[-1]
    own = re.split(r"^[a-z]", below, maxsplit=1, flags=re.MULTILINE)[0]
    return own.count("\n  - ") + 1 if "\nvendor:" in text else 0


CONFIGS = [path for path in sorted(EXAMPLES.glob("*/*.yaml")) if loops_of(path) > 1]


def findings(data: dict[str, Any]) -> tuple[pidcfg.Finding, ...]:
    """Those of a configuration in memory."""
    return pidcfg.check(Path("x.yaml"), files={"x.yaml": json.dumps(data)}).findings


def known(rows: tuple[pidcfg.Finding, ...]) -> set[tuple[str, str, str]]:
    """What identifies findings of the rules at loops."""
    return {(d.code, d.loop, d.key) for d in rows if d.loop and not d.code.startswith("PID0")}


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_what_is_found_beside_a_broken_loop_is_true(path: Path) -> None:
    whole = known(findings(plain(path)))
    for i in range(len(plain(path)["loops"])):
        data = plain(path)
        name = data["loops"][i]["name"]
        data["loops"][i]["nonsense"] = 1
        rows = findings(data)
        assert [d.code for d in rows if d.code == REMARK] == [REMARK]
        assert known(rows) <= {row for row in whole if row[1] != name}
        alone = {row for row in whole if row[1] != name} & without(path, name)
        assert alone <= known(rows)


def without(path: Path, name: str) -> set[tuple[str, str, str]]:
    """What is found in the file without a loop: what is gone with it waits for it."""
    data = plain(path)
    data["loops"] = [loop for loop in data["loops"] if loop["name"] != name]
    return known(findings(data))


def test_an_error_of_another_loop_is_told_at_once() -> None:
    data = plain(EXAMPLES / "dl06" / "reactor.yaml")
    data["loops"][1]["pv"]["range"] = [0, "x"]
    data["loops"][2]["tuning"]["gain"] = 120.2
    assert {(d.code, d.loop) for d in findings(data) if d.severity.label == "error"} == {
        ("PID022", "TIC-101"),
        ("PID101", "LIC-103"),
    }


def test_what_two_loops_make_together_waits() -> None:
    """The minor loop names a major loop that cannot be read: it is there all the same."""
    data = plain(EXAMPLES / "dl06" / "reactor.yaml")
    data["loops"][1]["nonsense"] = 1
    assert not [d for d in findings(data) if "cascade" in d.key]


def test_two_sound_loops_of_one_name_are_told_beside_a_broken_one() -> None:
    data = plain(EXAMPLES / "dl06" / "reactor.yaml")
    data["loops"][1]["nonsense"] = 1
    data["loops"][2]["name"] = "FIC-102"
    assert "PID106" in {d.code for d in findings(data)}


@pytest.mark.parametrize("broken", [{"loops": [{"name": "A"}]}, {"plc": {"nonsense": 1}}])
def test_nothing_is_judged_where_no_loop_stands_by_itself(broken: dict[str, Any]) -> None:
    rows = findings({**plain(EXAMPLES / "dl06" / "reactor.yaml"), **broken})
    assert {d.code for d in rows} <= {"PID020", "PID021"}
