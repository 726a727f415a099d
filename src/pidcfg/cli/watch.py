"""``--watch``: the command again whenever a file changes that it has read, or could have.

The disk is asked in short intervals. No notification of a system reaches a network drive, a container's mount and a
laptop alike, and a few hundred files are asked for in a millisecond.
"""

from __future__ import annotations

import glob
import os
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import click

from pidcfg.cli import terminal
from pidcfg.cli.console import print_error, system_refusal, write_note, write_remark
from pidcfg.cli.inputs import FILES_READ_KEY, NAMES_READ_KEY, STDIN, expand_patterns
from pidcfg.cli.main import Exit
from pidcfg.cli.terminal import LINE

POLL_SECONDS = 0.25
"""Seconds between two looks at the disk."""
QUIET_SECONDS = 0.1
"""Seconds without a change after which an editor has done saving."""
RENAME_SECONDS = 1.0
"""Seconds in which a file that is gone may come back: editors save by renaming."""
PAUSE_FACTOR = 20
"""A look that takes long is followed by so many times as long a pause."""
ARGUMENTS_KEY, WATCH_KEY = "pidcfg.watch.arguments", "pidcfg.watch"
EXCLUDED_OPTIONS = {
    "fix": "--fix",
    "diff": "--diff",
    "create": "--create-baseline",
    "shrink": "--shrink-baseline",
    "accept": "--accept",
}
"""Options that are no matter of looking again, by the names of their parameters."""

State = tuple[int, int, int] | None
"""What tells that a file has changed: its time, size and number; None: there is no such file."""


def _keep_option(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    """Keeps the option for `WatchCommand`."""
    del param
    ctx.meta[WATCH_KEY] = value


WATCH_OPTION = click.option(
    "--watch",
    is_flag=True,
    expose_value=False,
    callback=_keep_option,
    help="Run again whenever a file changes, until Ctrl-C; the exit code is that of the last run.",
)


class WatchCommand(click.Command):
    """A command that ``--watch`` runs again and again with the same arguments, read anew each time."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """The options; the arguments are kept for the next run."""
        ctx.meta[ARGUMENTS_KEY] = list(args)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> object:
        """One run, or one for each change."""
        if not ctx.meta.get(WATCH_KEY):
            return super().invoke(ctx)
        refuse_unwatchable(ctx)
        raise click.exceptions.Exit(self._run_until_interrupted(ctx))

    def _run_until_interrupted(self, ctx: click.Context) -> int:
        """Runs until somebody presses Ctrl-C; the exit code of the last run that came to its end."""
        code: int = Exit.INTERRUPTED
        try:
            states = file_states(watched_files(ctx))
            while True:
                code = self._run_once(ctx)
                names = sorted(watched_files(ctx))
                states = {**file_states(names), **states}
                file_count = sum(states.get(name) is not None for name in names)
                if not ctx.params["quiet"]:
                    write_note(f"watching {file_count} file{'s' if file_count != 1 else ''}; Ctrl-C ends")
                states, changed = next_change(ctx, states)
                clear_screen()
                if not ctx.params["quiet"]:
                    write_remark(f"changed: {', '.join(changed)}")
        except KeyboardInterrupt:
            if terminal.is_terminal(sys.stderr):
                write_note("")  # the terminal has written ^C
            write_note(
                "interrupted" if code == Exit.INTERRUPTED else f"stopped; the last run ended with exit code {code}"
            )
        return code

    def _run_once(self, ctx: click.Context) -> int:
        """One run in a context of its own: settings and variables are read anew; its exit code."""
        for key in (FILES_READ_KEY, NAMES_READ_KEY):
            ctx.meta.pop(key, None)
        LINE.begin()
        try:
            with self.make_context(ctx.info_name, list(ctx.meta[ARGUMENTS_KEY]), parent=ctx.parent) as run:
                super().invoke(run)
        except click.exceptions.Exit as end:
            return end.exit_code
        except click.ClickException as error:
            print_error(error)
            return Exit.UNUSABLE
        except BrokenPipeError:
            raise
        except OSError as error:
            write_remark(f"Error: {system_refusal(error)}")
            return Exit.UNUSABLE
        finally:
            LINE.end()
            sys.stdout.flush()
        return Exit.OK


def refuse_unwatchable(ctx: click.Context) -> None:
    """Ends the command where there is nothing to watch, or something would be written again and again."""
    if STDIN in ctx.params["paths"]:
        raise click.UsageError("--watch needs files: standard input can be read only once", ctx)
    for name in ctx.params["paths"]:
        folder = Path(name) if name.endswith(("/", os.sep)) else Path(name).parent
        if not glob.has_magic(name) and not Path(name).exists() and not folder.is_dir():
            raise click.UsageError(f"--watch: there is no folder {folder.as_posix()} in which {name} could come", ctx)
    for name, option in EXCLUDED_OPTIONS.items():
        if ctx.params.get(name):
            raise click.UsageError(f"--watch and {option} exclude each other", ctx)


def watched_files(ctx: click.Context) -> Iterator[str]:
    """The files of a command: what its paths stand for, what it has read, and where settings may be."""
    from pidcfg.cli.settings import CONFIG_FILE_META, settings_candidates

    paths: Sequence[str] = ctx.params["paths"]
    yield from ctx.meta.get(NAMES_READ_KEY, ())
    for name in expand_patterns(paths):
        yield from _yaml_files_below(name) if Path(name).is_dir() else (name,)
    for place in {place for name in paths for place in settings_candidates(name)}:
        yield os.path.relpath(place)
    yield from filter(None, (ctx.params.get("baseline"), ctx.meta.get(CONFIG_FILE_META)))


def _yaml_files_below(name: str) -> Iterator[str]:
    """The YAML files below a folder that a run would read."""
    from pidcfg.cli.inputs import walk_folders

    return (Path(folder.path, file).as_posix() for folder in walk_folders(name) for file in folder.files)


def file_states(names: Iterator[str] | Sequence[str]) -> dict[str, State]:
    """What the disk says of each file."""
    return {name: file_state(name) for name in names}


def file_state(name: str) -> State:
    """What the disk says of a file."""
    try:
        status = Path(name).stat()
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino


def changed_files(before: Mapping[str, State], current: Mapping[str, State]) -> list[str]:
    """The files that are others, new or gone."""
    return sorted(name for name in {*before, *current} if before.get(name) != current.get(name))


def next_change(ctx: click.Context, states: Mapping[str, State]) -> tuple[dict[str, State], list[str]]:
    """Waits until files have changed and the change is complete; how they are now, and which ones changed."""
    while True:
        begin = time.monotonic()
        current = file_states(watched_files(ctx))
        if changed_files(states, current):
            current = wait_until_settled(ctx, states)
            if changed := changed_files(states, current):
                return current, changed
        time.sleep(max(POLL_SECONDS, PAUSE_FACTOR * (time.monotonic() - begin)))


def wait_until_settled(ctx: click.Context, states: Mapping[str, State]) -> dict[str, State]:
    """How the files are once nothing changes any more, and none is missing that an editor is about to put back."""
    begin, current = time.monotonic(), file_states(watched_files(ctx))
    while True:
        time.sleep(QUIET_SECONDS)
        before, current = current, file_states(watched_files(ctx))
        is_missing = any(states[name] is not None and current.get(name) is None for name in states)
        if not changed_files(before, current) and not (is_missing and time.monotonic() - begin < RENAME_SECONDS):
            return current


def clear_screen() -> None:
    """An empty screen for the next run, where there is a screen."""
    if terminal.is_terminal(sys.stdout):
        click.clear()
