"""``pidcfg rule``: what a rule checks, why, and the cure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from pidcfg.cli import options
from pidcfg.cli.console import echo_json, show_markdown, show_text
from pidcfg.text.writer import json_text

if TYPE_CHECKING:
    from pidcfg.validate import RuleText

EPILOG = options.examples_text(
    "pidcfg rule", "pidcfg rule PID101", "pidcfg rule DL24", "pidcfg rule PID024 --format json"
)


@click.command("rule", epilog=EPILOG)
@click.argument("code", required=False)
@options.output_format("text", "json")
def command(code: str | None, fmt: str) -> None:
    """Explain the rule CODE, or list those whose code begins so, or all."""
    from pidcfg.validate import list_texts, text_by_code

    begin = (code or "").upper()
    if (rule := text_by_code(begin)) is not None:
        _show_rule(rule, fmt)
    elif rules := list_texts(begin):
        _show_list(list(rules.values()), fmt)
    else:
        from pidcfg.validate.catalog import suggest_code

        raise click.ClickException(f"no rule begins with {code}; {suggest_code(code or '')}")


def _show_rule(rule: RuleText, fmt: str) -> None:
    """A rule's page."""
    from pidcfg.validate import rule_data, rule_page

    if fmt == "json":
        echo_json(json_text({"version": 1, **rule_data(rule)}))
    else:
        show_markdown(rule_page(rule))


def _show_list(rules: list[RuleText], fmt: str) -> None:
    """A line a rule."""
    from pidcfg.validate import rule_data

    if fmt == "json":
        rows = [rule_data(rule) for rule in rules]
        echo_json(json_text({"version": 1, "rules": rows}))
    else:
        show_text("".join(f"{r.code}  {r.kind:<9}  {r.name:<34}  {r.title}\n" for r in rules))
