"""``docs/reliability.md`` from the figures of the parts: no figure on it is typed."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reliability import growth, hostile, kills, others
from reliability.mutants import PACKAGES, equal

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

PAGE = Path(__file__).parents[2] / "docs" / "reliability.md"
HEAD = """\
# Reliability

What was thrown at pidcfg, and what came of it. `python tasks.py torture` runs the programme, or parts of it, and
`python tasks.py mutants` puts faults into the code; each part keeps its figures, of all runs where seeds
differ, and this page is written from them. It says what was found beside what was tried.
"""
NOT_RUN = "This part was not run yet."
KILLED, LIVE = ("failed", "time"), ("lives", "unreached")
"""Ends of a mutant."""
MEANT = {
    "encoders": "95 %", "conversion": "95 %", "rules": "92 %", "controllers": "92 %", "verification": "90 %",
    "live": "90 %", "certification": "90 %",
}  # fmt: skip
"""Share of the mutants that the tests should end."""


def page(kept: Mapping[str, Any]) -> str:
    """The page."""
    parts = (HEAD, *(f"## {title}\n\n{text}\n" for title, text in _sections(kept)))
    return "\n".join(parts)


def _sections(kept: Mapping[str, Any]) -> Iterable[tuple[str, str]]:
    for title, part, text in (
        ("Hostile files", "hostile", _hostile),
        ("Changed examples", "examples", _examples),
        ("Changed listings", "codecs", _codecs),
        ("Words of every register", "words", _words),
        ("Inputs that grow towards new branches", "guided", _guided),
        ("Commands that are ended", "kills", _kills),
        ("Faults of the machine", "faults", _faults),
        ("Time and memory by the size of the input", "growth", _growth),
        ("Beside other tools", "against", _against),
        ("Tests in other orders", "order", _order),
    ):
        yield title, text(kept[part]) if part in kept else NOT_RUN
    yield "Faults in the code", _mutants(kept)
    yield "Long tests", _long()


def _table(head: tuple[str, ...], rows: Iterable[Iterable[object]]) -> str:
    lines = (head, ("---",) * len(head), *rows)
    return "\n".join("| " + " | ".join(map(str, row)) + " |" for row in lines)


def _run(found: Mapping[str, Any]) -> tuple[str, str]:
    minutes = found["cpu"] / 60
    return "seeds; CPU", f"{found['seed']}; " + (f"{minutes:.1f} min" if minutes < 60 else f"{minutes / 60:.1f} h")


def _wrong(found: Mapping[str, Any]) -> tuple[str, int]:
    return "found", len(found["failures"])


def _hostile(found: Mapping[str, Any]) -> str:
    rows = (
        _run(found),
        ("files", f"{found['files']} of {found['kinds']} kinds of input, each spoiled in up to {found['spoils']} ways"),
        ("commands run on them, as UTF-8, ASCII, cp1252 and in the locale C", found["executions"]),
        ("tracebacks; exit code 3", f"{found['tracebacks']}; {found['bugs']}"),
        (f"hangs (over {hostile.SECONDS} s of CPU)", found["hangs"]),
        ("slowest command", f"{found['slowest']:.1f} s of CPU"),
        ("most memory of the process that ran all of them", f"{found['memory'] / 1024:.0f} MB"),
        _wrong(found),
    )
    return _table(("what", "figure"), rows)


def _examples(found: Mapping[str, Any]) -> str:
    rows = (
        _run(found),
        ("changed examples; of these valid", f"{found['mutants']}; {found['valid']}"),
        ("encoded or decoded; as a sheet and back", f"{found['codecs']}; {found['sheets']}"),
        ("converted; corrected", f"{found['conversions']}; {found['fixes']}"),
        ("simulated twice, of these compiled too", f"{found['simulations']}; {found['compiled']}"),
        ("commands run on them", found["commands"]),
        ("branches of the code that none before it on that machine had taken, of every sixth", found["branches"]),
        ("CPU without a new one, at the end of each run", ", ".join(f"{s / 60:.0f} min" for s in found["quiet"])),
        _wrong(found),
    )
    return (
        f"{_table(('what', 'figure'), rows)}\n\n"
        "True of every one: only declared errors; what validates without an error encodes, and what encodes decodes\n"
        "to the same words, or a note says which differ, in every format that holds all of them; a sheet comes back\n"
        "as the same configuration; `--fix` twice is as once, and removes what it claims; a file does not differ from\n"
        "itself, and none with other words is the same; what is converted can be read, a line speaks of each field,\n"
        "and twice is as once; a scenario without an error runs, and gives the same figures twice and\n"
        "compiled; a command ends with a declared exit code, says why, and changes no file but its own."
    )


def _codecs(found: Mapping[str, Any]) -> str:
    rows = (
        _run(found),
        ("listings of examples with other contents; of these decoded", f"{found['mutants']}; {found['valid']}"),
        ("encoded or decoded", found["codecs"]),
        _wrong(found),
    )
    return (
        f"{_table(('what', 'figure'), rows)}\n\n"
        "True of every one: only declared errors; what decodes encodes, and comes back as the same configuration or\n"
        "the same words."
    )


def _words(found: Mapping[str, Any]) -> str:
    rows = (
        _run(found),
        ("fields of all tables, listings, addresses and literals, each as often as it was run", f"{found['fields']:,}"),
        ("decoded or encoded", f"{found['executions']:,}"),
        ("words that mean nothing, refused with a declared error", f"{found['refused']:,}"),
        ("numbers that were encoded", f"{found['rounded']:,}"),
        _wrong(found),
    )
    return (
        f"{_table(('what', 'figure'), rows)}\n\n"
        "A field of up to 16 bits gets every word, a wider one drawn patterns and made ones. True of every one: a\n"
        "word that decodes encodes to itself (−0 to 0, of several codes of one choice the first), and a number goes\n"
        "to the nearest word, of two the even one."
    )


def _guided(found: Mapping[str, Any]) -> str:
    rows = (
        (
            name,
            f"{row['executions']:,}",
            f"{row['executions'] / row['cpu']:,.0f}",
            f"{row['seconds'] / 60:.1f} min",
            row["new"],
            f"{row['quiet']:.0f} s",
        )
        for name, row in sorted(found["targets"].items())
    )
    head = ("reader", "executions", "a second of CPU", "time", "inputs kept for a new branch", "without one at the end")
    return (
        f"{_table(('what', 'figure'), (_run(found), _wrong(found)))}\n\n{_table(head, rows)}\n\n"
        "Coverage-guided (atheris). True of every one: only declared errors, within 20 s and 1 GB; a configuration\n"
        "without an error encodes; a baseline is written as it is read. Formats of listings are read apart from what\n"
        "their words mean, each for every vendor that has it; `-words` puts other contents into a vendor's words.\n\n"
        "`PIDCFG_ATHERIS` names the Python: of a virtual environment with atheris and `requirements/run.txt` and\n"
        "`report.txt`, in which pidcfg itself is not installed."
    )


def _kills(found: Mapping[str, Any]) -> str:
    ended = ", ".join(f"{count} by {name}" for name, count in sorted(found["ended"].items()))
    rows = (
        _run(found),
        (
            "commands; ended at a random moment",
            f"{len(kills.COMMANDS + kills.LIVE)}; {sum(found['ended'].values())}: {ended}",
        ),
        ("at their end before", found["finished"]),
        ("run again after SIGKILL, and nothing of the first one left", found["cleaned"]),
        ("files neither old nor new; left behind; other exit codes", len(found["failures"])),
    )
    return _table(("what", "figure"), rows)


def _faults(found: Mapping[str, Any]) -> str:
    rows = ((fault, runs or "not to be made here", _of(found, fault)) for fault, runs in found["runs"].items())
    return (
        f"{_table(('fault', 'commands', 'found'), rows)}\n\n"
        "After each the files are the old or the new ones, whole, with nothing beside them, and the exit code is\n"
        "declared."
    )


def _of(found: Mapping[str, Any], fault: str) -> int:
    return sum(failure.startswith(f"{fault}: ") for failure in found["failures"])


def _growth(found: Mapping[str, Any]) -> str:
    rows = (
        (kind, f"{row['size']:.0f}", f"{row['seconds']:.2f} s", f"{row['factor']:.2f}", f"{row['memory']:.0f} MB")
        for kind, row in found["kinds"].items()
    )
    head = ("input", "largest", "CPU", "twice the input, at most", "memory above a small one")
    return (
        f"{_table(head, rows)}\n\n"
        f"Twice the input may take {growth.MOST} times the CPU (medians of {growth.TIMES}, "
        f"{growth.DOUBLINGS} doublings), and the largest {growth.MEGABYTES} MB.\nBeyond that: {len(found['failures'])}."
    )


def _against(found: Mapping[str, Any]) -> str:
    rows = ((tool, *(row[end] for end in ("answer", "crash", "time-out"))) for tool, row in found["tools"].items())
    missing = f"\nNot installed: {', '.join(found['missing'])}." if found["missing"] else ""
    return (
        f"{found['files']} hostile YAML files, drawn with seed {found['seed']}; check-jsonschema with the schema that "
        f"pidcfg prints.\n\n{_table(('tool', 'answers', 'crashes', f'over {others.SECONDS} s'), rows)}{missing}\n\n"
        "`python tasks.py torture against` looks for the others on the PATH and in the folder that `PIDCFG_OTHERS`\n"
        "names, such as `others/bin` after `python -m venv others` and\n"
        "`others/bin/pip install yamllint check-jsonschema zizmor`."
    )


def _order(found: Mapping[str, Any]) -> str:
    rows = (
        (run["seed"], run["workers"], *_counts(run), ", ".join(map("`{}`".format, run["flips"])) or "-")
        for run in found["runs"]
    )
    how = "all of them freely" if any(run["freely"] for run in found["runs"]) else "files, and tests inside of each"
    head = ("seed", "workers", "passed", "skipped", "failed", "failed here and passed alone", "which")
    return f"{_table(head, rows)}\n\nThe ordinary tests in the order of a seed ({how}); what fails is run again alone."


LONG = re.compile(r"pytest\.mark\.long\(\s*\"([^\"]+)\"")


def _long() -> str:
    """The tests that are marked so, by their files."""
    paths = sorted(PAGE.parents[1].glob("tests/test_*.py"))
    rows = [(f"`{path.name}`", reason) for path in paths for reason in LONG.findall(path.read_text("utf-8"))]
    return f"Ordinary tests that take more than 10 s of CPU:\n\n{_table(('file', 'why'), rows)}"


def _counts(run: Mapping[str, Any]) -> tuple[int, ...]:
    return run["passed"], run["skipped"], run["failed"], len(run["flips"])


def _mutants(kept: Mapping[str, Any]) -> str:
    rows = []
    for package in PACKAGES:
        for found in kept.get(f"mutants-{package}", ()):
            ends = found["ends"]
            out = ends.get("equal", 0) + ends.get("gone", 0)
            control = ", ".join(f"{count} {end}" for end, count in sorted(found["control"].items()))
            shares = _killed(found["first"]), _killed(ends), MEANT[package]
            rows.append((package, found["seed"], sum(ends.values()) - out, out, *shares, control))
    head = ("package", "seed", "faults", "left out", "ended at first", "ended now", "meant", "unchanged code")
    return (
        "Small faults, one at a time: another comparison, operator, number or argument, a statement or a value that\n"
        "is gone. Each runs the tests that call its function, as many as fit the time. A seed draws them anew: what\n"
        "ended at first is the rate of the tests as they were before its faults were seen, what ends now that of the\n"
        "tests that came of them, with more time. Left out is what changes nothing, and what stands in code that was\n"
        "deleted since.\n\n"
        f"{_table(head, rows) if rows else NOT_RUN}{_equal()}"
    )


def _killed(ends: Mapping[str, int]) -> str:
    """Those that a test ended, of all that change something."""
    killed = sum(ends.get(end, 0) for end in KILLED)
    tried = killed + sum(ends.get(end, 0) for end in LIVE)
    return f"{100 * killed / tried:.0f} % ({killed} of {tried})" if tried else "not kept"


def _equal() -> str:
    """Why no test can end a fault that was left out."""
    rows = ((f"`{mutant}`".replace("|", "\\|"), reason) for mutant, reason in sorted(equal().items()))
    table = _table(("fault", "why it changes nothing"), rows)
    return f"\n\nLeft out:\n\n{table}" if equal() else ""
