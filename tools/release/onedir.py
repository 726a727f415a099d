"""Makes build/onedir/pidcfg, a folder that runs without Python, tries it and packs it: ``python tasks.py onedir``.

It is for the system that it is made on, and made in an environment of its own, so that no test tool lies in it. Needs
nothing but Python itself. PyInstaller finds what modules import; those that pidcfg loads by name are collected whole.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LOCKS = ("build", "run", "report", "live", "lsp", "onedir")
FOLDER = ROOT / "build" / "onedir"
WITHOUT = ("distributed", "matplotlib", "numba", "numpy", "PIL", "tkinter", "unittest", "pydoc", "setuptools", "pip")
"""What only the extras `fast` and `cluster` and pictures as PNG need, and what nobody needs to run pidcfg."""
HOOK = """\
from PyInstaller.utils.hooks import collect_data_files, collect_submodules

hiddenimports = collect_submodules("pidcfg")
datas = collect_data_files("pidcfg")
module_collection_mode = "pyz+py"
"""
"""What PyInstaller is told of pidcfg: its sources go along, since schemas and what-if pages read them."""
ENTRY = """\
from multiprocessing import freeze_support

freeze_support()

from pidcfg.__main__ import main

main()
"""
"""Begins as a command, or as one of the processes that a command of many files starts."""
TRIED = (
    ("--version",),
    ("validate", "examples/dl06/reactor.yaml", "examples/click/tank.yaml", "--severity", "error"),
    ("encode", "examples/click/tank.yaml", "--format", "nickname-csv", "-o", "{}/tank.csv"),
    ("simulate", "examples/click/tank.scenario.yaml", "--quiet"),
    ("convert", "examples/dpide/dyeing.yaml", "--to", "nextopid", "-o", "{}/dyeing.yaml"),
    ("report", "examples/click", "examples/dl06", "--jobs", "2", "-o", "{}/report.html"),
    ("certify", "examples/dpide/chiller.scenario.yaml", "--samples", "29", "--jobs", "2", "--exit-zero"),
    ("export", "examples/dl06/reactor.yaml", "-o", "{}/loops.xlsx"),
    ("init", "--from", "{}/loops.xlsx", "--vendor", "dl06", "-o", "{}/loops.yaml"),
    ("explain", "V7642=0008"),
    ("schema", "dl06"),
    ("completion", "bash"),
    ("lsp", "--help"),
    ("serve", "--help"),
)
"""Commands that load what is loaded by name; ``{}`` is a folder to write to."""


def environment(folder: Path) -> Path:
    """The Python of an environment with what goes into the folder, PyInstaller, and nothing else."""
    venv.create(folder, with_pip=True)
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    pip = (python, "-m", "pip", "--disable-pip-version-check", "install", "--quiet")
    locks = [word for name in LOCKS for word in ("-r", str(ROOT / "requirements" / f"{name}.txt"))]
    subprocess.run([*pip, "--require-hashes", *locks], check=True)
    subprocess.run([*pip, "--no-deps", "--no-build-isolation", ROOT], check=True)
    return python


def freeze(python: Path, work: Path) -> None:
    """Lets PyInstaller make the folder."""
    script = work / "command.py"
    script.write_text(ENTRY, "utf-8")
    (work / "hook-pidcfg.py").write_text(HOOK, "utf-8")
    command = [str(python), "-m", "PyInstaller", "--onedir", "--name", "pidcfg", "--noconfirm", "--clean"]
    command += ["--log-level", "WARN", "--console", "--noupx"]
    command += ["--distpath", str(FOLDER), "--workpath", str(work / "work"), "--specpath", str(work)]
    command += ["--additional-hooks-dir", str(work), "--copy-metadata", "pidcfg"]
    for name in WITHOUT:
        command += ["--exclude-module", name]
    subprocess.run([*command, str(script)], check=True)


def try_it(program: Path) -> None:
    """Runs commands in an environment that has nothing else; ends where one fails."""
    keep = ("SYSTEMROOT", "TEMP", "TMP", "USERPROFILE", "LOCALAPPDATA")
    with tempfile.TemporaryDirectory() as made:
        environment = {name: os.environ[name] for name in keep if name in os.environ}
        environment |= {"HOME": made, "PIDCFG_NO_CACHE": "1", "PYTHONUTF8": "1"}
        for words in TRIED:
            line = [word.replace("{}", made) for word in words]
            done = subprocess.run(
                [program, *line], cwd=ROOT, env=environment, check=False, capture_output=True, text=True
            )
            if done.returncode:
                sys.exit(f"pidcfg {' '.join(line)} ends with {done.returncode}\n{done.stdout}{done.stderr}")


def main() -> None:
    """Makes, tries and packs the folder."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    with tempfile.TemporaryDirectory() as work:
        freeze(environment(Path(work) / "venv"), Path(work))
    folder = FOLDER / "pidcfg"
    shutil.copy(ROOT / "LICENSE", folder)
    shutil.copy(ROOT / "requirements" / "pidcfg.cdx.json", folder)
    program = folder / ("pidcfg.exe" if os.name == "nt" else "pidcfg")
    try_it(program)
    version = subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout.split()[-1]
    name = f"pidcfg-{version}-{platform.system().lower()}-{platform.machine().lower()}"
    packed = Path(shutil.make_archive(str(FOLDER / name), "zip", FOLDER, "pidcfg"))
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    print(f"{folder}: {size / 1e6:.0f} MB, tried with {len(TRIED)} commands")
    print(f"{packed}: {packed.stat().st_size / 1e6:.0f} MB")


if __name__ == "__main__":
    main()
