"""A share of the torture with fixed seeds: hostile files, changed examples and ended commands."""

from __future__ import annotations

import cProfile
import random
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from living_rig import GOOD
from pidcfg.vendors import VENDORS
from reliability import (
    codecs,
    commands,
    copies,
    faults,
    figures,
    fuzz,
    growth,
    hostile,
    kills,
    memories,
    mutants,
    mutation,
    order,
    readers,
    rounding,
    small,
    words,
)
from reliability.mutation import Runner, valid
from reliability.page import PAGE, page
from reliability.reached import _called, importing_files
from reliability.torture import PARTS
from reliability.users import users

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="timers, signals and copies of POSIX")
SEED = 1
BOILER = Path(__file__).parents[1] / "examples" / "generic" / "boiler.yaml"
EVERY = 14
"""A case of so many is run: each kind of input and each way of spoiling comes up."""


@pytest.fixture
def _as_before():
    import signal

    handlers = {number: signal.getsignal(number) for number in (signal.SIGVTALRM, signal.SIGTERM, signal.SIGINT)}
    yield
    for number, handler in handlers.items():
        signal.signal(number, handler)


def test_there_are_enough_hostile_files_and_they_are_the_same_each_time():
    one, two = hostile.cases(SEED), hostile.cases(SEED)
    assert len(one) >= 700
    assert [case.data for case in one] == [case.data for case in two]
    assert len({case.name for case in one}) == len(one)


@pytest.mark.usefixtures("_as_before")
def test_hostile_files_end_in_findings(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    hostile.prepare(tmp_path)
    figures = hostile.Figures()
    for number, case in enumerate(hostile.cases(SEED)[::EVERY]):
        hostile.judge(case, tmp_path, hostile.CODE_PAGES[number % 4], figures, number)
    assert figures.failures == []
    assert (figures.tracebacks, figures.bugs, figures.hangs) == (0, 0, 0)
    assert figures.executions == figures.files >= 50


@pytest.mark.usefixtures("_as_before")
def test_a_traceback_a_bug_and_an_escape_are_seen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    case = hostile.Case("a.yaml", b"a: 1\n", (("validate", "{}"),))
    figures = hostile.Figures()
    monkeypatch.setattr("pidcfg.cli.findings.check_input", lambda *_: 1 / 0)
    hostile.judge(case, tmp_path, hostile.CODE_PAGES[0], figures)
    assert (figures.tracebacks, figures.bugs, len(figures.failures)) == (1, 1, 1)


def test_every_reader_takes_what_is_sound_and_refuses_what_is_not_as_it_says():
    refused = []
    for target in readers.TARGETS:
        read, declared = readers.reader(target)
        for data in (small.seeds(target)[0], b"\xff\x00: ["):
            try:
                read(data)
            except declared:
                refused.append((target, data == small.seeds(target)[0]))
    assert [target for target, sound in refused if sound] == ["workbook", "generic-words"], (
        "of these the sound input is refused: a formula without a result, and an empty text for a mode"
    )
    assert len(refused) > 10


@pytest.fixture
def changed(monkeypatch):
    """Changed examples without compiled kernels, which take half a minute."""
    monkeypatch.setattr(fuzz.engine, "is_installed", lambda: False)
    return fuzz.Fuzz(SEED)


def test_changed_examples_keep_what_must_be_true(changed):
    for number in range(12):
        changed.run(number, deep=number % 4 == 0)
    assert changed.found.failures == []
    assert changed.found.mutants == 12
    assert changed.found.valid > 0


def test_every_command_of_a_changed_example_ends_as_it_must(changed, monkeypatch):
    text, scenario = (path.read_text("utf-8") for path in (BOILER, BOILER.with_suffix(".scenario.yaml")))
    scenario = scenario.replace("boiler.yaml", commands.CONFIG)
    for line in commands.LINES[::9]:
        monkeypatch.setattr(commands, "LINES", (line,))
        commands.run(text, scenario, "generic", random.Random(SEED), ok=True)


@pytest.mark.parametrize(
    ("place", "fault", "told"),
    [
        ("reliability.fuzz.words_of", lambda _: object(), "encode: other words come back, and no note says so"),
        ("reliability.fuzz.unspoken", lambda *_: ["gain"], "no line of the report speaks of ['gain']"),
        ("reliability.fuzz.Fuzz._run", lambda *args: ("ran", args[-1].__name__), "simulate: engines differ"),
        ("pidcfg.output.sheets.number_or_text", lambda _: 7, "sheet: "),
        ("command.main", lambda: sys.exit(3), " ends with 3: "),
        ("command.main", lambda: sys.exit(2), " ends with 2 and says nothing"),
        ("command.main", lambda: sys.exit(Path(commands.CONFIG).write_text("")), f" changes {{'{commands.CONFIG}'}}"),
        ("command.main", lambda: sys.exit(Path(".m.yaml.1").touch()), " leaves ['.m.yaml.1']"),
    ],
)
def test_what_is_not_true_of_a_changed_example_is_seen(changed, place, fault, told, monkeypatch):
    monkeypatch.setattr(place, fault)
    for number in range(60):
        changed.run(number)
        if any(told in failure for failure in changed.found.failures):
            return
    pytest.fail(f"{changed.found}")


@pytest.mark.usefixtures("_as_before")
def test_listings_of_any_memory_end_in_answers(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rig = memories.Memories(SEED, tmp_path)
    for vendor in VENDORS:
        for number in (1, 9, 43):  # on an older version each found something
            rig.run(vendor, number, (*memories.COMMANDS[:2], memories.COMMANDS[-1]))
    assert rig.failures == []
    assert rig.answers > rig.runs // 3


def test_changed_listings_keep_what_must_be_true(monkeypatch):
    rig = codecs.Codecs(SEED)
    for number in range(12):
        rig.run(number)
    assert rig.found.failures == []
    assert rig.found.valid > 0
    monkeypatch.setattr(codecs, "words_of", lambda _: object())
    monkeypatch.setattr(codecs, "decode", lambda *_, **__: type("Decoded", (), {"ok": True, "text": GOOD, "notes": ()}))
    monkeypatch.setattr(codecs, "encode", lambda *_, **__: type("Encoded", (), {"ok": False, "findings": ()}))
    rig.run(1)
    assert rig.found.failures[-1].endswith("what was decoded does not encode, and nothing says why")


def test_a_command_that_is_ended_leaves_an_old_file_or_a_new_one(monkeypatch):
    monkeypatch.setattr(kills, "COMMANDS", kills.COMMANDS[:1])
    monkeypatch.setattr(kills, "LIVE", ())
    found = kills.Kills()
    for number in (1, 2, 3):
        kills.run(found, SEED, number)
    assert found.failures == []
    assert sum(found.ended.values()) + found.finished == 3


def test_a_part_of_a_file_a_lost_one_and_one_that_is_left_are_seen():
    before, after = {"a": b"old", "b": b"old"}, {"a": b"new", "b": b"old", "c": b"new"}
    for found, fault in (
        ({"a": b"ne", "b": b"old"}, ["a is neither old nor new"]),
        ({"a": b"new"}, ["b is gone"]),
        ({"a": b"old", "b": b"old", "d": b""}, ["d is left"]),
        ({"a": b"old", "b": b"old", "c": b"new"}, []),
    ):
        assert kills._faults(found, before, after, kills.signal.SIGTERM) == fault


def test_a_file_that_grows_by_rows_ends_behind_any_of_them():
    after = {kills.ROWS: b"a,b\n1,2\n3,4\n"}
    for data, count in ((b"", 0), (b"a,b\n1,2\n", 0), (b"a,b\n1,2", 1), (b"a,b\n1,2\n3\n", 1)):
        assert len(kills._faults({kills.ROWS: data}, {}, after, kills.signal.SIGTERM)) == count


def test_a_file_that_may_not_grow_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    monkeypatch.setattr(faults, "COMMANDS", kills.COMMANDS[:1])
    monkeypatch.setattr(faults, "QUOTA", (100,))
    found = faults.Faults()
    assert faults.quota(found, tmp_path) == 1
    assert found.failures == []
    outcome = faults.subprocess.CompletedProcess((), 3, b"", b"Traceback")
    (tmp_path / "a.yaml").write_bytes(b"part")
    faults.judged(found, "x", outcome, tmp_path, {"a.yaml": b"whole"})
    assert len(found.failures) == 2


def test_a_copy_that_takes_too_long_or_fails_is_told():
    assert copies.in_a_copy(lambda: [1], 5, silent=True) == (0, [1])
    assert copies.in_a_copy(lambda: 1 / 0, 5, silent=True) == (copies.BROKEN, None)
    code, found = copies.in_a_copy(spinning, 1, silent=True)
    assert code < 0
    assert found is None


def spinning():
    while True:
        pass


def test_the_square_of_the_input_is_seen(monkeypatch):
    clock = iter(range(10**6))
    monkeypatch.setattr(growth, "KINDS", {"x": (1, lambda n: [next(clock) for _ in range(n * n)])})
    monkeypatch.setattr(growth.time, "process_time", lambda: float(next(clock)))
    assert growth.measured("x")["factor"] > growth.MOST
    monkeypatch.setattr(growth, "KINDS", {"x": (8, lambda n: [next(clock) for _ in range(n)])})
    assert growth.measured("x")["factor"] <= growth.MOST


def test_a_fault_in_the_code_is_another_tree_and_another_code(monkeypatch):
    path = "pidcfg/conversion/builder.py"
    found = list(valid(m for m in mutants.mutants(path) if m.scope[0] == "filter_time"))
    kinds = {mutant.change.partition(" -> ")[2] for mutant in found}
    assert {"factor > ONE", "factor < ONE", "return None", "ONE + factor"} <= kinds
    compared = next(mutant for mutant in found if mutant.change == "factor >= ONE -> factor < ONE")
    assert [name for name, _ in mutants.changed_codes(compared)] == ["filter_time"]
    assert (
        mutants.drawn("conversion", 1)[:5] == mutants.drawn("conversion", 1)[:5] != mutants.drawn("conversion", 2)[:5]
    )


def test_a_function_that_waits_is_a_function_and_so_is_one_that_another_thread_runs():
    from pidcfg.live.serving import _run_in_real_time

    path = "pidcfg/live/serving.py"
    mutant = next(m for m in mutants.mutants(path) if m.change == "lag > MAX_LAG_SECONDS -> lag >= MAX_LAG_SECONDS")
    assert mutant.scope[0] == "_run_in_real_time"
    assert users(mutant, lambda *_: True) == {(path, "_run_in_real_time")}
    assert _called(cProfile.Profile(), _run_in_real_time.__code__) == {f"{path}::_run_in_real_time"}


def test_a_fault_is_put_into_the_functions_that_live():
    from pidcfg.conversion import builder as module

    mutant = next(
        m for m in mutants.mutants("pidcfg/conversion/builder.py") if m.change == "factor >= ONE -> factor < ONE"
    )
    ((key, code),) = mutants.changed_codes(mutant).items()
    function = module.filter_time
    assert (function.__code__.co_qualname, function.__code__.co_firstlineno) == key
    before = function.__code__
    runner = Runner.__new__(Runner)
    runner.functions = {(before.co_filename, *key): [function]}
    runner.caches = []
    runner.session = type("Session", (), {"run": lambda *_: None})()
    try:
        runner._changed(mutant, [])
        assert function.__code__ == code
        assert function(module.ONE / 2, module.ONE) == 0
    finally:
        function.__code__ = before


def test_a_fault_in_a_table_reaches_what_is_made_from_it():
    path = "pidcfg/encoders/maps/click.py"
    mutant = next(m for m in mutants.mutants(path) if not m.scope[0])
    assert ("pidcfg/encoders/click/image.py", "encode") in users(mutant, lambda *_: True)
    one = next(m for m in mutants.mutants("pidcfg/conversion/builder.py") if m.scope[0] == "filter_time")
    assert users(one, lambda *_: True) == {("pidcfg/conversion/builder.py", "filter_time")}
    assert users(one, lambda path, _: path != one.path) == {
        ("pidcfg/conversion/operation.py", "Smoothing.time"),
        ("pidcfg/conversion/click.py", "_neutral_pv_filter"),
        ("pidcfg/conversion/from_dl06.py", "_pv_filter"),
    }


def test_what_a_run_left_is_tried_again_where_it_stands_now(tmp_path, monkeypatch):
    """Lines of code above it may have come or gone; what was seen at first is kept."""
    monkeypatch.setattr(figures, "FOLDER", tmp_path)
    path = "pidcfg/conversion/builder.py"
    one = next(mutant for mutant in mutants.mutants(path) if mutant.change == "factor >= ONE -> factor < ONE")
    moved, gone = one.exact.replace(f":{one.line} ", f":{one.line + 7} "), f"{path}:9 no_such_code -> pass @1"
    run = {"first": {"failed": 8, "lives": 2}, "ends": {"failed": 8, "lives": 2}, "left": [moved, gone], "control": {}}
    for seed in (3, 4):
        figures.keep("mutants-conversion", {**run, "seed": seed})

    assert list(mutation.again("conversion", 3, lambda _: "failed")) == [(one, "failed"), (None, "gone")]
    changed = {**run, "seed": 3, "ends": {"failed": 9, "gone": 1}, "left": []}
    assert figures.kept()["mutants-conversion"] == [changed, {**run, "seed": 4}]
    assert "| conversion | 3 | 9 | 1 | 80 % (8 of 10) | 100 % (9 of 9) |" in page(figures.kept())


def test_a_test_file_names_the_modules_that_it_looks_into():
    assert "tests/test_explain.py" in importing_files("pidcfg/encoders/maps/click.py")
    assert "tests/test_explain.py" not in importing_files("pidcfg/encoders/maps/generic.py")
    assert "tests/test_live.py" in importing_files("pidcfg/live/link.py"), "the map may have files that are left out"


def test_an_order_keeps_all_tests_and_files_together_and_is_that_of_its_seed():
    names = [f"{file}::test_{i}" for file in "abcd" for i in range(5)]
    orders = [[names[i] for i in order.shuffled(names, seed, freely=False)] for seed in (1, 1, 2)]
    assert orders[0] == orders[1] != orders[2]
    assert sorted(orders[0]) == names != orders[0]
    files = [name[0] for name in orders[0]]
    assert sum(one != two for one, two in pairwise(files)) == 3
    free = order.shuffled(names, 1, freely=True)
    assert sorted(free) == list(range(len(names)))
    assert sum(names[i][0] != names[j][0] for i, j in pairwise(free)) > 3


def test_a_test_that_fails_in_an_order_and_passes_alone_is_a_flip():
    alone = {"flips": "passed", "broken": "failed"}

    def ran(arguments, **variables):
        if len(arguments) == 1:
            return {arguments[0]: alone[arguments[0]]}
        assert variables == {order.SEED: "7"}
        return {"good": "passed", "away": "skipped", "flips": "failed", "broken": "failed"}

    found = order.run_one(["tests"], 7, 3, freely=False, ran=ran)
    assert (found["passed"], found["skipped"], found["failed"]) == (1, 1, 2)
    assert (found["flips"], found["broken"]) == (["flips"], ["broken"])


def test_the_plugin_shuffles_and_tells_how_each_test_ended(tmp_path, monkeypatch):
    for name in (order.SEED, order.FREELY, order.OUTCOMES):
        monkeypatch.delenv(name, raising=False)
    Path(tmp_path / "test_two.py").write_text(
        "seen = []\n\ndef test_one():\n    seen.append(1)\n\ndef test_two():\n    assert seen\n", "utf-8"
    )
    plain = order.outcomes([str(tmp_path), "--rootdir", str(tmp_path)])
    assert plain == {"test_two.py::test_one": "passed", "test_two.py::test_two": "passed"}
    seed = next(seed for seed in range(9) if order.shuffled(list(plain), seed, freely=False) == [1, 0])
    ends = order.outcomes([str(tmp_path), "--rootdir", str(tmp_path)], **{order.SEED: str(seed)})
    assert ends == {"test_two.py::test_one": "passed", "test_two.py::test_two": "failed"}
    broken_off = "def test_one():\n    raise KeyboardInterrupt\n\ndef test_two(): ...\n"
    (tmp_path / "test_two.py").write_text(broken_off, "utf-8")
    assert order.outcomes([str(tmp_path), "--rootdir", str(tmp_path)]) == {"2 tests that did not run": "failed"}


def test_the_page_is_written_from_the_figures_that_are_kept():
    assert PAGE.read_text("utf-8") == page(figures.kept())


def test_a_part_that_was_not_run_is_told_and_a_failure_counts():
    assert page({}).count("This part was not run yet.") == len(PARTS) + 1
    kept = figures.kept()
    worse = {**kept, "examples": {**kept["examples"], "failures": ["x"]}}
    assert page(worse) != page(kept)


@pytest.fixture(scope="module")
def every_field():
    return words.Words(SEED)


def test_words_of_every_field_come_back_and_numbers_go_to_the_nearest(every_field, monkeypatch):
    monkeypatch.setattr(words, "WORDS", range(0, 0x10000, 4093))
    monkeypatch.setattr(words, "MADE", words.MADE[::500])
    monkeypatch.setattr(words, "PATTERNS", 2)
    monkeypatch.setattr(rounding, "DRAWN", 2)
    every_field.found = words.Found()
    for number in range(len(every_field.fields)):
        every_field.run(number)
    assert every_field.found.failures == []
    assert every_field.found.fields == len(every_field.fields) > 700


@pytest.mark.parametrize(
    ("field", "place", "broken"),
    [
        ("dl06 Loop table (32 words a loop) gain", "pidcfg.encoders.codecs.bcd_word", lambda digits: digits),
        ("dl06 Loop table (32 words a loop) gain", "pidcfg.encoders.codecs.round_to_integer", int),
        ("dl06 Loop table (32 words a loop) setpoint", "pidcfg.encoders.codecs.round_to_integer", int),
        ("click Floats (25 consecutive DF) pv_high", "pidcfg.encoders.codecs._round_to_odd", float),
        ("dl06 V address", "pidcfg.encoders.regmap.Bank.address_name", lambda bank, n: f"{bank.prefix}{n}"),
        ("literal of REAL", "pidcfg.encoders.structured_text.real_text", "{:.6f}".format),
        ("literal of INT", "pidcfg.encoders.parameters.store_content", lambda _, value: abs(int(value))),
    ],
)
def test_a_codec_that_is_wrong_is_seen(every_field, field, place, broken, monkeypatch):
    monkeypatch.setattr(words, "WORDS", range(0, 0x10000, 257))
    monkeypatch.setattr(words, "PATTERNS", 20)
    monkeypatch.setattr(words, "MADE", words.MADE[::100])
    monkeypatch.setattr(rounding, "DRAWN", 200)
    monkeypatch.setattr(place, broken)
    every_field.found = words.Found()
    for number, each in enumerate(every_field.fields):
        if each.name.startswith(field):
            every_field.run(number)
    assert every_field.found.failures
