"""The public calls that return models and images themselves, for programs that work with them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from pidcfg.limits import DEFAULT
from pidcfg.reader import data_of, read_file
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.encoders.image import Decoded
    from pidcfg.validate.engine import Checked


def check_text(text: str | bytes, file: str = "<text>") -> Checked:
    """A configuration as text: its findings, and when it is sound its model and its ``encoding.image``.

    Nothing is raised for what is wrong with the text; it is in ``findings``.
    """
    from pidcfg.results.sources import checked_of

    return checked_of(data_of(text), file, None, DEFAULT)


def check_file(path: str | Path) -> Checked:
    """A configuration file. Raises `OSError` when it cannot be read."""
    return check_text(read_file(path), Path(path).as_posix())


def decode_words(vendor: str, words: Mapping[int, int], **options: Any) -> Decoded:
    """Words by address back to a configuration as plain data; options as in ``pidcfg decode``.

    Raises `KeyError` for a vendor that is not known and `pidcfg.encoders.words.DecodeError` for words that are missing
    or impossible.
    """
    decoded: Decoded = VENDORS[vendor].load("decode")(words, options=options)
    return decoded
