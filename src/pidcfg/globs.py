"""Patterns of paths, the same on every system: ``*`` and ``?`` within a name, ``**`` for any number of folders."""

from __future__ import annotations

from fnmatch import fnmatchcase

ANY, UP = "**", ".."


def matches(pattern: str, path: str) -> bool:
    """Whether a path (relative, with forward slashes) fits; a pattern without a slash is a name at any depth.

    A pattern that fits a folder fits everything below it, and none fits what leads out of the folder where patterns
    begin. The pattern is walked once along the path, so that none takes
    long.
    """
    if path.startswith("/") or UP in path.split("/"):
        return False
    bare = pattern.removeprefix("./")
    parts = [part.replace("[", "[[]") for part in bare.strip("/").split("/")]
    if "/" not in pattern.rstrip("/"):
        parts.insert(0, ANY)
    places = _reached({0}, parts)
    for name in path.split("/"):
        stays = {i for i in places if i < len(parts) and parts[i] == ANY}
        steps = {i + 1 for i in places if i < len(parts) and parts[i] != ANY and fnmatchcase(name, parts[i])}
        places = _reached(stays | steps, parts)
        if len(parts) in places:
            return True
    return False


def _reached(places: set[int], parts: list[str]) -> set[int]:
    """The places of a pattern with those behind ``**``, which may stand for nothing."""
    reached = set(places)
    for i, part in enumerate(parts):
        if i in reached and part == ANY:
            reached.add(i + 1)
    return reached
