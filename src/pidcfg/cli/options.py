"""Options that several commands share, and wrong arguments as what they are on the command line."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import fields, replace
from functools import wraps
from pathlib import Path
from typing import Any, NoReturn

import click
from click.core import ParameterSource
from click.types import IntParamType

from pidcfg.text.diagnostics import Diagnostic, Severity
from pidcfg.text.reader import DEFAULT, Limits

# --- Options that several commands share ------------------------------------------------------------------------------

Decorator = Callable[[Callable[..., object]], Callable[..., object]]


def is_plain_number(value: object) -> bool:
    """Whether a number is spelled as everybody reads it: Python takes 1_0 and the digits of other scripts, too."""
    return not isinstance(value, str) or (value.isascii() and "_" not in value)


WHOLE_NUMBER = re.compile(r"[-+]?[0-9]+")


class Integer(IntParamType):
    """A whole number of the command line."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number."""
        if not is_plain_number(value) or (isinstance(value, str) and not WHOLE_NUMBER.fullmatch(value.strip())):
            self.fail(f"{value!r} is not a whole number; write digits alone", param, ctx)
        return super().convert(value, param, ctx)


class LimitedInteger(Integer, click.IntRange):
    """A whole number of the command line within limits."""


class Real(click.FloatRange):
    """A number of the command line within limits."""

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number."""
        return super().convert(NUMBER_TYPE.convert(value, param, ctx), param, ctx)


class Number(click.ParamType[float]):
    """A number of the command line; what looks like one in another spelling is refused with its cure."""

    name = "float"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number; the message says how to write what is none."""
        from pidcfg.schemas.numbers import unitless_cure

        number = None
        with suppress(ValueError):
            number = float(value) if is_plain_number(value) else None
        if number is None:
            self.fail(f"{value!r} is not a number; {unitless_cure(str(value))}", param, ctx)
        return number


NUMBER_TYPE = Number()


class RuleCodes(click.ParamType[list[str], str | list[str]]):
    """Rule codes or their beginnings, separated by commas."""

    name = "codes"

    def convert(self, value: str | list[str], param: click.Parameter | None, ctx: click.Context | None) -> list[str]:
        """Splits the list."""
        if not isinstance(value, str):
            return value
        codes = [code.strip().upper() for code in value.split(",") if code.strip()]
        if codes:
            from pidcfg.validate import list_texts
            from pidcfg.validate.catalog import suggest_code

            for code in codes:
                if not list_texts(code):
                    self.fail(f"no rule begins with {code!r}; {suggest_code(code)}", param, ctx)
        return codes


LIMIT_VALUE = re.compile(r"0{0,9}[1-9][0-9]{0,17}")
"""A limit: a whole number above 0."""


def parse_limits(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> Limits:
    """``NAME=VALUE`` pairs as limits."""
    limits = DEFAULT
    names = [f.name for f in fields(Limits)]
    for text in values:
        name, _, number = text.partition("=")
        if name not in names or not LIMIT_VALUE.fullmatch(number):
            raise click.BadParameter(f"{text[:60]!r}; write NAME=VALUE with one of {', '.join(names)}", ctx, param)
        limits = replace(limits, **{name: int(number)})
    return limits


def output_format(*names: str) -> Decorator:
    """``--format``."""
    return click.option(
        "--format",
        "fmt",
        type=click.Choice(names),
        default=names[0],
        show_default=True,
        help="How the result is printed.",
    )


LIMITS_OPTION = click.option(
    "--limit",
    "limits",
    multiple=True,
    metavar="NAME=VALUE",
    callback=parse_limits,
    help="Raise a limit on untrusted input, e.g. file_bytes=4000000.",
)


def _silence_line(ctx: click.Context, param: click.Parameter, quiet: bool) -> bool:
    """Nothing but findings and results, so no progress either."""
    del ctx, param
    if quiet:
        from pidcfg.cli.terminal import LINE

        LINE.silence()
    return quiet


QUIET_OPTION = click.option(
    "-q", "--quiet", is_flag=True, callback=_silence_line, help="Print findings and results only."
)
STRICT_OPTION = click.option("--strict", is_flag=True, help="Exit 1 on warnings too.")


def exit_zero(command: Callable[..., object]) -> Callable[..., object]:
    """``--exit-zero`` of a command that judges: a verdict is told and fails nothing; what is unusable does."""
    from pidcfg.cli.main import Exit

    @wraps(command)
    def exit_on_verdict(*args: object, exit_zero: bool, **kwargs: object) -> object:
        try:
            return command(*args, **kwargs)
        except click.exceptions.Exit as end:
            if exit_zero and end.exit_code == Exit.FINDINGS:
                raise click.exceptions.Exit(Exit.OK) from None
            raise

    text = "Exit 0 where it would be 1: what was found is told and fails nothing."
    return click.option("--exit-zero", is_flag=True, help=text)(exit_on_verdict)


SEVERITY_OPTION = click.option(
    "--severity",
    type=click.Choice(["error", "warning", "info"]),
    default="info",
    show_default=True,
    help="Show findings of this severity and above.",
)
SELECT_OPTION = click.option(
    "--select", type=RuleCodes(), default="", help="Only rules whose code begins so: DL2,PID101."
)
IGNORE_OPTION = click.option("--ignore", type=RuleCodes(), default="", help="Leave out rules whose code begins so.")
VERBOSE_OPTION = click.option(
    "-v",
    "--verbose",
    is_flag=True,
    help="Print what several loops share at length, and say on standard error what is read, left out and set.",
)


def _keep_name(ctx: click.Context, param: click.Parameter, value: str | None) -> None:
    """Keeps the name for whoever reads standard input."""
    from pidcfg.cli.inputs import STDIN_NAME_KEY

    del param
    if value:
        ctx.meta[STDIN_NAME_KEY] = Path(value).as_posix()


STDIN_FILENAME_OPTION = click.option(
    "--stdin-filename",
    metavar="FILE",
    is_eager=True,
    expose_value=False,
    callback=_keep_name,
    help="What - is called: findings, settings, patterns, baselines and relative paths go by this name.",
)


def _keep_patterns(ctx: click.Context, param: click.Parameter, lines: tuple[str, ...]) -> tuple[str, ...]:
    """Keeps the patterns of the command line for whoever walks a folder; those of settings are kept by themselves."""
    if lines and ctx.get_parameter_source(param.name or "") is not ParameterSource.DEFAULT_MAP:
        from pidcfg.cli.inputs import EXCLUSION_KEY, Exclusion, pattern_fault

        for line in lines:
            if fault := pattern_fault(line):
                raise click.BadParameter(fault, ctx, param)
        ctx.meta[EXCLUSION_KEY] = Exclusion(Path.cwd(), "--exclude", lines)
    return lines


EXCLUDE_OPTION = click.option(
    "--exclude",
    multiple=True,
    metavar="PATTERN",
    expose_value=False,
    callback=_keep_patterns,
    help="Leave out of folders what this pattern names, as a line of .gitignore does; may be repeated.",
)
MAP_OPTION = click.option(
    "--map",
    "map_path",
    metavar="FILE",
    help="The Modbus map of a PLC whose manual prints none, in place of the file's plc.map: rows such as "
    "R1,holding,0,uint16 (encode --format modbus-map writes them to be filled in).",
)


def map_file(name: str | None, limits: Limits) -> Path | None:
    """The file of a map; one that cannot be read ends the command."""
    if name is None:
        return None
    from pidcfg.cli.inputs import readable_input

    readable_input(name, limits)
    return Path(name)


STANDARD_OUTPUT = "-"


def dash_as_none(_ctx: click.Context, _param: click.Parameter, name: str | None) -> str | None:
    """The name of a file; None where it is left out, or - stands for standard output."""
    return None if name == STANDARD_OUTPUT else name


def refuse_dash(ctx: click.Context, param: click.Parameter, name: str | None) -> str | None:
    """The name of a file or a folder that standard output cannot be."""
    if name == STANDARD_OUTPUT:
        raise click.BadParameter("'-' is standard output; write a name", ctx, param)
    return name


OUTPUT_OPTION = click.option(
    "-o",
    "--output",
    "out",
    type=click.Path(dir_okay=False),
    callback=dash_as_none,
    help="Write to a file, never over one that differs; - is standard output.",
)
FORCE_OPTION = click.option("--force", is_flag=True, help="Overwrite a file that differs.")


JOBS_OPTION = click.option(
    "--jobs",
    type=LimitedInteger(1),
    metavar="N",
    help="Processes; the results are the same with any number.  [default: the cores of this machine]",
)


def process_count(jobs: int | None) -> int:
    """How many processes ``--jobs`` means."""
    from pidcfg.text.processes import cores

    return jobs or cores()


def select_findings(findings: list[Diagnostic], select: list[str], ignore: list[str]) -> list[Diagnostic]:
    """The findings that the options leave; what keeps a file from being used cannot be ignored."""
    from pidcfg.validate.catalog import is_chosen

    return [d for d in findings if is_chosen(d, select, ignore)]


def selects_code(code: str, select: list[str], ignore: list[str]) -> bool:
    """Whether the options select a code."""
    from pidcfg.validate import has_prefix

    return (not select or any(has_prefix(code, begin) for begin in select)) and not any(
        has_prefix(code, begin) for begin in ignore
    )


def select_severe(findings: list[Diagnostic], severity: str, threshold: Severity) -> list[Diagnostic]:
    """The findings that are shown: those of this severity and above, and whatever fails the run."""
    return [d for d in findings if d.severity >= min(Severity[severity.upper()], threshold)]


def examples_text(*lines: str) -> str:
    """The examples at the end of a command's help."""
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)


# --- Wrong arguments of a public call, as what they are on the command line: wrong options, and files with faults -----

NO_NAMES: Mapping[str, str] = {}


class VerifyCommand(click.Command):
    """A command whose ``--verify`` takes its value behind ``=`` or not at all, so that a file may follow it."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """The options, with the value that ``--verify`` alone stands for."""
        end = args.index("--") if "--" in args else len(args)
        complete_args = ["--verify=pass" if arg == "--verify" else arg for arg in args[:end]]
        return super().parse_args(ctx, [*complete_args, *args[end:]])


@contextmanager
def usage_errors(options: Mapping[str, str] = NO_NAMES) -> Iterator[None]:
    """Ends the command with what is wrong with an option; ``options`` that are not called as the argument is."""
    from pidcfg.output.arguments import ArgumentError, OptionError

    def option(name: str) -> str:
        return options.get(name, f"--{name.replace('_', '-')}")

    try:
        yield
    except OptionError as error:
        raise click.BadParameter(error.remark, param_hint=option(error.names[0])) from None
    except ArgumentError as error:
        raise click.UsageError(error.with_names(option)) from None


def refuse_all(faults: Sequence[str]) -> NoReturn:
    """Ends the command with everything that is wrong with its files."""
    from pidcfg.cli.console import write_remark

    for fault in faults[:-1]:
        write_remark(f"Error: {fault}")
    raise click.ClickException(faults[-1])
