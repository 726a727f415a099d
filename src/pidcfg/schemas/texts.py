"""The texts below the fields of a model, which say what each key is.

They are read from the source when they are wanted, so that loading a model for validation stays fast.
"""

from __future__ import annotations

import ast
import inspect
from functools import cache

from pydantic import BaseModel


@cache
def field_texts(model: type[BaseModel]) -> dict[str, str]:
    """The text below each field of a model, from its source; inherited fields keep theirs."""
    texts: dict[str, str] = {}
    for cls in reversed([c for c in model.__mro__ if issubclass(c, BaseModel) and c.__module__.startswith("pidcfg")]):
        body = ast.parse(inspect.getsource(cls)).body[0]
        if isinstance(body, ast.ClassDef):
            texts |= _texts_in(body)
    return texts


def _texts_in(body: ast.ClassDef) -> dict[str, str]:
    texts = {}
    for field, text in zip(body.body, body.body[1:], strict=False):
        if (
            isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(text, ast.Expr)
            and isinstance(text.value, ast.Constant)
        ):
            texts[field.target.id] = " ".join(str(text.value.value).split())
    return texts
