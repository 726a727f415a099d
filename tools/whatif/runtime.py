"""Collect Python for the browser from npm and PyPI into one file: `python tasks.py whatif-runtime`."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import pidcfg
from pidcfg.output.browser.page import RUNTIME_FILE, runtime_entries, runtime_path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
WHEELS = ("annotated-types", "pydantic", "pydantic-core", "ruamel-yaml", "typing-extensions", "typing-inspection")
"""What pidcfg needs of requirements/run.txt to check and to run; their versions and hashes stand there."""
PLATFORM = ("--platform", "pyemscripten_2026_0_wasm32", "--implementation", "cp", "--python-version", "314")
TAGS = ("--abi", "cp314", "--abi", "none")
EPOCH = (1980, 1, 1, 0, 0, 0)


def run(*command: str | Path, folder: Path = ROOT) -> None:
    """A program; ends the task with what it wrote where it fails."""
    program = shutil.which(str(command[0]))
    if program is None:
        sys.exit(f"{command[0]} is not installed; it is needed to make {RUNTIME_FILE}, not to use it")
    done = subprocess.run([program, *map(str, command[1:])], cwd=folder, check=False, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")


def locked() -> str:
    """The lines of the lock for the wheels."""
    text = (ROOT / "requirements" / "run.txt").read_text("utf-8").replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line.partition("==")[0] in WHEELS]
    if len(lines) != len(WHEELS):
        sys.exit(f"requirements/run.txt has not all of {', '.join(WHEELS)}")
    return "\n".join(lines)


def main() -> None:
    """Makes the file in build/whatif and in the user's cache."""
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        for file in ("package.json", "package-lock.json"):
            shutil.copy(HERE / file, work)
        run("npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", folder=work)
        pyodide = work / "node_modules" / "pyodide"
        (work / "wheels.txt").write_text(locked(), "utf-8")
        pip = ("-m", "pip", "download", "--quiet", "--no-deps", "--require-hashes", "--only-binary", ":all:")
        run(sys.executable, *pip, *PLATFORM, *TAGS, "--dest", work / "wheels", "-r", work / "wheels.txt")
        shutil.copytree(Path(pidcfg.__file__).parent, work / "source", ignore=shutil.ignore_patterns("__pycache__"))
        run("node", HERE / "compile.mjs", pyodide, work)
        lock = json.loads((pyodide / "pyodide-lock.json").read_text("utf-8"))
        made = {name: (pyodide / name).read_bytes() for name in ("pyodide.mjs", "pyodide.asm.mjs", "pyodide.asm.wasm")}
        made |= {name: (work / name).read_bytes() for name in ("stdlib.zip", "site.zip", "core.zip")}
        made["pyodide-lock.json"] = json.dumps({"info": lock["info"], "packages": {}}).encode()
        compiled = {path.stem: path.read_bytes() for path in (work / "compiled").glob("*.pyc")}
        versions = {"pyodide": json.loads((pyodide / "package.json").read_text("utf-8"))["version"]}
        versions |= {"python": lock["info"]["python"]}
        versions |= dict(re.findall(r"^([a-z-]+)==([^ ;]+)", locked(), re.MULTILINE))
        rows = runtime_entries(versions, made, compiled)
    built = ROOT / "build" / "whatif" / RUNTIME_FILE
    built.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(built, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for entry, data in rows.items():
            archive.writestr(zipfile.ZipInfo(entry, EPOCH), data, zipfile.ZIP_DEFLATED)
    place = runtime_path()
    shutil.copy(built, place)
    print(f"{place} and {built}: {built.stat().st_size / 1e6:.1f} MB, Pyodide {versions['pyodide']}")


if __name__ == "__main__":
    main()
