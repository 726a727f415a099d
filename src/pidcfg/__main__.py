"""``python -m pidcfg``."""

from pidcfg.cli.main import main

main()
