"""``pidcfg rule``: what a rule checks, why, and the cure."""

from __future__ import annotations

import difflib
import json

import click

from pidcfg.cli import options
from pidcfg.cli.console import echo, markdown

EPILOG = options.examples("pidcfg rule", "pidcfg rule PID101", "pidcfg rule PID024 --format json")


@click.command("rule", epilog=EPILOG)
@click.argument("code", required=False)
@options.output_format("text", "json")
def command(code: str | None, fmt: str) -> None:
    """Explain the rule CODE, or list all rules."""
    from pidcfg.validate.pages import all_rules, as_data, page

    rules = all_rules()
    if code is None:
        rows = [as_data(rule) for rule in rules.values()]
        lines = "".join(f"{r.code}  {r.severity.label:<7}  {r.name:<34}  {r.title}\n" for r in rules.values())
        echo(json.dumps({"version": 1, "rules": rows}, indent=2, ensure_ascii=False) + "\n" if fmt == "json" else lines)
        return
    found = rules.get(code.upper())
    if found is None:
        near = difflib.get_close_matches(code.upper(), rules, n=1)
        raise click.ClickException(
            f"no rule {code}" + (f"; did you mean {near[0]}?" if near else "; 'pidcfg rule' lists all")
        )
    if fmt == "json":
        echo(json.dumps({"version": 1, **as_data(found)}, indent=2, ensure_ascii=False) + "\n")
    else:
        markdown(page(found))
