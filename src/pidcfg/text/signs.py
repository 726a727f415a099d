"""Signs and bytes that are not what they look like, how wide a text is, and which name was probably meant."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable
from itertools import takewhile

# ----------------------------------------------------------------------------------------------------------------------
# What is no text where it stands: what would move a cursor, end a line, hide what is written, or command a CI job.

CONTROL_SIGNS = "\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"
"""DEL, the control characters of Latin-1, separators of lines, and what turns the direction of writing round."""
UNPRINTABLE = re.compile(f"[\x00-\x08\x0b-\x1f{CONTROL_SIGNS}]")
"""What must reach no terminal, log or page as it is."""
CI_COMMAND = re.compile(r"(?:^|(?<=\r))[^\S\r\n]*:(?=:)|#(?=#\w*\[)", re.MULTILINE)
"""How an order begins that a CI system takes out of a log: ``::add-mask::`` of GitHub first on a line, and anywhere its
``##[add-mask]``, ``##vso[…]`` of Azure and ``##teamcity[…]``; a sign behind it is the end of the order."""
FORMULA_STARTS = ("=", "+", "-", "@", "\uff1d", "\uff0b", "\uff0d", "\uff20", "\t", "\r", "\n", "'")
"""How a text begins that a spreadsheet would calculate, the wide signs too, or whose first character it would drop."""


def to_printable(text: str) -> str:
    """Text for people and logs: a control character other than tab and line feed shows as U+FFFD."""
    return UNPRINTABLE.sub("\N{REPLACEMENT CHARACTER}", text)


def find_ci_command(text: str) -> re.Match[str] | None:
    """Where a CI system finds an order first."""
    return CI_COMMAND.search(text) if "::" in text or "##" in text else None


def break_ci_commands(text: str) -> str:
    """Text for people and logs in which no CI system finds an order: a blank stands where one would begin."""
    return text if find_ci_command(text) is None else CI_COMMAND.sub(lambda begin: f"{begin[0]} ", text)


def to_one_line(text: str) -> str:
    """Text that has one line of an output to itself: a line break in it would begin another one, of any meaning."""
    return " ".join(to_printable(text).splitlines())


# ----------------------------------------------------------------------------------------------------------------------
# How many columns a text takes on a terminal: a Chinese, Japanese or Korean sign takes two, a combining one none.

WIDE_CLASSES = frozenset("WF")
"""Classes of East Asian width that take two columns (Unicode Standard Annex 11)."""


def width_of(text: str) -> int:
    """The columns that a text takes."""
    if text.isascii():
        return len(text)
    from unicodedata import category, east_asian_width

    return sum(0 if category(c) in {"Mn", "Me", "Cf"} else 1 + (east_asian_width(c) in WIDE_CLASSES) for c in text)


def pad_right(text: str, width: int) -> str:
    """The text with blanks behind it up to a width in columns."""
    return text + " " * (width - width_of(text))


def pad_left(text: str, width: int) -> str:
    """The text with blanks before it up to a width in columns."""
    return " " * (width - width_of(text)) + text


# ----------------------------------------------------------------------------------------------------------------------
# Signs that only look like those of YAML, of numbers and of keys: what they are called, and what they are taken for.
# Word processors, web pages and keyboards of other languages make them. They are letters to YAML, so that nothing is
# read as what it looks like: a message names the sign, and a person chooses.

BLANKS = {
    "\N{NO-BREAK SPACE}": "a no-break space",
    "\N{NARROW NO-BREAK SPACE}": "a narrow no-break space",
    "\N{FIGURE SPACE}": "a figure space",
    "\N{THIN SPACE}": "a thin space",
    "\N{EN SPACE}": "an en space",
    "\N{EM SPACE}": "an em space",
    "\N{IDEOGRAPHIC SPACE}": "an ideographic space",
    "\N{ZERO WIDTH SPACE}": "a zero width space",
    "\N{ZERO WIDTH NO-BREAK SPACE}": "a byte order mark",
}
DASHES = "\N{HYPHEN}\N{NON-BREAKING HYPHEN}\N{FIGURE DASH}\N{EN DASH}\N{EM DASH}\N{MINUS SIGN}"
QUOTES = {
    "\N{LEFT DOUBLE QUOTATION MARK}": "\N{RIGHT DOUBLE QUOTATION MARK}",
    "\N{RIGHT DOUBLE QUOTATION MARK}": "\N{RIGHT DOUBLE QUOTATION MARK}",
    "\N{DOUBLE LOW-9 QUOTATION MARK}": "\N{LEFT DOUBLE QUOTATION MARK}\N{RIGHT DOUBLE QUOTATION MARK}",
    "\N{LEFT SINGLE QUOTATION MARK}": "\N{RIGHT SINGLE QUOTATION MARK}",
    "\N{RIGHT SINGLE QUOTATION MARK}": "\N{RIGHT SINGLE QUOTATION MARK}",
    "\N{SINGLE LOW-9 QUOTATION MARK}": "\N{LEFT SINGLE QUOTATION MARK}\N{RIGHT SINGLE QUOTATION MARK}",
    "\N{LEFT-POINTING DOUBLE ANGLE QUOTATION MARK}": "\N{RIGHT-POINTING DOUBLE ANGLE QUOTATION MARK}",
    "\N{RIGHT-POINTING DOUBLE ANGLE QUOTATION MARK}": "\N{LEFT-POINTING DOUBLE ANGLE QUOTATION MARK}",
}
"""Quotes of word processors, and those that close them, by language."""
FULL_WIDTH = range(0xFF01, 0xFF5F)
"""The signs of ASCII as wide as a Chinese character."""
BLANK = re.compile("[" + "".join(BLANKS) + "]")


def ascii_equivalent(sign: str) -> str:
    """The sign of ASCII that a sign is taken for; itself where there is none."""
    if sign in BLANKS:
        return " "
    if sign in DASHES:
        return "-"
    if sign in QUOTES:
        return '"'
    if ord(sign) in FULL_WIDTH:
        return chr(ord(sign) - FULL_WIDTH.start + ord("!"))
    digit = unicodedata.decimal(sign, None)
    return sign if digit is None else str(digit)


def to_ascii(text: str) -> str:
    """A text with the signs that its own are taken for, without blanks and quotes around it."""
    return "".join(map(ascii_equivalent, text)).strip(' "')


def code_point(sign: str) -> str:
    """A sign as a message names it: it may be invisible."""
    return f"U+{ord(sign):04X}"


def describe_sign(sign: str) -> str:
    """What a sign is, and what it is not."""
    if sign in BLANKS:
        return f"{BLANKS[sign]}, not a space"
    if sign in DASHES:
        return "a dash, not a minus"
    if sign in QUOTES:
        return "a quote, not a quote of YAML"
    return unicodedata.name(sign, "a sign without a name")


def find_lookalike(text: str) -> str | None:
    """The first sign of a text that looks like another one: not ASCII in a word that is, or taken for ASCII."""
    taken = next((sign for sign in text if ascii_equivalent(sign) != sign), None)
    if taken is not None:
        return taken
    latin = any(sign.isascii() and sign.isalpha() for sign in text)
    return next((sign for sign in text if latin and _is_foreign(sign)), None)


def _is_foreign(sign: str) -> bool:
    """Whether a sign is a letter of another alphabet than the Latin one."""
    return sign.isalpha() and not unicodedata.name(sign, "LATIN").startswith("LATIN")


def lookalike_remark(text: str) -> str:
    """What a message adds about the odd sign of a text; empty: there is none."""
    sign = find_lookalike(text)
    return f": {code_point(sign)} in it is {describe_sign(sign)}" if sign else ""


def is_curly_quoted(text: str) -> bool:
    """Whether a text begins and ends with quotes that are none of YAML's."""
    return len(text) > 1 and text[-1] in QUOTES.get(text[0], "")


# ----------------------------------------------------------------------------------------------------------------------
# What bytes that are no UTF-8 text seem to be, by their first ones: other kinds of file, and UTF-16 without a mark.

SAVE_AS_UTF8 = "save the file as UTF-8"
EXPORT_CURE = "export it as text, or write the configuration as YAML"
MAGIC = (
    (b"PK\x03\x04", "an Excel or ZIP file", "save the sheet as CSV, or unpack the archive"),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an old Excel or Word file", "save the sheet as CSV"),
    (b"%PDF-", "a PDF file", EXPORT_CURE),
    (b"\x1f\x8b", "a gzip file", "unpack it first"),
    (b"7z\xbc\xaf\x27\x1c", "a 7-Zip file", "unpack it first"),
    (b"\x89PNG", "a picture", EXPORT_CURE),
    (b"\xff\xd8\xff", "a picture", EXPORT_CURE),
    (b"SQLite format 3\x00", "a database", EXPORT_CURE),
)
"""Files that are not text: how they begin, what they are, and what to do."""
UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
UTF16_SAMPLE = 400
"""Bytes that tell UTF-16 without a mark: every other one of a text in letters, spaces and digits is 0."""


def describe_binary(data: bytes) -> tuple[str, str] | None:
    """What a file is that is no text, with its cure; None where its first bytes say nothing."""
    return next((("the file is " + kind, cure) for begins, kind, cure in MAGIC if data.startswith(begins)), None)


def describe_non_utf8(data: bytes) -> tuple[str, str] | None:
    """What a file is that is no UTF-8 text, with its cure; None where its first bytes say nothing."""
    if binary := describe_binary(data):
        return f"{binary[0]}, not text", binary[1]
    if data[:2] in UTF16_MARKS or _is_unmarked_utf16(data[:UTF16_SAMPLE]):
        return "the file is UTF-16, not UTF-8", SAVE_AS_UTF8
    return None


def _is_unmarked_utf16(head: bytes) -> bool:
    """Whether (nearly) every other byte is 0, and hardly one of the rest."""
    even, odd = head[::2], head[1::2]
    if len(odd) < 2:
        return False
    few, most = sorted((even.count(0) / len(even), odd.count(0) / len(odd)))
    return few < 0.1 and most > 0.6


# --- Names that were probably meant -----------------------------------------------------------------------------------

FIELD_TERMS = (
    ({"p", "kp", "kc", "pgain", "gain"}, ("gain", "proportional_gain", "Kp", "Kc_Kp")),
    (
        {"i", "ti", "tn", "reset", "resettime", "integral", "integraltime"},
        ("reset", "reset_time", "integral_time", "Ti_Ki"),
    ),
    ({"d", "td", "tv", "rate", "derivative", "derivativetime"}, ("rate", "derivative_time", "Td_Kd")),
    ({"sp", "sv", "setpoint"}, ("setpoint", "SP", "SV", "set: {setpoint: …}")),
    ({"mv", "cv", "out", "output"}, ("output", "set: {output: …}")),
    ({"ll", "lolo"}, ("low_low",)),
    ({"l", "lo"}, ("low",)),
    ({"h", "hi"}, ("high",)),
    ({"hh", "hihi"}, ("high_high",)),
    ({"time", "t", "when"}, ("at",)),
)
"""What engineers call a setting, and the keys that it has, of which a place knows one."""
WORD_SEPARATORS = str.maketrans("", "", "-_ ")


def fold_word(word: str) -> str:
    """A word without capitals, hyphens, underscores and blanks."""
    return word.casefold().translate(WORD_SEPARATORS)


def key_of_term(key: str, known_keys: Collection[str]) -> str | None:
    """The known key that a word of the field stands for; None where there is none."""
    names = next((names for words, names in FIELD_TERMS if fold_word(key) in words), ())
    return next((name for name in names if name in known_keys), None)


def closest_name(word: str, names: Iterable[str]) -> str | None:
    """The name that was probably meant: the most alike, of equals the one that begins alike."""
    from difflib import SequenceMatcher, get_close_matches

    candidates = get_close_matches(word, names, 4, 0.5)
    likeness = SequenceMatcher(b=word)

    def rank(name: str) -> tuple[float, int]:
        likeness.set_seq1(name)
        alike = takewhile(lambda pair: pair[0] == pair[1], zip(name, word, strict=False))
        return likeness.ratio(), sum(1 for _ in alike)

    return max(candidates, key=rank, default=None)


def match_ignoring_case(value: object, choices: Iterable[str]) -> str | None:
    """The only word that differs from a value in capitals alone."""
    same = [word for word in choices if isinstance(value, str) and word.casefold() == value.casefold()]
    return same[0] if len(same) == 1 else None
