"""Terms of any vendor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.differences.memory_terms import memory_terms
from pidcfg.differences.parameter_terms import parameter_terms
from pidcfg.differences.raw_terms import unplaced
from pidcfg.encoders.parameters import Program
from pidcfg.listings import name_in

if TYPE_CHECKING:
    from pidcfg.differences.terms import Subject, Terms


def terms_of(subject: Subject) -> Terms:
    """A side by its registers, or by its named parameters; of a listing without a configuration also all else of it."""
    image, reading = subject.encoding.image, subject.reading
    is_named = isinstance(image, Program)
    terms = (parameter_terms if is_named else memory_terms)(subject)
    if reading is not None and reading.fault:
        held = reading.listing.words if is_named or reading.listing.mixed else image.words
        names = {name_in(entry) for entry in image.settings}
        terms.owners[0].items.update(unplaced(reading.listing, subject.vendor, held, names))
    return terms
