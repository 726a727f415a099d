"""``pidcfg schema``: JSON Schema for editors."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

from pidcfg.cli import options
from pidcfg.cli.console import echo
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from pydantic import BaseModel

SCENARIO, SETTINGS = "scenario", "settings"
EPILOG = options.examples("pidcfg schema dl06", "pidcfg schema dl06 -o dl06.schema.json", "pidcfg schema settings")


@click.command("schema", epilog=EPILOG)
@click.argument("vendor", type=click.Choice([*VENDORS, SCENARIO, SETTINGS]), required=False)
@options.OUT
@options.FORCE
def command(vendor: str | None, out: str | None, force: bool) -> None:
    """Print the JSON Schema of VENDOR's files, of scenarios or of settings; without VENDOR, list what there is."""
    from pidcfg.cli.outputs import write_files

    if vendor is None:
        others = [(SCENARIO, "simulation scenarios"), (SETTINGS, "settings in pidcfg.toml")]
        rows = [(v.key, v.title) for v in VENDORS.values()] + others
        echo("".join(f"{key:<10} {title}\n" for key, title in rows))
        return
    text = json.dumps(document_schema(vendor), indent=2, ensure_ascii=False) + "\n"
    if out is None:
        echo(text)
    else:
        write_files({out: text}, force=force)


def document_schema(vendor: str) -> dict[str, Any]:
    """The JSON Schema of a vendor's files, of scenarios, or of settings."""
    if vendor == SETTINGS:
        from pidcfg.cli.settings_check import settings_schema

        return settings_schema()
    from pidcfg.schemas.document import json_schema

    return json_schema(_model(vendor), _title(vendor))


def _model(vendor: str) -> type[BaseModel]:
    if vendor == SCENARIO:
        from pidcfg.schemas.scenario import Scenario

        return Scenario
    return VENDORS[vendor].model


def _title(vendor: str) -> str:
    return "pidcfg scenario" if vendor == SCENARIO else f"pidcfg configuration for {VENDORS[vendor].title}"
