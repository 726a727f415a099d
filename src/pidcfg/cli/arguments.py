"""Wrong arguments of a public call, as what they are on the command line: wrong options, and files with faults."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, NoReturn

import click

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

NOTHING: Mapping[str, str] = {}


class VerifyCommand(click.Command):
    """A command whose ``--verify`` takes its value behind ``=`` or not at all, so that a file may follow it."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """The options, with the value that ``--verify`` alone stands for."""
        end = args.index("--") if "--" in args else len(args)
        filled = ["--verify=pass" if arg == "--verify" else arg for arg in args[:end]]
        return super().parse_args(ctx, [*filled, *args[end:]])


@contextmanager
def usage(options: Mapping[str, str] = NOTHING) -> Iterator[None]:
    """Ends the command with what is wrong with an option; ``options`` that are not called as the argument is."""
    from pidcfg.results.arguments import ArgumentError, OptionError

    def option(name: str) -> str:
        return options.get(name, f"--{name.replace('_', '-')}")

    try:
        yield
    except OptionError as error:
        raise click.BadParameter(error.remark, param_hint=option(error.names[0])) from None
    except ArgumentError as error:
        raise click.UsageError(error.spelled(option)) from None


def refuse_all(faults: Sequence[str]) -> NoReturn:
    """Ends the command with everything that is wrong with its files."""
    from pidcfg.cli.terminal.console import remark

    for fault in faults[:-1]:
        remark(f"Error: {fault}")
    raise click.ClickException(faults[-1])
