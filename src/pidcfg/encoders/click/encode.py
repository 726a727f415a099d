"""A CLICK configuration to its C, DS and DF registers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import Block, Encoding
from pidcfg.encoders.maps.click import BLOCKS, SPACE, UNUSED
from pidcfg.encoders.plain import present, switched_on
from pidcfg.schemas.base import plain_number

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.schemas.click import ClickFile, Loop, Pv


def encode(config: ClickFile) -> Encoding:
    """The three blocks of every loop; requests and what the help does not name are 0."""
    blocks = tuple(block for i, loop in enumerate(config.loops) for block in _blocks(i, loop))
    plc = present({"name": config.name, "description": config.description})
    return Encoding("click", blocks, SPACE, tuple(_settings(loop) for loop in config.loops), plc)


def _blocks(i: int, loop: Loop) -> Iterator[Block]:
    values = values_of(loop)
    for key, (prefix, table) in BLOCKS.items():
        start = SPACE.number(prefix, getattr(loop, key))
        yield Block(("loops", i), start, table, table.encode(values, {}), loop.name)


def values_of(loop: Loop) -> dict[str, Any]:
    """Every register's value by path, with what follows from what is not given."""
    given = {
        "sample_rate": loop.sample_rate,
        "bumpless": loop.bumpless,
        "action": loop.action,
        "freeze_bias": loop.freeze_bias,
        "derivative_gain_limit": loop.derivative_gain_limit,
        "derivative_gain_limit_enabled": switched_on(loop.derivative_gain_limit_enabled, loop.derivative_gain_limit),
        **{f"tuning.{key}": value for key, value in dict(loop.tuning).items()},
        **{f"state.{key}": value for key, value in dict(loop.state).items()},
        **{f"autotune.{key}": value for key, value in dict(loop.autotune).items()},
        "error.curve": loop.error.curve,
        "error.deadband": loop.error.deadband,
        "error.deadband_enabled": switched_on(loop.error.deadband_enabled, loop.error.deadband),
        **_scaled(loop),
        **_alarms(loop),
    }
    return UNUSED | present(given)


def _scaled(loop: Loop) -> dict[str, Any]:
    pv, setpoint, output = loop.pv, loop.setpoint, loop.output
    return {
        "pv.range.0": pv.range[0],
        "pv.range.1": pv.range[1],
        "pv.filter": pv.filter,
        "pv.filter_enabled": switched_on(pv.filter_enabled, pv.filter),
        "setpoint.value": setpoint.value,
        "setpoint.lower_limit": setpoint.lower_limit,
        "setpoint.lower_limit_enabled": switched_on(setpoint.lower_limit_enabled, setpoint.lower_limit),
        "setpoint.upper_limit": setpoint.upper_limit,
        "setpoint.upper_limit_enabled": switched_on(setpoint.upper_limit_enabled, setpoint.upper_limit),
        "output.limits.0": output.limits[0],
        "output.limits.1": output.limits[1],
        "output.pwm.period": None if output.pwm is None else output.pwm.period,
    }


def pv_alarms_on(loop: Loop) -> bool:
    """Whether the bit of the four PV alarms is set."""
    pv = loop.alarms.pv
    return pv is not None and switched_on(pv.enabled, pv.low_low, pv.low, pv.high, pv.high_high)


def deviation_alarms_on(loop: Loop) -> bool:
    """Whether the bit of the two deviation alarms is set."""
    deviation = loop.alarms.deviation
    return deviation is not None and switched_on(deviation.enabled, deviation.high, deviation.high_high)


def _alarms(loop: Loop) -> dict[str, Any]:
    alarms = loop.alarms
    rate = alarms.rate_of_change
    return {
        **({f"alarms.pv.{k}": v for k, v in dict(alarms.pv).items()} if alarms.pv else {}),
        **({f"alarms.deviation.{k}": v for k, v in dict(alarms.deviation).items()} if alarms.deviation else {}),
        "alarms.pv.enabled": pv_alarms_on(loop),
        "alarms.deviation.enabled": deviation_alarms_on(loop),
        "alarms.rate_of_change": None if rate is None else rate.per_sample(loop.sample_rate).value,
        "alarms.rate_of_change_enabled": switched_on(alarms.rate_of_change_enabled, rate),
        "alarms.hysteresis": alarms.hysteresis,
    }


def _settings(loop: Loop) -> Mapping[str, Any]:
    """What no register holds; ``pwm`` always, since its absence says that the output is analog."""
    pwm = loop.output.pwm
    entry = {
        "loop": loop.name,
        "description": loop.description,
        **{key: f"{prefix}{getattr(loop, key)}" for key, (prefix, _) in BLOCKS.items()},
        "mode": loop.mode,
        "action_verified": True if loop.action_verified else None,
        "pv": _pv_settings(loop.pv) or None,
        "output": present({"unit": loop.output.unit}) | {"pwm": None if pwm is None else {"bit": pwm.bit}},
        "setpoint": False if loop.setpoint.value is None else None,
    }
    return present(entry)


def _pv_settings(pv: Pv) -> dict[str, Any]:
    return present({"unit": pv.unit, "input_range": pv.input_range and [plain_number(end) for end in pv.input_range]})
