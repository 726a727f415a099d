"""The commands as a user meets them: output, exit codes, files."""

from __future__ import annotations

import json
import os
import random
import re
import shlex
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from browser import IN_CI, NAMES
from command import run
from pidcfg.cli import console as errors
from pidcfg.cli import main
from pidcfg.cli.main import COMMANDS, cli
from pidcfg.cli.outputs import write_files
from pidcfg.vendors import VENDORS
from whatif_rig import make_runtime

ROOT = Path(__file__).parents[1]
REACTOR = ROOT / "examples" / "dl06" / "reactor.yaml"


@pytest.fixture
def reactor(tmp_path: Path) -> Path:
    """A copy of the reactor that a test may change."""
    path = tmp_path / "reactor.yaml"
    path.write_bytes(REACTOR.read_bytes())
    return path


def changed(path: Path, old: str, new: str) -> Path:
    """The file with one text replaced; the text must be there."""
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), "utf-8")
    return path


def test_a_good_file_passes(reactor):
    result = run("validate", str(reactor))
    assert result.returncode == 0, result.stdout.decode()
    assert "1 file checked: 0 errors" in result.stderr.decode()


def test_a_finding_shows_line_caret_limit_and_cure(reactor):
    changed(reactor, "gain: 0.80", "gain: 120")
    result = run("validate", reactor.name, "--severity", "error", cwd=reactor.parent)
    assert result.returncode == 1
    lines = result.stdout.decode().splitlines()
    assert lines[0] == "reactor.yaml:17:20: error PID101: gain is 120 %/%; allowed is 0 to 99.99 %/% [FIC-102]"
    assert lines[1] == "   17 |     tuning: {gain: 120, reset: 4.0, reset_unit: seconds, rate: 0}"
    assert lines[2] == "      |                    ^^^"
    assert any(line.startswith("      = cure: ") for line in lines)
    assert "\x1b" not in result.stdout.decode(), "no colour in a pipe"


def test_json_findings_have_the_published_layout(reactor):
    changed(reactor, "gain: 0.80", "gain: 120")
    result = run("validate", str(reactor), "--format", "json", "--severity", "error")
    document = json.loads(result.stdout)
    assert result.returncode == 1
    assert document["version"] == 1
    assert document["summary"] == {"files": 1, "errors": 1, "warnings": 0, "infos": 0}
    (found,) = document["findings"]
    assert (found["code"], found["severity"], found["line"], found["column"]) == ("PID101", "error", 17, 20)
    assert (found["path"], found["loop"]) == ("loops[0].tuning.gain", "FIC-102")
    assert list(found) == [
        "code",
        "severity",
        "message",
        "file",
        "line",
        "column",
        "end_line",
        "end_column",
        "path",
        "loop",
        "with",
        "plc_effect",
        "reference",
        "help",
        "url",
    ]
    assert (found["end_line"], found["end_column"]) == (17, 23)
    assert found["url"].startswith("rules-common.html#pid101-")


def test_json_is_one_valid_document_even_when_nothing_could_be_read(tmp_path):
    result = run("validate", "none.yaml", "--format", "json", cwd=tmp_path)
    assert result.returncode == 2
    assert json.loads(result.stdout)["findings"][0]["code"] == "PID040"


def test_one_bad_file_does_not_hide_the_findings_of_another(reactor, tmp_path):
    (tmp_path / "broken.yaml").write_text("pidcfg: 1\nvendor: [\n", "utf-8")
    changed(reactor, "gain: 0.80", "gain: 120")
    result = run("validate", str(tmp_path), "--format", "json")
    assert result.returncode == 2, "unusable input outweighs findings"
    assert {f["code"] for f in json.loads(result.stdout)["findings"]} >= {"PID001", "PID101"}


def test_findings_point_through_aliases_at_the_text_to_edit(tmp_path):
    text = (ROOT / "examples/dl06/extruder.yaml").read_text("utf-8").replace("gain: 4.00", "gain: 400", 1)
    (tmp_path / "x.yaml").write_text(text, "utf-8")
    found = json.loads(run("validate", "x.yaml", "--format", "json", "--severity", "error", cwd=tmp_path).stdout)
    line = next(i for i, row in enumerate(text.splitlines(), start=1) if "gain: 400" in row)
    assert [(f["code"], f["line"]) for f in found["findings"]] == [("PID101", line)] * 4, (
        "of each loop, where it is written"
    )
    assert [f["loop"] for f in found["findings"]] == ["TIC-Z1", "TIC-Z2", "TIC-Z3", "TIC-Z4"]


def test_folders_take_files_with_our_key_only(reactor, tmp_path):
    (tmp_path / "other.yaml").write_text("services: {}\n", "utf-8")
    (tmp_path / ".hidden").mkdir()
    (tmp_path / ".hidden" / "x.yaml").write_text("pidcfg: 1\n", "utf-8")
    assert "1 file checked" in run("validate", str(tmp_path)).stderr.decode()


def test_patterns_that_the_shell_has_left_alone_are_expanded(reactor, tmp_path):
    assert "1 file checked" in run("validate", "*.yaml", cwd=tmp_path).stderr.decode()
    assert run("validate", "*.nothing", cwd=tmp_path).returncode == 2


def test_folders_do_not_pass_over_files_of_ours_that_cannot_be_read(tmp_path):
    """A file saved as UTF-16, or with a tab before the key, is ours to complain about; others are counted."""
    (tmp_path / "good.yaml").write_bytes(REACTOR.read_bytes())
    (tmp_path / "u16.yaml").write_bytes("pidcfg: 1\n".encode("utf-16"))
    (tmp_path / "tab.yaml").write_text("\tpidcfg: 1\n", "utf-8")
    (tmp_path / "compose.yaml").write_text("services: {}\n", "utf-8")
    result = run("validate", str(tmp_path), "--format", "json")
    assert result.returncode == 2
    assert {f["code"] for f in json.loads(result.stdout)["findings"]} >= {"PID002", "PID014"}
    assert "1 without a pidcfg key skipped" in run("validate", str(tmp_path)).stderr.decode()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes by name are POSIX")
def test_pipes_and_devices_are_neither_waited_for_nor_replaced(reactor, tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    assert "1 file checked" in run("validate", str(tmp_path)).stderr.decode()
    for target in (tmp_path / "pipe.yaml", Path(os.devnull), tmp_path):
        result = run("encode", str(reactor), "-o", str(target), "--force")
        assert result.returncode == 2
        assert b"Error: " in result.stderr
    assert not Path(os.devnull).is_file()


def test_a_link_is_written_through(reactor, tmp_path):
    target, link = tmp_path / "target.txt", tmp_path / "link.txt"
    target.write_text("old", "utf-8")
    try:
        link.symlink_to(target)
    except OSError:
        return  # Windows without the right to make links
    assert run("encode", str(reactor), "-o", str(link), "--force").returncode == 0
    assert link.is_symlink()
    assert "V2000" in target.read_text("utf-8")


def test_a_full_disk_is_no_bug(reactor):
    if Path("/dev/full").exists():
        with Path("/dev/full").open("wb") as full:
            command = [sys.executable, "-m", "pidcfg", "encode", str(reactor)]
            result = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, check=False)
        assert result.returncode == 2
        assert b"Traceback" not in result.stderr


def test_encode_json_is_a_document_even_when_nothing_can_be_encoded(reactor):
    changed(reactor, "gain: 0.80", "gain: 120")
    result = run("encode", str(reactor), "--format", "json")
    assert result.returncode == 1
    assert json.loads(result.stdout)["findings"][0]["code"] == "PID101"


def test_json_escapes_what_the_code_page_lacks(reactor):
    changed(reactor, "unit: degC", 'unit: "°C"')
    result = run("encode", str(reactor), "--format", "json", PYTHONIOENCODING="ascii")
    assert json.loads(result.stdout)["settings"][1]["pv"]["unit"] == "°C"


def test_decode_says_which_words_it_leaves_out(reactor, tmp_path):
    run("encode", str(reactor), "-o", "image.txt", cwd=tmp_path)
    lines = (tmp_path / "image.txt").read_text("utf-8").splitlines()
    kept = [line for line in lines if not line.startswith(("V301", "V302"))] + ["V1400   1234"]
    (tmp_path / "cut.txt").write_text("\n".join(kept), "utf-8")
    result = run("decode", "cut.txt", "--vendor", "dl06", cwd=tmp_path)
    notes = result.stderr.decode()
    assert "V3010 of the ramp/soak table is missing" in notes
    assert "belong to no loop and are left out: V1400, V3000, V3001" in notes


def test_an_empty_folder_is_said_so(tmp_path):
    result = run("validate", str(tmp_path))
    assert result.returncode == 2
    assert "holds no .yaml" in result.stdout.decode()


def test_standard_input_is_read():
    result = run("validate", "-", stdin=REACTOR.read_bytes())
    assert result.returncode == 0
    assert run("validate", "-", stdin=b"").returncode == 2


def test_byte_order_mark_and_crlf_are_fine(reactor):
    reactor.write_bytes(b"\xef\xbb\xbf" + reactor.read_bytes().replace(b"\n", b"\r\n"))
    assert run("validate", str(reactor)).returncode == 0


def test_select_ignore_severity_and_strict(reactor):
    changed(reactor, "gain: 0.80", "gain: 120")
    assert run("validate", str(reactor), "--ignore", "PID101").returncode == 0
    assert run("validate", str(reactor), "--select", "DL2").returncode == 0
    assert run("validate", str(reactor), "--select", "PID1").returncode == 1
    changed(reactor, "gain: 120", "gain: 0.80")
    assert run("validate", str(reactor), "--strict").returncode == 1
    assert run("validate", str(reactor), "--strict", "--severity", "error").returncode == 1, "shown is not counted"


def test_a_code_that_no_rule_has_is_wrong_usage(reactor):
    result = run("validate", str(reactor), "--select", "XYZ")
    assert result.returncode == 2
    assert b"no rule begins with 'XYZ'" in result.stderr


def test_unreadable_text_cannot_be_ignored(tmp_path):
    (tmp_path / "x.yaml").write_bytes(b"pidcfg: 1\nvendor: \xff\n")
    assert run("validate", str(tmp_path / "x.yaml"), "--ignore", "PID0", "--select", "PID9").returncode == 2


@pytest.mark.parametrize("limit", ["file_bytes=100", "nodes=10", "depth=2", "scalar_bytes=3"])
def test_limits_end_with_exit_code_2_and_their_value(reactor, limit):
    result = run("validate", str(reactor), "--limit", limit)
    assert result.returncode == 2
    assert limit.partition("=")[2] in result.stdout.decode()


@pytest.mark.parametrize(("size", "code"), [(1 << 20, 0), ((1 << 20) + 1, 2)])
def test_a_configuration_has_at_most_a_megabyte(tmp_path, size, code):
    text = REACTOR.read_bytes()
    text += b"# " + b"x" * (size - len(text) - 2)
    (tmp_path / "x.yaml").write_bytes(text)
    result = run("validate", str(tmp_path / "x.yaml"), "--no-cache")
    assert result.returncode == code
    assert ("larger than 1048576 bytes" in result.stdout.decode()) == (code == 2)


@pytest.mark.parametrize(("size", "code"), [(3 << 20, 0), ((3 << 20) + 1, 2)])
def test_what_a_program_has_written_may_be_three_times_as_large(tmp_path, size, code):
    listing = run("encode", str(REACTOR), "--quiet").stdout
    line = b"# " + b"x" * 998 + b"\n"
    listing += line * ((size - len(listing)) // len(line))
    (tmp_path / "x.txt").write_bytes(listing + b"\n" * (size - len(listing)))
    assert run("decode", str(tmp_path / "x.txt"), "--vendor", "dl06").returncode == code


def test_wrong_usage_is_exit_code_2():
    assert run("validate").returncode == 2
    assert run("nonsense").returncode == 2
    assert run("validate", str(REACTOR), "--limit", "depth=x").returncode == 2


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("simulat", "did you mean simulate?"),
        ("check", "did you mean validate?"),
        ("Validate", "did you mean validate?"),
        ("zzz", f"there are {', '.join(COMMANDS)}"),
    ],
)
def test_an_unknown_command_says_which_one_is_meant(word, meant):
    result = CliRunner().invoke(cli, [word, "x.yaml"])
    assert result.exit_code == 2
    assert f"no such command: {word}; {meant}\n" in result.stderr


@pytest.mark.parametrize("vendor", sorted(VENDORS))
def test_demo_shows_a_mistake_words_and_a_run_on_one_screen(vendor):
    result = CliRunner().invoke(cli, ["demo", "--vendor", vendor])
    assert result.exit_code == 0, result.output
    lines = result.output.splitlines()
    assert len(lines) <= 30
    assert max(map(len, lines)) <= 80
    assert re.search(r"pidcfg encode gives \d+ words .*\n(  \S.* \S.*\n){2,3}pidcfg simulate", result.output)
    assert sum("●" in line for line in lines) >= 5
    assert sum("  proven  " in line for line in lines) == 1
    assert [line.split()[:3] for line in lines[-3:]] == [
        ["Next:", "pidcfg", word] for word in ("init", "simulate", "--help")
    ]


def test_what_other_programs_call_commands_is_none_of_ours():
    assert not set(main.SYNONYMS) & set(COMMANDS)
    assert set(main.SYNONYMS.values()) <= {*COMMANDS, "--help"}


def closed(shell: str) -> subprocess.CompletedProcess[bytes]:
    """A line of a shell that closes streams."""
    command = f'exec "{sys.executable}" -m pidcfg {shell}'
    return subprocess.run(["sh", "-c", command], capture_output=True, check=False)


@pytest.mark.skipif(os.name != "posix", reason="closing a stream is a matter of POSIX shells")
def test_closed_streams_are_no_bug(reactor):
    bad = changed(reactor, "gain: 0.80", "gain: 120")
    result = closed("validate - <&-")
    assert result.returncode == 2
    assert b"PID040: cannot read standard input: it is closed" in result.stdout
    for streams in (">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"):
        result = closed(f"validate {bad} {streams}")
        assert result.returncode == 1, streams
        assert b"Traceback" not in result.stderr, streams
    out = bad.with_name("out.hex")
    assert closed(f"encode {REACTOR} --format ihex -o {out} <&- >&- 2>&-").returncode == 0
    assert out.read_text("ascii").endswith(":00000001FF\n"), "no file takes the place of a stream"


@pytest.mark.skipif(os.name != "posix", reason="streams are files in POSIX only")
@pytest.mark.parametrize("name", ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"])
def test_a_stream_is_no_file(reactor, name):
    result = CliRunner().invoke(cli, ["encode", str(reactor), "-o", name])
    said = f"Error: {name} is a stream and no file; without -o the result goes to standard output\n"
    assert (result.stdout, result.stderr) == ("", said)
    result = CliRunner().invoke(cli, ["validate", str(reactor), "--output", f"sarif={name}"])
    assert (result.exit_code, result.stdout) == (2, "")
    assert f"{name} is no regular file; name one, or leave the option out: --format sarif prints" in result.stderr


@pytest.mark.skipif(os.name != "posix", reason="elsewhere the working directory cannot be deleted")
def test_a_device_is_refused_in_words_of_the_command(reactor):
    result = CliRunner().invoke(cli, ["validate", str(reactor), "--output", f"sarif={os.devnull}"])
    assert result.exit_code == 2
    assert f"{os.devnull} is no regular file" in result.stderr
    assert "-o " not in result.stderr
    with pytest.raises(click.ClickException, match=f"^{os.devnull} is no regular file; name a file$"):
        write_files({os.devnull: "x"})


@pytest.mark.skipif(os.name != "posix", reason="elsewhere the working directory cannot be deleted")
def test_what_the_system_refuses_has_a_name(reactor, tmp_path, monkeypatch):
    refused = PermissionError(13, "Permission denied", "loops/oven.yaml")
    assert errors.system_refusal(refused) == "cannot write or read loops/oven.yaml: Permission denied"
    assert (
        errors.system_refusal(OSError(28, "No space left on device")) == "cannot write or read: No space left on device"
    )
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert errors.system_refusal(FileNotFoundError(2, "No such file")).startswith("the working directory is gone")
    monkeypatch.undo()


def test_a_bug_is_exit_code_3_and_no_finding():
    code = "import pidcfg.cli.main as m, click\nm.COMMANDS['validate'] = ('no.such.module', '')\nm.main()"
    result = subprocess.run([sys.executable, "-c", code, "validate", "x"], capture_output=True, check=False)
    assert result.returncode == 3
    assert b"a bug in pidcfg" in result.stderr


def test_a_reader_that_goes_away_is_no_error(reactor):
    shell = f"{sys.executable} -m pidcfg encode --quiet {reactor} | head -1"
    if os.name == "posix":
        result = subprocess.run(["sh", "-c", shell], capture_output=True, check=False)
        assert (result.returncode, result.stderr) == (0, b"")


@pytest.mark.parametrize("encoding", ["cp1252", "cp437", "ascii"])
def test_windows_code_pages_do_not_crash(reactor, encoding):
    changed(reactor, "unit: degC", 'unit: "°C → Ω"')
    changed(reactor, "gain: 0.80", "gain: 120")
    result = run("validate", str(reactor), PYTHONIOENCODING=encoding)
    assert result.returncode == 1
    assert b"PID101" in result.stdout
    assert run("encode", str(REACTOR), PYTHONIOENCODING=encoding).returncode == 0


@pytest.mark.parametrize("kind", ["text", "csv", "json", "ihex", "modbus"])
def test_encode_decode_encode_through_files(reactor, tmp_path, kind):
    first, back, again = tmp_path / "first", tmp_path / "back.yaml", tmp_path / "again"
    assert run("encode", str(reactor), "--format", kind, "-o", str(first)).returncode == 0
    assert run("decode", str(first), "--vendor", "dl06", "-o", str(back)).returncode == 0
    assert run("encode", str(back), "--format", kind, "-o", str(again)).returncode == 0
    words = [re.sub("^#.*\n", "", f.read_text("utf-8"), flags=re.MULTILINE) for f in (first, again)]
    if kind == "json":
        words = [json.dumps([(w["address"], w["value"]) for w in json.loads(t)["words"]]) for t in words]
    assert words[0] == words[1]


def test_encode_json_has_the_published_layout(reactor):
    document = json.loads(run("encode", str(reactor), "--format", "json").stdout)
    assert (document["version"], document["vendor"]) == (1, "dl06")
    assert document["words"][7] == {
        "address": "V2007",
        "value": 32,
        "hex": "0020",
        "loop": "FIC-102",
        "field": "sample_rate",
    }
    assert document["settings"][0]["pv"] == {"range": [0, 50], "unit": "m3/h"}
    addresses = [int(w["address"][1:], 8) for w in document["words"]]
    assert addresses == sorted(addresses)


@pytest.mark.parametrize("kind", ["text", "csv", "modbus", "ihex"])
def test_the_checklist_is_one_line_beside_the_listing_and_whole_when_asked_for(reactor, kind):
    short = run("encode", str(reactor), "--format", kind)
    whole = run("encode", str(reactor), "--format", kind, "--checklist")
    items = [row for row in whole.stderr.decode().splitlines() if row.startswith("check after the download: ")]
    assert len(items) > 1
    assert short.stderr.decode() == f"{len(items)} things to check after the download: see --checklist\n"
    assert short.stdout == whole.stdout
    assert b"check after" not in short.stdout


def test_beside_a_listing_with_the_checklist_in_it_is_no_word_of_it(reactor):
    result = run("encode", str(reactor), "--format", "json")
    assert len(json.loads(result.stdout)["checklist"]) > 1
    assert "after the download" not in result.stderr.decode()


def test_words_that_differ_come_without_a_checklist(reactor, tmp_path):
    before = tmp_path / "before.csv"
    assert run("encode", str(reactor), "--format", "csv", "-o", str(before)).returncode == 0
    changed(reactor, "gain: 0.80", "gain: 0.81")
    result = run("encode", str(reactor), "--changed-from", str(before))
    assert result.returncode == 0
    assert b"check after" not in result.stderr
    assert b"V2010" in result.stdout


def test_a_format_that_carries_the_checklist_needs_no_line_beside_it(reactor):
    result = run("encode", str(reactor), "--format", "json")
    assert result.stderr == b""
    assert len(json.loads(result.stdout)["checklist"]) > 1


def test_encode_refuses_errors_and_writes_nothing(reactor, tmp_path):
    changed(reactor, "V2000", "V1177")
    out = tmp_path / "image.txt"
    result = run("encode", str(reactor), "-o", str(out))
    assert result.returncode == 1
    assert result.stdout == b""
    assert not out.exists()
    assert run("encode", str(reactor), "-o", str(out), "--allow-errors").returncode == 0
    assert out.read_text("utf-8").splitlines()[-2].startswith("V7640   027F")


def test_encode_never_overwrites_a_file_that_differs(reactor, tmp_path):
    out = tmp_path / "image.txt"
    out.write_text("mine", "utf-8")
    result = run("encode", str(reactor), "-o", str(out))
    assert result.returncode == 2
    assert out.read_text("utf-8") == "mine"
    assert b"--force" in result.stderr
    assert run("encode", str(reactor), "-o", str(out), "--force").returncode == 0
    assert run("encode", str(reactor), "-o", str(out)).returncode == 0, "the same bytes may be written again"
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == [], "no temporary file is left"


def test_output_into_a_missing_folder_is_one_clear_error(reactor, tmp_path):
    result = run("encode", str(reactor), "-o", str(tmp_path / "none" / "image.txt"))
    assert result.returncode == 2
    assert b"Traceback" not in result.stderr


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file is empty: export the listing again"),
        ("V2000 1400\nV2000 1400\n", "2:1: error PID041: V2000 stands here again"),
        ("V2008 1400\n", "'V2008' is not an address"),
        ("V2000 14000\n", "not word content of up to 4 hexadecimal digits"),
        ("V2000\n", "the word of V2000 is missing"),
        ("address,hex\nV2000,1400,9\n", "3 cells stand under a header of 2 columns"),
        ("address,hex,value\nV2000,1400,1400\n", "hex 1400 is 5120, but the value says 1400"),
        ("address,word\nV2000,1400\n", "the header has no column hex or value"),
        ('{"words": [{"address": "V2000", "value": 70000}]}', "not a word of 0 to 65535"),
        ('{"words": [{"address": "V2000", "value": 1, "hex": "0002"}]}', "differ"),
        ('{"vendor": "click", "words": []}', "the listing is of vendor 'click'"),
        ('{"words": 3}', "no list 'words'"),
        ("{", "not JSON"),
        ("[" * 100_000, "no memory listing"),
        ('{"words":' + "[" * 100_000, "nested too deeply"),
        (":00000001FE\n", "not Intel HEX"),
        (":0100000005FA\n:00000001FF\n", "incomplete"),
        ("# loop: []\nV2000 0001\n", "1:9: error PID041: the settings are not a mapping"),
        ('# loop: {"loop": "A", "pv": {"range": [1]}}\nV7640 0400\nV7641 0001\n', "settings[0]"),
        ("V7640 0400\nV7641 0001\n", "does not hold V2000"),
        ("V7641 0001\n", "--loop-table"),
        ("V7640 0400\nV7641 000A\n", "2:1: error PID041: V7641: 0x000A has a digit above 9"),
        ("V2000 0400 1025\n", "hex 0400 is 1024, but the value says 1025"),
        (":0210000000040EDE\n", "not Intel HEX"),
        (":020FA0000004" + "4B\n", "end-of-file record"),
    ],
)
def test_bad_listings_are_refused_with_one_clear_error(tmp_path, text, message):
    (tmp_path / "x").write_text(text, "utf-8")
    result = run("decode", "x", "--vendor", "dl06", cwd=tmp_path)
    assert result.returncode == 2
    assert message in result.stderr.decode()
    assert b"Traceback" not in result.stderr
    assert result.stdout == b""


def test_rule_explains_and_suggests():
    assert "Cure." in run("rule", "PID101").stdout.decode()
    assert run("rule", "pid101").returncode == 0
    result = run("rule", "PID999")
    assert result.returncode == 2
    assert json.loads(run("rule", "PID024", "--format", "json").stdout)["name"] == "leading-zero"
    assert len(run("rule").stdout.decode().splitlines()) > 80


def test_rules_are_listed_by_the_beginning_of_their_code():
    every, some = (run("rule", *code).stdout.decode().splitlines() for code in ((), ("dl24",)))
    assert some == [line for line in every if line.startswith("DL24")]
    assert len(json.loads(run("rule", "DL24", "--format", "json").stdout)["rules"]) == len(some) > 5
    assert "no rule begins with PIX" in run("rule", "PIX").stderr.decode()


def test_the_starter_file_passes_and_is_never_overwritten(tmp_path):
    assert run("init", "--vendor", "dl06", "-o", "new.yaml", cwd=tmp_path).returncode == 0
    assert run("validate", "new.yaml", cwd=tmp_path).returncode == 0
    (tmp_path / "new.yaml").write_text("mine", "utf-8")
    assert run("init", "--vendor", "dl06", "-o", "new.yaml", cwd=tmp_path).returncode == 2


@pytest.mark.parametrize("kind", [*VENDORS, "scenario"])
def test_json_schemas_are_valid_and_say_what_every_key_means(kind):
    schema = json.loads(run("schema", kind).stdout)
    pytest.importorskip("jsonschema").Draft202012Validator.check_schema(schema)
    for definition in (schema, *schema["$defs"].values()):
        for key, prop in definition.get("properties", {}).items():
            assert prop.get("description"), key


def test_the_json_schema_accepts_the_examples_and_refuses_what_validate_refuses():
    schema = json.loads(run("schema", "dl06").stdout)
    gain = schema["$defs"]["Tuning"]["properties"]["gain"]
    assert (gain["minimum"], gain["maximum"], gain["x-unit"]) == (0, 99.99, "%/%")
    rate = schema["$defs"]["Loop"]["properties"]["sample_rate"]["anyOf"][1]
    assert (rate["minimum"], rate["maximum"]) == (0.05, 99.99)
    assert schema["$defs"]["Loop"]["additionalProperties"] is False


@pytest.mark.parametrize("kind", [*VENDORS, "scenario"])
def test_the_json_schemas_accept_the_examples(kind):
    validator = pytest.importorskip("jsonschema").Draft202012Validator(json.loads(run("schema", kind).stdout))
    own = [data for data in examples() if data.get("vendor", "scenario") == kind]
    assert own
    for data in own:
        validator.validate(data)


@cache
def examples():
    """All examples as data."""
    from ruamel.yaml import YAML

    return [YAML(typ="safe").load(path) for path in sorted((ROOT / "examples").glob("*/*.yaml"))]


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """A folder with the files that the examples name."""
    folder = tmp_path_factory.mktemp("prepared")
    (folder / "loops").mkdir()
    (folder / "scenarios").mkdir()
    for name in ("reactor.yaml", "reactor.scenario.yaml"):
        text = (ROOT / "examples/dl06" / name).read_text("utf-8")
        (folder / name).write_text(text, "utf-8")
        (folder / "loops" / name).write_text(text, "utf-8")
        (folder / "scenarios" / name).write_text(text, "utf-8")
    for kind, name in (("json", "reactor.json"), ("ihex", "reactor.hex"), ("csv", "table.csv")):
        run("encode", "reactor.yaml", "--format", kind, "-o", name, cwd=folder)
    pvs = ((t, 40 + 20 * (1 - 0.98 ** max(t - 130, 0))) for t in range(0, 900, 5))
    rows = [f"2026-03-02,08:{t // 60:02}:{t % 60:02},{pv:.4f},{20 + 10 * (t >= 120)}" for t, pv in pvs]
    (folder / "step.csv").write_text("Date,Time,Temperature,Valve\n" + "\n".join(rows) + "\n", "utf-8")
    (folder / "chiller.yaml").write_text((ROOT / "examples/dpide/chiller.yaml").read_text("utf-8"), "utf-8")
    # It is run 500 times: seconds in the place of minutes, and it begins as it stands.
    scenario = (ROOT / "examples/dpide/chiller.scenario.yaml").read_text("utf-8")
    (folder / "chiller.scenario.yaml").write_text(
        re.sub(r"(\d) min", r"\1 s", scenario.replace("initial: steady\n", "")), "utf-8"
    )
    (folder / "tank.yaml").write_text((ROOT / "examples/click/tank.yaml").read_text("utf-8"), "utf-8")
    run("encode", "tank.yaml", "--format", "nickname-csv", "-o", "nicknames.csv", cwd=folder)
    header = (folder / "nicknames.csv").read_text("utf-8").splitlines()[0]
    (folder / "project.csv").write_text(f'{header}\nX001,BIT,"Start",0,No,""\n', "utf-8")
    (folder / "kiln.yaml").write_text((ROOT / "examples/ezlogix/oven.yaml").read_text("utf-8"), "utf-8")
    (folder / "kiln-map.csv").write_text("R1,holding,0,uint16\nS1,coil,0,bool\n", "utf-8")
    text = (folder / "reactor.yaml").read_text("utf-8")
    (folder / "main.yaml").write_text(text, "utf-8")
    (folder / "ovens.yaml").write_text(text, "utf-8")
    (folder / "reactor-before.yaml").write_text(text.replace("gain: 2.50", "gain: 2.40"), "utf-8")
    (folder / "reactor-2.yaml").write_text(text.replace("gain: 2.50", "gain: 3.10"), "utf-8")
    blocks = (ROOT / "examples/nextopid/autotune.yaml").read_text("utf-8")
    (folder / "boiler.yaml").write_text(blocks.replace("plc: {", "plc: {program: Boiler, "), "utf-8")
    run("encode", "boiler.yaml", "--format", "plcopen", "-o", "project.xml", cwd=folder)
    make_runtime(folder / "whatif-runtime.zip")
    run("export", "reactor.yaml", "-o", "loops.csv", cwd=folder)
    (folder / "branch.yaml").write_text(text.replace("bias_freeze: true", "bias_freeze: false"), "utf-8")
    for name in ("upload.hex", "monday.hex", "friday.hex"):
        (folder / name).write_bytes((folder / "reactor.hex").read_bytes())
    (folder / "upload.csv").write_bytes((folder / "table.csv").read_bytes())
    run("convert", "reactor.yaml", "--to", "click", "--allow-loss", "-o", "reactor-click.yaml", cwd=folder)
    (folder / "reactor.hex").rename(folder / "image.hex")
    (folder / "reactor.hex").write_bytes((folder / "image.hex").read_bytes())
    return folder


ONE_WAY = {"lsp": 1}
"""Commands that are called in one way, by an editor."""
AT_A_PLC = {"pull", "compare", "trend", "serve"}
"""Commands whose examples name a PLC that is not here, or go on until somebody ends them: they are only read."""


def prints_pages():
    """Whether there is a browser that prints a PDF, as there must be in CI."""
    return IN_CI or any(map(shutil.which, NAMES))


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_three_examples_and_they_run(name, prepared, tmp_path, monkeypatch):
    """The examples of --help, word by word, in a folder that holds the files they name."""
    text = run(name, "--help").stdout.decode()
    examples = [line.strip() for line in text.partition("Examples:")[2].splitlines() if "pidcfg" in line]
    assert len(examples) >= ONE_WAY.get(name, 3)
    shutil.copytree(prepared, tmp_path, dirs_exist_ok=True)
    if name == "whatif":
        monkeypatch.setenv("PIDCFG_WHATIF_RUNTIME", str(prepared / "whatif-runtime.zip"))
        monkeypatch.setenv("PIDCFG_WHATIF_FORCE", "1")
    if name in AT_A_PLC:
        monkeypatch.chdir(tmp_path)
        for line in examples:
            _, command, *words = shlex.split(line)
            cli.get_command(click.Context(cli), command).make_context(command, words)
        return
    for line in examples:
        first, *rest = [part.strip() for part in line.split("|")]
        words = shlex.split(first)
        if first.endswith(".pdf") and not prints_pages():
            continue
        result = run(*words[1:], cwd=tmp_path)
        assert result.returncode in {0, 1}, (line, result.stderr.decode())
        if rest and rest[0].startswith("pidcfg"):
            assert run(*shlex.split(rest[0])[1:], cwd=tmp_path, stdin=result.stdout).returncode == 0, line


def test_mutated_files_never_give_a_traceback():
    """Hundreds of damaged reactors through the whole of validate and encode, in this process for speed."""
    from pidcfg.text.source import read_document
    from pidcfg.validate.engine import check_document

    source = REACTOR.read_bytes()
    rng = random.Random(20)
    tokens = b"{ } [ ] : - &a *a !!x 0 9e999 null ~ true V8 <<: ' | # 1e-400 counts 99999".split()
    tokens += [b"\t", b"\x00", b"\xff", b"\n", b'"', b"- ", b": "]
    for _ in range(700):
        data = bytearray(source)
        for _ in range(rng.randint(1, 4)):
            at = rng.randrange(len(data))
            size = rng.choice([0, 1, 1, 3, 20, 200])
            data[at : at + size] = rng.choice(tokens) * rng.choice([1, 1, 2])
        checked = check_document(read_document(bytes(data), "m.yaml"))
        lines = len(checked.document.lines)
        for found in checked.findings:
            assert found.span.line <= max(lines, 1), found
        if checked.encoding is not None:
            assert all(0 <= cell.raw <= 0xFFFF for cell in checked.encoding.image.cells)


@pytest.mark.parametrize("case", sorted((ROOT / "tests" / "cases").glob("*.yaml")), ids=lambda path: path.stem)
def test_no_configuration_makes_encode_fall_over(case):
    """Also with --allow-errors, a configuration is encoded or refused."""
    from click.testing import CliRunner

    from pidcfg.cli.commands.encode import command

    result = CliRunner().invoke(command, [str(case), "--allow-errors", "--quiet"])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    assert result.exit_code in {0, 1, 2}


def test_decisions_are_found_without_the_extras(monkeypatch):
    from pidcfg.output.explanation.lookup import all_decisions

    every = all_decisions()
    for name in [
        name
        for name in sys.modules
        if name.startswith(("pidcfg.sim.engine.compile", "pidcfg.output.report", "pidcfg.pictures"))
    ]:
        monkeypatch.delitem(sys.modules, name)
    for name in ("numba", "numpy", "matplotlib", "jinja2", "xlsxwriter"):
        monkeypatch.setitem(sys.modules, name, None)
    assert all_decisions() == every


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["convert"], ["Missing argument 'FILE'.", "Also missing: '--to'"]),
        (["decode"], ["Missing argument 'IMAGE...'.", "Also missing: '--vendor'"]),
        (["tune", "--method", "zn-open", "--gain", "2"], ["zn-open needs --time-constant and --dead-time"]),
        (["tune", "--method", "zn-open"], ["zn-open needs --gain, --time-constant and --dead-time"]),
        (["tune", "--method", "zn-closed"], ["zn-closed needs --ultimate-gain and --ultimate-period"]),
    ],
)
def test_everything_that_is_missing_is_asked_for_at_once(words, says):
    result = run(*words)
    assert result.returncode == 2
    assert result.stderr.decode().splitlines()[-len(says) :] == [f"Error: {says[0]}", *says[1:]]


def test_what_was_given_is_not_asked_for():
    assert b"Also missing" not in run("convert", "--to", "click").stderr
    assert b"Also missing" not in run("decode", "--vendor", "click").stderr


@pytest.mark.parametrize("words", [["decode", "--vendor", "dl06"], ["tune", "--method", "zn-open", "--from-csv"]])
def test_a_workbook_is_named_wherever_a_table_is_wanted(words, tmp_path):
    (tmp_path / "a.xlsx").write_bytes(b"PK\x03\x04\x14\x00\x06\x00")
    result = run(*words, str(tmp_path / "a.xlsx"))
    assert result.returncode == 2
    assert b"the file is an Excel or ZIP file, no " in result.stderr
    assert b"save the sheet as CSV" in result.stderr
