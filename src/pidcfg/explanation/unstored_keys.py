"""Keys of a configuration that no register holds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.explanation.page import Page, Value
from pidcfg.explanation.question import Asked, Thing, ThingError
from pidcfg.explanation.texts import key_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.explanation.find_register import RegisterBook
    from pidcfg.explanation.page import Origin

NO_REGISTER = "stands in no register: "
DIALOG = f"{NO_REGISTER}set it in the PID dialog"
FILE = f"{NO_REGISTER}only the configuration file holds it"
PLC = "plc."


def beside_pages(book: RegisterBook, thing: Thing, asked: Asked) -> list[Page]:
    """A key by its whole path its last part or its section, with each loop of the configuration that gives it."""
    loop, _, rest = thing.name.partition(".")
    loops = asked.config.loops if asked.config is not None else ()
    wanted, only = (rest, loop) if rest and loop in loops else (thing.name, None)
    name = wanted.lower()
    found = [path for path in book.beside if name == path] or [p for p in book.beside if p.endswith(f".{name}")]
    found = found or [p for p in book.beside if name in p.split(".")[:-1]]
    if found and thing.value is not None:
        raise ThingError(f"{thing.text}: {found[0]} {book.beside[found[0]]}; it has no content to explain")
    return [page for path in found for page in _pages(book, path, asked, only)]


def _pages(book: RegisterBook, path: str, asked: Asked, only: str | None) -> Iterator[Page]:
    origins: list[Origin | None] = [o for o in _origins(path, asked) if only in {None, o.loop}]
    for at in origins or [None]:
        text = key_text(book.key, path)
        yield Page(
            kind="parameter",
            name=path if at is None or at.loop is None else f"{at.loop}.{path}",
            title=text.partition(": ")[0].partition("; ")[0].rstrip("."),
            vendor=book.key,
            vendor_title=book.title,
            value=None if at is None else Value(at.text, at.text),
            holds=text,
            access="setting",
            by=book.beside[path],
            key=path,
            loop=None if at is None else at.loop,
            origins=() if at is None else (at,),
        )


def _origins(path: str, asked: Asked) -> Iterator[Origin]:
    """The lines of the configuration that give a key."""
    if asked.config is None:
        return
    steps: tuple[str | int, ...] = tuple(path.split("."))
    places: list[tuple[tuple[str | int, ...], str | None]] = [(steps, None)]
    if not path.startswith(PLC):
        places = [(("loops", i, *steps), loop) for i, loop in enumerate(asked.config.loops)]
    for place, loop in places:
        if (found := asked.config.origin(place, loop)) is not None:
            yield found
