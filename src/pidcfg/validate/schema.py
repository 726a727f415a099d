"""Schema errors as findings: each gets a code, a place and a cure, and a misspelt key the one that it can stand for."""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from functools import cache, lru_cache
from itertools import islice, pairwise
from typing import TYPE_CHECKING, Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError

from pidcfg.schemas import numbers
from pidcfg.schemas.document import field_texts, models_in, models_of
from pidcfg.text.diagnostics import Diagnostic, Edit, Severity, Span
from pidcfg.text.document import Document, Node, span_of
from pidcfg.text.paths import Path, value_at
from pidcfg.text.signs import fold_word, key_of_term, lookalike_remark, match_ignoring_case, to_ascii
from pidcfg.validate.rule import CODES_BY_KIND, WRONG_TYPE_CODE, loop_name

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

# --- The one key that a misspelt key can stand for; no valid key of any vendor is ever replaced by another ------------

KEY_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
"""The words of a key: ``ControlON_OFF`` has three."""
MIN_WORD_LETTERS = 5
"""A word has so many before and after its slip: in shorter ones (``MaxMV``, ``MinMV``) one letter is a meaning."""
MIN_DISTANCE = 2
"""No other key of the place may be so near."""


def unambiguous_key(key: str, known_keys: Sequence[str]) -> str | None:
    """The only key that a misspelt one can stand for, or None.

    It differs from what is written in capitals, hyphens and underscores alone, or by one slip inside a long word with
    every other key of the place clearly further. A valid key of any vendor is never replaced.
    """
    same_words = [name for name in known_keys if fold_word(name) == fold_word(key)]
    if same_words:
        return same_words[0] if len(same_words) == 1 and key not in all_keys() else None
    typos = [name for name in known_keys if is_typo(key, name)]
    if len(typos) != 1 or any(edit_distance(key, name) <= MIN_DISTANCE for name in known_keys if name != typos[0]):
        return None
    others = (name for name in all_keys() if name != typos[0])
    return None if any(fold_word(name) == fold_word(key) or is_typo(key, name) for name in others) else typos[0]


SET_KEY, SETTABLE_KEYS = "set", ("setpoint", "output")
"""The key of an event that takes settings by their names."""


def key_for_term(key: str, model: type[BaseModel]) -> str | None:
    """The key that a word of the field stands for at a place, or that stands one level below it; None: there is none.

    Only for the cure: whether the number means the same there (a time, a gain) is the writer's to say.
    """
    known_keys = keys_of(model)
    nested_hints = [f"{name}: {{{key}: …}}" for name, inner in _inner_models(model) if key in keys_of(inner)]
    if nested_hints:
        return " or ".join(dict.fromkeys(nested_hints))
    event_hints = [f"{SET_KEY}: {{{name}: …}}" for name in SETTABLE_KEYS] if {SET_KEY, "at"} <= {*known_keys} else []
    return key_of_term(key, [*known_keys, *event_hints]) or next(
        (n for n in known_keys if _sorted_words(n) == _sorted_words(key)), None
    )


def _sorted_words(key: str) -> list[str]:
    """The words of a key in an order of their own: people turn ``freeze_bias`` round."""
    return sorted(key.casefold().split("_"))


def parent_keys_of(key: str, root: type[BaseModel]) -> list[str]:
    """The only keys of a file below which a key is known, in words; empty: none, or more than one."""
    parents = _parents_by_key(root).get(key, ())
    return sorted(parents) if len(parents) == 1 else []


@cache
def _parents_by_key(root: type[BaseModel]) -> Mapping[str, set[str]]:
    """The keys of a file by what stands below them."""
    parents: dict[str, set[str]] = {}
    for name, inner in _models_inside(root):
        for key in keys_of(inner):
            parents.setdefault(key, set()).add(name)
    return parents


def _models_inside(root: type[BaseModel]) -> Iterator[tuple[str, type[BaseModel]]]:
    """The models inside of a model with the keys that they are the values of; at each place once."""
    unvisited = [root]
    visited: set[type[BaseModel]] = set()
    while unvisited:
        model = unvisited.pop()
        visited.add(model)
        for name, field in model.model_fields.items():
            for inner in models_in(field.annotation):
                yield field.alias or name, inner
                unvisited += [inner] if inner not in visited else []


@cache
def _inner_models(model: type[BaseModel]) -> tuple[tuple[str, type[BaseModel]], ...]:
    """The mappings inside of a model, by their keys; lists are none."""
    fields = [(field.alias or name, field.annotation) for name, field in model.model_fields.items()]
    return tuple((name, inner) for name, kind in fields if "tuple" not in str(kind) for inner in models_in(kind))


def is_typo(key: str, name: str) -> bool:
    """Whether a key is a name with one letter of a long word wrong, left out, doubled, or swapped with the next.

    A letter that is missing at an end of a word is none: ``limit`` and ``limits`` are two words.
    """
    length_difference = len(key) - len(name)
    offset = next((i for i, (a, b) in enumerate(zip(key, name, strict=False)) if a != b), min(len(key), len(name)))
    if length_difference == 0 and offset < len(name) and key[offset].isalpha():
        swapped = (
            key[offset : offset + 2] == name[offset + 1 : offset + 2] + name[offset]
            and key[offset + 2 :] == name[offset + 2 :]
        )
        is_changed = key[offset + 1 :] == name[offset + 1 :]
        return (is_changed and _in_word(name, offset, offset, MIN_WORD_LETTERS)) or (
            swapped and _in_word(name, offset, offset + 1, MIN_WORD_LETTERS)
        )
    if length_difference == -1:
        return key[offset:] == name[offset + 1 :] and _in_word(name, offset - 1, offset + 1, MIN_WORD_LETTERS + 1)
    doubled = length_difference == 1 and offset > 0 and key[offset] == key[offset - 1]
    return doubled and key[offset + 1 :] == name[offset:] and _in_word(name, offset - 1, offset - 1, MIN_WORD_LETTERS)


def _in_word(name: str, first: int, last: int, letters: int) -> bool:
    """Whether places of a name lie in one word of so many letters."""
    words = (match.span() for match in KEY_WORDS.finditer(name))
    return any(begin <= first and last < end and end - begin >= letters for begin, end in words)


@cache
def all_keys() -> frozenset[str]:
    """Every key of every vendor's files, and of scenarios, at every level."""
    from pidcfg.schemas.scenario import Scenario
    from pidcfg.vendors import VENDORS

    roots: list[type[BaseModel]] = [Scenario, *(vendor.model for vendor in VENDORS.values())]
    return frozenset(key for root in roots for model in models_of(root) for key in keys_of(model))


def keys_of(model: type[BaseModel]) -> list[str]:
    """The keys of a model as files have them."""
    return [field.alias or name for name, field in model.model_fields.items()]


def edit_distance(first: str, other: str) -> int:
    """How many letters were left out, added, changed or swapped with their neighbour."""
    previous: list[int] = []
    row = list(range(len(other) + 1))
    for i, a in enumerate(first, start=1):
        row_before_previous, previous, row = previous, row, [i]
        for j, b in enumerate(other, start=1):
            best = min(previous[j] + 1, row[j - 1] + 1, previous[j - 1] + (a != b))
            if i > 1 and j > 1 and a == other[j - 2] and b == first[i - 2]:
                best = min(best, row_before_previous[j - 2] + 1)
            row.append(best)
    return row[-1]


# --- Schema errors as findings: each gets a code, a place, a cure and a message that replaces pydantic's --------------

KIND_TEXTS = {
    "model_type": "a mapping of keys",
    "model_attributes_type": "a mapping of keys",
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": "a mapping of keys",
}
KEY_MARK = "[key]"
"""pydantic's last step where the key itself is wrong."""
UNION_KEY = "type"
"""The key that says which of several models an item of a list is."""
UNION_KINDS = {"union_tag_invalid": "literal_error", "union_tag_not_found": "missing"}
"""Errors of that key, by what they are to the reader."""
CHOICE_KINDS = {"literal_error", "union_tag_invalid"}
WRITE_TRUE_OR_FALSE = "write true or false"
"""The cure of a switch where no word is clearly meant."""
MIN_KEY_LIKENESS = 0.7
"""How like a key is to the one by which an item is known, where that one is missing."""
MIN_WORD_LIKENESS, MIN_LEAD = 0.5, 0.05
"""How like a word must be to one that is suggested, and how much more than to any other."""
MAX_VALUE_LENGTH = 60
DID_YOU_MEAN = "did you mean "
WORD_AND_REST = re.compile(r"(?P<word>[\w -]*\w) *(?:#|//|\(\*|[;,]$)\s*(?P<rest>.*)")
"""A word with a comment, or the end of a line of another language, behind it."""
SWITCH_WORDS = {"on", "off", "yes", "no", "true", "false"}
SUGGESTED_WORD = re.compile(rf"{DID_YOU_MEAN}([^?]+)\?")
WORD_PATTERN = re.compile(r"\w+")

M = TypeVar("M", bound=BaseModel)


def read_model(model: type[M], doc: Document) -> tuple[M | None, list[Diagnostic]]:
    """The document as a model, or what is wrong with it."""
    findings = [_no_value_finding(doc, path) for path in _null_paths(doc.data, ())] if _has_null(doc.data) else []
    try:
        config = model.model_validate(doc.data)
    except ValidationError as error:
        nulls = {d.path for d in findings}
        faults = error.errors(include_url=False)
        errors = [(d, e) for d, e in ((_make_diagnostic(e, model, doc), e) for e in faults) if d.path not in nulls]
        edits = rename_edits(errors, model, doc)
        with_edits = [replace(d, edits=edits[d.path]) if d.path in edits else d for d, _ in errors]
        return None, [*findings, *_drop_suggested_keys(with_edits)]
    return (None if findings else config), findings


def _has_null(value: object) -> bool:
    """Whether there is a key without a value."""
    items = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return any(inner is None or (isinstance(inner, dict | list) and _has_null(inner)) for inner in items)


def _null_paths(value: object, path: Path) -> Iterator[Path]:
    """Places of keys without a value."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for step, inner in items:
        if inner is None:
            yield (*path, step)
        else:
            yield from _null_paths(inner, (*path, step))


def _drop_suggested_keys(errors: list[Diagnostic]) -> Iterator[Diagnostic]:
    """Without the errors for missing keys that another error suggests as the spelling of an unknown key."""
    suggested = {path for d in errors if d.code == "PID020" for path in _suggested_paths(d)}
    yield from (d for d in errors if d.code != "PID021" or d.path not in suggested)


def _suggested_paths(d: Diagnostic) -> Iterator[Path]:
    """The keys that the cure of an unknown one names, beside it and below the loop."""
    match = SUGGESTED_WORD.search(d.help or "")
    words = WORD_PATTERN.findall(match[1]) if match else []
    yield from ((*d.path[:-1], word) for word in words)
    yield from ((*d.path[:2], *words[: i + 1]) for i in range(len(words)))


def _no_value_finding(doc: Document, path: Path) -> Diagnostic:
    key, parent = path[-1], next((step for step in reversed(path[:-1]) if isinstance(step, str)), "the list")
    if isinstance(key, int):
        message, help_text = f"item {key + 1} of {parent} has no value", "give a value, or remove the item"
    else:
        message, help_text = f"{key} has no value", _comma_cure(doc, path) or "give a value, or remove the key"
    span, loop = doc.locate(path, key=True), loop_name(doc, path)
    return Diagnostic("PID037", Severity.ERROR, message, doc.file, span, path, loop=loop, help=help_text)


def _comma_cure(doc: Document, path: Path) -> str | None:
    """The cure of a decimal comma inside braces, where what stands behind it is a key without a value."""
    parent = value_at(doc.data, path[:-1])
    before = "".join(f"{key}={parent[key]}" for key, following in pairwise(parent) if following == path[-1])
    number = before.partition("=")[2]
    if number.startswith("(") and str(path[-1]).endswith(")"):
        return f"write [{number[1:]}, {str(path[-1])[:-1]}]: a list stands in square brackets"
    if not (number[-1:].isdigit() and str(path[-1])[:1].isdigit()):
        return None
    help_text = numbers.number_cure(f"{number},{path[-1]}")
    return help_text and f"{help_text}; {number},{path[-1]} inside braces is two keys"


def _make_diagnostic(error: ErrorDetails, model: type[BaseModel], doc: Document) -> Diagnostic:
    loc: Path = tuple(step for step in error["loc"] if step != KEY_MARK)
    kind = error["type"]
    if kind in UNION_KINDS and not isinstance(error["input"], dict):
        kind = "model_type"
    elif kind in UNION_KINDS:
        similar_keys = difflib.get_close_matches(UNION_KEY, map(str, error["input"]), 1, MIN_KEY_LIKENESS)
        if similar_keys and UNION_KEY not in error["input"]:
            return _misspelt_finding(path_of_loc((*loc, similar_keys[0]), doc.data), doc)
        loc, kind = (*loc, UNION_KEY), UNION_KINDS[kind]
    path = path_of_loc(loc, doc.data)
    code = "PID030" if path == ("pidcfg",) else CODES_BY_KIND.get(kind, WRONG_TYPE_CODE)
    message, cure = _message_and_cure({**error, "type": kind, "loc": loc}, path, model)
    if "item" in error.get("ctx", {}):
        path = (*path, error["ctx"]["item"])
    span = doc.locate(path, key=kind in {"missing", "extra_forbidden"} or KEY_MARK in error["loc"])
    certain_text = error.get("ctx", {}).get("only") or (_matching_choice(error) if kind in CHOICE_KINDS else None)
    edits = value_edit(doc, path, certain_text) if certain_text and doc.data else ()
    return Diagnostic(
        code, Severity.ERROR, message, doc.file, span, path, loop=loop_name(doc, path), help=cure, edits=edits
    )


def _misspelt_finding(path: Path, doc: Document) -> Diagnostic:
    """The finding on a key by which the item of a list was to be known."""
    message, cure = describe_unknown_key(str(path[-1]), [UNION_KEY])
    span = doc.locate(path, key=True)
    return Diagnostic("PID020", Severity.ERROR, message, doc.file, span, path, loop=loop_name(doc, path), help=cure)


def _matching_choice(error: ErrorDetails) -> str | None:
    """The only word of a choice that differs from the value in capitals alone."""
    value = error["input"].get(UNION_KEY) if isinstance(error["input"], dict) else error["input"]
    context = error.get("ctx", {})
    return match_ignoring_case(value, _listed_choices(context.get("expected_tags") or context.get("expected", "")))


def path_of_loc(loc: Path, data: object) -> Path:
    """A place of pydantic's as the file has it: without the word that chose one of several models."""
    path: list[str | int] = []
    for step in loc:
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


def _message_and_cure(error: ErrorDetails, path: Path, model: type[BaseModel]) -> tuple[str, str | None]:
    """Message and cure, in place of pydantic's."""
    kind, context, value = error["type"], error.get("ctx", {}), error["input"]
    key = str(path[-1]) if path else "the file"
    if path == ("pidcfg",):
        problem = "is missing" if kind == "missing" else f"{quoted_value(value)} is not one that this pidcfg reads"
        return f"the format version {problem}", "write 'pidcfg: 1'"
    if kind == "extra_forbidden":
        keys = tuple(step for step in path[:-1] if isinstance(step, str))
        return _unknown_key_message(key, model, model_at(model, error["loc"][:-1]), keys)
    if "expected_tags" in context:
        return describe_wrong_choice(key, context["tag"], _listed_choices(context["expected_tags"]))
    text = _field_description(model, error["loc"])
    if kind == "literal_error":
        message, cure = describe_wrong_choice(key, value, _listed_choices(context["expected"]))
        return message, cure or text
    if kind == "missing":
        one_too_many = len(path) > 1 and key == "name" and path[-2] != 0
        dash = "; if the keys belong to what stands above, take the dash away" * one_too_many
        return f"{_parent_text(path)}{key} is missing", f"add {key}" + (f": {text}" if text else "") + dash
    message = _message_by_kind(kind, context, key, value) or f"{key}: {error['msg'].lower()}"
    cure = context.get("help") or _shape_cure(kind, key, value, model_at(model, error["loc"]))
    if (
        text
        and cure
        and ("without decimals" in cure or (cure == numbers.WRITE_ONE_NUMBER and re.match(r"[0-9] \w+, [0-9] ", text)))
    ):
        cure = f"{cure}: {text}"
    return message, f"{cure}; {text}" if kind == "boolean_form" and text and cure == WRITE_TRUE_OR_FALSE else cure


@lru_cache(maxsize=1000)
def _unknown_key_message(
    key: str, root: type[BaseModel], model: type[BaseModel] | None, parents: Path
) -> tuple[str, str | None]:
    """The message and cure for an unknown key at a place of a file."""
    from pidcfg.validate.terms import key_text, limit_key_text, translate_key

    if model is None:
        return describe_unknown_key(key, [])
    if pair := limit_key_text(key, keys_of(model)):
        return describe_unknown_key(key, keys_of(model), pair)
    if (translation := translate_key(key, root, parents)) is not None:
        message, cure = describe_unknown_key(key, keys_of(model), key_text(translation.key, parents))
        return message, f"{cure} {translation.note}".rstrip()
    return describe_unknown_key(key, keys_of(model), key_for_term(key, model), parent_keys_of(key, root))


def _field_description(model: type[BaseModel], loc: Path) -> str | None:
    """What the key at a place is, as its documentation says."""
    parent = model_at(model, loc[:-1])
    names = {field.alias or name: name for name, field in parent.model_fields.items()} if parent else {}
    text = field_texts(parent).get(names.get(str(loc[-1]), "")) if parent else None
    return text and text.rstrip(".")


def _shape_cure(kind: str, key: str, value: object, inner: type[BaseModel] | None) -> str | None:
    """The cure of anything else in the place of a list of mappings, or of a mapping."""
    if KIND_TEXTS.get(kind) == "a list" and (inner or isinstance(value, dict)):
        given = value if isinstance(value, dict) else dict.fromkeys(keys_of(inner)) if inner else {}
        first, content = next(iter(given.items()), ("name", None))
        item = f"- name: {first}" if isinstance(content, dict) and key == "loops" else f"- {first}: …"
        return f"begin each item of {key} with a dash: '{item}'"
    if kind in KIND_TEXTS and inner is not None:
        known = keys_of(inner)
        return f"write '{key}: {{{known[0]}: …}}'; known keys here: {', '.join(known)}"
    return None


def _message_by_kind(kind: str, context: Any, key: str, value: object) -> str | None:
    """The message of the kinds that need nothing of the schema."""
    if kind in KIND_TEXTS:
        return f"{key} must be {KIND_TEXTS[kind]}, not {quoted_value(value)}"
    if kind in {"too_long", "too_short"}:
        bound = context.get("max_length", context.get("min_length"))
        return f"{key} has {context['actual_length']} items; the limit is {bound}"
    return f"{key}: {context['text']}" if "text" in context else None


def _parent_text(path: Path) -> str:
    """Where a key is missing, in words."""
    parents = [str(p) for p in path[:-1] if isinstance(p, str)]
    return f"{parents[-1]}." if parents and parents[-1] not in {"loops", "steps"} else ""


def _listed_choices(expected: str) -> list[str]:
    """The words as pydantic lists them: ``'a', 'b' or 'c'``."""
    return [part.strip().strip("'") for part in expected.replace(" or ", ", ").split(", ")]


def describe_unknown_key(
    key: str, known_keys: list[str], suggestion: str | None = None, parent_keys: Sequence[str] = ()
) -> tuple[str, str | None]:
    """The message and cure for a key that is not in the schema.

    ``suggestion``: what it is known to stand for; ``parent_keys``: the keys below which it belongs.
    """
    near = [suggestion] if suggestion else difflib.get_close_matches(to_ascii(key), known_keys, n=1, cutoff=0.6)
    cure = f"{DID_YOU_MEAN}{near[0]}?" if near else f"known keys here: {', '.join(known_keys)}"
    if parent_keys and not suggestion and (not near or key in parent_keys):
        cure = f"it belongs below {parent_keys[0]}; {cure}"
    return f"unknown key {key!r}{lookalike_remark(key)}", cure


def describe_wrong_choice(key: str, value: object, choices: list[str]) -> tuple[str, str | None]:
    """The message and cure for a word that is not in a list."""
    word = to_ascii(str(value)).lower()
    ranked = sorted(((difflib.SequenceMatcher(None, c.lower(), word).ratio(), c) for c in choices), reverse=True)
    is_clear = ranked[0][0] >= MIN_WORD_LIKENESS and (len(ranked) == 1 or ranked[0][0] - ranked[1][0] > MIN_LEAD)
    remark = lookalike_remark(value) if isinstance(value, str) else ""
    message = f"{key} is {quoted_value(value)}, not one of {', '.join(choices)}{remark}"
    return message, _choice_cure(str(value), choices) or (f"{DID_YOU_MEAN}{ranked[0][1]}?" if is_clear else None)


def _choice_cure(value: str, choices: Sequence[str]) -> str | None:
    """What to write for a word with something behind it, or for the state of a switch; None: nothing is certain."""
    match = WORD_AND_REST.fullmatch(value)
    if match and match["word"] in choices:
        rest = match["rest"]
        return f"write {match['word']}{numbers.comment_of(rest) if rest else ': nothing stands behind it'}"
    if value.casefold() in SWITCH_WORDS and {"auto", "manual"} <= {*choices}:
        return "write auto for a loop that is to control, manual for one that is operated by hand"
    return None


def quoted_value(value: object) -> str:
    """A value as a message quotes it, shortened."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list | tuple):
        return "a list"
    text = str(value)
    return repr(str(text[:MAX_VALUE_LENGTH] + ("…" if len(text) > MAX_VALUE_LENGTH else "")))


def keys_at(model: type[BaseModel], loc: Path) -> list[str]:
    """The keys that the schema knows at a place."""
    inner = model_at(model, loc)
    return keys_of(inner) if inner else []


def model_at(model: type[BaseModel], loc: Path) -> type[BaseModel] | None:
    """The model that the schema has at a place, which names it where there are several."""
    current: list[type[BaseModel]] = [model]
    is_free_key = False
    for step in loc:
        if not current or isinstance(step, int) or is_free_key:
            is_free_key = False
            continue
        matching = [m for m in current if _discriminator(m) == step] if len(current) > 1 else []
        if matching:
            current = matching
            continue
        field = current[0].model_fields.get(step)
        current = models_in(field.annotation) if field else []
        is_free_key = field is not None and get_origin(field.annotation) is dict
    return current[0] if current else None


def _discriminator(model: type[BaseModel]) -> str | None:
    """The word that chooses a model among several."""
    field = model.model_fields.get(UNION_KEY)
    return next(iter(get_args(field.annotation)), None) if field else None


def rename_edits(
    errors: list[tuple[Diagnostic, ErrorDetails]], model: type[BaseModel], doc: Document
) -> dict[Path, tuple[Edit, ...]]:
    """The edits that correct unknown keys, by their paths: where one key alone is likely and takes the value."""
    unknown = [(d.path, e["loc"][:-1]) for d, e in errors if d.code == "PID020"][:MAX_KEYS]
    if not unknown:
        return {}
    new_keys = {path: key for path, loc in unknown if (key := unambiguous_key(str(path[-1]), keys_at(model, loc)))}
    return key_edits(new_keys, [e for _, e in errors], model, doc)


# --- Edits that correct a finding without changing the meaning of the file; `fixes` applies them ----------------------

MAX_KEYS, MAX_TRIES = 200, 30
"""Unknown keys of one file that are looked at, and how often: each time costs a reading of the whole."""
QUOTES = "'\""
NEEDS_QUOTES = re.compile(r"[%@`][\w%/.°²³-]*(?=[ \t]*(?:$|[,}\]]|[ \t]#))")
"""A word that begins with what no value may begin with, up to where any value ends."""


def quote_edit(doc: Document, span: Span) -> tuple[Edit, ...]:
    """Quotes around a value such as ``%``, whose first character begins nothing in YAML."""
    row = doc.lines[span.line - 1]
    match = NEEDS_QUOTES.match(row, span.column - 1)
    if match is None or not row[: match.start()].rstrip(" ").endswith((":", "[", ",")):
        return ()
    place = Span(span.line, match.start() + 1, span.line, match.end() + 1)
    return (Edit(place, f'"{match.group()}"'),)


def value_edit(doc: Document, path: Path, text: str) -> tuple[Edit, ...]:
    """Another text in the place of a value; none where an alias shares it, or where it takes several lines."""
    entry = _key_and_value(doc, path)
    event = None if entry is None else entry[1].event
    if event is None or not hasattr(event, "value") or event.anchor is not None:
        return ()
    span = span_of(event)
    return (Edit(span, text),) if span.line == span.end_line else ()


def key_edit(doc: Document, path: Path, key: str) -> tuple[Edit, ...]:
    """Another key; quotes stay."""
    entry = _key_and_value(doc, path)
    if entry is None or entry[0] is None or entry[0].anchor is not None:
        return ()
    span = span_of(entry[0])
    quote = doc.lines[span.line - 1][span.column - 1 : span.column]
    return (Edit(span, f"{quote}{key}{quote}" if quote in QUOTES else key),) if span.line == span.end_line else ()


def _key_and_value(doc: Document, path: Path) -> tuple[Any, Node] | None:
    """The event of the key and the node of a value."""
    node, key = doc.root, None
    for step in path:
        entry = node.child(step)
        if entry is None:
            return None
        key, node = entry
    return key, node


def key_edits(
    new_keys: dict[Path, str], faults: list[ErrorDetails], model: type[BaseModel], doc: Document
) -> dict[Path, tuple[Edit, ...]]:
    """The edits of keys that may be renamed: nothing has the new key yet, and its value is right for it."""
    uses = Counter((path[:-1], key) for path, key in new_keys.items())
    new_keys = {path: key for path, key in new_keys.items() if uses[path[:-1], key] == 1}
    accepted_keys: dict[Path, str] = {}
    pending_groups, tries = [new_keys] if new_keys else [], 0
    while pending_groups and tries < MAX_TRIES:
        group, tries = pending_groups.pop(), tries + 1
        if _has_fewer_faults(model, doc.data, group, faults):
            accepted_keys |= group
        elif len(group) > 1:
            half = len(group) // 2
            pending_groups += [dict(islice(group.items(), half, None)), dict(islice(group.items(), half))]
    return {path: edits for path, key in accepted_keys.items() if (edits := key_edit(doc, path, key))}


def _has_fewer_faults(
    model: type[BaseModel], data: object, new_keys: dict[Path, str], faults: list[ErrorDetails]
) -> bool:
    """Whether data with other keys lose faults, and get none that is new."""
    copy = deepcopy(data)
    if not all(_rename_key(copy, path, key) for path, key in new_keys.items()):
        return False
    try:
        model.model_validate(copy)
    except ValidationError as error:
        faults_before = {(e["type"], e["loc"]) for e in faults}
        faults_after = [(e["type"], e["loc"]) for e in error.errors(include_url=False)]
        return faults_before.issuperset(faults_after) and len(faults_after) <= len(faults) - len(new_keys)
    return True


def _rename_key(data: object, path: Path, key: str) -> bool:
    """Renames one key, wherever an alias shares its mapping; False where the new key is taken or has no value."""
    parent = value_at(data, path[:-1])
    if path[-1] not in parent:
        return key in parent  # renamed through another path to the same mapping
    if key in parent or parent[path[-1]] is None:
        return False
    parent[key] = parent.pop(path[-1])
    return True
