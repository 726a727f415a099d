"""Imports point down, heavy packages stay where they are needed, modules and functions stay small."""

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import pidcfg
from pidcfg.vendors import VENDORS

ROOT = Path(__file__).parents[1]
SRC = ROOT / "src"

# fmt: off
MAY_IMPORT = {
    # part          parts of pidcfg that it may import besides itself; about, text.frozen and text.paths serve all
    "about":            "",
    "text.frozen":      "",
    "text.paths":       "",
    "text.signs":       "",
    "text.references":  "",
    "text.processes":   "",
    "text.reader":      "",
    "text.store":       "text.reader",
    "text.writer":      "text.signs",
    "text.diagnostics": "",
    "text.document":    "text.reader text.diagnostics",
    "text.syntax":      "text.signs text.diagnostics",
    "text.source":      "text.signs text.reader text.diagnostics text.document text.syntax",
    "text":             "",
    "schemas":          "text.signs text.references",
    "vendors":          "",
    "encoders":         "text.signs text.references text.writer schemas",
    "encoders.decoding": "text.signs text.references text.reader vendors encoders",
    "pictures":         "text.signs",
    "conversion":       "text.references text.diagnostics text.document schemas vendors encoders",
    "tuning":           "text.signs text.references text.reader schemas vendors encoders",
    "validate":         "text.signs text.references text.reader text.writer text.diagnostics text.document text.source "
                        "schemas vendors encoders",
    "sim":              "text.signs text.references text.store schemas encoders tuning",
    "study":            "",
    "study.scenario":   "text.references text.reader text.diagnostics text.document text.source schemas vendors "
                        "encoders validate sim study.uncertainty study.accepted",
    "study.uncertainty": "text.references text.document schemas sim",
    "study.accepted":   "text.references text.reader text.writer text.diagnostics text.document schemas sim",
    "study.outcome":    "text.reader text.diagnostics text.document pictures validate sim "
                        "study.scenario study.accepted",
    "study.certification": "text.references text.processes text.reader text.writer text.diagnostics text.document "
                        "text.source schemas pictures sim study.scenario study.uncertainty "
                        "study.outcome",
    "study.verification": "text.references text.processes schemas vendors encoders pictures conversion sim",
    "study.draft_plan": "text.references schemas sim study.verification",
    "study.draft":      "text.signs text.reader text.diagnostics text.document text.source schemas validate sim "
                        "study.scenario study.outcome study.draft_plan study.verification",
    "output":           "text.signs text.reader text.writer text.diagnostics text.document text.source schemas vendors "
                        "encoders conversion tuning validate sim study.scenario study.accepted "
                        "study.outcome study.certification study.verification",
    "output.runs":      "text.diagnostics schemas pictures sim study.outcome study.accepted "
                        "study.certification output.findings output.notebook",
    "output.drawing":   "text.references text.diagnostics pictures study.outcome study.certification output.arguments "
                        "output.findings output.notebook output.runs",
    "output.handles":   "text.references text.reader text.diagnostics text.document text.source schemas encoders "
                        "validate tuning sim.controllers.plc study.scenario output.arguments output.findings "
                        "output.retune",
    "output.explanation": "text.signs text.references text.diagnostics text.document schemas vendors encoders validate "
                        "output.arguments output.findings",
    "output.report":    "text.signs text.diagnostics schemas vendors encoders pictures conversion validate sim "
                        "output.explanation",
    "output.sheets":    "text.signs text.writer text.document schemas vendors",
    "output.sheet_reader": "text.signs text.reader text.writer text.diagnostics text.document text.source schemas "
                        "vendors validate output.sheets",
    "output.notebook":  "text.signs text.diagnostics pictures study.outcome",
    "output.browser":   "text.references text.diagnostics text.document text.store vendors pictures output.handles "
                        "output.runs output.words",
    "live":             "text.references text.reader text.diagnostics text.document schemas vendors encoders "
                        "conversion validate sim study.scenario study.outcome output",
    "api":              "text.reader vendors encoders tuning validate sim study output",
    "cli":              "*",
    "cli.lsp":          "text.reader text.writer text.diagnostics text.document text.source vendors validate "
                        "study.scenario output api cli.inputs cli.policy cli.formats",
    "__init__":         "text.reader text.diagnostics text.document encoders tuning validate study output live api",
    "__main__":         "cli",
}

ONLY_IN = {
    # package       modules that may import it
    "click":         "cli",
    "rich":          "cli.console cli.terminal cli.commands.trend",
    "pathspec":      "cli.inputs",
    "pygls":         "cli.lsp.server",
    "lsprotocol":    "cli.lsp",
    "ruamel":        "text.source text.writer",
    "openpyxl":      "output.sheet_reader",
    "pymodbus":      "live",
    "serial":        "live",
    "numpy":         "sim.engine.compile",
    "numba":         "sim.engine.compile",
    "matplotlib":    "pictures.figure",
    "distributed":   "study.certification.cluster",
    "jinja2":        "pictures output.report",
    "markupsafe":    "output.report",
    "xlsxwriter":    "output.report output.sheets",
    "pydantic":      "schemas encoders vendors validate sim tuning conversion output study.verification "
                     "cli.commands.schema",
    "pydantic_core": "schemas encoders vendors validate sim study.uncertainty study.verification study.draft "
                     "study.draft_plan",
    "importlib":     "vendors cli live output.sheet_reader output.conversion output.explanation.lookup "
                     "sim.engine.compile study.certification.samples __init__",
    # imports by name: the tables above cannot see them
}

LOADS = {
    # command                                         slow packages that it may load, and vendors
    "--version":                                      "",
    "--help":                                         "",
    "validate --help":                                "",
    "convert --help":                                 "",
    "decode --help":                                  "",
    "certify --help":                                 "",
    "encode --help":                                  "",
    "rule PID101":                                    "",
    "explain V7642=0008":                             "pydantic dl06",
    "init --vendor dl06":                             "",
    "completion zsh":                                 "",
    "tune --method zn-closed --ultimate-gain 2 --ultimate-period 3": "",
    "validate examples/dl06/reactor.yaml":            "pydantic ruamel dl06",
    "validate examples/dl06/reactor.yaml --format sarif": "pydantic ruamel dl06",
    "validate examples/dl06/reactor.yaml --format junit": "pydantic ruamel dl06",
    "schema":                                         "",
    "schema output-simulate":                         "",
    "encode examples/dl06/reactor.yaml":              "pydantic ruamel dl06",
    "simulate examples/dl06/reactor.scenario.yaml":   "pydantic ruamel dl06",
    "report examples/dl06/reactor.yaml -o -":         "pydantic ruamel jinja2 dl06",
    "simulate examples/dl06/reactor.scenario.yaml --plot -": "pydantic ruamel dl06",
    "simulate examples/click/tank.scenario.yaml":     "pydantic ruamel click",
    "validate examples/ezlogix/oven.yaml":            "pydantic ruamel ezlogix",
    "encode examples/ezlogix/oven.yaml":              "pydantic ruamel ezlogix",
    "simulate examples/ezlogix/oven.scenario.yaml":   "pydantic ruamel ezlogix",
    "encode examples/nextopid/cascade.yaml --format st": "pydantic ruamel nextopid",
    "diff examples/ezlogix/oven.yaml examples/ezlogix/oven.yaml --plot -": "pydantic ruamel ezlogix generic",
    "simulate examples/nextopid/cascade.scenario.yaml --engine python": "pydantic ruamel nextopid",
    "simulate examples/dpide/oven.scenario.yaml":     "pydantic ruamel dpide",
    "validate src/pidcfg/cli/starters/click.yaml":        "pydantic ruamel click",
    "encode src/pidcfg/cli/starters/click.yaml":          "pydantic ruamel click",
    "encode src/pidcfg/cli/starters/click.yaml --format nickname-csv": "pydantic ruamel click",
    "rule":                                           "",
    "rule NX6":                                       "",
    "rule DL222":                                     "",
    "explain DS101 --loop":                           "pydantic click",
    "explain R102 --loop":                            "pydantic ezlogix",
    "explain PID101":                                 "",
    "explain DL242 ck301":                            "",
    "schema click":                                   "pydantic click",
    "schema scenario":                                "pydantic",
    "tune --method zn-closed --ultimate-gain 2 --ultimate-period 3 --for click": "pydantic click",
    "export examples/dl06/reactor.yaml":              "pydantic ruamel",
    "decode examples/dl06/golden/reactor.json --vendor dl06": "pydantic ruamel dl06",
    "convert examples/dl06/reactor.yaml --to click --allow-loss": "pydantic ruamel dl06 click generic",
    "diff examples/dl06/reactor.yaml examples/dl06/reactor.yaml": "pydantic ruamel dl06 generic",
    "init --scenario examples/dl06/reactor.yaml":     "pydantic ruamel dl06 generic",
    "pull --help":                                    "",
    "compare --help":                                 "",
    "trend --help":                                   "",
    "serve --help":                                   "",
    "lsp --help":                                     "",
}

STARTS = "about cli cli.environment cli.interrupts cli.main cli.terminal"
OPTIONS = (
    f"{STARTS} cli.commands cli.console cli.options text text.diagnostics text.frozen text.reader text.signs"
)
REPORTS = "cli.inputs cli.formats cli.formats.report_options text.frozen"
READS = "cli.inputs text.document text.reader text.source"
OF_VENDORS = "vendors encoders " + " ".join(f"encoders.{vendor}" for vendor in VENDORS)
MODULES = {
    # command            every module of pidcfg that it imports
    "--version":         STARTS,
    "--help":            STARTS,
    "completion --help": f"{STARTS} cli.commands cli.commands.completion cli.console text text.signs",
    "validate --help":   f"{OPTIONS} {REPORTS} {READS} cli.commands.validate cli.formats.findings cli.settings "
                         "cli.watch output output.findings text.paths text.writer",
    "convert --help":    f"{OPTIONS} {REPORTS} {READS} cli.commands.convert cli.plots {OF_VENDORS}",
    "encode --help":     f"{OPTIONS} cli.commands.encode {OF_VENDORS}",
    "decode --help":     f"{OPTIONS} {READS} cli.commands.decode {OF_VENDORS}",
}

LINES = {
    # command            most lines of modules of pidcfg that it imports, those of rules apart
    "--version":         870,
    "completion --help": 1_440,
    "validate --help":   5_800,
    "convert --help":    4_750,
    "encode --help":     2_870,
    "decode --help":     4_250,
    "validate examples/dl06/reactor.yaml": 15_150,
    "encode examples/dl06/reactor.yaml": 18_900,
    "simulate examples/dl06/reactor.scenario.yaml": 31_250,
}
RULE_LINES = 4_000
"""Most lines of the modules of rules that a file loads: a further rule is held by its case, not by this."""
SERVE_ALL = ("about", "text.frozen", "text.paths")

LONG_FUNCTIONS = {
    # function                     why it may have more than 50 lines
    "sim.controllers.dl06.scan.sample": "a kernel: one sample in the order of the manual; a call costs ten operations",
}
# fmt: on

HEAVY = (
    "pygls",
    "lsprotocol",
    "pydantic",
    "ruamel",
    "rich",
    "numpy",
    "numba",
    "intelhex",
    "pathspec",
    "pyclickplc",
    "pymodbus",
    "serial",
    "matplotlib",
    "jinja2",
    "xlsxwriter",
)
STANDARD = sys.stdlib_module_names - {"importlib"}
LONGEST_MODULE, LONGEST_FUNCTION = 700, 50
LONG_MODULES = {"output.json_schemas": "a table of what each command prints, a function an object of it"}


def module_name(path):
    """Name of a module below pidcfg, such as `encoders.maps.dl06`."""
    parts = path.relative_to(SRC / "pidcfg").with_suffix("").parts
    return ".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)


@cache
def trees():
    """Every module as it is parsed, by name."""
    return {module_name(path): ast.parse(path.read_bytes()) for path in sorted(SRC.rglob("*.py"))}


def imports(tree):
    """Every imported name with its line; `from a import b` counts as `a.b`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((f"{'.' * node.level}{node.module}.{alias.name}", node.lineno) for alias in node.names)


def within(module, parts):
    """Whether a module is one of the parts or inside one."""
    return any(module == part or module.startswith(f"{part}.") for part in parts)


def imported_modules(module):
    """The modules of pidcfg that one imports, wherever in it, also those that are imported for their types alone."""
    for name, _ in imports(trees()[module]):
        target = name.removeprefix("pidcfg.")
        while target and target not in trees():
            target = target.rpartition(".")[0]
        if name.startswith("pidcfg.") and target and target != module:
            yield target
        elif name in {"pidcfg", *PUBLIC} and module != "__init__":
            yield "__init__"


PUBLIC = {f"pidcfg.{name}" for name in pidcfg.__all__}
"""What stands in the package itself: to ask it for a call, or for the version, is to import all that it names."""


def circles(graph):
    """Every largest set of modules of which each can be reached from each."""
    reached = {module: {module} for module in graph}
    growing = True
    while growing:
        growing = False
        for module, there in reached.items():
            wider = there.union(*(reached[target] for near in there for target in graph[near]))
            growing |= len(wider) > len(there)
            reached[module] = wider
    groups = {frozenset(other for other in reached[module] if module in reached[other]) for module in graph}
    return [group for group in groups if len(group) > 1]


def report(breaches):
    """One line for each breach, ready to be read in a CI log."""
    return "\n" + "\n".join(breaches)


def test_imports_point_down_and_never_up():
    breaches = []
    for module, tree in trees().items():
        part = max((part for part in MAY_IMPORT if within(module, [part])), key=len)
        allowed = (part, *SERVE_ALL, *(MAY_IMPORT if MAY_IMPORT[part] == "*" else MAY_IMPORT[part].split()))
        for name, line in imports(tree):
            if name.startswith("."):
                breaches.append(f"{module}:{line} imports {name}: relative imports hide the direction")
            elif name.startswith("pidcfg.") and not within(name.removeprefix("pidcfg."), allowed):
                breaches.append(f"{module}:{line} imports {name}; {part} may see only {', '.join(allowed)}")
    assert not breaches, report(breaches)


TESTS = ROOT / "tests"
TOOLS = ROOT / "tools"
LOCKED = [(ROOT / "requirements" / f"{name}.txt").read_text("utf-8") for name in ("build", "run")]
EVERYWHERE = {"pytest", "-pytest", "hypothesis", *re.findall(r"^([a-z0-9-]+)==", "".join(LOCKED), re.MULTILINE)}
"""Packages that are there wherever tests run: what pidcfg needs itself, and what runs tests."""


TOP = re.compile(
    r"""^(?:import (?P<package>[\w.]+)|from (?P<module>[\w.]+) import (?P<names>[\w, ]+|\([^)]+\))"""
    r"""|.*\bimportorskip\("(?P<asked>\w+))""",
    re.MULTILINE,
)
"""Imports above the functions of a module, where ruff wants them, and skips. To parse all tests would take longer."""

BROUGHT = {"numba": {"numpy"}, "pyclickplc": {"pymodbus"}, "pygls": {"lsprotocol"}}
"""Packages that another one cannot be without."""


@cache
def needs(path):
    """The packages without which a module is skipped at its import, and those without which it fails there."""
    head = re.split(r"^(?:@|def |async |class )", path.read_text("utf-8"), maxsplit=1, flags=re.MULTILINE)[0]
    asked, missing = set(), set()
    for line in TOP.finditer(head):
        asked.update({line["asked"]} - {None}, BROUGHT.get(line["asked"], ()))
        names = [f"{line['module']}.{name}" for name in re.findall(r"\w+", line["names"] or "")]
        for name in names or [line["package"]]:
            there = needs_of_import(name, path) if name else (set(), set())
            missing |= there[1] - asked
            asked |= there[0]
    return asked, missing


@cache
def own_modules():
    """The files of our modules by the name that they are imported by."""
    files = (
        (path, path.relative_to(folder).with_suffix(""))
        for folder in (TESTS, TOOLS, SRC)
        for path in folder.rglob("*.py")
    )
    return {".".join(name.parts).removesuffix(".__init__"): path for path, name in files}


def needs_of_import(name, importer):
    """The packages without which an import skips, and those without which it fails."""
    parts = name.split(".")
    prefixes = [".".join(parts[:end]) for end in range(len(parts), 0, -1)]
    if own := next((own_modules()[prefix] for prefix in prefixes if prefix in own_modules()), None):
        return needs(own) if own != importer else (set(), set())
    is_there = parts[0] in sys.stdlib_module_names or {re.sub("[._]", "-", prefix) for prefix in prefixes} & EVERYWHERE
    return set(), set() if is_there else {parts[0]}


def test_test_modules_are_collected_wherever_pidcfg_runs():
    paths = [*sorted(TESTS.glob("test_*.py")), TESTS / "conftest.py"]
    breaches = [f"{path.stem} imports {', '.join(found)}" for path in paths if (found := sorted(needs(path)[1]))]
    assert not breaches, report(["ask for them by pytest.importorskip, which says what is missing:", *breaches])


def test_no_modules_import_each_other_in_a_circle():
    breaches = [
        " ".join(sorted(circle)) for circle in circles({module: set(imported_modules(module)) for module in trees()})
    ]
    assert not breaches, report(breaches)


def test_a_room_calls_nothing_as_one_of_its_modules():
    breaches = []
    for room, tree in trees().items():
        modules = {name.removeprefix(f"{room}.") for name in trees() if name.startswith(f"{room}.")}
        breaches += [
            f"{room}: to import {room}.{name} replaces its own {name}"
            for node in tree.body
            if not (isinstance(node, ast.ImportFrom) and node.module == f"pidcfg.{room}")
            for name in (names_of(node) & modules if modules else ())
        ]
    assert not breaches, report(breaches)


def names_of(statement):
    """The names that a statement of a module gives to something."""
    if isinstance(statement, (ast.FunctionDef, ast.ClassDef)):
        return {statement.name}
    if isinstance(statement, (ast.Import, ast.ImportFrom)):
        return {one.asname or one.name for one in statement.names}
    return {node.id for node in ast.walk(statement) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}


def test_a_circle_is_seen_however_long_it_is():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": {"e"}, "e": {"d"}, "f": {"a", "d"}}
    assert set(circles(graph)) == {frozenset("abc"), frozenset("de")}
    assert circles({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def test_packages_from_outside_are_known_to_the_modules_that_need_them():
    breaches = []
    for module, tree in trees().items():
        for name, line in imports(tree):
            package = name.split(".")[0]
            if package != "pidcfg" and package not in STANDARD and not within(module, ONLY_IN.get(package, "").split()):
                breaches.append(
                    f"{module}:{line} imports {name}; {package} belongs to {ONLY_IN.get(package, 'nobody')}"
                )
    assert not breaches, report(breaches)


CALLS = ("check", "encode", "decode", "convert", "diff", "simulate", "certify", "tune", "explain")
TYPES_AND_TEXTS = (
    *(
        "cli",
        "api",
        "output",
        "text.frozen",
        "text.reader",
        "text.diagnostics",
        "text.document",
        "text.processes",
        "vendors",
    ),
    *("encoders.listing", "encoders.modbus_map.UnusableMapError"),
    *("pictures.Chart", "study.certification.certify.BatchOutcome", "study.certification.certify.charts_of"),
    *("study.certification.samples.WorkersError", "study.outcome.Outcome", "study.outcome.signals_before_root"),
    *("sim.engine.choice.EngineName", "text.paths.Data", "text.writer.json_text"),
    *("tuning.rules", "tuning.Form"),
    *("validate.catalog.is_unusable", "validate.engine.is_scenario"),
)
"""What a command needs beside the call of its name: arguments, results, what prints them; nothing that does work."""


@pytest.mark.parametrize("call", CALLS)
def test_a_command_makes_the_call_of_its_name_and_no_other(call):
    module = "cli.commands.validate" if call == "check" else f"cli.commands.{call}"
    names = [name.removeprefix("pidcfg.") for name, _ in imports(trees()[module]) if name.startswith("pidcfg.")]
    assert [name for name in names if not within(name, TYPES_AND_TEXTS)] == []
    through = trees()["cli.findings"] if call == "check" else trees()[module]
    assert {name for name, _ in imports(through) if name.startswith("pidcfg.api.")} == {f"pidcfg.api.{call}"}


MEETING_PLACE = "generic"
"""The neutral form, which every vendor may know."""


def vendor_of(module):
    """The vendor whose business a module is, by its name; None for the modules that serve all."""
    words = {word for part in module.split(".") for word in (part, *part.split("_"))}
    return next((vendor for vendor in VENDORS if vendor in words and vendor != MEETING_PLACE), None)


def test_vendors_do_not_know_each_other_and_the_rest_knows_none():
    breaches = [
        f"{module}:{line} imports {name}"
        for module, tree in trees().items()
        for name, line in imports(tree)
        if name.startswith("pidcfg.") and vendor_of(name.removeprefix("pidcfg.")) not in {None, vendor_of(module)}
    ]
    assert not breaches, report(breaches)


def test_only_the_table_of_vendors_asks_which_vendor_it_is():
    breaches = [
        f"{module}:{node.lineno} compares with {constant.value!r}"
        for module, tree in trees().items()
        if module != "vendors"
        for node in ast.walk(tree)
        if isinstance(node, (ast.Compare, ast.MatchValue))
        for constant in ast.walk(node)
        if isinstance(constant, ast.Constant) and constant.value in VENDORS
    ]
    assert not breaches, report(breaches)


def test_no_exception_outlives_its_reason():
    assert set(LONG_FUNCTIONS) == {name for name, length in function_lengths() if length > LONGEST_FUNCTION}
    assert set(LONG_MODULES) == {name for name, length in module_lengths() if length > LONGEST_MODULE}


def module_lengths():
    """Every module with its number of lines."""
    for path in sorted(SRC.rglob("*.py")):
        yield module_name(path), len(path.read_bytes().splitlines())


def function_lengths():
    """Every function with its number of lines, from its docstring to its end; parameters are a table above it."""
    for module, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                yield f"{module}.{node.name}", node.end_lineno - node.body[0].lineno + 1


def test_functions_are_short():
    breaches = [
        f"{name} has {length} lines"
        for name, length in function_lengths()
        if length > LONGEST_FUNCTION and name not in LONG_FUNCTIONS
    ]
    assert not breaches, report(breaches)


@cache
def loaded_by(code):
    """The modules that a Python program has imported when it ends."""
    tail = "\nprint('loaded', *sys.modules, file=sys.stderr)"
    run = subprocess.run([sys.executable, "-c", code + tail], cwd=ROOT, capture_output=True, text=True, check=False)
    last = run.stderr.splitlines()[-1].split()
    assert last[0] == "loaded", run.stderr
    return set(last[1:])


def modules_of_pidcfg(loaded):
    """Those of pidcfg among some modules, named below it."""
    return {name.removeprefix("pidcfg.") for name in loaded if name.startswith("pidcfg.")} - {"__main__"}


def vendors_of(modules):
    """The vendors whose tables, models or rules are among some modules; the rows of their options are a few lines."""
    light = {f"encoders.{key}" for key in VENDORS}
    return {part for name in modules - light for part in name.split(".") if part in VENDORS}


def loaded_by_command(command):
    """The modules that a command has imported when it ends."""
    return loaded_by(f"""
import sys
from pidcfg.__main__ import main
sys.argv = ["pidcfg", *{command.split()}]
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
""")


def test_the_command_starts_without_any_slow_package():
    assert loaded_by("import sys, pidcfg.cli.main").isdisjoint(HEAVY)


@pytest.mark.parametrize("command", LOADS)
def test_a_command_loads_only_what_it_needs(command):
    loaded = loaded_by_command(command)
    assert (loaded & {*HEAVY}) | vendors_of(modules_of_pidcfg(loaded)) <= {*LOADS[command].split()}


@pytest.mark.parametrize("command", MODULES)
def test_a_command_imports_the_modules_that_it_needs_and_no_other(command):
    loaded = modules_of_pidcfg(loaded_by_command(command))
    assert sorted(loaded) == sorted({*MODULES[command].split()})


@pytest.mark.parametrize("command", LINES)
def test_a_command_imports_no_more_lines_than_it_may(command):
    lengths = dict(module_lengths())
    loaded = modules_of_pidcfg(loaded_by_command(command))
    rules = {name for name in loaded if name.startswith("validate.rules")}
    assert sum(lengths[name] for name in loaded - rules) <= LINES[command]
    assert sum(lengths[name] for name in rules) <= RULE_LINES


ONE_FINDING = """
from pidcfg.cli.formats import render_findings
from pidcfg.cli.formats.findings import Findings
from pidcfg.text.diagnostics import Diagnostic, Severity
render_findings("sarif", Findings([Diagnostic({!r}, Severity.ERROR, "message", "file.yaml")], {{}}))
import sys
"""
SARIF = (
    "about cli cli.formats cli.formats.findings cli.formats.reports output output.findings text text.diagnostics "
    "text.document text.frozen text.reader text.references text.signs text.writer validate "
    "validate.catalog validate.rule vendors"
)


def test_a_finding_as_sarif_imports_its_rule_and_no_other():
    loaded = modules_of_pidcfg(loaded_by(ONE_FINDING.format("PID001")))
    assert sorted(loaded) == sorted(SARIF.split())


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_finding_as_sarif_imports_the_rules_of_one_vendor(vendor):
    code = min(VENDORS[vendor].load("rules").keys() - VENDORS[MEETING_PLACE].load("rules").keys(), default="PID101")
    loaded = modules_of_pidcfg(loaded_by(ONE_FINDING.format(code)))
    assert not [module for module in loaded if vendor_of(module) not in {None, vendor}]


@pytest.mark.parametrize("vendor", VENDORS.values(), ids=list(VENDORS))
def test_the_names_of_formats_that_help_reads_are_those_of_the_formats(vendor):
    assert vendor.load("format_names") == tuple(vendor.load("formats"))
