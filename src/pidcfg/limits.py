"""Limits on untrusted input, all in one place; the command line may raise them, a file never can."""

from __future__ import annotations

from pidcfg.frozen import frozen


@frozen
class Limits:
    """How large an input may be before it is refused (exit code 2, naming the limit)."""

    file_bytes: int = 3 << 20
    depth: int = 32
    nodes: int = 50_000
    aliases: int = 100
    scalar_bytes: int = 4 << 10
    key_bytes: int = 256
    loops: int = 1_000
    files: int = 10_000
    loop_steps: int = 100_000_000


DEFAULT = Limits()
