"""Configurations to register words and back: codecs, register maps and one writer per file kind."""
