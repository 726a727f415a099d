"""Packages that pidcfg runs without: one clear word where something needs them."""

from __future__ import annotations

from importlib.util import find_spec

import click


def need(package: str, extra: str) -> None:
    """Ends the command, before anything runs, where the package of an extra is not installed."""
    if find_spec(package) is None:
        raise click.ClickException(
            f"{package} is not installed; install pidcfg with its extra `{extra}`, in a copy of the project by "
            f"'pip install \".[{extra}]\"'"
        )
