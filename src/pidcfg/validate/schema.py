"""Schema errors as findings: each gets a code, a place, a cure and a message that replaces pydantic's."""

from __future__ import annotations

import difflib
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError

from pidcfg.diagnostics import Diagnostic, Edit, Severity
from pidcfg.odd_signs import plain, said_of
from pidcfg.paths import value_at
from pidcfg.schemas import misread
from pidcfg.schemas.texts import field_texts
from pidcfg.validate.codes import BY_KIND, OTHER_KIND
from pidcfg.validate.edits import MOST_KEYS, key_edits, of_value
from pidcfg.validate.identity import loop_name
from pidcfg.validate.spelling import clear_match, keys_of, models_in, places_of, spoken_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from pidcfg.paths import Path
    from pidcfg.source import Document

KINDS = {
    "model_type": "a mapping of keys",
    "model_attributes_type": "a mapping of keys",
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": "a mapping of keys",
}
OF_A_KEY = "[key]"
"""pydantic's last step where the key itself is wrong."""
UNION_KEY = "type"
"""The key that says which of several models an item of a list is."""
UNION_KINDS = {"union_tag_invalid": "literal_error", "union_tag_not_found": "missing"}
"""Errors of that key, by what they are to the reader."""
CHOICE_KINDS = {"literal_error", "union_tag_invalid"}
EITHER = "write true or false"
"""The cure of a switch where no word is clearly meant."""
LIKE, CLEARLY = 0.5, 0.05
"""How like a word must be to one that is suggested, and how much more than to any other."""
SHOWN = 60
DID_YOU_MEAN = "did you mean "

M = TypeVar("M", bound=BaseModel)


def read_model(model: type[M], doc: Document) -> tuple[M | None, list[Diagnostic]]:
    """The document as a model, or what is wrong with it."""
    findings = [_no_value(doc, path) for path in _nulls(doc.data, ())]
    try:
        config = model.model_validate(doc.data)
    except ValidationError as error:
        nulls = {d.path for d in findings}
        faults = error.errors(include_url=False)
        errors = [(d, e) for d, e in ((_diagnostic(e, model, doc), e) for e in faults) if d.path not in nulls]
        edits = renames(errors, model, doc)
        with_edits = [replace(d, edits=edits[d.path]) if d.path in edits else d for d, _ in errors]
        return None, [*findings, *_without_echoes(with_edits)]
    return (None if findings else config), findings


def _nulls(value: Any, path: Path) -> Iterator[Path]:
    """Places of keys without a value."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for step, inner in items:
        if inner is None:
            yield (*path, step)
        else:
            yield from _nulls(inner, (*path, step))


def _without_echoes(errors: list[Diagnostic]) -> Iterator[Diagnostic]:
    """Without the errors for missing keys that another error suggests as the spelling of an unknown key."""
    suggested = {
        (*d.path[:-1], d.help.removeprefix(DID_YOU_MEAN)[:-1])
        for d in errors
        if d.code == "PID020" and d.help and DID_YOU_MEAN in d.help
    }
    yield from (d for d in errors if d.code != "PID021" or d.path not in suggested)


def _no_value(doc: Document, path: Path) -> Diagnostic:
    key, parent = path[-1], next((step for step in reversed(path[:-1]) if isinstance(step, str)), "the list")
    if isinstance(key, int):
        message, help_text = f"item {key + 1} of {parent} has no value", "give a value, or remove the item"
    else:
        message, help_text = f"{key} has no value", _comma(doc, path) or "give a value, or remove the key"
    span, loop = doc.locate(path, key=True), loop_name(doc, path)
    return Diagnostic("PID037", Severity.ERROR, message, doc.file, span, path, loop=loop, help=help_text)


def _comma(doc: Document, path: Path) -> str | None:
    """The cure of a decimal comma inside braces, where what stands behind it is a key without a value."""
    parent = value_at(doc.data, path[:-1])
    before = "".join(f"{key}={parent[key]}" for key, following in pairwise(parent) if following == path[-1])
    number = before.partition("=")[2]
    if not (number[-1:].isdigit() and str(path[-1])[:1].isdigit()):
        return None
    help_text = misread.cure(f"{number},{path[-1]}")
    return help_text and f"{help_text}; {number},{path[-1]} inside braces is two keys"


def _diagnostic(error: Any, model: type[BaseModel], doc: Document) -> Diagnostic:
    place: Path = tuple(step for step in error["loc"] if step != OF_A_KEY)
    kind = error["type"]
    if kind in UNION_KINDS and not isinstance(error["input"], dict):
        kind = "model_type"
    elif kind in UNION_KINDS:
        place, kind = (*place, UNION_KEY), UNION_KINDS[kind]
    path = written(place, doc.data)
    code = "PID030" if path == ("pidcfg",) else BY_KIND.get(kind, OTHER_KIND)
    message, cure = _wording({**error, "type": kind, "loc": place}, path, model)
    span = doc.locate(path, key=kind in {"missing", "extra_forbidden"} or OF_A_KEY in error["loc"])
    only = error.get("ctx", {}).get("only") or (_same_word(error) if kind in CHOICE_KINDS else None)
    edits = of_value(doc, path, only) if only and doc.data else ()
    return Diagnostic(
        code, Severity.ERROR, message, doc.file, span, path, loop=loop_name(doc, path), help=cure, edits=edits
    )


def _same_word(error: Any) -> str | None:
    """The only word of a choice that differs from the value in capitals alone."""
    value = error["input"].get(UNION_KEY) if isinstance(error["input"], dict) else error["input"]
    context = error.get("ctx", {})
    return same_word(value, _choices(context.get("expected_tags") or context.get("expected", "")))


def same_word(value: object, choices: Iterable[str]) -> str | None:
    """The only word that differs from a value in capitals alone."""
    same = [word for word in choices if isinstance(value, str) and word.casefold() == value.casefold()]
    return same[0] if len(same) == 1 else None


def written(place: Path, data: Any) -> Path:
    """A place of pydantic's as the file has it: without the word that chose one of several models."""
    path: list[str | int] = []
    for step in place:
        if isinstance(data, dict) and step not in data and data.get(UNION_KEY) == step:
            continue
        path.append(step)
        if isinstance(data, dict):
            data = data.get(step)
        elif isinstance(data, list) and isinstance(step, int):
            data = data[step]
        else:
            data = None
    return tuple(path)


def _wording(error: Any, path: Path, model: type[BaseModel]) -> tuple[str, str | None]:
    """Message and cure, in place of pydantic's."""
    kind, context, value = error["type"], error.get("ctx", {}), error["input"]
    key = str(path[-1]) if path else "the file"
    if path == ("pidcfg",):
        problem = "is missing" if kind == "missing" else f"{shown(value)} is not one that this pidcfg reads"
        return f"the format version {problem}", "write 'pidcfg: 1'"
    if kind == "extra_forbidden":
        return _unknown(key, model, model_at(model, error["loc"][:-1]))
    if "expected_tags" in context:
        return not_a_choice(key, context["tag"], _choices(context["expected_tags"]))
    text = _text_of(model, error["loc"])
    if kind == "literal_error":
        message, cure = not_a_choice(key, value, _choices(context["expected"]))
        return message, cure or text
    if kind == "missing":
        one_too_many = len(path) > 1 and key == "name" and path[-2] != 0
        dash = "; if the keys belong to what stands above, take the dash away" * one_too_many
        return f"{_below(path)}{key} is missing", f"add {key}" + (f": {text}" if text else "") + dash
    message = _plain_wording(kind, context, key, value) or f"{key}: {error['msg'].lower()}"
    cure = context.get("help") or _shape(kind, key, value, model_at(model, error["loc"]))
    return message, f"{cure}; {text}" if kind == "boolean_form" and text and cure == EITHER else cure


@lru_cache(maxsize=1000)
def _unknown(key: str, root: type[BaseModel], below: type[BaseModel] | None) -> tuple[str, str | None]:
    """The message and cure for an unknown key at a place of a file."""
    if below is None:
        return unknown_key(key, [])
    return unknown_key(key, keys_of(below), spoken_of(key, below), places_of(key, root))


def _text_of(model: type[BaseModel], place: Path) -> str | None:
    """What the key at a place is, as its documentation says."""
    below = model_at(model, place[:-1])
    names = {field.alias or name: name for name, field in below.model_fields.items()} if below else {}
    text = field_texts(below).get(names.get(str(place[-1]), "")) if below else None
    return text and text.rstrip(".")


def _shape(kind: str, key: str, value: object, inner: type[BaseModel] | None) -> str | None:
    """The cure of anything else in the place of a list of mappings, or of a mapping."""
    if KINDS.get(kind) == "a list" and (inner or isinstance(value, dict)):
        given = value if isinstance(value, dict) else dict.fromkeys(keys_of(inner)) if inner else {}
        first, content = next(iter(given.items()), ("name", None))
        item = f"- name: {first}" if isinstance(content, dict) and key == "loops" else f"- {first}: …"
        return f"begin each item of {key} with a dash: '{item}'"
    if kind in KINDS and inner is not None:
        known = keys_of(inner)
        return f"write '{key}: {{{known[0]}: …}}'; known keys here: {', '.join(known)}"
    return None


def _plain_wording(kind: str, context: Any, key: str, value: object) -> str | None:
    """The message of the kinds that need nothing of the schema."""
    if kind in KINDS:
        return f"{key} must be {KINDS[kind]}, not {shown(value)}"
    if kind in {"too_long", "too_short"}:
        bound = context.get("max_length", context.get("min_length"))
        return f"{key} has {context['actual_length']} items; the limit is {bound}"
    return f"{key}: {context['text']}" if "text" in context else None


def _below(path: Path) -> str:
    """Where a key is missing, in words."""
    parents = [str(p) for p in path[:-1] if isinstance(p, str)]
    return f"{parents[-1]}." if parents and parents[-1] not in {"loops", "steps"} else ""


def _choices(expected: str) -> list[str]:
    """The words as pydantic lists them: ``'a', 'b' or 'c'``."""
    return [part.strip().strip("'") for part in expected.replace(" or ", ", ").split(", ")]


def unknown_key(
    key: str, known: list[str], meant: str | None = None, places: Sequence[str] = ()
) -> tuple[str, str | None]:
    """The message and cure for a key that is not in the schema.

    ``meant``: what it is known to stand for; ``places``: the keys below which it belongs.
    """
    near = [meant] if meant else difflib.get_close_matches(plain(key), known, n=1, cutoff=0.6)
    cure = f"{DID_YOU_MEAN}{near[0]}?" if near else f"known keys here: {', '.join(known)}"
    if places and not meant and (not near or key in places):
        cure = f"it belongs below {places[0]}; {cure}"
    return f"unknown key {key!r}{said_of(key)}", cure


def not_a_choice(key: str, value: object, choices: list[str]) -> tuple[str, str | None]:
    """The message and cure for a word that is not in a list."""
    word = plain(str(value)).lower()
    ranked = sorted(((difflib.SequenceMatcher(None, c.lower(), word).ratio(), c) for c in choices), reverse=True)
    clear = ranked[0][0] >= LIKE and (len(ranked) == 1 or ranked[0][0] - ranked[1][0] > CLEARLY)
    odd = said_of(value) if isinstance(value, str) else ""
    message = f"{key} is {shown(value)}, not one of {', '.join(choices)}{odd}"
    return message, f"{DID_YOU_MEAN}{ranked[0][1]}?" if clear else None


def shown(value: object) -> str:
    """A value as a message quotes it, shortened."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list | tuple):
        return "a list"
    text = str(value)
    return repr(str(text[:SHOWN] + ("…" if len(text) > SHOWN else "")))


def keys_at(model: type[BaseModel], place: Path) -> list[str]:
    """The keys that the schema knows at a place."""
    below = model_at(model, place)
    return keys_of(below) if below else []


def model_at(model: type[BaseModel], place: Path) -> type[BaseModel] | None:
    """The model that the schema has at a place, which names it where there are several."""
    current: list[type[BaseModel]] = [model]
    free = False
    for step in place:
        if not current or isinstance(step, int) or free:
            free = False
            continue
        chosen = [m for m in current if _chosen_by(m) == step] if len(current) > 1 else []
        if chosen:
            current = chosen
            continue
        field = current[0].model_fields.get(step)
        current = models_in(field.annotation) if field else []
        free = field is not None and get_origin(field.annotation) is dict
    return current[0] if current else None


def _chosen_by(model: type[BaseModel]) -> str | None:
    """The word that chooses a model among several."""
    field = model.model_fields.get(UNION_KEY)
    return next(iter(get_args(field.annotation)), None) if field else None


def renames(
    errors: list[tuple[Diagnostic, Any]], model: type[BaseModel], doc: Document
) -> dict[Path, tuple[Edit, ...]]:
    """The edits that correct unknown keys, by their paths: where one key alone is likely and takes the value."""
    unknown = [(d.path, e["loc"][:-1]) for d, e in errors if d.code == "PID020"][:MOST_KEYS]
    if not unknown:
        return {}
    new_keys = {path: key for path, place in unknown if (key := clear_match(str(path[-1]), keys_at(model, place)))}
    return key_edits(new_keys, [e for _, e in errors], model, doc)
