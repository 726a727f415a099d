"""``pidcfg schema``: JSON Schema of files, for editors, and of the commands' JSON, for programs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from pidcfg.cli import options
from pidcfg.cli.console import echo_json, show_text
from pidcfg.output.json_schemas import OUTPUT_SCHEMAS, SCENARIO, schema
from pidcfg.text.writer import json_text
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from pidcfg.text.paths import Data

SETTINGS_NAME = "settings"
EPILOG = options.examples_text(
    "pidcfg schema dl06",
    "pidcfg schema dl06 -o dl06.schema.json",
    "pidcfg schema scenario",
    "pidcfg schema settings",
    "pidcfg schema output-validate",
)


@click.command("schema", epilog=EPILOG)
@click.argument(
    "name", metavar="[NAME]", type=click.Choice([*VENDORS, SCENARIO, SETTINGS_NAME, *OUTPUT_SCHEMAS]), required=False
)
@options.OUTPUT_OPTION
@options.FORCE_OPTION
def command(name: str | None, out: str | None, force: bool) -> None:
    """Print the JSON Schema NAME: of a vendor's files, of scenarios, of settings, or of what a command prints as JSON.

    Without NAME, list what there is.
    """
    from pidcfg.cli.outputs import write_files

    if name is None:
        rows = [(v.key, v.title) for v in VENDORS.values()]
        rows += [(SCENARIO, "simulation scenarios"), (SETTINGS_NAME, "settings in pidcfg.toml")]
        rows += [(key, f"what pidcfg {words} prints") for key, (_, words) in OUTPUT_SCHEMAS.items()]
        show_text("".join(f"{key:<16} {title}\n" for key, title in rows))
        return
    text = json_text(document_schema(name))
    if out is None:
        echo_json(text)
    else:
        write_files({out: text}, force=force)


def document_schema(name: str) -> Data:
    """The JSON Schema of a vendor's files, with templates, of scenarios, of settings, or of an output."""
    if name == SETTINGS_NAME:
        from pidcfg.cli.settings import settings_schema

        return settings_schema()
    return schema(name)
