"""Starts pidcfg from the kit: installs it at the first time, then opens a report, a prompt, or runs a command.

Stands in the kit beside pidcfg.cmd and pidcfg, which call it; needs nothing but Python.
"""

from __future__ import annotations

import hashlib
import os
import platform
import struct
import subprocess
import sys
import tempfile
import webbrowser
from pathlib import Path

HERE = Path(__file__).resolve().parent
SUMS = HERE / "SHA256SUMS"
WINDOWS = os.name == "nt"
OLDEST, NEWEST = (3, 11), (3, 14)
"""The Pythons that the kit has files for."""
MACHINES = ("amd64", "x86_64")
SHOWN = 5
"""Of damaged files, the first ones are named."""


def refused() -> str:
    """Why this computer cannot use the kit; empty where it can."""
    suits = OLDEST <= sys.version_info[:2] <= NEWEST and struct.calcsize("P") == 8
    if suits and platform.machine().lower() in MACHINES and sys.platform in {"win32", "linux"}:
        return ""
    here = f"Python {platform.python_version()} on {platform.system()} {platform.machine()}"
    oldest, newest = (".".join(map(str, one)) for one in (OLDEST, NEWEST))
    return f"the kit has files for Python {oldest} to {newest} on Windows and Linux, 64 bit (x86_64); this is {here}"


def sums() -> dict[str, str]:
    """SHA-256 of every file of the kit as it was packed."""
    rows = (line.split("  ", 1) for line in SUMS.read_text("utf-8").splitlines())
    return {name: digest for digest, name in rows}


def damaged() -> list[str]:
    """The files that are not as they were packed, or not there."""
    found = []
    for name, digest in sums().items():
        try:
            same = hashlib.sha256((HERE / name).read_bytes()).hexdigest() == digest
        except OSError:
            same = False
        if not same:
            found.append(name)
    return found


def home() -> Path:
    """Where this kit is installed: a folder of the user, another one for every kit and Python."""
    base = os.environ.get("LOCALAPPDATA") if WINDOWS else os.environ.get("XDG_DATA_HOME")
    folder = Path(base) if base else Path.home() / ".local" / "share"
    mark = hashlib.sha256(SUMS.read_bytes()).hexdigest()[:12]
    return folder / "pidcfg-kit" / "{}-{}.{}".format(mark, *sys.version_info[:2])


def scripts(folder: Path) -> Path:
    """Where an environment has its programs."""
    return folder / ("Scripts" if WINDOWS else "bin")


def install(folder: Path) -> None:
    """Installs from the kit into an environment, unless that was done before; ends where it cannot."""
    stamp = folder / "pidcfg-kit.stamp"
    if stamp.is_file():
        return
    if why := refused():
        sys.exit(why)
    if wrong := damaged():
        more = f" and {len(wrong) - SHOWN} more" if len(wrong) > SHOWN else ""
        sys.exit(f"not as they were packed: {', '.join(wrong[:SHOWN])}{more}; copy the kit again")
    print(f"installing pidcfg into {folder} (once)", flush=True)
    if subprocess.run([sys.executable, "-m", "venv", "--clear", str(folder)], check=False).returncode:
        sys.exit("no virtual environment could be made; on Debian and Ubuntu the package python3-venv is missing")
    python = scripts(folder) / ("python.exe" if WINDOWS else "python")
    pip = [str(python), "-m", "pip", "--isolated", "--disable-pip-version-check", "install", "--quiet", "--no-index"]
    files = [
        "--find-links",
        str(HERE / "wheels"),
        "--no-deps",
        "--require-hashes",
        "-r",
        str(HERE / "requirements.txt"),
    ]
    if subprocess.run([*pip, *files], check=False).returncode:
        sys.exit("pidcfg could not be installed")
    stamp.write_text(f"{HERE}\n", "utf-8")


def environment(folder: Path) -> dict[str, str]:
    """The variables that pidcfg runs with: its programs first on the PATH, and Python for what-if pages."""
    found = {**os.environ, "PATH": os.pathsep.join([str(scripts(folder)), os.environ.get("PATH", "")])}
    runtime = HERE / "whatif-runtime.zip"
    if runtime.is_file():
        found.setdefault("PIDCFG_WHATIF_RUNTIME", str(runtime))
    return found


def is_dropped(words: list[str]) -> bool:
    """Whether the arguments are files and folders as a file manager hands them over: by their whole paths."""
    return bool(words) and all(Path(word).is_absolute() and Path(word).exists() for word in words)


def report_place(words: list[str]) -> Path:
    """The report's file: beside what was dropped, or in the folder for temporary files where nothing may be written."""
    first = Path(words[0])
    folder = first if first.is_dir() else first.parent
    name = f"{first.stem}.report.html" if first.is_file() and len(words) == 1 else "pidcfg-report.html"
    try:
        with tempfile.TemporaryFile(dir=folder):
            return folder / name
    except OSError:
        return Path(tempfile.gettempdir()) / name


def report(program: str, words: list[str], variables: dict[str, str]) -> int:
    """Makes the report and opens it; errors of the configuration stand in it."""
    place = report_place(words)
    code = subprocess.run([program, "report", "-o", str(place), "--force", "--", *words], check=False, env=variables)
    if code.returncode in {0, 1}:
        print(place)
        webbrowser.open(place.as_uri())
    elif sys.stdin is not None and sys.stdin.isatty():
        input("Enter closes this window. ")
    return code.returncode


def prompt(program: str, variables: dict[str, str]) -> int:
    """A prompt in which pidcfg works; where nobody types, its help."""
    if sys.stdin is None or not sys.stdin.isatty():
        return subprocess.run([program, "--help"], check=False, env=variables).returncode
    print("pidcfg --help shows the commands; exit closes the prompt.", flush=True)
    shell = [os.environ.get("COMSPEC", "cmd.exe"), "/k"] if WINDOWS else [os.environ.get("SHELL", "/bin/sh")]
    return subprocess.run(shell, check=False, env=variables).returncode


def main(words: list[str]) -> int:
    """Does what was asked for, and says how it ended."""
    folder = home()
    install(folder)
    program, variables = str(scripts(folder) / ("pidcfg.exe" if WINDOWS else "pidcfg")), environment(folder)
    if is_dropped(words):
        return report(program, words, variables)
    if not words:
        return prompt(program, variables)
    return subprocess.run([program, *words], check=False, env=variables).returncode


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)
