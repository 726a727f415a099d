"""``python -m pidcfg``, and the command itself: a Ctrl-C while the program is loaded is one as well."""

import atexit
import gc
import sys

INTERRUPTED = 130
FEW_COLLECTIONS = (500_000, 20, 20)
"""A command makes hardly any cycles, 25 objects a file: searching for them after every 700 objects takes a fifth of its
time, and once more at its end, where the system takes all memory back at once."""


def main() -> None:
    """Runs the command line."""
    gc.set_threshold(*FEW_COLLECTIONS)
    atexit.register(gc.freeze)
    try:
        from pidcfg.cli.main import main as run
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    run()


if __name__ == "__main__":
    main()
