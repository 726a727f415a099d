"""``pidcfg whatif``: one HTML file in which gains are turned and the words run, without a server."""

from __future__ import annotations

import posixpath
from pathlib import Path

import click

from pidcfg.cli import options
from pidcfg.cli.console import write_remark
from pidcfg.cli.inputs import RememberedFiles, readable_input
from pidcfg.cli.outputs import write_files
from pidcfg.text.reader import SUFFIXES, Limits

EPILOG = options.examples_text(
    "pidcfg whatif reactor.scenario.yaml -o whatif.html",
    "pidcfg whatif reactor.scenario.yaml -o whatif.html --against reactor-2.yaml",
    "pidcfg whatif reactor.scenario.yaml -o whatif.html --runtime whatif-runtime.zip",
)
PAGE_SUFFIXES = (".html", ".htm")


def page_name(ctx: click.Context, param: click.Parameter, name: str) -> str:
    """The name of a page."""
    if Path(name).suffix.lower() not in PAGE_SUFFIXES:
        raise click.BadParameter(f"{name!r}; write a name that ends in {' or '.join(PAGE_SUFFIXES)}", ctx, param)
    return name


class RecordedFiles(RememberedFiles):
    """The files of the disk, kept as they are read."""

    def __init__(self) -> None:
        self.contents: dict[str, bytes] = {}

    def read(self, name: str, max_bytes: int) -> bytes:
        """The first bytes of a file."""
        data = super().read(name, max_bytes)
        self.contents[name] = data
        return data


@click.command("whatif", epilog=EPILOG)
@click.argument("scenario", metavar="SCENARIO", callback=options.refuse_dash)
@click.option("-o", "--output", "out", metavar="FILE", required=True, callback=page_name, help="The page.")
@click.option(
    "--against",
    metavar="CONFIG",
    callback=options.refuse_dash,
    help="Another configuration, which the page shows dashed in the place of the one as filed.",
)
@click.option(
    "--runtime",
    metavar="FILE",
    callback=options.refuse_dash,
    help="Python for the browser; without it the one in the user's cache, where 'python tasks.py whatif-runtime' "
    "puts it.",
)
@options.FORCE_OPTION
@options.QUIET_OPTION
@options.LIMITS_OPTION
def command(
    scenario: str, out: str, against: str | None, runtime: str | None, force: bool, quiet: bool, limits: Limits
) -> None:
    """Write a page in which the gains, the events and the plants of SCENARIO can be turned, and the PLC's words run.

    It is one file that opens by a double click: Python, pidcfg and the files are in it. No server, no network, nothing
    leaves the page. Sliders snap to what the registers hold; the page shows the trend now against as filed, overshoot,
    IAE and Ms, the words that change, and findings.

    Exit codes: 0 the page was written, 2 a scenario that cannot run, or no Python for the browser.
    """
    from pidcfg.output.browser.page import RuntimeFileError, read_runtime, runtime_path, whatif_page
    from pidcfg.output.browser.session import Session, UnusableError

    name, files = read_page_files(scenario, against, limits)
    against_name = None if against is None else relative_name(against, scenario)
    try:
        session = Session(name, files, against_name)
        page = whatif_page(session, read_runtime(Path(runtime) if runtime is not None else runtime_path()))
    except (UnusableError, RuntimeFileError, OSError) as error:
        raise click.ClickException(str(error)) from None
    write_files({out: page}, force=force)
    if not quiet:
        write_remark(f"{out}: {len(page) / 1e6:.1f} MB; open it with a double click")


def read_page_files(scenario: str, against: str | None, limits: Limits) -> tuple[str, dict[str, str]]:
    """The scenario's name from its own folder, and by such names every file that the page needs."""
    from pidcfg.api import check

    for name in (scenario, against):
        if name is not None:
            readable_input(name, limits)
    if against is not None and Path(against).suffix.lower() not in SUFFIXES:
        raise click.ClickException(f"{against} is no configuration; name a .yaml file")
    files = RecordedFiles()
    check(Path(scenario), files=files, limits=limits)
    if against is not None:
        files.read(Path(against).as_posix(), limits.listing_bytes + 1)
    texts = {relative_name(name, scenario): data.decode("utf-8", "replace") for name, data in files.contents.items()}
    return relative_name(scenario, scenario), texts


def relative_name(name: str, scenario: str) -> str:
    """A name from the folder of the scenario: a page says nothing of the folders above it."""
    folder = posixpath.dirname(Path(scenario).as_posix()) or "."
    return posixpath.relpath(Path(name).as_posix(), folder)
