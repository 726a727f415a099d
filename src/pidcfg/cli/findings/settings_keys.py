"""The keys of a settings file, and the JSON Schema for editors that is generated from them."""

from __future__ import annotations

from typing import Any, NamedTuple

from pidcfg.cli.formats import formats_of

PER_FILE, EXCLUDE = "per-file-ignores", "exclude"
EXCLUDES = f"{EXCLUDE} of "
"""How the reason begins why a settings file leaves an entry out of a folder."""
LARGEST = 1 << 18
"""Bytes of a settings file; a byte of TOML takes up to 600 of memory."""
MOST = 200
"""Patterns of ``exclude``."""


class Key(NamedTuple):
    """One key: its kind, what it does, and an example."""

    kind: str
    text: str
    example: str


# fmt: off
KEYS = {
    "select": Key("codes", "Only rules whose code begins so.", '["DL2", "PID101"]'),
    "ignore": Key("codes", "Rules whose code begins so are left out.", '["DL220"]'),
    "severity": Key("severity", "Findings of this severity and above are shown.", '"warning"'),
    "strict": Key("switch", "Exit 1 on warnings too.", "true"),
    "format": Key("format", "How the result is printed.", '"text"'),
    "baseline": Key("path", "A file of known findings, below the folder of the settings file.", '"known.json"'),
    EXCLUDE: Key(
        "patterns", "What is left out of folders: lines of .gitignore, from the folder of the settings file.",
        '["archive/", "*.bak.yaml"]',
    ),
    PER_FILE: Key(
        "table", "Patterns of paths below the folder of the settings file, and the rules left out there.",
        '{"old/**" = ["DL222"]}',
    ),
}
"""All there is."""
REFUSED = {
    "tool": "in pidcfg.toml the keys stand at the top, without [tool.pidcfg]",
    "limit": "limits on untrusted input are raised on the command line only (--limit)",
    "limits": "limits on untrusted input are raised on the command line only (--limit)",
    "output": "files to write are named on the command line only (--report-output)",
    "fix": "files are changed only when the command line says so (--fix)",
}
"""Keys that users may expect, and why they do not exist."""
# fmt: on
SEVERITIES = ("error", "warning", "info")
ALIASES = {key.replace("-", "_"): key for key in KEYS}
OPTIONS = frozenset(KEYS) - {PER_FILE}
"""Keys that are options of the command too."""


def settings_schema() -> dict[str, Any]:
    """The JSON Schema of ``pidcfg.toml``, for editors."""
    from pidcfg.schemas.document import DIALECT
    from pidcfg.schemas.numbers import text_schema

    codes = {"type": "array", "items": text_schema("[A-Za-z]{1,3}[0-9]{0,3}", "PID101", "DL2")}
    kinds: dict[str, dict[str, Any]] = {
        "codes": codes,
        "switch": {"type": "boolean"},
        "severity": {"enum": list(SEVERITIES)},
        "format": {"enum": list(formats_of("validate"))},
        "path": {"type": "string", "minLength": 1},
        "patterns": {"type": "array", "items": {"type": "string", "minLength": 1}, "maxItems": MOST},
        "table": {"type": "object", "additionalProperties": codes},
    }
    properties = {key: {**kinds[row.kind], "description": row.text} for key, row in KEYS.items()}
    return {
        "$schema": DIALECT,
        "type": "object",
        "properties": properties,
        "additionalProperties": False,
        "title": "pidcfg settings",
    }
