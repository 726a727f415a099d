"""The axis of an output has its whole range and its unit, also where the configuration writes neither."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from pidcfg.cli.main import cli
from pidcfg.text.source import read_document

STARTERS = Path(__file__).parents[1] / "src/pidcfg/starters"
SCENARIO = """\
pidcfg: 1
scenario: Axes
config: config.yaml
duration: 60
plants:
  {loop}: {{model: first_order, gain: 0.1, time_constant: 20, initial: 40}}
"""


def axis(text, name, folder):
    """What a picture writes beside the panel of the output: the numbers, and the title."""
    (folder / "config.yaml").write_text(text, "utf-8")
    loop = read_document(text.encode(), "config.yaml").data["loops"][0]["name"]
    (folder / "axes.scenario.yaml").write_text(SCENARIO.format(loop=loop), "utf-8")
    plot = folder / "axes.svg"
    result = CliRunner().invoke(cli, ["simulate", str(folder / "axes.scenario.yaml"), "--plot", str(plot)])
    assert plot.exists(), result.output
    texts = re.findall(r"<text[^>]*>([^<]*)", plot.read_text("utf-8"))
    end = next(i for i, text in enumerate(texts) if text.split(" ")[0] == name)
    numbers = []
    for number in reversed(texts[:end]):
        if not re.fullmatch(r"-?[0-9.]+", number):
            break
        numbers.insert(0, float(number))
    return numbers, texts[end]


@pytest.mark.parametrize(
    ("vendor", "change", "title", "ends"),
    [
        ("click", None, "CO (%)", (0, 100)),
        ("click", ("limits: [0, 100]", "limits: [40, 60]"), "CO (%)", (0, 100)),
        ("dpide", None, "MV (ms)", (0, 4000)),
    ],
)
def test_the_axis_of_an_output_has_its_whole_range(vendor, change, title, ends, tmp_path):
    text = (STARTERS / f"{vendor}.yaml").read_text("utf-8")
    if change:
        assert change[0] in text
        text = text.replace(*change)
    numbers, written = axis(text, title.split(" ")[0], tmp_path)
    assert written == title
    assert (numbers[-5], numbers[-1]) == ends
