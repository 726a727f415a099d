"""Small changes of an example: such as a slip of the hand makes, and such as join what was never joined."""

from __future__ import annotations

import copy
import json
from typing import TYPE_CHECKING, Any

from pidcfg.text.document import Plain

if TYPE_CHECKING:
    import random

    Place = tuple[Any, ...]

VALUES = ("0", "1", "-1", "0.1", "99.99", "100", "0.04", "65535", "32767.5", "1e-9", "1e9", "3.4e38", "true", "false",
          "off", "V2000", "V7640", "DS1", "DF500", "x", "[0, 100]", "[100, 0]", "[]", "{}", "1 min", "500 ms", "auto",
          "manual", "cascade", "direct", "reverse", "2048 counts", "999 %")  # fmt: skip
"""Values that mean something somewhere."""
FACTORS = (0.0, 0.01, 0.5, 0.9, 1.01, 1.1, 2.0, 10.0, 1000.0, -1.0)
KEPT = frozenset({"pidcfg", "vendor", "config"})
"""Keys without which a file is none of its kind."""


def written(value: Any) -> str:
    """Data of the reader as YAML in flow style, plain texts as they were."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)}: {written(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(written, value)) + "]"
    return "" if value is None else str(value) if isinstance(value, Plain) else json.dumps(value, ensure_ascii=False)


def _key(key: str) -> str:
    return str(key) if key.isidentifier() else json.dumps(key, ensure_ascii=False)


def file_of(data: dict[str, Any]) -> str:
    """A configuration or scenario, a key a line."""
    return "".join(f"{key}: {written(value)}\n" for key, value in data.items())


def mutated(data: dict[str, Any], donor: dict[str, Any], rng: random.Random) -> dict[str, Any]:
    """A copy with one to three changes: a value, a key gone, an item twice, a part of another example, a slip."""
    data = copy.deepcopy(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        places = [place for place in _places(data) if place[0] not in KEPT]
        if not places:
            break
        place = rng.choice(places)
        rng.choice((_gone, _twice, _given, _joined, _scaled, _scaled, _slip, _other, _other))(data, place, donor, rng)
    return data


def _places(value: Any, above: Place = ()) -> list[Place]:
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [place for key, inner in items for place in ((*above, key), *_places(inner, (*above, key)))]


def _value(data: Any, place: Place) -> Any:
    for step in place:
        data = data[step]
    return data


def _gone(data: Any, place: Place, _donor: Any, _rng: random.Random) -> None:
    del _value(data, place[:-1])[place[-1]]


def _twice(data: Any, place: Place, _donor: Any, _rng: random.Random) -> None:
    parent = _value(data, place[:-1])
    if isinstance(parent, list):
        parent.insert(place[-1], copy.deepcopy(parent[place[-1]]))


def _given(data: Any, place: Place, donor: Any, rng: random.Random) -> None:
    """The value that another example has for the same key."""
    others = [other for other in _places(donor) if other[-1] == place[-1]]
    if others:
        _value(data, place[:-1])[place[-1]] = copy.deepcopy(_value(donor, rng.choice(others)))


def _joined(data: Any, place: Place, donor: Any, rng: random.Random) -> None:
    """A key more, with what another example has there."""
    parent = _value(data, place[:-1])
    others = [other for other in _places(donor) if isinstance(other[-1], str) and other[0] == place[0]]
    if others and isinstance(parent, dict):
        other = rng.choice(others)
        parent[other[-1]] = copy.deepcopy(_value(donor, other))


def _scaled(data: Any, place: Place, donor: Any, rng: random.Random) -> None:
    """A number a little or far off; what is none becomes another value."""
    value = _value(data, place)
    if not isinstance(value, Plain):
        return
    number, blank, unit = value.partition(" ")
    try:
        changed = float(number) * rng.choice(FACTORS)
    except ValueError:
        _other(data, place, donor, rng)
        return
    _value(data, place[:-1])[place[-1]] = Plain(f"{changed:g}{blank}{unit}")


def _other(data: Any, place: Place, _donor: Any, rng: random.Random) -> None:
    _value(data, place[:-1])[place[-1]] = Plain(rng.choice(VALUES))


def _slip(data: Any, place: Place, _donor: Any, rng: random.Random) -> None:
    """A letter too few in a key, other capitals, a hyphen, a number in quotes, `yes` for `true`."""
    parent, key = _value(data, place[:-1]), place[-1]
    if isinstance(parent, dict) and rng.randrange(2):
        at = rng.randrange(len(key)) if key else 0
        new = rng.choice(
            (key[:at] + key[at + 1 :], key.upper(), key.replace("_", "-"), key.replace("_", ""), key + "s")
        )
        parent[new] = parent.pop(key)
    elif isinstance(parent[key], Plain):
        text = str(parent[key])
        yes = {"true": "yes", "false": "no"}.get(text, f"0{text}")
        parent[key] = rng.choice((text, Plain(yes), Plain(text.upper()), Plain(text.lower()), Plain(f"{text}.0")))
