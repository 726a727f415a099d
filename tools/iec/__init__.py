"""Structured Text of IEC 61131-3, read and executed: what pidcfg writes is run by something that is not pidcfg.

`syntax` reads a text, `machine` executes it. Only the subset that the encoders write is there; everything else is
refused with its line. Nothing here imports pidcfg: the blocks of a vendor's library are given by whoever runs a text.

It is written here because no package of PyPI, npm or Debian runs Structured Text: matiec, rusty and ironplc are not
there, and blark parses only.
"""
