"""PID loops of small PLCs as text: check them, encode them, see them run.

The names below are imported when they are first used, so that `import pidcfg` costs nothing.
"""

TYPE_CHECKING = False  # as typing has it, which takes longer to import than all that comes before a command
if TYPE_CHECKING:
    from typing import Any

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
    from pidcfg.live.calls import compare, pull, serve, trend

__version__ = "0.2.0"
__all__ = [
    "__version__",
    "certify",
    "check",
    "check_file",
    "check_text",
    "compare",
    "convert",
    "decode",
    "decode_words",
    "diff",
    "encode",
    "explain",
    "load",
    "pull",
    "serve",
    "simulate",
    "trend",
    "tune",
]


LIVE = ("compare", "pull", "serve", "trend")
"""The functions that speak to a PLC."""


def __getattr__(name: str) -> "Any":
    """The public functions, from `pidcfg.api` and, of those that speak to a PLC, from `pidcfg.live.calls`."""
    if name in __all__:
        from importlib import import_module

        return getattr(import_module("pidcfg.live.calls" if name in LIVE else "pidcfg.api"), name)
    raise AttributeError(f"module 'pidcfg' has no attribute {name!r}")
