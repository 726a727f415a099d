"""``python -m pidcfg``, and the command itself: a Ctrl-C while the program is loaded is one as well."""

import sys

INTERRUPTED = 130


def main() -> None:
    """Runs the command line."""
    try:
        from pidcfg.cli.main import main as run
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    run()


if __name__ == "__main__":
    main()
