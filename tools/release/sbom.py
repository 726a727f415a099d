"""Writes requirements/pidcfg.cdx.json: the packages that a wheel of pidcfg was tested with, as CycloneDX.

``python tasks.py lock`` runs it. An environment of its own gets exactly what requirements/ locks for users, colorama
included, so that licences and who needs whom are those of the packages themselves.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
import venv
from pathlib import Path
from typing import Any

import pidcfg

ROOT = Path(__file__).resolve().parents[2]
BILL = ROOT / "requirements" / "pidcfg.cdx.json"
NEEDED, EXTRAS = "run", ("fast", "report", "png", "live", "lsp")
"""Locks for users: what every installation has, and what an extra brings."""


def locked(name: str) -> dict[str, str]:
    """Names and versions of a lock."""
    text = (ROOT / "requirements" / f"{name}.txt").read_text("utf-8")
    return dict(re.findall(r"^([a-z0-9-]+)==([^ ;\\\n]+)", text, re.MULTILINE))


def plain_name(name: str) -> str:
    """A package's name as indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def environment(folder: Path) -> Path:
    """The Python of an environment with all that is locked for users."""
    venv.create(folder, with_pip=False)
    python = folder / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    lines = []
    for name in (NEEDED, *EXTRAS):
        text = (ROOT / "requirements" / f"{name}.txt").read_text("utf-8")
        lines.append(re.sub(r" ; [^\\\n]*", " ", text))
    (folder / "all.txt").write_text("".join(lines), "utf-8")
    pip = (sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-deps", "--require-hashes")
    subprocess.run([*pip, "-r", folder / "all.txt"], check=True)
    return python


def bill_of(data: dict[str, Any]) -> dict[str, Any]:
    """What cyclonedx-py found, without links, with the version of pidcfg, and extras told from what all need."""
    own, needed = data["metadata"]["component"], locked(NEEDED)
    own |= {"version": pidcfg.__version__, "purl": f"pkg:pypi/pidcfg@{pidcfg.__version__}"}
    own.pop("externalReferences", None)
    for component in (*data["components"], *data["metadata"]["tools"]["components"]):
        component.pop("externalReferences", None)
    for component in data["components"]:
        component["scope"] = "required" if plain_name(component["name"]) in needed else "optional"
    return data


def main() -> None:
    """Makes the file."""
    with tempfile.TemporaryDirectory() as name:
        python = environment(Path(name) / "venv")
        command = (sys.executable, "-m", "cyclonedx_py", "environment", python, "--pyproject", ROOT / "pyproject.toml")
        options = (
            "--mc-type",
            "application",
            "--output-reproducible",
            "--spec-version",
            "1.6",
            "--output-format",
            "JSON",
        )
        made = subprocess.run([*command, *options], check=True, capture_output=True)
    data = bill_of(json.loads(made.stdout))
    BILL.write_text(json.dumps(data, indent=1, ensure_ascii=False, sort_keys=True) + "\n", "utf-8", newline="\n")
    print(f"{BILL.relative_to(ROOT)}: {len(data['components'])} packages")


if __name__ == "__main__":
    main()
