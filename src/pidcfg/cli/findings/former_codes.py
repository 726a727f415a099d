"""Codes from before each vendor had its own prefix (PID242, now DL242): understood until 1.0, with one remark."""

from __future__ import annotations

import click

from pidcfg.validate.catalog import current

REMARKED = "pidcfg.former_codes"
"""The key in click's ``meta`` that marks the remark as written."""


def current_code(code: str, ctx: click.Context | None = None) -> str:
    """A code or its beginning as it is written now; the first former code is remarked on, on stderr."""
    name = current(code)
    if name != code:
        remark(code, name, ctx)
    return name


def remark(code: str, name: str, ctx: click.Context | None = None) -> None:
    """Notes a former code, once a run, at the end of the command and not with ``--quiet``."""
    from pidcfg.cli.terminal.console import note

    here = ctx or click.get_current_context(silent=True)
    if here is None or here.resilient_parsing or REMARKED in here.find_root().meta:
        return
    here.find_root().meta[REMARKED] = True
    text = f"{code} is called {name} now: codes begin with a prefix a vendor; the old ones are understood until 1.0"
    here.call_on_close(lambda: None if here.params.get("quiet") else note(text))
