"""Makes build/pidcfg-kit-VERSION.zip, for computers without a network: ``python tasks.py kit``.

``--check`` unpacks it and tries it (``check.py``).
"""

from __future__ import annotations

import hashlib
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import pidcfg
from kit.start import NEWEST, OLDEST

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BUILD = ROOT / "build"
NAME = f"pidcfg-kit-{pidcfg.__version__}"
KIT = BUILD / f"{NAME}.zip"
LOCKS = ("run", "report", "live", "lsp")
PYTHONS = [f"{OLDEST[0]}.{minor}" for minor in range(OLDEST[1], NEWEST[1] + 1)]
SYSTEMS = {
    "Windows": ("win_amd64",),
    "Linux": ("manylinux2014_x86_64", "manylinux_2_27_x86_64", "manylinux_2_28_x86_64"),
}
"""Tags of the files that the kit has; those of Linux run on Debian 11, Ubuntu 20.04 and Red Hat 8 or newer."""
EPOCH = (1980, 1, 1, 0, 0, 0)
WHATIF = ROOT / "examples/dl06/reactor.scenario.yaml"


def locked() -> dict[str, tuple[str, list[str]]]:
    """What the kit installs: each requirement with its marker, and the hashes that its files may have."""
    found: dict[str, tuple[str, list[str]]] = {}
    for lock in LOCKS:
        text = (ROOT / "requirements" / f"{lock}.txt").read_text("utf-8").replace("\\\n", " ")
        for line in text.splitlines():
            requirement, *hashes = (part.strip() for part in line.split("--hash=sha256:"))
            name = requirement.partition("==")[0]
            if hashes:
                found[name] = (requirement, hashes)
    return dict(sorted(found.items()))


def run(*command: str | Path) -> None:
    """A program; ends the task with what it wrote where it fails."""
    done = subprocess.run(list(map(str, command)), cwd=ROOT, check=False, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")


def sha256(path: Path) -> str:
    """The sum of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def fill_wheelhouse(wheels: Path) -> None:
    """Downloads every file that one of the Pythons on one of the systems installs, and builds that of pidcfg."""
    with tempfile.TemporaryDirectory() as name:
        listed = Path(name) / "requirements.txt"
        rows = [
            f"{requirement.partition(' ;')[0]} {' '.join(f'--hash=sha256:{one}' for one in hashes)}\n"
            for requirement, hashes in locked().values()
        ]
        listed.write_text("".join(rows), "utf-8")
        pip = ("-m", "pip", "download", "--quiet", "--no-deps", "--require-hashes", "--only-binary", ":all:")
        for tags in SYSTEMS.values():
            platforms = [word for tag in tags for word in ("--platform", tag)]
            for version in PYTHONS:
                python = ("--implementation", "cp", "--python-version", version)
                run(sys.executable, *pip, *platforms, *python, "-d", wheels, "-r", listed)
    run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", wheels)


def requirements(wheels: Path) -> str:
    """What start.py installs, each file by its sum: nothing else can be put in its place."""
    there: dict[str, list[str]] = {}
    for path in sorted(wheels.glob("*.whl")):
        there.setdefault(re.sub(r"[-_.]+", "-", path.name.split("-")[0]).lower(), []).append(sha256(path))
    lines = [(requirement, there[name]) for name, (requirement, _) in locked().items()]
    lines.append((f"pidcfg=={pidcfg.__version__}", there["pidcfg"]))
    return "".join(
        " \\\n    ".join([requirement, *(f"--hash=sha256:{one}" for one in hashes)]) + "\n"
        for requirement, hashes in lines
    )


def collect(kit: Path) -> None:
    """All files of the kit but their sums."""
    runtime = BUILD / "whatif" / "whatif-runtime.zip"
    for needed, task in ((BUILD / "site" / "index.html", "docs"), (runtime, "whatif-runtime")):
        if not needed.exists():
            sys.exit(f"{needed} is missing; python tasks.py {task} makes it")
    (kit / "wheels").mkdir()
    fill_wheelhouse(kit / "wheels")
    (kit / "requirements.txt").write_text(requirements(kit / "wheels"), "utf-8", newline="\n")
    shutil.copytree(BUILD / "site", kit / "site", ignore=shutil.ignore_patterns(".buildinfo", ".doctrees"))
    shutil.copytree(ROOT / "docs" / "schemas", kit / "schemas")
    shutil.copytree(ROOT / "examples", kit / "examples", ignore=shutil.ignore_patterns("golden"))
    shutil.copy(runtime, kit)
    page = ("whatif", WHATIF, "-o", kit / "whatif.html", "--runtime", runtime, "--quiet")
    run(sys.executable, "-m", "pidcfg", *page)
    for path in (HERE / "start.py", HERE / "pidcfg", ROOT / "LICENSE", ROOT / "requirements" / "pidcfg.cdx.json"):
        shutil.copy(path, kit)
    facts = {"version": pidcfg.__version__, "oldest": PYTHONS[0], "newest": PYTHONS[-1]}
    texts = {"pidcfg.cmd": (HERE / "pidcfg.cmd").read_text("utf-8")}
    texts["READ-ME.txt"] = (HERE / "read-me.txt").read_text("utf-8").format(**facts)
    for name, text in texts.items():
        (kit / name).write_text(text, "utf-8", newline="\r\n")  # as Windows has them


def sums_of(kit: Path) -> str:
    """The sums of all files, as `sha256sum -c` reads them."""
    files = sorted(path for path in kit.rglob("*") if path.is_file() and path.name != "SHA256SUMS")
    return "".join(f"{sha256(path)}  {path.relative_to(kit).as_posix()}\n" for path in files)


def pack(files: Iterable[Path], kit: Path, target: Path) -> None:
    """The kit as one file; the same files give the same bytes."""
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(files):
            entry = zipfile.ZipInfo(f"{NAME}/{path.relative_to(kit).as_posix()}", EPOCH)
            mode = 0o755 if path.name == "pidcfg" else 0o644
            entry.external_attr = (0o100000 | mode) << 16
            stored = path.suffix in {".whl", ".zip", ".png"}
            archive.writestr(entry, path.read_bytes(), zipfile.ZIP_STORED if stored else zipfile.ZIP_DEFLATED)


def make() -> None:
    """Makes the kit."""
    with tempfile.TemporaryDirectory() as name:
        kit = Path(name)
        collect(kit)
        (kit / "SHA256SUMS").write_text(sums_of(kit), "utf-8", newline="\n")
        pack((path for path in kit.rglob("*") if path.is_file()), kit, KIT)
        count = len([*(kit / "wheels").iterdir()])
    Path(f"{KIT}.sha256").write_text(f"{sha256(KIT)}  {KIT.name}\n", "utf-8", newline="\n")
    print(f"{KIT}: {KIT.stat().st_size / 1e6:.0f} MB, {count} wheels for Python {PYTHONS[0]} to {PYTHONS[-1]}")


def main(arguments: Sequence[str]) -> None:
    """Makes the kit, or tries the one that was made."""
    if not {*arguments} <= {"--check"}:
        sys.exit(__doc__)
    if not arguments:
        make()
        return
    if not KIT.exists():
        sys.exit(f"{KIT} is not there; python tasks.py kit makes it")
    from kit.check import check

    check(KIT)


if __name__ == "__main__":
    main(sys.argv[1:])
