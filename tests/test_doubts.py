"""BCD words that seem typed in decimal, and a loop table that no loop is calculated of: told, and never changed."""

import pytest

import golden
import pidcfg
from command import run_text
from pidcfg.encoders.codecs import Bcd, DecodeError

REACTOR = golden.EXAMPLES / "dl06" / "reactor.yaml"


def listing(changes=None, *, bare=False):
    """The words of the reactor as text, some with another content; ``bare``: without what no register holds."""
    lines = pidcfg.encode(REACTOR, format="text").text.splitlines()
    rows = [line.split()[:2] for line in lines if not line.startswith("#")]
    changes = changes or {}
    head = [] if bare else [line for line in lines if line.startswith("#")]
    return "\n".join([*head, *(f"{a} {changes.get(a, word)}" for a, word in rows)]) + "\n"


def decoded(text, **more):
    return pidcfg.decode(text.encode(), "dl06", **more)


@pytest.mark.parametrize(
    ("codec", "word", "said"),
    [
        (Bcd(2), 0x00FA, "it is 250 (typed in decimal? 2.50 would be 0250)"),
        (Bcd(1), 0x070A, "it is 1802 (typed in decimal? 180.2 would be 1802)"),
        (Bcd(0), 0x000A, "it is 10 (typed in decimal? 10 would be 0010)"),
        (Bcd(1, off=(9999,)), 0x270F, "it is 9999 (typed in decimal? 999.9 (off) would be 9999)"),
    ],
)
def test_a_word_that_is_no_bcd_is_told_as_the_number_that_it_is_in_decimal(codec, word, said):
    with pytest.raises(DecodeError, match="has a digit above 9") as error:
        codec.decode(word)
    assert str(error.value).endswith(said)


def test_a_word_beyond_four_digits_was_not_typed_in_decimal():
    with pytest.raises(DecodeError, match=r"has a digit above 9$"):
        Bcd(2).decode(0xFA00)


def test_the_bcd_words_of_the_same_loop_are_suspected_and_nothing_is_changed():
    plain, found = decoded(listing()), decoded(listing({"V2010": "00FA"}))
    assert plain.suggestion == ""
    assert not [note for note in plain.notes if "decimal, too" in note]
    (beside,) = [note for note in found.notes if "typed in decimal, too" in note]
    assert beside.startswith("FIC-102: beside V2010 these may be typed in decimal, too: V2007 0020 is 0.20, or 0.32")
    assert "V2011 0040 is 4.0, or 6.4" in beside
    assert "V2050" not in beside  # another loop
    tuning = [loop["tuning"] for loop in (plain.data["loops"][0], found.data["loops"][0])]
    assert tuning == [{"gain": 0.8, "reset": 4, "rate": 0}, {"gain": 0, "reset": 4, "rate": 0}]
    assert found.data["loops"][1:] == plain.data["loops"][1:]


def test_a_slope_of_a_profile_is_a_bcd_word_of_its_loop():
    found = decoded(listing({"V3001": "00CD"}))
    (beside,) = [note for note in found.notes if "typed in decimal, too" in note]
    assert beside.startswith("TIC-101: beside V3001 ")
    assert "V2050 0250 is 2.50, or 5.92 if 592 was typed in decimal" in beside


@pytest.mark.parametrize("bare", [False, True])
def test_the_suggested_listing_differs_in_the_words_that_are_no_bcd_alone(bare):
    options = {"loop_table": "V2000", "number_of_loops": "3"} if bare else {}
    found = decoded(listing({"V2010": "0050", "V2050": "00FA", "V2047": "00C8"}, bare=bare), options=options)
    assert (
        decoded(found.suggestion, options=options).data
        == decoded(listing({"V2010": "0050"}, bare=bare), options=options).data
    )
    marked = [line.split(None, 1)[0] for line in found.suggestion.splitlines() if "  # " in line]
    assert {"V2047", "V2050", "V2051", "V2052"} <= set(marked)
    assert "V2010" not in marked  # its loop has nothing that is no BCD
    lines = {line.split(None, 1)[0]: line for line in found.suggestion.splitlines()}
    assert lines["V2050"].endswith("# 00FA is no BCD; 2.50 if 250 was typed in decimal")
    assert lines["V2051"].split()[1] == "1800"
    assert lines["V2051"].endswith("# 1800 is 180.0, or 614.4 if 6144 was typed in decimal")


def test_the_command_writes_the_suggestion_on_request_alone(tmp_path):
    (tmp_path / "up.txt").write_text(listing({"V2010": "00FA"}), "utf-8")
    plain = run_text("decode", "up.txt", "--vendor", "dl06", cwd=tmp_path)
    assert "note: --suggest FILE writes the corrected listing, with both readings" in plain.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["up.txt"]
    done = run_text("decode", "up.txt", "--vendor", "dl06", "--suggest", "new.txt", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, plain.stdout)
    assert "V2010   0250    592  FIC-102  gain" in (tmp_path / "new.txt").read_text("utf-8")
    again = run_text("decode", "new.txt", "--vendor", "dl06", "--suggest", "none.txt", cwd=tmp_path)
    assert "note: none.txt is not written: no word seems typed in decimal" in again.stderr
    assert not (tmp_path / "none.txt").exists()


@pytest.mark.parametrize("options", [("--suggest", "-"), ("--suggest", "a.txt", "--annotate")])
def test_a_suggestion_needs_a_file_and_no_meanings(tmp_path, options):
    (tmp_path / "up.txt").write_text(listing(), "utf-8")
    done = run_text("decode", "up.txt", "--vendor", "dl06", *options, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")


def test_a_table_that_no_loop_is_calculated_of_is_told():
    bare = decoded(listing({"V7641": "0000"}, bare=True))
    assert bare.data["loops"] == []
    assert "V7641 is 0: the PLC calculates no loop; --number-of-loops reads the table all the same" in bare.notes
    whole = decoded(listing({"V7641": "0000"}))
    assert len(whole.data["loops"]) == 3
    assert "V7641 is 0: the PLC calculates no loop" in whole.notes
    read = decoded(listing({"V7641": "0000"}, bare=True), options={"number_of_loops": "3"})
    assert len(read.data["loops"]) == 3
    assert "V7641 is 0: the PLC calculates no loop" in read.notes
