"""PID loops of small PLCs as text: check them, encode them, see them run.

The names below are imported when they are first used, so that `import pidcfg` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pidcfg.api import (
        certify,
        check,
        check_file,
        check_text,
        convert,
        decode,
        decode_words,
        diff,
        encode,
        explain,
        load,
        simulate,
        tune,
    )

__version__ = "0.1.0"
__all__ = [
    "__version__",
    "certify",
    "check",
    "check_file",
    "check_text",
    "convert",
    "decode",
    "decode_words",
    "diff",
    "encode",
    "explain",
    "load",
    "simulate",
    "tune",
]


def __getattr__(name: str) -> Any:
    """The public functions, from `pidcfg.api`."""
    if name in __all__:
        return getattr(import_module("pidcfg.api"), name)
    raise AttributeError(f"module 'pidcfg' has no attribute {name!r}")
