"""``pidcfg export``: a configuration as a sheet of loops, or with its templates written out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click

from pidcfg.cli import options
from pidcfg.cli.console import echo, write_remark
from pidcfg.cli.environment import require_extra

if TYPE_CHECKING:
    from pidcfg.text.document import Document
    from pidcfg.text.reader import Limits

EPILOG = options.examples_text(
    "pidcfg export reactor.yaml -o loops.csv",
    "pidcfg export reactor.yaml -o loops.xlsx",
    "pidcfg export reactor.yaml --format csv --decimal-comma",
    "pidcfg export ovens.yaml",
)
FORMATS = ("yaml", "csv", "xlsx")


@click.command("export", epilog=EPILOG)
@click.argument("file")
@click.option(
    "--format",
    "fmt",
    type=click.Choice(FORMATS),
    help="yaml: with every template written out; csv, xlsx: a sheet with a row for each loop.  "
    "[default: by the name of the output, else yaml]",
)
@click.option("--decimal-comma", is_flag=True, help="CSV with semicolons and decimal commas.")
@options.OUTPUT_OPTION
@options.FORCE_OPTION
@options.QUIET_OPTION
@options.LIMITS_OPTION
def command(
    file: str, fmt: str | None, decimal_comma: bool, out: str | None, force: bool, quiet: bool, limits: Limits
) -> None:
    """Write a configuration as a sheet of loops, or with its templates written out.

    'pidcfg init --from' reads such a sheet, or anybody's, back.
    """
    from pidcfg.cli.console import suggest_next_step
    from pidcfg.cli.findings import load_configuration
    from pidcfg.cli.outputs import write_files
    from pidcfg.validate.engine import vendor_of

    doc = load_configuration(file, limits)
    suffix = Path(out or "").suffix.lower().lstrip(".").replace("yml", "yaml")
    if fmt is None and suffix and suffix not in FORMATS:
        raise click.UsageError(f"-o {out}: write a name that ends in .yaml, .csv or .xlsx, or say --format")
    kind = fmt or (suffix if suffix in FORMATS else "yaml")
    if decimal_comma and kind != "csv":
        raise click.UsageError("--decimal-comma is for CSV")
    if kind == "xlsx":
        require_extra("xlsxwriter", "report")
        if out is None:
            raise click.UsageError("a workbook is no text; name it with -o")
    vendor, _ = vendor_of(doc)
    if vendor is None or not isinstance((doc.data or {}).get("loops"), list):
        _refuse_document(doc)
    from pidcfg.output import sheets

    text: str | bytes
    if kind == "xlsx":
        text = sheets.as_workbook(doc, vendor)
    elif kind == "csv":
        text = sheets.as_csv(doc, vendor, comma=decimal_comma)
    else:
        from pidcfg.output.sheets import expanded_text

        text = expanded_text(doc)
    if out is None:
        echo(str(text))
        return
    write_files({out: text}, force=force)
    if not quiet:
        write_remark(f"{out}: written")
    suggest_next_step(*(("validate", out) if kind == "yaml" else ("init", "--from", out)), quiet=quiet)


def _refuse_document(doc: Document) -> NoReturn:
    """Ends the command with what is wrong with the file."""
    from pidcfg.cli.findings import show_errors
    from pidcfg.validate.engine import check_document

    show_errors(check_document(doc).findings, doc, "text")
    raise click.ClickException(f"{doc.file} could not be read")
