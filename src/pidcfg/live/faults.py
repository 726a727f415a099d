"""What is wrong with a line, in words: bytes that are no answer, and devices that cannot be opened."""

from __future__ import annotations

import os
from contextlib import suppress

TERMINAL_ERRORS: tuple[type[Exception], ...] = ()
"""What a system raises for a device that takes no baud rate or parity; it is no `OSError`."""
with suppress(ImportError):  # Windows has no such thing
    import termios

    TERMINAL_ERRORS = (termios.error,)

MBAP = 8
"""Bytes from which on a frame of Modbus TCP tells whose answer it is: transaction, protocol, length, unit, function."""
PROTOCOL, LENGTH, UNIT = slice(2, 4), slice(4, 6), 6


def what_came(sent: bytes, came: bytes, *, is_serial: bool) -> str:
    """What came instead of the answer to a request; empty: nothing."""
    count = len(came)
    if not came or is_serial:
        return f"{count} bytes that make none" if came else ""
    if any(came[PROTOCOL]):
        return "bytes that are no Modbus"
    if count < MBAP:
        return f"{count} bytes of one"
    if came[:2] != sent[:2] or came[UNIT] != sent[UNIT]:
        return f"one of unit {came[UNIT]}" if came[:2] == sent[:2] else "one to another request"
    whole = int.from_bytes(came[LENGTH]) + LENGTH.stop
    return f"{count} of {whole} bytes of one" if count < whole else "bytes that make none"


def serial_reason(device: str) -> str:
    """What the system says of a serial device."""
    import serial

    try:
        serial.Serial(device).close()
    except OSError as error:
        return os.strerror(error.errno) if error.errno else "it is no serial line"
    except ValueError as error:
        return str(error)
    return "the device cannot be opened"
