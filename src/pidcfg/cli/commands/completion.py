"""``pidcfg completion``: the script that lets a shell complete pidcfg's commands."""

from __future__ import annotations

from importlib.resources import files

import click

from pidcfg.cli.console import echo

SCRIPTS = {
    "bash": "pidcfg.bash",
    "zsh": "_pidcfg.zsh",
    "fish": "pidcfg.fish",
    "powershell": "pidcfg.ps1",
}
"""Shell and its script."""

EPILOG = """\b
To have it in every new shell:
  bash         echo 'eval "$(pidcfg completion bash)"' >> ~/.bashrc
  zsh          echo 'eval "$(pidcfg completion zsh)"' >> ~/.zshrc    (after compinit)
  fish         pidcfg completion fish > ~/.config/fish/completions/pidcfg.fish
  powershell   pidcfg completion powershell >> $PROFILE

\b
Examples:
  pidcfg completion bash
  pidcfg completion fish
  pidcfg completion powershell"""


@click.command("completion", epilog=EPILOG)
@click.argument("shell", type=click.Choice(list(SCRIPTS)))
def command(shell: str) -> None:
    """Print the script that completes commands, options, rule codes and files in SHELL."""
    echo(completion_script(shell))


def completion_script(shell: str) -> str:
    """The script of a shell."""
    return files("pidcfg").joinpath("cli", "completions", SCRIPTS[shell]).read_text(encoding="utf-8")
