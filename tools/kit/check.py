"""Tries a kit as a stranger to it would: unpacked, in an environment with nothing else, without a network."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.append(str(Path(__file__).resolve().parents[2] / "tests"))

from pages import ROOT, blocks, put, skipped, steps, unlike

if TYPE_CHECKING:
    from collections.abc import Sequence

PAGE = ROOT / "docs" / "tutorial.md"
CUT_OFF = (("unshare", "--net"), ("unshare", "--map-root-user", "--net"))
"""Ways to run a program without a network: as root, and as anybody where the system lets him."""


def without_network() -> tuple[str, ...]:
    """What begins a command that has no network; nothing where this computer cannot do that."""
    if not shutil.which("unshare"):
        return ()
    return next(
        (way for way in CUT_OFF if subprocess.run([*way, "true"], check=False, capture_output=True).returncode == 0), ()
    )


def unpack(kit: Path, target: Path) -> Path:
    """The kit's folder, with the rights that its files have in it."""
    with zipfile.ZipFile(kit) as archive:
        for entry in archive.infolist():
            Path(archive.extract(entry, target)).chmod(entry.external_attr >> 16 & 0o777)
    (folder,) = target.iterdir()
    return folder


class Stranger:
    """Somebody who has Python, the kit and an empty home."""

    def __init__(self, kit: Path, work: Path) -> None:
        self.home, self.work = work / "home", work / "work"
        self.folder = unpack(kit, work / "kit")
        tools = work / "tools"
        for path in (self.home, self.work, tools):
            path.mkdir()
        (tools / "python3").symlink_to(Path(sys.base_prefix) / "bin" / "python3")
        self.opened = work / "opened.txt"
        browser = tools / "browser"
        browser.write_text(f'#!/bin/sh\necho "$1" >> "{self.opened}"\n', "utf-8")
        browser.chmod(0o755)
        self.path = f"{tools}:/usr/bin:/bin"
        self.variables = {"HOME": str(self.home), "PATH": self.path, "BROWSER": str(browser), "LC_ALL": "C.UTF-8"}
        self.begin = without_network()

    def run(self, *words: str | Path, code: int = 0, folder: Path | None = None) -> str:
        """What a program prints; ends the check where it ends otherwise than it should."""
        command = [*self.begin, *map(str, words)]
        done = subprocess.run(
            command,
            cwd=folder or self.work,
            env=self.variables,
            check=False,
            text=True,
            encoding="utf-8",
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        if done.returncode != code:
            sys.exit(f"{' '.join(map(str, words))} ends with {done.returncode}, not {code}\n{done.stdout}")
        return done.stdout

    def installed(self) -> Path:
        """Where the kit has put its programs."""
        (stamp,) = self.home.rglob("pidcfg-kit.stamp")
        return stamp.parent / "bin"


def follow_tutorial(stranger: Stranger) -> int:
    """Does what the tutorial says, with the kit's pidcfg; how many commands those were."""
    stranger.variables["PATH"] = f"{stranger.installed()}:{stranger.path}"
    here, code, count, before = stranger.work, 0, 0, Path.cwd()
    for block in blocks(PAGE.read_text("utf-8")):
        if block.file and block.language != "console":
            os.chdir(here)
            put(block)
            os.chdir(before)
        for step in steps(block) if block.language == "console" else ():
            if skipped(step.command):
                continue
            if step.command == "echo $?":
                shown = f"{code}\n"
            else:
                printed = stranger.run("sh", "-c", f'{step.command}\nprintf "\\n%s %s\\n" "$?" "$PWD"', folder=here)
                shown, _, last = printed.rstrip("\n").rpartition("\n")
                code, here = int(last.partition(" ")[0]), Path(last.partition(" ")[2])
            count += 1
            if step.shown and (wrong := unlike(step.shown, shown)):
                sys.exit(f"{PAGE.name}, line {step.begin}: $ {step.command}\n{wrong}\n\n{shown}")
    stranger.variables["PATH"] = stranger.path
    return count


def drop(stranger: Stranger, *words: Path, code: int = 0) -> Path:
    """Drops files and folders on the kit's command; the report that opened."""
    stranger.opened.unlink(missing_ok=True)
    stranger.run(stranger.folder / "pidcfg", *words, code=code)
    (address,) = stranger.opened.read_text("utf-8").splitlines()
    page = Path(address.removeprefix("file://").replace("%20", " "))
    if "<title>" not in page.read_text("utf-8"):
        sys.exit(f"{page} is no page")
    return page


def check(kit: Path) -> None:
    """Tries the kit; ends with what does not hold."""
    with tempfile.TemporaryDirectory() as name:
        stranger = Stranger(kit, Path(name))
        folder = stranger.folder
        how = "without a network" if stranger.begin else "WITH a network: this computer cannot take it away"
        print(f"an empty environment, {how}")
        stranger.run("sha256sum", "--quiet", "-c", "SHA256SUMS", folder=folder)
        print(f"{len((folder / 'SHA256SUMS').read_text('utf-8').splitlines())} sums hold")
        first = stranger.run(folder / "pidcfg", "--version")
        print(first.strip().splitlines()[-1])
        print(f"{follow_tutorial(stranger)} commands of the tutorial print what it shows")
        shutil.copytree(folder / "examples", stranger.work / "my loops")
        dropped: list[tuple[Sequence[str], int]] = [
            (["click/tank.yaml"], 0),
            (["mistakes/oven.yaml"], 1),
            (["dl06"], 0),
            (["click/tank.yaml", "dpide/oven.yaml"], 0),
        ]
        for names, code in dropped:
            page = drop(stranger, *(stranger.work / "my loops" / one for one in names), code=code)
            print(f"{', '.join(names)} dropped: {page.name} opened")
        stranger.run(folder / "pidcfg", "whatif", folder / "examples/click/tank.scenario.yaml", "-o", "whatif.html")
        stranger.run(folder / "pidcfg", "lsp", "--help")
        print("a what-if page is made")
        wheel = next((folder / "wheels").glob("pidcfg-*.whl"))
        wheel.write_bytes(wheel.read_bytes()[:-1])
        shutil.rmtree(stranger.home)
        stranger.home.mkdir()
        said = stranger.run(folder / "pidcfg", "--version", code=1)
        if not re.search(r"not as they were packed: wheels/pidcfg-", said):
            sys.exit(f"a damaged file is not told:\n{said}")
        print("a damaged file is refused")
