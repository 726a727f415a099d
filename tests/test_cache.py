"""The cache of findings: the same output with and without it, and never a wrong answer or an error because of it."""

import errno
import multiprocessing
import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from pidcfg.cli import findings as cache
from pidcfg.cli import findings as collect
from pidcfg.cli.main import cli
from pidcfg.text import store
from pidcfg.text.reader import DEFAULT
from pidcfg.text.store import Store, cache_folder
from pidcfg.validate.catalog import FILE_RULES, find_rules

EXAMPLES = Path(__file__).parents[1] / "examples"
REACTOR = "dl06/reactor.yaml"
CACHE = collect._open_cache
FORMATS = ("text", "json", "sarif", "junit", "github", "concise")


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with copies of the examples as the working folder, and a cache of its own beside it."""
    work = tmp_path / "work"
    shutil.copytree(EXAMPLES, work)
    monkeypatch.chdir(work)
    monkeypatch.setenv("PIDCFG_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(collect, "_open_cache", CACHE)
    return tmp_path / "cache" / "findings"


def validate(*arguments):
    """Exit code, standard output and standard error."""
    result = CliRunner().invoke(cli, ["validate", *arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return result.exit_code, result.stdout, result.stderr


def entries(place):
    """The files of the cache."""
    return sorted(path for path in place.rglob("*") if path.is_file())


def checks(monkeypatch):
    """Notes the name of every input that is checked anew."""
    from pidcfg.cli import findings as collect

    names, true = [], collect.check_input

    def check_input(entry):
        names.append(entry.name)
        return true(entry)

    monkeypatch.setattr(collect, "check_input", check_input)
    return names


def test_output_is_the_same_with_and_without_the_cache(place, monkeypatch):
    plain = validate(".", "--no-cache")
    assert not place.exists()
    first, names = validate("."), checks(monkeypatch)
    assert (first, validate(".")) == (plain, plain)
    assert names == []


@pytest.mark.parametrize("fmt", FORMATS)
def test_every_format_is_the_same(place, fmt):
    arguments = ("dl06", "nextopid", "--format", fmt, "--strict")
    assert validate(*arguments) == validate(*arguments) == validate(*arguments, "--no-cache")
    assert entries(place)


def test_a_file_that_changes_or_moves_is_told_apart(place, monkeypatch):
    validate(REACTOR)
    names, path = checks(monkeypatch), Path(REACTOR)
    path.rename("other.yaml")
    assert "other.yaml:17" in validate("other.yaml")[1]
    assert names == []
    path = Path("other.yaml")
    path.write_text(path.read_text().replace("gain: 0.80", "gain: 0.00"))
    after = validate("other.yaml")
    assert names == ["other.yaml"]
    assert after == validate("other.yaml", "--no-cache")


def test_a_scenario_is_checked_again_when_its_configuration_changes(place, monkeypatch):
    scenario, config = "dl06/reactor.scenario.yaml", Path(REACTOR)
    before, names = validate(scenario), checks(monkeypatch)
    assert validate(scenario) == before
    assert names == []
    text = config.read_text()
    config.write_text(text.replace("name: TIC-101", "name: TIC-999"))
    changed = validate(scenario)
    assert changed == validate(scenario, "--no-cache")
    assert changed[0] == 1
    config.unlink()
    assert validate(scenario) == validate(scenario, "--no-cache")
    config.write_text(text)
    assert validate(scenario) == before


def test_a_scenario_finds_its_configuration_from_everywhere(place, monkeypatch):
    path = Path("dl06/reactor.scenario.yaml")
    path.write_text(path.read_text().replace("loop: TIC-101", "loop: TIC-10"))
    one = validate("dl06/reactor.scenario.yaml")
    monkeypatch.chdir("dl06")
    assert validate("reactor.scenario.yaml") == validate("reactor.scenario.yaml", "--no-cache")
    assert validate("reactor.scenario.yaml")[0] == one[0] == 1


def test_comments_settings_and_baselines_come_after_it(place):
    validate(REACTOR)
    for arguments in (("--ignore", "DL220"), ("--severity", "warning"), ("--select", "DL2"), ("--strict",)):
        assert validate(REACTOR, *arguments) == validate(REACTOR, *arguments, "--no-cache")
    validate(REACTOR, "--baseline", "b.json", "--create-baseline")
    assert validate(REACTOR, "--baseline", "b.json") == validate(REACTOR, "--baseline", "b.json", "--no-cache")


def test_other_limits_share_nothing(place, monkeypatch):
    validate(REACTOR)
    names = checks(monkeypatch)
    assert validate(REACTOR, "--limit", "loops=1")[0] == 2
    assert names == [REACTOR]


def test_what_cannot_be_read_is_not_kept(place):
    Path("bad.yaml").write_text("pidcfg: 1\nvendor: dl06\nloops: [\n")
    assert validate("bad.yaml")[0] == 2
    assert validate("missing.yaml")[0] == 2
    assert validate("dl06/reactor.scenario.yaml", "--limit", "file_bytes=100")[0] == 2
    assert not entries(place)


def test_only_rules_of_files_say_that_one_cannot_be_read():
    assert {code for code, rule in find_rules().items() if rule.is_unusable} <= set(FILE_RULES)


@pytest.mark.parametrize("changed", ["CACHE_FORMAT", "LIBRARIES"])
def test_another_ground_is_another_key(place, monkeypatch, changed):
    validate(REACTOR)
    monkeypatch.setattr(cache, changed, 99 if changed == "CACHE_FORMAT" else ("click",))
    names = checks(monkeypatch)
    validate(REACTOR)
    assert names == [REACTOR]


def test_a_source_that_changes_is_another_key(monkeypatch, tmp_path):
    package = tmp_path / "src" / "pidcfg"
    package.mkdir(parents=True)
    (package / "a.py").write_text("a = 1\n")
    monkeypatch.setattr(cache, "PACKAGE_FOLDER", package)
    before = cache._key_base(DEFAULT)
    assert cache._key_base(DEFAULT) == before
    (package / "a.py").write_text("a = 10\n")
    after = cache._key_base(DEFAULT)
    assert after != before
    record = tmp_path / "src" / "pidcfg-1.0.dist-info" / "RECORD"
    record.parent.mkdir()
    record.write_text("pidcfg/a.py,sha256=1,7\n")
    installed = cache._key_base(DEFAULT)
    record.write_text("pidcfg/a.py,sha256=2,7\n")
    assert len({before, after, installed, cache._key_base(DEFAULT)}) == 4


# --- damage ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A store with one entry: the store, the key, the file and its bytes."""
    folder = tmp_path_factory.mktemp("store")
    one = Store(folder)
    one.put("ab12", [{"x": "y"}, [1, 2, "text"]])
    (path,) = entries(folder)
    return one, path, path.read_bytes()


@given(data=st.data())
def test_a_damaged_entry_is_a_miss(whole, data):
    one, path, good = whole
    kind = data.draw(st.sampled_from(["cut", "bit", "added", "other"]))
    at = data.draw(st.integers(0, len(good) - 1))
    if kind == "cut":
        bad = good[:at]
    elif kind == "bit":
        bad = good[:at] + bytes([good[at] ^ 1 << data.draw(st.integers(0, 7))]) + good[at + 1 :]
    else:
        bad = good[:at] + data.draw(st.binary(min_size=1, max_size=40)) + good[at if kind == "added" else len(good) :]
    path.write_bytes(bad)
    assert one.get("ab12") is None or bad == good
    path.write_bytes(good)
    assert one.get("ab12") == [{"x": "y"}, [1, 2, "text"]]


def test_an_entry_in_the_place_of_another_is_a_miss(whole):
    one, path, good = whole
    path.with_name("ab34").write_bytes(good)
    assert one.get("ab34") is None


def test_entries_of_another_shape_are_misses(place):
    plain = validate(REACTOR)
    (path,) = entries(place)
    for value in (
        None,
        1,
        [],
        [{}],
        [{}, [[0]]],
        [{}, [[7, "X"]]],
        [{"a": "b"}, []],
        {"a": 1},
        [{}, "text"],
        [[], [[]]],
    ):
        Store(place).put(path.name, value)
        assert validate(REACTOR) == plain


# --- the folder ------------------------------------------------------------------------------------------------------


posix = pytest.mark.skipif(sys.platform == "win32", reason="permissions of POSIX")


@posix
@pytest.mark.parametrize("part", ["cache/findings", "cache", "."])
def test_a_folder_that_others_may_write_to_is_not_used(place, part):
    plain = validate(REACTOR)
    shutil.rmtree(place)
    (place / "../.." / part).resolve().mkdir(parents=True, exist_ok=True)
    (place / "../.." / part).resolve().chmod(0o777)
    code, text, said = validate(REACTOR)
    assert (code, text) == plain[:2]
    assert said == f"note: findings are not kept: others may write to {(place / '../..' / part).resolve()}\n" + plain[2]
    assert not entries(place)
    (place / "../.." / part).resolve().chmod(0o700)
    assert validate(REACTOR) == plain
    assert entries(place)


@posix
@pytest.mark.parametrize("mode", [0o702, 0o720, 0o1777])
def test_the_folder_itself_is_for_its_user_alone(tmp_path, monkeypatch, mode):
    monkeypatch.setenv("PIDCFG_CACHE_DIR", str(tmp_path))
    cache_folder("x").chmod(mode)
    with pytest.raises(store.UnsafeFolderError):
        cache_folder("x")


@posix
@pytest.mark.parametrize(
    ("last", "mode", "owner", "safe"),
    [
        # the folder itself?  mode   owner: the user (7), root (0), another (8)   whether it is used
        (True, 0o755, 7, True),
        (True, 0o755, 0, False),
        (True, 0o755, 8, False),
        (True, 0o775, 7, False),
        (True, 0o757, 7, False),
        (True, 0o1757, 7, False),
        (False, 0o755, 7, True),
        (False, 0o755, 0, True),
        (False, 0o755, 8, False),
        (False, 0o775, 0, False),
        (False, 0o777, 0, False),
        (False, 0o1777, 0, True),
        (False, 0o1777, 8, False),
    ],
)
def test_who_may_own_and_write_to_a_part_of_the_way(last, mode, owner, safe):
    facts = SimpleNamespace(st_mode=mode, st_uid=owner)
    with nullcontext() if safe else pytest.raises(store.UnsafeFolderError, match="/x"):
        store._require_private(Path("/x"), facts, 7, is_last=last)


@posix
@pytest.mark.parametrize("spoil", ["shelf", "entry", "link", "owner"])
def test_an_entry_that_another_may_have_written_is_a_miss(tmp_path, spoil):
    shelves = Store(tmp_path)
    shelves.put("ab12", 1)
    shelf, entry = tmp_path / "ab", tmp_path / "ab" / "ab12"
    assert shelves.get("ab12") == 1
    if spoil == "link":
        entry.rename(tmp_path / "elsewhere")
        entry.symlink_to(tmp_path / "elsewhere")
    elif spoil == "owner":
        if os.geteuid():
            pytest.skip("only root can give a file away")
        os.chown(entry, 12345, -1)
    else:
        (shelf if spoil == "shelf" else entry).chmod(0o777)
    assert shelves.get("ab12") is None
    if spoil == "shelf":
        with pytest.raises(store.UnsafeFolderError, match="others may write to"):
            shelves.write("ab12", b"2")


@posix
def test_a_link_leads_to_a_folder_that_is_looked_at(tmp_path, monkeypatch):
    (tmp_path / "open").mkdir()
    (tmp_path / "open").chmod(0o777)
    (tmp_path / "open" / "own").mkdir(mode=0o700)
    (tmp_path / "link").symlink_to(tmp_path / "open" / "own")
    monkeypatch.setenv("PIDCFG_CACHE_DIR", str(tmp_path / "link"))
    with pytest.raises(store.UnsafeFolderError, match="open"):
        cache_folder("x")
    (tmp_path / "open").chmod(0o700)
    assert cache_folder("x") == tmp_path / "open" / "own" / "x"


@posix
def test_every_folder_that_is_made_is_for_its_user_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("PIDCFG_CACHE_DIR", str(tmp_path / "a" / "b"))
    before = os.umask(0)
    try:
        folder = cache_folder("x")
        Store(folder).put("ab12", 1)
    finally:
        os.umask(before)
    assert {path.stat().st_mode & 0o777 for path in (*folder.parents[:2], folder, folder / "ab")} == {0o700}


@pytest.mark.skipif(sys.platform in {"win32", "darwin"}, reason="XDG")
@pytest.mark.parametrize("value", ["rel", "", "./rel"])
def test_a_relative_xdg_folder_is_none(place, tmp_path, monkeypatch, value):
    monkeypatch.delenv("PIDCFG_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", value)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_folder("x") == tmp_path / "home" / ".cache" / "pidcfg" / "x"
    assert not Path("rel").exists()


def test_a_place_that_is_no_folder_does_no_harm(place, monkeypatch):
    plain = validate(REACTOR, "--no-cache")
    for where in (REACTOR, "\0", "/proc/nowhere", f"{REACTOR}/below"):
        if "\0" not in where:
            monkeypatch.setenv("PIDCFG_CACHE_DIR", where)
        assert validate(REACTOR) == plain


@pytest.mark.parametrize("fails", [errno.ENOSPC, errno.EACCES, errno.EIO])
def test_a_full_disk_leaves_nothing(place, monkeypatch, fails):
    def refuse(path, target):
        raise OSError(fails, os.strerror(fails))

    monkeypatch.setattr(Path, "replace", refuse)
    assert validate(REACTOR) == validate(REACTOR, "--no-cache")
    assert not entries(place)


def test_the_size_is_bounded(tmp_path):
    one = Store(tmp_path, shelf_bytes=5_000)
    for i in range(200):
        one.put(f"ab{i:04}", ["x" * 400])
    kept = entries(tmp_path)
    assert sum(path.stat().st_size for path in kept) <= 6_000
    assert one.get("ab0199") == ["x" * 400]
    assert one.get("ab0000") is None


def test_what_is_too_large_is_not_kept(tmp_path):
    one = Store(tmp_path, entry_bytes=1000)
    one.put("ab12", "x" * 999)
    assert not entries(tmp_path)
    one.put("ab12", "x" * 998)
    assert one.get("ab12") == "x" * 998


# --- several runs ----------------------------------------------------------------------------------------------------


def _run(folder):
    os.chdir(folder)
    return validate(".")


def test_runs_side_by_side_agree(place):
    with multiprocessing.get_context("spawn").Pool(3) as pool:
        results = pool.map(_run, [str(Path.cwd())] * 4, chunksize=1)
    assert set(results) == {validate(".", "--no-cache")}


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_killed_writer_does_no_harm(place):
    plain = validate(".", "--no-cache")
    command = [sys.executable, "-m", "pidcfg", "validate", "."]
    for seconds in (0.4, 0.7, 1.0, 1.3):
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
            try:
                run.wait(seconds)
            except subprocess.TimeoutExpired:
                run.send_signal(signal.SIGKILL)
    assert validate(".") == plain


def test_a_clock_that_is_wrong_does_no_harm(place, monkeypatch):
    plain = validate(REACTOR)
    for path in entries(place):
        os.utime(path, (4e9, 4e9))
    names = checks(monkeypatch)
    assert validate(REACTOR) == plain
    assert names == []


def test_help_says_how_to_do_without_it():
    assert re.search(r"--no-cache\s+Check every file anew", CliRunner().invoke(cli, ["validate", "--help"]).output)
