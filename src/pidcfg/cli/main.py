"""Entry point: finds the command, imports nothing else, and turns every ending into an exit code."""

from __future__ import annotations

import os
import sys
import warnings
from contextlib import suppress
from enum import IntEnum
from importlib import import_module
from typing import TYPE_CHECKING, NoReturn

import click

from pidcfg.about import VERSION
from pidcfg.cli import environment, interrupts, terminal
from pidcfg.cli.terminal import LINE

if TYPE_CHECKING:
    from collections.abc import Iterable

    from click.shell_completion import CompletionItem


class Exit(IntEnum):
    """A contract with CI, documented in docs/exit-codes.md; never renumbered."""

    OK = 0
    FINDINGS = 1
    UNUSABLE = 2
    BUG = 3
    INTERRUPTED = 130
    TERMINATED = 143


COMMANDS = {
    "demo": ("pidcfg.cli.commands.demo", "Show a mistake, the words and a run, on one screen."),
    "init": ("pidcfg.cli.commands.init", "Write a starter file, a scenario, loops from a sheet."),
    "validate": ("pidcfg.cli.commands.validate", "Find every mistake in configurations and scenarios."),
    "diff": ("pidcfg.cli.commands.diff", "Compare two configurations by meaning."),
    "encode": ("pidcfg.cli.commands.encode", "Write the PLC's memory for a configuration."),
    "decode": ("pidcfg.cli.commands.decode", "Read a memory listing back into a configuration."),
    "convert": ("pidcfg.cli.commands.convert", "Write another vendor's configuration."),
    "export": ("pidcfg.cli.commands.export", "Write the loops as a sheet, or templates written out."),
    "simulate": ("pidcfg.cli.commands.simulate", "Run the encoded loops against a plant."),
    "whatif": ("pidcfg.cli.commands.whatif", "Write a page with sliders: gains turned, words run."),
    "certify": ("pidcfg.cli.commands.certify", "Run them on many plants: stronger, slower, noisier."),
    "report": ("pidcfg.cli.commands.report", "Write a commissioning report: HTML, PDF, CSV, XLSX."),
    "tune": ("pidcfg.cli.commands.tune", "Work out gains by the manuals' rules."),
    "pull": ("pidcfg.cli.commands.plc:pull", "Read the loops of a PLC over Modbus."),
    "compare": ("pidcfg.cli.commands.plc:compare", "Compare configurations with the PLC they are for."),
    "trend": ("pidcfg.cli.commands.trend", "Record PV, set point, output and mode of a PLC."),
    "serve": ("pidcfg.cli.commands.plc:serve", "Stand in for a PLC over Modbus: a scenario's loops."),
    "explain": ("pidcfg.cli.commands.explain", "Say what a register, bit or error number means."),
    "rule": ("pidcfg.cli.commands.rule", "Explain a rule, or list all of them."),
    "schema": ("pidcfg.cli.commands.schema", "Print the JSON Schema of a file for editors."),
    "lsp": ("pidcfg.cli.commands.lsp", "Serve an editor: findings and words while you type."),
    "completion": ("pidcfg.cli.commands.completion", "Print the script that completes commands in a shell."),
}
"""Module, whose function ``command`` is the command, or the one behind the colon, and short help.

The module is imported when it is called.
"""
GROUPS = {
    "demo": "Begin",
    "validate": "Check",
    "encode": "Words",
    "simulate": "Run",
    "tune": "Gains",
    "pull": "PLC",
    "explain": "Look up",
}
"""The first command of each group of the help, and what the group is called."""


SYNONYMS = {
    "check": "validate",
    "lint": "validate",
    "verify": "validate",
    "fix": "validate",
    "format": "validate",
    "compile": "encode",
    "build": "encode",
    "write": "encode",
    "disassemble": "decode",
    "read": "pull",
    "upload": "pull",
    "monitor": "compare",
    "record": "trend",
    "log": "trend",
    "translate": "convert",
    "migrate": "convert",
    "run": "simulate",
    "test": "simulate",
    "plot": "simulate",
    "montecarlo": "certify",
    "batch": "certify",
    "autotune": "tune",
    "help": "--help",
    "rules": "rule",
    "describe": "explain",
    "new": "init",
    "import": "init",
    "show": "export",
    "config": "export",
}
"""What other programs call a command, and its name here."""


COMPLETE_VARIABLE = "_PIDCFG_COMPLETE"
"""The variable by which a shell asks for completions."""

NO_PLUGINS = ("PYDANTIC_DISABLE_PLUGINS", "__all__")
"""No package that happens to be installed beside this one has a say in how a file is read; nor is it searched for."""


def load_command(name: str) -> click.Command:
    """A command, whose module is imported only now, with what all commands have: ``--color``, and variables."""
    module, _, function = COMMANDS[name][0].partition(":")
    command: click.Command = getattr(import_module(module), function or "command")
    return environment.with_variables(terminal.add_color_option(command), name)


def closest_command(word: str, words: Iterable[str]) -> str | None:
    """The one of the words that looks most like it, if any does."""
    from difflib import get_close_matches

    return next(iter(get_close_matches(word.lower(), words, n=1)), None)


class LazyGroup(click.Group):
    """Commands that are imported when they are used, so that start-up stays short."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """All commands in the order of the table."""
        del ctx
        return list(COMMANDS)

    def invoke(self, ctx: click.Context) -> object:
        """The command, with a line on the terminal while it takes long, which is removed before any other output."""
        LINE.begin()
        try:
            return super().invoke(ctx)
        except click.ClickException as error:
            if not isinstance(error, click.BadParameter) or error.param is None:
                self._name_variables(ctx)
            raise
        except BrokenPipeError:  # while click prints help, or in the middle of a command, which then must not succeed
            _drop_stdout()
            return Exit.OK if {*ctx.help_option_names} & {*sys.argv} else Exit.FINDINGS
        finally:
            LINE.end()

    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: object
    ) -> click.Context:
        """The context of the whole command line; its own ``--help`` and ``--version`` may lose their reader too."""
        try:
            return super().make_context(info_name, args, parent, **extra)
        except BrokenPipeError:
            _drop_stdout()
            raise click.exceptions.Exit from None

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Imports the command's module."""
        del ctx
        if cmd_name not in COMMANDS:
            return None
        LINE.label = cmd_name
        command = load_command(cmd_name)
        if COMPLETE_VARIABLE in os.environ:
            from pidcfg.cli.completion import with_candidates

            return with_candidates(command)
        for remark in environment.unknown_variables(command, cmd_name):
            _write_remark(remark)
        return command

    def _name_variables(self, ctx: click.Context) -> None:
        """Says which variables may have had a part in an error that names no option."""
        name = ctx.invoked_subcommand
        for setting in environment.variables_in_force(load_command(name)) if name in COMMANDS else ():
            _write_remark(f"the environment sets {setting}")

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command; an unknown word is refused with the command that comes nearest."""
        word = args[0]
        if word not in COMMANDS and word[:1].isalpha() and not ctx.resilient_parsing:
            near = SYNONYMS.get(word.lower()) or closest_command(word, COMMANDS)
            near = f"pidcfg validate {word}" if os.path.exists(word) else near  # noqa: PTH110 - pathlib costs start-up
            ctx.fail(
                f"no such command: {word}; " + (f"did you mean {near}?" if near else f"there are {', '.join(COMMANDS)}")
            )
        return super().resolve_command(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem[str]]:
        """The commands, and the options that they all have, without importing a command."""
        from click.shell_completion import CompletionItem

        items = [CompletionItem(name, help=text) for name, (_, text) in COMMANDS.items() if name.startswith(incomplete)]
        return items + super(click.Group, self).shell_complete(ctx, incomplete)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list of commands without importing them."""
        del ctx
        with formatter.section("Commands"):
            formatter.write_dl([(f"{GROUPS.get(name, ''):<7}  {name}", text) for name, (_, text) in COMMANDS.items()])


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(VERSION, prog_name="pidcfg")
@terminal.color_option()
def cli() -> None:
    """Check, encode and simulate the PID loops of PLCs from text files. Nothing is ever written to a PLC.

    Exit codes: 0 fine, 1 errors found or expectations failed, 2 unusable input or usage, 3 a bug in pidcfg.
    """


environment.with_variables(cli)


def _open_streams() -> None:
    """Stands in for output streams that the caller has closed; a closed input takes its place, and stays closed."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            handle = os.open(os.devnull, os.O_RDWR)
            if name != "stdin":
                setattr(sys, name, os.fdopen(handle, "w", encoding="utf-8"))


def _drop_stdout() -> None:
    """Sends what is still to be written to nowhere."""
    from pidcfg.cli.console import discard_output

    discard_output(sys.stdout)


def _write_note(text: str) -> None:
    """A remark on standard error, through what escapes and paints it."""
    from pidcfg.cli.console import write_note

    write_note(text)


def _write_remark(text: str) -> None:
    """A remark in one line, whatever the names and values in it hold."""
    from pidcfg.cli.console import write_remark

    write_remark(f"note: {text}")


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    """What a part below the command line warns of."""
    _write_remark(str(message))


def _end_with_error(error: click.ClickException | OSError) -> NoReturn:
    """Ends a command that cannot go on with the reason, plainly where no more files may be open to say it."""
    try:
        from pidcfg.cli.console import print_error, system_refusal

        if isinstance(error, click.ClickException):
            print_error(error)
        else:
            _drop_stdout()
            _write_note(f"Error: {system_refusal(error)}")
    except OSError:
        with suppress(OSError):
            sys.stderr.write(f"Error: {ascii(str(error))[1:-1]}\n")
    sys.exit(Exit.UNUSABLE)


def _flush_stdout() -> None:
    """Writes what is left; a reader that has gone (as `| head` does) changes no exit code."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        _drop_stdout()


def _run_command() -> object:
    """The command, or what a shell asks for."""
    if COMPLETE_VARIABLE in os.environ:
        from pidcfg.cli.completion import register_shells

        register_shells()
    with interrupts.keep_signal():
        return cli(standalone_mode=False, prog_name="pidcfg", complete_var=COMPLETE_VARIABLE)


def main() -> None:
    """A traceback makes Python exit 1, which CI would read as findings; a bug must not."""
    os.environ.setdefault(*NO_PLUGINS)
    warnings.showwarning = _show_warning
    _open_streams()
    terminal.install_fallback()
    try:
        interrupts.begin_command()
        code = _run_command()
        _flush_stdout()
        interrupts.finish_command()
        sys.exit(code if isinstance(code, int) else Exit.OK)
    except (click.Abort, KeyboardInterrupt):
        interrupts.finish_command()
        _write_note("interrupted")
        sys.exit(Exit.INTERRUPTED)
    except interrupts.Terminated:
        interrupts.finish_command()
        LINE.end()
        _drop_stdout()
        sys.exit(Exit.TERMINATED)
    except (click.ClickException, OSError) as e:
        interrupts.finish_command()
        _end_with_error(e)
    except MemoryError:
        interrupts.finish_command()
        _end_with_error(click.ClickException("there is not enough memory"))
    except Exception:  # noqa: BLE001 - the one place where a bug becomes an exit code
        interrupts.finish_command()
        import traceback

        _write_note(traceback.format_exc().rstrip("\n"))
        _write_note(f"This is a bug in pidcfg {VERSION}; please report the lines above.")
        sys.exit(Exit.BUG)


if __name__ == "__main__":
    main()
