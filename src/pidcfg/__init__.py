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
    from pidcfg.encoders.codecs import DecodeError
    from pidcfg.encoders.image import Decoded
    from pidcfg.encoders.listing import UnwritableError
    from pidcfg.encoders.modbus_map import UnusableMapError
    from pidcfg.live.calls import compare, pull, serve, trend
    from pidcfg.live.link import PlcError
    from pidcfg.live.pull import CompareResult, PullResult
    from pidcfg.live.serving import ServeResult
    from pidcfg.live.trend import TrendResult
    from pidcfg.output.arguments import ArgumentError
    from pidcfg.output.conversion import ConvertResult
    from pidcfg.output.differences import DiffResult
    from pidcfg.output.explanation.lookup import ExplainResult
    from pidcfg.output.explanation.page import QuestionError
    from pidcfg.output.findings import CheckResult, LoadResult
    from pidcfg.output.gains import TuneResult
    from pidcfg.output.runs import CertifyResult, SimulateResult
    from pidcfg.output.words import DecodeResult, EncodeResult
    from pidcfg.study.certification.samples import WorkersError
    from pidcfg.text.diagnostics import Diagnostic, Severity
    from pidcfg.text.document import Document
    from pidcfg.text.reader import Limits
    from pidcfg.tuning.rules import TuningError
    from pidcfg.validate.engine import Checked

__version__ = "0.2.0"
__all__ = [
    "ArgumentError",
    "CertifyResult",
    "CheckResult",
    "Checked",
    "CompareResult",
    "ConvertResult",
    "DecodeError",
    "DecodeResult",
    "Decoded",
    "Diagnostic",
    "DiffResult",
    "Document",
    "EncodeResult",
    "ExplainResult",
    "Limits",
    "LoadResult",
    "PlcError",
    "PullResult",
    "QuestionError",
    "ServeResult",
    "Severity",
    "SimulateResult",
    "TrendResult",
    "TuneResult",
    "TuningError",
    "UnusableMapError",
    "UnwritableError",
    "WorkersError",
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
TYPES = {
    "encoders.codecs": ("DecodeError",),
    "encoders.image": ("Decoded",),
    "encoders.listing": ("UnwritableError",),
    "encoders.modbus_map": ("UnusableMapError",),
    "live.link": ("PlcError",),
    "live.pull": ("CompareResult", "PullResult"),
    "live.serving": ("ServeResult",),
    "live.trend": ("TrendResult",),
    "output.arguments": ("ArgumentError",),
    "output.conversion": ("ConvertResult",),
    "output.differences": ("DiffResult",),
    "output.explanation.lookup": ("ExplainResult",),
    "output.explanation.page": ("QuestionError",),
    "output.findings": ("CheckResult", "LoadResult"),
    "output.gains": ("TuneResult",),
    "output.runs": ("CertifyResult", "SimulateResult"),
    "output.words": ("DecodeResult", "EncodeResult"),
    "study.certification.samples": ("WorkersError",),
    "text.diagnostics": ("Diagnostic", "Severity"),
    "text.document": ("Document",),
    "text.reader": ("Limits",),
    "tuning.rules": ("TuningError",),
    "validate.engine": ("Checked",),
}
"""Where the types are that a public call takes, returns or raises."""


def __getattr__(name: str) -> "Any":
    """A public name, from the module that has it."""
    if name not in __all__:
        raise AttributeError(f"module 'pidcfg' has no attribute {name!r}")
    from importlib import import_module

    functions = "live.calls" if name in LIVE else "api"
    module = next((module for module, names in TYPES.items() if name in names), functions)
    return getattr(import_module(f"pidcfg.{module}"), name)


def __dir__() -> "list[str]":
    """The public names, also those that are not imported yet."""
    return [*globals(), *__all__]
