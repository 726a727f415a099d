"""Terms of any vendor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.differences.memory_terms import memory_terms
from pidcfg.differences.parameter_terms import parameter_terms
from pidcfg.encoders.parameters import Program

if TYPE_CHECKING:
    from pidcfg.differences.terms import Subject, Terms


def terms_of(subject: Subject) -> Terms:
    """A side by its registers, or by its named parameters."""
    return (parameter_terms if isinstance(subject.encoding.image, Program) else memory_terms)(subject)
