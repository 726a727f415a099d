"""The words of a DL06 loop table, read as chapter 8 of the manual defines them."""

from __future__ import annotations


def bcd(word):
    """A BCD word as a whole number; one with a digit above 9 counts as 0 (D50)."""
    text = f"{word:04X}"
    return int(text) if text.isdecimal() else 0


def signed(word, top):
    """Sign and magnitude (D02)."""
    return -(word & top) if word & 0x8000 else word


class Words:
    """The 32 words of a loop; `mode` and `mode2` are bits of +00 and +01."""

    def __init__(self, memory, table):
        self.memory, self.table = memory, table

    def __getitem__(self, offset):
        return self.memory[self.table + offset]

    def mode(self, bit):
        return self[0] >> bit & 1

    def mode2(self, bit):
        return self[1] >> bit & 1

    def pv_ends(self):
        """The data format of SP and PV."""
        return ends(self.mode2(0), self.mode2(1), self.mode2(9))

    def out_ends(self):
        """The data format of the output."""
        return ends(self.mode2(11), self.mode2(12), self.mode2(13)) if self.mode2(10) else self.pv_ends()

    def pv_word(self, offset):
        """A place on the PV's scale."""
        low, high = self.pv_ends()
        return signed(self[offset], high) if low else self[offset]

    def out_word(self, offset):
        """A place on the output's scale."""
        low, high = self.out_ends()
        return signed(self[offset], high) if low else self[offset]

    def distance(self, offset):
        """A distance: a plain number of counts."""
        return self[offset]

    def pv_format(self):
        """The PV's data format in words."""
        low, high = self.pv_ends()
        return f"{ ({4095: 12, 32767: 15}.get(high, 16)) }-bit {'bipolar' if low else 'unipolar'}"


def ends(bipolar, fifteen, sixteen):
    """The ends of a data format by its bits."""
    if sixteen:
        return 0, 65535
    top = 32767 if fifteen else 4095
    return (-top if bipolar else 0), top
