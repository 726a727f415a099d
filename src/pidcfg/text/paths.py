"""Dotted keys and what stands at them, and patterns of paths."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from functools import lru_cache
from itertools import pairwise
from typing import Any

# --- Dotted keys and what stands at them: the only module that walks plain data and models by path --------------------
#
# A path is a tuple of keys and indices, ``("setpoint", "limits", 0)``; as text it is written ``setpoint.limits.0``.
# Models are anything with attributes; nothing of pydantic is imported here.

Path = tuple[str | int, ...]
"""Keys and indices from the top of a file, or from a loop."""
Data = dict[str, Any]
"""What a mapping of YAML or JSON holds, by its keys: texts, numbers, switches, and lists and mappings of them."""
CONTAINERS = (dict, list, tuple)


@lru_cache(maxsize=4096)
def parse_path(text: str) -> Path:
    """``setpoint.limits.0`` as keys and indices; empty text is the top."""
    return tuple(int(step) if step.isdecimal() else step for step in text.split(".")) if text else ()


def dotted_text(path: Sequence[str | int]) -> str:
    """Keys and indices as text: ``setpoint.limits.0``."""
    return ".".join(str(step) for step in path)


def outer_keys(key: str) -> Iterator[str]:
    """What a dotted key lies in, the nearest first: ``setpoint.limits`` and ``setpoint`` of ``setpoint.limits.0``."""
    while "." in key:
        key = key.rpartition(".")[0]
        yield key


def value_at(data: object, path: Sequence[str | int]) -> Any:
    """What stands at a path of plain data or of models; None where there is nothing."""
    for step in path:
        if not isinstance(data, CONTAINERS):
            data = getattr(data, str(step), None)
        elif isinstance(data, dict):
            data = data.get(step)
        else:
            data = data[step] if isinstance(step, int) and step < len(data) else None
        if data is None:
            return None
    return data


def has_key(data: object, path: Sequence[str | int]) -> bool:
    """Whether plain data have the last key of a path, be it with an empty value."""
    parent = value_at(data, path[:-1]) if path else None
    if isinstance(parent, list):
        return isinstance(path[-1], int) and path[-1] < len(parent)
    return isinstance(parent, dict) and path[-1] in parent


def set_value(data: Data, path: Sequence[str | int], value: object) -> None:
    """Sets a value in plain data; mappings on the way are created as needed, items of lists must exist."""
    container: Any = data
    for step, next_step in pairwise(path):
        kinds = dict if isinstance(next_step, str) else dict | list
        if isinstance(container, dict) and not isinstance(container.get(str(step)), kinds):
            container[str(step)] = {}
        container = container[step]
    container[path[-1]] = value


def leaves(data: Any, prefix: Path = ()) -> Iterator[tuple[tuple[str, ...], object, Path]]:
    """The values of nested mappings: ``{tuning: {gain: 2}}`` and ``{tuning.gain: 2}`` are ``(tuning, gain)`` and 2.

    The third is the path as it is written.
    """
    for key, value in data.items():
        full_path = (*prefix, key)
        if isinstance(value, dict):
            yield from leaves(value, full_path)
        else:
            yield tuple(dotted_text(full_path).split(".")), value, full_path


def is_given(model: object, path: Sequence[str | int]) -> bool:
    """Whether a file gives a field of a model, by its path below the model, with a value.

    An index finds what stands at that place of a sequence: ``ramp_soak.steps.1.soak``.
    """
    for key in path:
        if isinstance(key, int):
            model = value_at(model, (key,))
        elif key in getattr(model, "model_fields_set", ()):
            model = getattr(model, key)
        else:
            return False
    return model is not None


def given_fields(model: Any, prefix: Path = ()) -> Iterator[tuple[Path, object]]:
    """The leaf fields that a file gives of a model, with their values, in the order of the schema."""
    for key in type(model).model_fields:
        value = getattr(model, key)
        if key not in model.model_fields_set or value is None:
            continue
        if hasattr(type(value), "model_fields"):
            yield from given_fields(value, (*prefix, key))
        else:
            yield (*prefix, key), value


# --- Patterns of paths, the same on every system: ``*`` and ``?`` within a name, ``**`` for any number of folders -----

ANY_DEPTH, PARENT = "**", ".."


def matches(pattern: str, path: str) -> bool:
    """Whether a path (relative, with forward slashes) fits; a pattern without a slash is a name at any depth.

    A pattern that fits a folder fits everything below it, and none fits what leads out of the folder where patterns
    begin. The pattern is walked once along the path, so that none takes
    long.
    """
    if path.startswith("/") or PARENT in path.split("/"):
        return False
    bare = pattern.removeprefix("./")
    parts = [part.replace("[", "[[]") for part in bare.strip("/").split("/")]
    if "/" not in pattern.rstrip("/"):
        parts.insert(0, ANY_DEPTH)
    positions = _reachable_positions({0}, parts)
    for name in path.split("/"):
        waiting = {i for i in positions if i < len(parts) and parts[i] == ANY_DEPTH}
        steps = {i + 1 for i in positions if i < len(parts) and parts[i] != ANY_DEPTH and fnmatchcase(name, parts[i])}
        positions = _reachable_positions(waiting | steps, parts)
        if len(parts) in positions:
            return True
    return False


def _reachable_positions(positions: set[int], parts: list[str]) -> set[int]:
    """The places of a pattern with those behind ``**``, which may stand for nothing."""
    reached = set(positions)
    for i, part in enumerate(parts):
        if i in reached and part == ANY_DEPTH:
            reached.add(i + 1)
    return reached
