"""What goes wrong between here and a PLC."""

from __future__ import annotations


class PlcError(ConnectionError):
    """A PLC that cannot be reached, or does not give what was asked for: one line with host, function and register."""


class AddressError(ValueError):
    """An address that no PLC can be reached at, or listened on; the message says how to write one."""
