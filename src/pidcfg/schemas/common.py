"""What the files of every vendor say in the same words."""

from __future__ import annotations

from pidcfg.schemas.base import FormatVersion, Model, Name, Text


class ConfigurationFile(Model):
    """The head of a configuration; each vendor adds its loops."""

    pidcfg: FormatVersion
    """Version of the file format."""
    vendor: str
    """The PLC family."""
    name: Text | None = None
    """Name of the machine or plant section."""
    description: Text | None = None
    """Anything worth knowing."""


class SectionSettings(Model):
    """What a listing says beside its words for the whole file."""

    name: Text | None = None
    """Name of the machine or plant section."""
    description: Text | None = None
    """Anything worth knowing."""


class LoopNameSettings(Model):
    """What a listing says beside its words of one loop."""

    loop: Name
    """Name of the loop."""
    description: Text | None = None
    """What the loop does."""
