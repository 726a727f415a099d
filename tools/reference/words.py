"""The registers of a configuration, through the public encoder: what a reference starts from and what events write."""

from __future__ import annotations

import json
from copy import deepcopy
from functools import lru_cache

from pidcfg.api import encode


def words(configuration):
    """Of each register its content, by address as the vendor writes it."""
    return dict(_words(json.dumps(configuration)))


@lru_cache(maxsize=64)
def _words(text):
    result = encode(text, "json", allow_errors=True)
    data = result.to_json()
    assert "words" in data, data
    return tuple((entry["address"], entry["value"]) for entry in data["words"])


def with_set(configuration, loop, changes):
    """The configuration with what a `set` event writes into one of its loops."""
    changed = deepcopy(configuration)
    _merge(next(entry for entry in changed["loops"] if entry["name"] == loop), changes)
    return changed


def _merge(target, changes):
    for key, value in changes.items():
        present = target.get(key)
        if isinstance(value, dict):
            _merge(target.setdefault(key, {}), value)
        elif key == "setpoint" or isinstance(present, dict):
            target.setdefault(key, {})["value"] = value
        else:
            target[key] = value


def written(configuration, changed):
    """The registers in which two configurations differ, with their new content."""
    old, new = words(configuration), words(changed)
    return {address: value for address, value in new.items() if old.get(address) != value}
