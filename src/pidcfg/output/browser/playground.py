"""What stands behind the panes of the playground: findings, words, trends, conversion and explanations of texts.

It makes public calls alone; the page calls it in its worker. Texts go in, and plain data come out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pidcfg
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.paths import Data

Progress = Any


def begin(_: Data, __: Progress = None) -> Data:
    """What the page needs to know before the first text."""
    return {"vendors": [{"key": vendor.key, "title": vendor.title} for vendor in VENDORS.values()]}


def judge(values: Data, _: Progress = None) -> Data:
    """The findings of both panes at their lines, and the words of the configuration."""
    files, config, scenario = _files_of(values)
    checked = pidcfg.encode(files[config], name=config, files=files, allow_errors=True)
    findings = list(pidcfg.check(files[config], name=config, files=files).findings)
    if files[scenario].strip():
        findings += pidcfg.check(files[scenario], name=scenario, files=files).findings
    rows = [_finding_data(finding, config) for finding in findings]
    return {"findings": rows, "words": checked.text if len(checked.files) == 1 else "", "vendor": checked.vendor}


def _finding_data(finding: Diagnostic, config: str) -> Data:
    return {
        "pane": "config" if finding.file == config else "scenario",
        "line": finding.span.line,
        "column": finding.span.column,
        "code": finding.code,
        "severity": finding.severity.label,
        "message": finding.message,
        "loop": finding.loop,
        "help": finding.help or "",
        "effect": finding.plc_effect or "",
        "reference": finding.reference or "",
    }


def trend(values: Data, progress: Progress = None) -> Data:
    """The run of the scenario, or of the one that is drafted for a configuration alone."""
    files, config, scenario = _files_of(values)
    name = scenario if files[scenario].strip() else config
    run = pidcfg.simulate(files[name], name=name, files=files, record=True, engine="python", progress=progress)
    if run.report is None:
        return {"picture": "", "verdicts": []}
    verdicts = [
        {"loop": name, "verdict": loop.verdict, "missing": loop.missing or ""}
        for name, loop in run.report.loops.items()
    ]
    return {"picture": run.html(), "verdicts": verdicts}


def convert(values: Data, _: Progress = None) -> Data:
    """The configuration for another PLC, and what became of what is not exact."""
    files, config, _scenario = _files_of(values)
    try:
        result = pidcfg.convert(files[config], values["to"], name=config, files=files)
    except ValueError as error:
        return {"text": "", "changes": [], "refused": str(error)}
    changes = [
        {
            "loop": loop.loop,
            "field": change.field,
            "kind": change.kind,
            "loss": change.loss,
            "source": _text_of(change.source),
            "target": _text_of(change.target),
            "note": change.note or "",
        }
        for loop in result.loops
        for change in loop.changes
        if change.kind != "exact"
    ]
    refused = "" if result.ok else "; ".join(finding.message for finding in result.findings)
    return {"text": result.text, "changes": changes, "refused": refused}


def _text_of(value: object) -> str:
    return "" if value is None else str(value)


def explain(values: Data, _: Progress = None) -> Data:
    """What words, bits, rules and registers mean, beside the configuration where it can be read."""
    files, config, _scenario = _files_of(values)
    things = values["asked"].split()
    try:
        is_sound = pidcfg.load(files[config], name=config).model is not None
        result = pidcfg.explain(*things, config=files[config] if is_sound else None, name=config, files=files)
    except ValueError as error:
        return {"pages": [], "refused": str(error)}
    return {"pages": ["\n".join(explanation_lines(entry)) for entry in result.to_json()["explanations"]], "refused": ""}


LINE_PREFIXES = {
    "holds": "",
    "meaning": "",
    "unit": "unit: ",
    "notation": "notation: ",
    "written_by": "written by ",
    "cure": "cure: ",
}
"""What is told of a thing, and how its line begins."""
PAGE_PREFIXES = {"message": "", "text": "", "why": "why: ", "fix": "cure: "}
"""The same of a rule or a decision."""


def explanation_lines(entry: Data) -> Iterator[str]:
    """A thing that is explained, in lines."""
    yield f"{entry['name']}: {entry['title']}" + (f" ({entry['vendor']})" if entry["vendor"] else "")
    value = entry["value"] or {}
    if value:
        yield f"  {' '.join(str(value[key]) for key in ('shown', 'text', 'problem') if value[key] is not None)}"
    yield from (f"  {prefix}{entry[key]}" for key, prefix in LINE_PREFIXES.items() if entry[key])
    yield from (
        f"  {prefix}{entry['page'][key]}" for key, prefix in PAGE_PREFIXES.items() if (entry["page"] or {}).get(key)
    )
    for bit in entry["bits"]:
        if bit["active"] or bit["state"] is None:
            yield f"  {bit['bit']} {bit['state'] or ''}: {bit['title']}".replace(" :", ":")
            yield from (f"    {prefix}{bit[key]}" for key, prefix in LINE_PREFIXES.items() if bit.get(key))
    yield from (f"  set in line {place['line']}: {place['key']} {place['text']}" for place in entry["set_by"])
    yield from (f"  {note}" for note in entry["notes"])
    if entry["reference"]:
        yield f"  see: {entry['reference']}"


def _files_of(values: Data) -> tuple[dict[str, str], str, str]:
    """The texts of the page by their names, and what the two panes are called."""
    return values["files"], values["config"], values["scenario"]
