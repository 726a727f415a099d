"""What bytes that are no UTF-8 text seem to be, by their first ones: other kinds of file, and UTF-16 without a mark."""

from __future__ import annotations

SAVE_AS_UTF8 = "save the file as UTF-8"
EXPORT = "export it as text, or write the configuration as YAML"
MAGIC = (
    (b"PK\x03\x04", "an Excel or ZIP file", "save the sheet as CSV, or unpack the archive"),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an old Excel or Word file", "save the sheet as CSV"),
    (b"%PDF-", "a PDF file", EXPORT),
    (b"\x1f\x8b", "a gzip file", "unpack it first"),
    (b"7z\xbc\xaf\x27\x1c", "a 7-Zip file", "unpack it first"),
    (b"\x89PNG", "a picture", EXPORT),
    (b"\xff\xd8\xff", "a picture", EXPORT),
    (b"SQLite format 3\x00", "a database", EXPORT),
)
"""Files that are not text: how they begin, what they are, and what to do."""
UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
LOOKED_AT = 400
"""Bytes that tell UTF-16 without a mark: every other one of a text in letters, spaces and digits is 0."""


def binary_file(data: bytes) -> tuple[str, str] | None:
    """What a file is that is no text, with its cure; None where its first bytes say nothing."""
    return next((("the file is " + kind, cure) for begins, kind, cure in MAGIC if data.startswith(begins)), None)


def other_file(data: bytes) -> tuple[str, str] | None:
    """What a file is that is no UTF-8 text, with its cure; None where its first bytes say nothing."""
    if binary := binary_file(data):
        return f"{binary[0]}, not text", binary[1]
    if data[:2] in UTF16_MARKS or _is_unmarked_utf16(data[:LOOKED_AT]):
        return "the file is UTF-16, not UTF-8", SAVE_AS_UTF8
    return None


def _is_unmarked_utf16(head: bytes) -> bool:
    """Whether (nearly) every other byte is 0, and hardly one of the rest."""
    even, odd = head[::2], head[1::2]
    if len(odd) < 2:
        return False
    few, most = sorted((even.count(0) / len(even), odd.count(0) / len(odd)))
    return few < 0.1 and most > 0.6
