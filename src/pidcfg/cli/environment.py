"""Environment variables: each option has one, ``PIDCFG_COMMAND_OPTION``; and packages that pidcfg runs without."""

from __future__ import annotations

import os
from collections.abc import Iterator
from importlib.util import find_spec

import click
from click.core import ParameterSource

# --- Environment variables: each option has one, ``PIDCFG_COMMAND_OPTION``, which the command line outranks -----------

VARIABLE_PREFIX = "PIDCFG"
OPTIONS_WITHOUT_VARIABLE = {"version"}
"""Options that have none: a variable of that name belongs to whoever builds or installs pidcfg."""


def variable_of(command: str, option: str) -> str:
    """The variable of an option: `PIDCFG_VALIDATE_REPORT_OUTPUT` of ``validate --report-output``."""
    return "_".join((VARIABLE_PREFIX, *command.split(), option.lstrip("-"))).upper().replace("-", "_")


def with_variables(command: click.Command, name: str = "") -> click.Command:
    """A command whose options may be given by variables too, and whose help names them; one of its own is kept."""
    for option in options_of(command):
        option.envvar = option.envvar or variable_of(name, option_name(option))
        option.show_envvar = True
    return command


def options_of(command: click.Command) -> Iterator[click.Option]:
    """The options that have a variable."""
    for param in command.params:
        if isinstance(param, click.Option) and not param.hidden and param.name not in OPTIONS_WITHOUT_VARIABLE:
            yield param


def option_name(option: click.Option) -> str:
    """What an option is called: the first of its long names."""
    return next(opt for opt in option.opts if opt.startswith("--"))


def variables_in_force(command: click.Command) -> Iterator[str]:
    """The variables of a command that the environment has, as a shell sets them."""
    names = (str(option.envvar) for option in options_of(command))
    return (f"{name}={os.environ[name]}" for name in names if os.environ.get(name))


def unknown_variables(command: click.Command, name: str) -> Iterator[str]:
    """What is wrong with variables that look like those of a command and are none."""
    known_names = [str(option.envvar) for option in options_of(command)]
    prefix = variable_of(name, "")
    for variable in sorted(os.environ):
        if variable.startswith(prefix) and variable not in known_names:
            from pidcfg.text.signs import closest_name

            nearest = closest_name(variable, known_names)
            yield f"{variable} is no variable of pidcfg {name}" + (f"; did you mean {nearest}?" if nearest else "")


def parameter_hint(param: click.Parameter, ctx: click.Context | None) -> str:
    """How an error names a parameter: an option with its variable where the value came from there."""
    if not isinstance(param, click.Option):
        return param.get_error_hint(ctx)
    names = " / ".join(f"'{opt}'" for opt in param.opts)
    source = ctx.get_parameter_source(param.name or "") if ctx is not None else None
    return f"{names} (from {param.envvar})" if source is ParameterSource.ENVIRONMENT else names


# --- Packages that pidcfg runs without: one clear word where something needs them -------------------------------------


def require_extra(package: str, extra: str) -> None:
    """Ends the command, before anything runs, where the package of an extra is not installed."""
    if find_spec(package) is None:
        raise click.ClickException(
            f"{package} is not installed; install pidcfg with its extra `{extra}`, in a copy of the project by "
            f"'pip install \".[{extra}]\"'"
        )
