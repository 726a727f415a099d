"""The public calls that need no configuration: what a rule gives, and what a word means."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, get_args

from pidcfg.limits import DEFAULT, Limits
from pidcfg.reader import Files, reader_of, source_data
from pidcfg.results.arguments import ArgumentError, refuse_unknown, vendor_named
from pidcfg.results.exact import exact

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from pidcfg.results.explanations import ExplainResult
    from pidcfg.results.gains import TuneResult
    from pidcfg.results.sources import Source
    from pidcfg.results.targets import Into
    from pidcfg.tuning.rules import Form, Model


@exact
def tune(
    method: str,
    form: Form | None = None,
    *,
    gain: float | None = None,
    time_constant: float | None = None,
    second_time_constant: float | None = None,
    dead_time: float | None = None,
    model: Model | None = None,
    transfer: str | None = None,
    closed_loop: float | None = None,
    sample_time: float | None = None,
    ultimate_gain: float | None = None,
    ultimate_period: float | None = None,
    vary: str | None = None,
    ms: float | None = None,
    samples: int = 0,
    record: Path | str | bytes | None = None,
    columns: str | None = None,
    rest: float | None = None,
    start: str | None = None,
    until: str | None = None,
    vendor: str | None = None,
    pv_range: tuple[float, float] | None = None,
    output_range: tuple[float, float] | None = None,
    into: Path | str | bytes | None = None,
    into_name: str | None = None,
    loop: str | None = None,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> TuneResult:
    """Gains by a rule, in output units per PV unit, times in s.

    ``form``: P, PI or PID; without it the most that the rule has. ``gain`` is in PV units per unit of the output,
    negative for cooling; the times are in s. A method needs some of the numbers. ``model``: first-order, second-order
    (with ``second_time_constant``) or integrating (``gain`` is the slope, per s). ``transfer``: a transfer function as
    text in place of these numbers, reduced by the half rule. ``record``: a CSV file of a step test in place of them;
    ``columns`` says where it has which (``time=…,output=…,pv=…``), ``rest`` is the output before it, ``start`` and
    ``until`` take a part of it. ``vendor``: also as this PLC holds them; one whose gain is a share of the span needs
    ``pv_range``; ``output_range`` is 0 to 100 when not given. ``into``: a configuration whose ``loop`` is to have the
    gains (the only one when not given); ``written`` of the result is the file with them, in the loop's own units, form
    and ranges; nothing is saved. ``vary`` and ``ms`` are for robust: what is uncertain (such as
    ``gain=±30%,dead-time=80%..130%``) and the limit of the maximum sensitivity (1.6 when not given), and so many
    ``samples`` of `certify` confirm the gains on the virtual PLC. Raises
    `ValueError` for a record that no process fits, and beyond the range of a rule.
    """
    from pidcfg.results import gains, processes, targets
    from pidcfg.tuning.methods import METHODS
    from pidcfg.tuning.rules import Form, Model

    refuse_unknown("method", method, METHODS)
    if form is not None:
        refuse_unknown("form", form, get_args(Form))
    if model is not None:
        refuse_unknown("model", model, get_args(Model))
    family = None if vendor is None else vendor_named(vendor)
    target = targets.Target(family, pv_range, output_range, _into(into, into_name, loop, files, limits))
    numbers = {
        "gain": gain,
        "time_constant": time_constant,
        "dead_time": dead_time,
        "second_time_constant": second_time_constant,
        "closed_loop": closed_loop,
        "sample_time": sample_time,
        "ultimate_gain": ultimate_gain,
        "ultimate_period": ultimate_period,
    }
    wish = processes.robustness(vary, ms, samples, given=METHODS[method].searches)
    values = {key: processes.usable(key, value) for key, value in numbers.items() if value is not None}
    request = processes.request(columns, rest, start, until, given=record is not None)
    step = None if record is None else (*source_data(record, name, files, limits.file_bytes + 1), request)
    known = processes.known_process(values, model, transfer, given=record is not None)
    return gains.tuned(method, form, replace(known, wish=wish), step, target, limits)


def _into(
    source: Path | str | bytes | None, name: str | None, loop: str | None, files: Files, limits: Limits
) -> Into | None:
    """The configuration that gains are put into; raises `ArgumentError` for a loop without one."""
    if source is None:
        for argument, value in (("into_name", name), ("loop", loop)):
            if value is not None:
                raise ArgumentError(f"`{argument}` is for `into`", argument, "into")
        return None
    from pidcfg.results.targets import Into

    return Into(*source_data(source, name, files, limits.file_bytes + 1), loop, reader_of(files))


@exact
def explain(
    *things: str,
    vendor: str | None = None,
    loop: bool = False,
    blocks: Sequence[str] = (),
    config: Source | None = None,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> ExplainResult:
    """What words, contents, bits, error numbers, registers, rules and decisions mean; without one, what can be asked.

    ``loop``: addresses are of loops that begin where the manual's example does; ``blocks``: where loop registers begin.
    ``config``: a configuration, for the loop and the line that set a register. Raises `ValueError` for an unknown
    thing.
    """
    from pidcfg.results.explanations import explained
    from pidcfg.results.sources import checked_of

    family = None if vendor is None else vendor_named(vendor).key
    checked = None if config is None else checked_of(config, name, files, limits)
    return explained(things, family, tuple(blocks), checked, loop=loop)
