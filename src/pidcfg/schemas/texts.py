"""The texts below the fields of a model, which say what each key is.

They are read from the source when they are wanted, so that loading a model for validation stays fast.
"""

from __future__ import annotations

import ast
import inspect
import sys
from functools import cache
from typing import TYPE_CHECKING

from pydantic import BaseModel

if TYPE_CHECKING:
    from types import ModuleType


@cache
def field_texts(model: type[BaseModel]) -> dict[str, str]:
    """The text below each field of a model, from its source; inherited fields keep theirs."""
    texts: dict[str, str] = {}
    for cls in reversed([c for c in model.__mro__ if issubclass(c, BaseModel) and c.__module__.startswith("pidcfg")]):
        texts |= _texts_of(sys.modules[cls.__module__]).get(cls.__qualname__, {})
    return texts


@cache
def _texts_of(module: ModuleType) -> dict[str, dict[str, str]]:
    """The texts of a module's classes; its source is parsed once, for all of them."""
    body = ast.parse(inspect.getsource(module)).body
    return {cls.name: _texts_in(cls) for cls in body if isinstance(cls, ast.ClassDef)}


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
