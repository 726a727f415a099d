"""Listings of PLCs into which nothing was written: they are read, their faults are told, and their runs show them."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from pidcfg.cli.main import cli
from pidcfg.encoders.maps.click import TABLES
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document

STARTERS = Path(__file__).parents[1] / "src/pidcfg/starters"
SCENARIO = """\
pidcfg: 1
scenario: Nothing was written
config: fresh.csv
duration: 20
plants:
  {loop}: {{model: first_order, gain: 1, time_constant: 5, initial: 20}}
"""


def invoke(*args):
    """The command in this process."""
    return CliRunner().invoke(cli, list(map(str, args)))


def listing(vendor, folder, keep=()):
    """The starter's listing with every register 0 but for those whose fields are named; and its first loop."""
    made = invoke("encode", STARTERS / f"{vendor}.yaml", "--format", "csv", "-o", folder / "written.csv")
    assert made.exit_code == 0, made.output
    lines = []
    for line in (folder / "written.csv").read_text("utf-8").splitlines():
        parts = line.split(",")
        if len(parts) == 5 and parts[0] != "address" and not line.startswith("#") and parts[4] not in keep:
            parts[1:3] = "0" * len(parts[1]), "0"
        lines.append(",".join(parts))
    path = folder / "fresh.csv"
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


def codes(path):
    return {d.code for d in check_document(read_document(path.read_bytes(), path.name)).findings}


@pytest.mark.parametrize(("vendor", "expected"), [("click", {"CK321", "CK361", "PID101"}), ("ezlogix", {"EZ430"})])
def test_a_listing_of_zeros_is_read_and_its_faults_are_told(vendor, expected, tmp_path):
    path = listing(vendor, tmp_path)
    decoded = invoke("decode", path, "--vendor", vendor, "-o", tmp_path / "fresh.yaml")
    assert decoded.exit_code == 0, decoded.output
    assert expected <= codes(tmp_path / "fresh.yaml")


@pytest.mark.parametrize(
    ("vendor", "exit_code", "says"),
    [("click", 1, "PID error 10: sample rate"), ("ezlogix", 0, "no loop was in Auto")],
)
def test_a_listing_of_zeros_runs_as_far_as_its_plc_would(vendor, exit_code, says, tmp_path):
    listing(vendor, tmp_path)
    ran = simulate(vendor, tmp_path)
    assert ran.exit_code == exit_code, ran.output
    assert says in ran.output


def test_without_a_process_range_a_click_controls_all_the_same(tmp_path):
    """The equation does not use it (D620)."""
    zeroed = {"pv_lower", "pv_upper"}
    path = listing("click", tmp_path, keep={row.name for t in TABLES for row in t.words if row.name not in zeroed})
    decoded = invoke("decode", path, "--vendor", "click", "-o", tmp_path / "fresh.yaml")
    assert decoded.exit_code == 0, decoded.output
    found = codes(tmp_path / "fresh.yaml")
    assert "CK321" in found
    assert not found & {"CK315", "CK316", "CK333", "CK334", "CK373", "CK377", "CK384"}, "they measure by the range"
    ran = simulate("click", tmp_path)
    assert "mode auto" in ran.output
    assert invoke("diff", path, tmp_path / "written.csv", "--vendor", "click").output.count("pv.range.1") == 1
    refused = invoke("convert", tmp_path / "fresh.yaml", "--to", "dl06", "-o", tmp_path / "converted.yaml")
    assert refused.exit_code == 1
    assert "CK321" in refused.output
    assert not (tmp_path / "converted.yaml").exists()


@pytest.mark.parametrize("vendor", ["click", "ezlogix"])
def test_rest_is_not_taken_for_control(vendor, tmp_path):
    """With `initial: steady` a loop whose Auto is refused rests in Manual, which is told."""
    listing(vendor, tmp_path)
    simulate(vendor, tmp_path)
    path = tmp_path / "fresh.scenario.yaml"
    path.write_text(path.read_text("utf-8").replace("duration: 20", "duration: 20\ninitial: steady"), "utf-8")
    text = invoke("simulate", path).output
    assert ("rests in manual, though auto is meant" in text) is (vendor == "click")


def simulate(vendor, folder):
    """A run of a fresh PLC with the starter's loop."""
    loop = read_document((STARTERS / f"{vendor}.yaml").read_bytes(), "starter").data["loops"][0]["name"]
    (folder / "fresh.scenario.yaml").write_text(SCENARIO.format(loop=loop), "utf-8")
    return invoke("simulate", folder / "fresh.scenario.yaml")
