"""What is said of every name of the tables is what the committed pages say, byte for byte."""

from __future__ import annotations

import pytest

import explained
from pidcfg.vendors import VENDORS


@pytest.mark.parametrize("vendor", VENDORS)
def test_what_is_said_of_every_name(vendor):
    assert explained.pages(vendor).encode() == (explained.FOLDER / f"{vendor}.txt").read_bytes()
