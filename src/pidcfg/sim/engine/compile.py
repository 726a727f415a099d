"""The same kernels, compiled: numba over NumPy records in place of CPython over slots dataclasses.

`compile_functions` rebuilds functions and all that they call with globals in which every one of them is its compiled
self, unedited otherwise, and a vendor's ``scan`` stands in the place of another function. `Rows` are flat dataclasses
in a structured array.

Compiled code lies in the user's cache (`pidcfg.text.store`), which checks an entry before numba sees any of it.
numba's own
files are not used: they are run as they are found, and know the file of a function and not what it calls. An entry is
named after a hash of all kernels together with the constants they use.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import pickle
import sys
import warnings
import zlib
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from functools import cache
from operator import attrgetter
from types import FunctionType, ModuleType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from pidcfg.sim.controllers.kernels import single
from pidcfg.text.store import KERNEL_FOLDER, Store, cache_folder


@contextmanager
def without_settings_file() -> Iterator[None]:
    """Numba reads .numba_config.yaml of the folder that one works in, which nobody named: here it does without."""
    parser = sys.modules.get("yaml")
    sys.modules["yaml"] = None  # type: ignore[assignment] # as if it were not installed
    try:
        with warnings.catch_warnings(action="ignore"):
            yield
    finally:
        del sys.modules["yaml"]
        if parser is not None:
            sys.modules["yaml"] = parser


with without_settings_file():
    import numba
    from numba.core.caching import NullCache
    from numba.core.compiler import CompileResult
    from numba.core.registry import cpu_target
    from numba.core.serialize import dumps

vars(numba.config)["_config_fname"] = os.devnull  # it looks again for each kernel

Kernel = Callable[..., Any]
NUMPY_TYPES = {"int": np.int64, "float": np.float64}
"""NumPy's type for each annotation that a kernel's record may have."""
ENTRY_BYTES, SHELF_BYTES = 8 << 20, 16 << 20
"""Of a compiled kernel as it is kept, and of those that lie together."""
NUMBA_OPTIONS: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True, "_nrt": False}
"""Kernels divide by nothing that can be 0, are called by nobody in C, and create no objects to count references of."""


def compile_functions(
    functions: Iterable[Kernel],
    replacements: Mapping[Kernel, Kernel] | None = None,
    inlined_kernels: Iterable[Kernel] = (),
) -> dict[Kernel, Kernel]:
    """The functions and all they call as numba dispatchers, by the original; compiled at their first call.

    Only ``functions`` can be called from Python. ``inlined_kernels``: kernels on the hot path, whose calls would cost
    more than they save. No fastmath.
    """
    swaps, entries, hot = add_native_kernels(replacements), set(functions), set(inlined_kernels)
    originals = reachable_kernels(sorted(entries, key=full_name), swaps)
    key = fingerprint(originals, swaps, hot)
    built: dict[Kernel, Kernel] = {}
    for f in originals:
        options = NUMBA_OPTIONS | {"forceinline": f in hot, "no_cpython_wrapper": f not in entries}
        built[f] = numba.njit(**options)(copy_function(f))
        if f in entries:
            vars(built[f])["_cache"] = KernelCache(entry_name(key, f))
    connect_kernels(originals, built, swaps)
    return built


def native_single(x: float) -> float:
    """`single` for numba."""
    return float(np.float32(x))


def add_native_kernels(replacements: Mapping[Kernel, Kernel] | None) -> dict[Kernel, Kernel]:
    """Replacements, with those of kernels that cannot be compiled as they are."""
    return {single: native_single, **(replacements or {})}


def reachable_kernels(functions: Iterable[Kernel], replacements: Mapping[Kernel, Kernel]) -> list[Kernel]:
    """The functions and everything that they call, in a fixed order."""
    kernels: dict[Kernel, None] = {}
    waiting = list(functions)
    while waiting:
        f = waiting.pop()
        if f not in kernels:
            kernels[f] = None
            waiting += [replacements.get(callee, callee) for _, callee in callees(f)]
    return list(kernels)


def copy_function(f: Kernel) -> FunctionType:
    """A copy of a function with a copy of its globals."""
    copy = FunctionType(f.__code__, dict(f.__globals__), f.__name__)
    copy.__module__, copy.__qualname__, copy.__doc__ = f.__module__, f.__qualname__, f.__doc__
    return copy


def connect_kernels(
    originals: Iterable[Kernel], built: Mapping[Kernel, Kernel], replacements: Mapping[Kernel, Kernel]
) -> None:
    """In the globals of each copy, put the built function where an original one stands."""
    for f in originals:
        scope = getattr(built[f], "py_func", built[f]).__globals__
        for name, callee in callees(f):
            target = replacements.get(callee, callee)
            scope[name] = built.get(target, target)


def callees(f: Kernel) -> list[tuple[str, Kernel]]:
    """The Python functions that a kernel names."""
    named = [(name, f.__globals__.get(name)) for name in f.__code__.co_names]
    return [(name, value) for name, value in named if isinstance(value, FunctionType)]


# --- records ---------------------------------------------------------------------------------------------------------


@cache
def record_type(cls: type) -> np.dtype[np.void]:
    """The structured type of a flat dataclass whose fields are ints and floats."""
    return np.dtype(
        [(f.name, NUMPY_TYPES[f.type if isinstance(f.type, str) else f.type.__name__]) for f in fields(cls)]
    )


def record_array(objects: Sequence[Any], cls: type) -> np.ndarray[Any, np.dtype[np.void]]:
    """The objects as an array of records; ``cls`` is theirs, since there may be none."""
    kind = record_type(cls)
    values = attrgetter(*(kind.names or ()))
    return np.array([values(item) for item in objects], kind)


@cache
def record_view(cls: type) -> type[Any]:
    """A class with the fields of a flat dataclass whose objects lie in an array of its records."""
    kind = record_type(cls)
    rows = [(name, np.ctypeslib.as_ctypes_type(kind[name])) for name in kind.names or ()]
    names = {"_fields_": rows, "__slots__": (), "__dataclass_fields__": {f.name: f for f in fields(cls)}}
    return type(cls.__name__, (ctypes.Structure,), names)


class Rows(list[Any]):
    """Objects that lie in an array of records: what a compiled kernel writes there, they show at once."""

    __slots__ = ("array", "memory")
    array: np.ndarray[Any, np.dtype[np.void]]
    memory: memoryview
    """Its bytes."""

    @classmethod
    def from_objects(cls, objects: Sequence[Any]) -> Sequence[Any]:
        """Copies of objects, all of one class, with the same values."""
        if not objects:
            return objects
        if isinstance(objects, Rows):
            return cls._view_array(objects.array.copy(), type(objects[0]))
        kind: Any = type(objects[0])
        return cls._view_array(record_array(objects, kind), record_view(kind))

    @classmethod
    def _view_array(cls, array: np.ndarray[Any, np.dtype[np.void]], view: type[Any]) -> Rows:
        rows = cls(view.from_buffer(array, at) for at in range(0, array.nbytes, array.itemsize))
        rows.array, rows.memory = array, array.view(np.uint8).data
        return rows


def copy_into_arrays(target: Any, source: Any) -> None:
    """Writes what some numbers or objects in an array hold, ``source``, into others."""
    if target:
        memory, other = (item.memory if isinstance(item, Rows) else memoryview(item) for item in (target, source))
        memory[:] = other


# --- calls -----------------------------------------------------------------------------------------------------------


def call_on_arrays(function: Kernel, original: Kernel, classes: Mapping[Any, type]) -> Kernel:
    """A compiled kernel that is called with `Rows` and with ``array`` of numbers, whose memory it reads and writes.

    The original's annotations say what becomes of each argument; ``classes`` has the classes of its type variables.
    What was an argument of the last call is not looked at again.
    """
    kinds = [kind for name, kind in get_type_hints(original).items() if name != "return"]
    last_arguments: list[tuple[Any, Any]] = [(None, None)] * len(kinds)

    def call(*arguments: Any) -> int:
        for at, (kind, value) in enumerate(zip(kinds, arguments, strict=True)):
            if kind is int or value is not last_arguments[at][0]:
                last_arguments[at] = value, to_arrays(kind, value, classes)
        return int(function(*[arrays for _, arrays in last_arguments]))

    return call


def to_arrays(kind: Any, value: Any, classes: Mapping[Any, type]) -> Any:
    """An argument for a compiled kernel: of a sequence the array in which it lies, of a group that of each field."""
    if type(value) is Rows:
        return value.array
    if parts := group_fields(kind):
        return type(value)(*(to_arrays(part, item, classes) for part, item in zip(parts, value, strict=True)))
    if kind is int:
        return value
    item = item_of(kind)
    if not value:
        return np.empty(0, NUMPY_TYPES[item.__name__] if item in {int, float} else record_type(classes.get(item, item)))
    if not isinstance(value, array):
        raise TypeError(f"{value!r} lies in no array")
    return np.frombuffer(value, NUMPY_TYPES[item.__name__])


@cache
def item_of(kind: Any) -> Any:
    """The type of a sequence's items."""
    return get_args(kind)[0]


@cache
def group_fields(kind: Any) -> list[Any]:
    """The types of a named tuple's fields; nothing for another type."""
    group = get_origin(kind) or kind
    return list(get_type_hints(group).values()) if hasattr(group, "_fields") else []


# --- cache -----------------------------------------------------------------------------------------------------------


class NotKeptWarning(UserWarning):
    """Compiled kernels could not be kept, so that the next run compiles them anew."""


@cache
def warn_not_kept(why: str) -> None:
    """Warns once, however many kernels there are: numba makes Python forget what it has warned of."""
    warnings.warn(f"compiled kernels are not kept, the next run compiles anew: {why}", NotKeptWarning, stacklevel=2)


class KernelCache(NullCache):
    """Where numba looks for a kernel's machine code before it compiles, and leaves it afterwards."""

    def __init__(self, name: str) -> None:
        self.name = name

    def load_overload(self, signals: object, target_context: Any) -> Any:
        """The compiled code for these argument types; None where none is kept."""
        target_context.refresh()
        data = read_entry(self.name)
        types, code = data[:HASH_BYTES], data[HASH_BYTES:]
        if types != hash_of(signals):
            return None
        return CompileResult._rebuild(target_context, *pickle.loads(zlib.decompress(code)))  # noqa: S301, SLF001 - a checked entry

    def save_overload(self, signals: object, data: Any) -> None:
        """Keeps compiled code, or says why it cannot be kept."""
        code = zlib.compress(dumps(data._reduce()), 1)  # noqa: SLF001 - as numba's own cache does
        try:
            kernel_store().write(self.name, hash_of(signals) + code)
        except OSError as error:
            warn_not_kept(error.strerror or str(error))


HASH_BYTES = 32


def hash_of(value: object) -> bytes:
    """A hash of a value by what `repr` says of it."""
    return hashlib.sha256(repr(value).encode()).digest()


def kernel_store() -> Store:
    """Where compiled kernels are kept; raises `OSError` where they cannot be."""
    return Store(cache_folder(KERNEL_FOLDER), ENTRY_BYTES, SHELF_BYTES)


def read_entry(name: str) -> bytes:
    """A compiled kernel as it is kept, after its checksum; nothing where there is none."""
    try:
        return kernel_store().read(name) or b""
    except OSError:
        return b""


def entry_name(key: str, f: Kernel) -> str:
    """What a kernel's machine code for this processor is kept under; ``key``: the `fingerprint` of all it may call."""
    processor = cpu_target.target_context.codegen().magic_tuple()
    return hash_of((key, full_name(f), processor)).hex()


def is_cached(
    called: Iterable[Kernel],
    functions: Iterable[Kernel],
    replacements: Mapping[Kernel, Kernel],
    inlined_kernels: Iterable[Kernel] = (),
) -> bool:
    """Whether those of the compiled functions that are called lie in the cache: a second then, not a quarter minute."""
    swaps = add_native_kernels(replacements)
    key = fingerprint(reachable_kernels(sorted(set(functions), key=full_name), swaps), swaps, inlined_kernels)
    return all(read_entry(entry_name(key, f)) for f in called)


def fingerprint(
    functions: Sequence[Kernel], replacements: Mapping[Kernel, Kernel], inlined_kernels: Iterable[Kernel] = ()
) -> str:
    """A hash of everything that decides the compiled code: bytecode, constants by value, who calls whom, versions."""
    versions = (sys.version, numba.__version__, np.__version__)
    digest = hashlib.sha256(repr((versions, NUMBA_OPTIONS, sorted(map(full_name, set(inlined_kernels))))).encode())
    for f in functions:
        code = f.__code__
        calls = [(n, full_name(replacements.get(callee, callee))) for n, callee in callees(f)]
        facts = (full_name(f), f.__defaults__, code.co_consts, code.co_names, code.co_varnames, constants(f), calls)
        digest.update(code.co_code + repr(facts).encode())
    return digest.hexdigest()[:24]


def constants(f: Kernel) -> list[tuple[str, Any]]:
    """The numbers that a kernel names, of its own module and of those that it names; they are compiled in."""
    scope, names = f.__globals__, f.__code__.co_names
    modules = [(f"{n}.", vars(scope[n])) for n in names if isinstance(scope.get(n), ModuleType)]
    return [
        (f"{where}{n}", values[n])
        for where, values in [("", scope), *modules]
        for n in names
        if isinstance(values.get(n), int | float | tuple)
    ]


def full_name(f: Kernel) -> str:
    """A function's full name."""
    return f"{f.__module__}.{f.__qualname__}"
