"""Prints the base step in one piece, as CPython runs it for a loop: ``python tasks.py bench --show dl06``."""

from __future__ import annotations

import argparse
from typing import Any

import production

from pidcfg.sim import pieces
from pidcfg.sim.engine import python_kernels


def text_of(vendor: str) -> str:
    """The piece with which the vendor's production run begins, and what it is right for."""
    case = production.loaded(production.configuration(vendor, 1), production.scenario(vendor, 1, 2000, noise=False))
    several: Any = python_kernels(case.controller).advance
    pieces.OFTEN = 0
    production.ours(case, "python")
    return str(several.__self__.steps[-1].text)


def main() -> None:
    """For the vendor that the command line names."""
    parser = argparse.ArgumentParser(description="the base step in one piece")
    parser.add_argument("vendor", choices=production.VENDORS)
    print(text_of(parser.parse_args().vendor), end="")


if __name__ == "__main__":
    main()
