"""What the file of a run holds that a person has accepted: metrics, modes and alarms, so that a diff of it can be read.

Times are in s, values in the units of the loop. A metric or a signal that is taken out of the file is not compared.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from pidcfg.schemas.scenario import Metric

Role = Literal["pv", "setpoint", "output"]
"""Which signal of a loop it is, whatever the PLC calls it."""


class Kept(BaseModel):
    """A part of the file; unknown keys, texts for numbers and NaN are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Extent(Kept):
    """How far a signal went, and where it ended."""

    min: float
    max: float
    final: float


class ModeBegin(Kept):
    """A mode, and since when."""

    at: float
    mode: str


class AlarmTimes(Kept):
    """When an alarm came first, and how long it was on in all."""

    first: float
    total: float


class AcceptedLoop(Kept):
    """What an accepted run shows of a loop."""

    pv_unit: str
    output_unit: str
    pv_range: tuple[float, float]
    """What the PLC takes its transmitter for; a tolerance is a share of it."""
    output_range: tuple[float, float] | None
    sample_time: float
    metrics: dict[Metric, float | None]
    """In the order of the report; None: nothing was measured."""
    signals: dict[Role, Extent]
    modes: list[ModeBegin]
    alarms: dict[str, AlarmTimes]


class AcceptedRun(Kept):
    """An accepted run; ``accepted`` is the title of its scenario."""

    pidcfg: Literal[1]
    accepted: str
    duration: Annotated[float, Field(gt=0)]
    loops: dict[str, AcceptedLoop]
    signals: dict[str, Extent]
    """The signals that are no loop's: of plants, and of the program around the loops."""


class AcceptedError(Exception):
    """Why a file cannot be used as the accepted run of a scenario."""


def run_of_data(data: bytes, most: int, *, quoted: bool = True) -> AcceptedRun:
    """What a file of at most ``most`` bytes holds; raises `AcceptedError`, with words of the file where ``quoted``."""
    if len(data) > most:
        raise AcceptedError(f"is larger than {most} bytes; raise it with --limit")
    try:
        return AcceptedRun.model_validate_json(data)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False, include_input=False)[0]
        place = ".".join(map(str, first["loc"]))
        why = f": {place and f'{place}: '}{first['msg'][:1].lower()}{first['msg'][1:]}" if quoted else ""
        raise AcceptedError(f"is no accepted run{why}") from None
