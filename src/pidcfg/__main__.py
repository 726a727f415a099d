"""``python -m pidcfg``, and the command itself: a Ctrl-C while the program is loaded is one as well."""

import sys

INTERRUPTED, TERMINATED = 130, 143
FEW_COLLECTIONS = (500_000, 20, 20)
"""A command makes hardly any cycles, 25 objects a file: searching for them after every 700 objects takes a fifth of its
time, and once more at its end, where the system takes all memory back at once."""


def main() -> None:
    """Runs the command line."""
    try:
        from pidcfg.cli import interrupts

        interrupts.install_handlers()
        import atexit
        import gc

        gc.set_threshold(*FEW_COLLECTIONS)
        atexit.register(gc.freeze)
        from pidcfg.cli.main import main as run
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    try:
        run()
    except SystemExit as end:
        if end.code in {INTERRUPTED, TERMINATED}:
            _leave(end.code)
        raise


def _leave(code: int) -> None:
    """Ends the process at once: taking a large run or compiled kernels apart takes longer than to stop the run."""
    import atexit
    import os
    from contextlib import suppress

    atexit._run_exitfuncs()  # noqa: SLF001 - what Python does first, too; temporary files are removed there
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(code)


if __name__ == "__main__":
    main()
