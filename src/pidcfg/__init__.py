"""PID loops of small PLCs as text: check them, encode them, see them run.

The names below are imported when they are first used, so that `import pidcfg` costs nothing.
"""

TYPE_CHECKING = False  # as typing has it, which takes longer to import than all that comes before a command
if TYPE_CHECKING:
    from typing import Any

    __version__: str
    from pidcfg.api import certify as certify
    from pidcfg.api import change as change
    from pidcfg.api import check as check
    from pidcfg.api import check_file as check_file
    from pidcfg.api import check_text as check_text
    from pidcfg.api import convert as convert
    from pidcfg.api import decode as decode
    from pidcfg.api import decode_words as decode_words
    from pidcfg.api import diff as diff
    from pidcfg.api import encode as encode
    from pidcfg.api import explain as explain
    from pidcfg.api import fix as fix
    from pidcfg.api import gains as gains
    from pidcfg.api import load as load
    from pidcfg.api import plot as plot
    from pidcfg.api import report as report
    from pidcfg.api import simulate as simulate
    from pidcfg.api import tune as tune
    from pidcfg.encoders.codecs import DecodeError as DecodeError
    from pidcfg.encoders.image import Decoded as Decoded
    from pidcfg.encoders.listing import UnwritableError as UnwritableError
    from pidcfg.encoders.modbus_map import UnusableMapError as UnusableMapError
    from pidcfg.live.link import PlcError as PlcError
    from pidcfg.live.pull import CompareResult as CompareResult
    from pidcfg.live.pull import PullResult as PullResult
    from pidcfg.live.pull import compare as compare
    from pidcfg.live.pull import pull as pull
    from pidcfg.live.serving import ServeResult as ServeResult
    from pidcfg.live.serving import serve as serve
    from pidcfg.live.trend import TrendResult as TrendResult
    from pidcfg.live.trend import trend as trend
    from pidcfg.output.arguments import ArgumentError as ArgumentError
    from pidcfg.output.conversion import ConvertResult as ConvertResult
    from pidcfg.output.differences import DiffResult as DiffResult
    from pidcfg.output.drawing import PlotResult as PlotResult
    from pidcfg.output.explanation import ExplainResult as ExplainResult
    from pidcfg.output.explanation import QuestionError as QuestionError
    from pidcfg.output.findings import CheckResult as CheckResult
    from pidcfg.output.findings import FixResult as FixResult
    from pidcfg.output.findings import LoadResult as LoadResult
    from pidcfg.output.gains import TuneResult as TuneResult
    from pidcfg.output.handles import ChangeResult as ChangeResult
    from pidcfg.output.handles import GainsResult as GainsResult
    from pidcfg.output.json_schemas import schema as schema
    from pidcfg.output.places import held_words as held_words
    from pidcfg.output.places import loops_of as loops_of
    from pidcfg.output.places import references as references
    from pidcfg.output.reporting import ReportResult as ReportResult
    from pidcfg.output.runs import CertifyResult as CertifyResult
    from pidcfg.output.runs import SimulateResult as SimulateResult
    from pidcfg.output.words import DecodeResult as DecodeResult
    from pidcfg.output.words import EncodeResult as EncodeResult
    from pidcfg.study.certification.samples import WorkersError as WorkersError
    from pidcfg.text.diagnostics import Diagnostic as Diagnostic
    from pidcfg.text.diagnostics import Severity as Severity
    from pidcfg.text.document import Document as Document
    from pidcfg.text.reader import Limits as Limits
    from pidcfg.text.reader import Overlay as Overlay
    from pidcfg.tuning.rules import TuningError as TuningError
    from pidcfg.validate.baseline import ignore_edit as ignore_edit
    from pidcfg.validate.engine import Checked as Checked

NAMES = {
    "api": (
        *("check", "check_text", "check_file", "load", "encode", "decode", "decode_words", "convert", "diff"),
        *("simulate", "certify", "tune", "explain", "fix", "gains", "change", "plot", "report"),
    ),
    "encoders.codecs": ("DecodeError",),
    "encoders.image": ("Decoded",),
    "encoders.listing": ("UnwritableError",),
    "encoders.modbus_map": ("UnusableMapError",),
    "live.link": ("PlcError",),
    "live.pull": ("CompareResult", "PullResult", "compare", "pull"),
    "live.serving": ("ServeResult", "serve"),
    "live.trend": ("TrendResult", "trend"),
    "output.arguments": ("ArgumentError",),
    "output.conversion": ("ConvertResult",),
    "output.differences": ("DiffResult",),
    "output.explanation": ("ExplainResult", "QuestionError"),
    "output.json_schemas": ("schema",),
    "output.findings": ("CheckResult", "FixResult", "LoadResult"),
    "output.gains": ("TuneResult",),
    "output.handles": ("ChangeResult", "GainsResult"),
    "output.places": ("held_words", "loops_of", "references"),
    "output.reporting": ("ReportResult",),
    "output.drawing": ("PlotResult",),
    "output.runs": ("CertifyResult", "SimulateResult"),
    "output.words": ("DecodeResult", "EncodeResult"),
    "study.certification.samples": ("WorkersError",),
    "text.diagnostics": ("Diagnostic", "Severity"),
    "text.document": ("Document",),
    "text.reader": ("Limits", "Overlay"),
    "tuning.rules": ("TuningError",),
    "validate.baseline": ("ignore_edit",),
    "validate.engine": ("Checked",),
}
"""The public calls, and the types that they take, return or raise, by the modules that they stand in."""
__all__ = ["__version__", *sorted(name for names in NAMES.values() for name in names)]  # noqa: PLE0604 - texts of the table


def __getattr__(name: str) -> "Any":
    """A public name, from the module that has it."""
    if name == "__version__":
        from pidcfg.about import VERSION

        return VERSION
    for module, names in NAMES.items():
        if name in names:
            from importlib import import_module

            return getattr(import_module(f"pidcfg.{module}"), name)
    raise AttributeError(f"module 'pidcfg' has no attribute {name!r}")


def __dir__() -> "list[str]":
    """The public names, also those that are not imported yet."""
    return [*globals(), *__all__]
