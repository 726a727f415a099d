"""``pidcfg lsp``: the language server, which an editor starts."""

from __future__ import annotations

from importlib.util import find_spec

import click

from pidcfg.cli import options

EPILOG = options.examples_text("pidcfg lsp")
PYGLS_MISSING = (
    'the language server needs pygls: pip install "pidcfg[lsp]" (in a copy of the project: pip install ".[lsp]")'
)


@click.command("lsp", epilog=EPILOG)
@click.option("--stdio", is_flag=True, hidden=True, help="As editors say it; there is no other way.")
def command(stdio: bool) -> None:
    """Serve an editor over standard input and output: findings, hover texts, words and completion while you type.

    An editor starts it; docs/editors.md says how each is told to.
    """
    del stdio
    if find_spec("pygls") is None:
        raise click.ClickException(PYGLS_MISSING)
    from pidcfg.cli.lsp.server import start_server

    start_server()
