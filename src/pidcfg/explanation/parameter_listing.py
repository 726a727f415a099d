"""A listing of named parameters with a meaning beside each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.parameters import read, shown
from pidcfg.explanation.annotate import Line
from pidcfg.explanation.parameter_texts import title_of
from pidcfg.schemas.iec import Wire

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.parameters import Content
    from pidcfg.explanation.find_parameter import NamedBook


def named_lines(
    book: NamedBook, words: Mapping[str, Content | Wire], settings: Sequence[Mapping[str, Any]]
) -> Iterator[Line]:
    """Every parameter of a listing with its meaning."""
    units = {
        str(s.get("loop")): {
            k: str(s[k]["unit"]) for k in ("pv", "output") if isinstance(s.get(k), dict) and s[k].get("unit")
        }
        for s in settings
    }
    for name, raw in words.items():
        loop, kind, parameter = book.split(name, settings)
        table = book.tables.get(kind) if kind is not None else None
        row = next((r for r in table.rows if r.name == parameter), None) if table is not None else None
        content = f":= {raw.text}" if isinstance(raw, Wire) else ""
        if row is None or kind is None:
            text = "a signal of the program" if "." not in name else "belongs to no loop"
            yield Line(name, "", content or str(raw), "", "", text)
            continue
        title = title_of(row, book.meaning(kind, row))
        if isinstance(raw, Wire):
            yield Line(name, "", content, "", row.type.name, f"{title}; wired")
        elif read(row.type, raw) is None:
            yield Line(name, "", str(raw), "", row.type.name, f"{title}: no value of {row.type.name}")
        else:
            says = book.saying(row, raw, units.get(loop, {}))
            own = (row.name, raw) in (book.states or {}) or any(
                (c.register, c.number) == (row.name, raw) for c in book.codes
            )
            yield Line(name, "", shown(row.type, raw), "", row.type.name, says if own else f"{title}: {says}")
