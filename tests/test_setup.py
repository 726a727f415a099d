"""What a stranger installs: the wheel, the locked requirements, and `tasks.py` with nothing but Python."""

import ast
import importlib.util
import json
import os
import re
import shutil
import stat
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import pidcfg
from conftest import Missing
from pidcfg.cli.environment import require_extra
from pidcfg.cli.main import COMMANDS

ROOT = Path(__file__).parents[1]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
NODE = ROOT / "tests/node"
PAGES = ROOT / "tools" / "whatif"
LOCKS = sorted((ROOT / "requirements").glob("*.txt"))
EXTRAS = PYPROJECT["project"]["optional-dependencies"]
RANGES = {"run": PYPROJECT["project"]["dependencies"], **EXTRAS, **PYPROJECT["dependency-groups"]}


def test_a_test_is_skipped_by_the_name_of_the_package_that_it_lacks(monkeypatch):
    assert set(Missing.PACKAGES) == {Requirement(text).name for text in EXTRAS["report"] + EXTRAS["png"]}
    monkeypatch.setattr(sys, "meta_path", [finder for finder in sys.meta_path if isinstance(finder, Missing)])
    monkeypatch.delitem(sys.modules, "jinja2", raising=False)
    with pytest.raises(pytest.skip.Exception, match="jinja2 is not installed"):
        require_extra("jinja2", "report")


# --- the wheel --------------------------------------------------------------------------------------------------------


def tracked_files():
    """What a clean clone holds; without git, everything."""
    if not (ROOT / ".git").exists():
        files = (path.relative_to(ROOT) for path in ROOT.rglob("*") if path.is_file())
        return [path for path in files if not {".venv", "__pycache__", "node_modules"} & set(path.parts)]
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout.decode()
    return [Path(name) for name in listed.split("\0") if name and (ROOT / name).is_file()]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel, built from a copy of the tracked files."""
    clone = tmp_path_factory.mktemp("clone")
    for path in tracked_files():
        (clone / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / path, clone / path)
        (clone / path).chmod(0o600)  # as a clone has them under a umask of 077
    built = WheelBuilder(str(clone)).build(directory=str(clone / "dist"), versions=["standard"])
    return zipfile.ZipFile(next(built))


def metadata(wheel, name):
    return next(wheel.read(entry).decode() for entry in wheel.namelist() if entry.endswith(f".dist-info/{name}"))


def test_the_wheel_holds_the_whole_package_and_nothing_else(wheel):
    package = {path.relative_to("src").as_posix() for path in tracked_files() if path.parts[0] == "src"}

    assert {name for name in wheel.namelist() if not re.search(r"\.(dist-info|data)/", name)} == package
    assert "pidcfg/py.typed" in package


def test_the_wheel_holds_no_times_and_nothing_of_a_umask(wheel):
    assert {stat.S_IMODE(entry.external_attr >> 16) for entry in wheel.infolist()} == {0o644}
    assert len({entry.date_time for entry in wheel.infolist()}) == 1


def test_the_wheel_brings_the_manual_pages_to_where_man_looks(wheel):
    pages = {path.name for path in tracked_files() if path.parent.as_posix() == "docs/man"}
    folder = f"pidcfg-{pidcfg.__version__}.data/data/share/man/man1"

    assert {name for name in wheel.namelist() if ".data/" in name} == {f"{folder}/{page}" for page in pages}
    assert pages == {"pidcfg.1", *(f"pidcfg-{command}.1" for command in COMMANDS)}


def test_the_wheel_asks_for_what_pyproject_says(wheel):
    text = metadata(wheel, "METADATA")

    assert f"\nVersion: {pidcfg.__version__}\n" in text
    assert "\nRequires-Python: >=3.11\n" in text
    assert len(re.findall(r"^Requires-Dist: (?!.*extra)", text, re.MULTILINE)) == len(RANGES["run"])
    assert re.findall(r"^Provides-Extra: (.+)$", text, re.MULTILINE) == list(EXTRAS)


def test_the_unpacked_wheel_runs(wheel, tmp_path):
    wheel.extractall(tmp_path)
    assert "pidcfg = pidcfg.__main__:main" in metadata(wheel, "entry_points.txt")

    start = "import pidcfg, sys; from pidcfg.cli.main import main; sys.stderr.write(pidcfg.__file__); main()"
    run = subprocess.run(
        [sys.executable, "-c", start, "--version"],
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert pidcfg.__version__ in run.stdout
    assert Path(run.stderr).is_relative_to(tmp_path)


# --- the locked requirements ------------------------------------------------------------------------------------------


def locked(path):
    """The requirements of a file, with their number of hashes."""
    text = re.sub(r"^#.*\n", "", path.read_text("utf-8"), flags=re.MULTILINE).replace("\\\n", " ")
    for line in text.splitlines():
        requirement, *hashes = line.split("--hash=sha256:")
        yield Requirement(requirement), len(hashes)


@pytest.mark.parametrize("path", LOCKS, ids=lambda path: path.stem)
def test_every_locked_requirement_is_exact_hashed_and_from_nowhere_in_particular(path):
    assert not re.search(r"://|--(?!hash=sha256:)|@ ", path.read_text("utf-8"))
    for requirement, hashes in locked(path):
        assert str(requirement.specifier).startswith("=="), requirement
        assert hashes, requirement


@pytest.mark.parametrize("path", LOCKS, ids=lambda path: path.stem)
def test_the_locked_versions_are_among_those_that_pyproject_allows(path):
    versions = {canonicalize_name(found.name): str(found.specifier).removeprefix("==") for found, _ in locked(path)}

    for line in RANGES[path.stem]:
        wanted = Requirement(line)
        assert versions[canonicalize_name(wanted.name)] in wanted.specifier, line


def test_no_package_is_locked_twice_at_different_versions():
    pinned = {(found.name, str(found.specifier)) for path in LOCKS for found, _ in locked(path)}

    assert len(pinned) == len({name for name, _ in pinned})


@pytest.mark.parametrize(("folder", "key", "least"), [(NODE, "devDependencies", 10), (PAGES, "dependencies", 1)])
def test_what_npm_installs_is_exact_hashed_and_from_its_registry_if_from_anywhere(folder, key, least):
    own, *packages = json.loads((folder / "package-lock.json").read_text("utf-8"))["packages"].values()
    assert own[key] == json.loads((folder / "package.json").read_text("utf-8"))[key]
    assert len(packages) > least
    for package in packages:
        assert re.fullmatch(r"[0-9.]+", package["version"]), package
        assert package["integrity"].startswith("sha512-"), package
        assert package.get("resolved", "https://registry.npmjs.org/").startswith("https://registry.npmjs.org/"), package


def test_every_dependency_has_its_reason():
    text = (ROOT / "docs" / "dependencies.md").read_text("utf-8")
    wanted = {Requirement(line).name for lines in RANGES.values() for line in lines}
    wanted |= json.loads((NODE / "package.json").read_text("utf-8"))["devDependencies"].keys()
    wanted |= json.loads((PAGES / "package.json").read_text("utf-8"))["dependencies"].keys()

    assert set(re.findall(r"^\| `([\w.-]+)`", text, re.MULTILINE)) == wanted


# --- tasks.py ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def tasks():
    spec = importlib.util.spec_from_file_location("tasks", ROOT / "tasks.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_set_up_needs_nothing_but_python():
    tree = ast.parse((ROOT / "tasks.py").read_text("utf-8"))
    imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    imported |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}

    assert {name.split(".")[0] for name in imported} <= sys.stdlib_module_names


def test_an_old_python_can_read_far_enough_to_be_refused():
    ast.parse((ROOT / "tasks.py").read_text("utf-8"), feature_version=(3, 7))


@pytest.mark.parametrize("arguments", [[], ["tset"], ["demo", "twice"]])
def test_an_unknown_task_ends_with_the_list_of_tasks(tasks, arguments):
    with pytest.raises(SystemExit) as end:
        tasks.main(arguments)

    assert all(name in end.value.code for name in tasks.TASKS)


def test_what_a_failing_command_returns_is_what_the_task_returns(tasks, monkeypatch):
    monkeypatch.setattr(tasks, "prepare", lambda _purpose: None)
    monkeypatch.setattr(tasks, "run", lambda *_command: 5)

    with pytest.raises(SystemExit) as end:
        tasks.main(["test"])

    assert end.value.code == 5


def test_a_failing_check_does_not_hide_the_others_and_all_are_shown_in_order(tasks, monkeypatch, capsys):
    monkeypatch.setattr(tasks, "prepare", lambda _purpose: None)

    def printed(arguments):
        code = int("mypy" in arguments or "--check" in arguments)
        return subprocess.CompletedProcess(arguments, code, f"said by {arguments[1]}\n".encode())

    monkeypatch.setattr(tasks, "printed", printed)

    with pytest.raises(SystemExit) as end:
        tasks.main(["check"])

    said = [line for line in capsys.readouterr().out.splitlines() if line.startswith("said by ")]
    assert said == [f"said by {step[1]}" for step in tasks.CHECKS]
    failed = "failed: -m ruff format --check .; -m mypy --strict; tests/generated.py --check"
    assert end.value.code == f"{failed} pages places messages typical"


def test_the_site_is_built_without_a_saved_state_and_warnings_are_errors(tasks, monkeypatch):
    monkeypatch.setattr(tasks, "prepare", lambda _purpose: None)
    ran = []
    monkeypatch.setattr(tasks, "run", lambda *command: ran.append(command) or 0)

    tasks.main(["docs"])

    assert ran[0][1:3] == ("-m", "sphinx")
    assert {"-W", "-E"} < set(ran[0])
    assert ran[0][-2:] == ("docs", "build/site")


def test_the_demo_is_the_command_of_that_name(tasks, monkeypatch):
    ran = []
    monkeypatch.setattr(tasks, "prepare", ran.append)
    monkeypatch.setattr(tasks, "must", lambda program, *words: ran.append((program.name, *words)))
    tasks.demo()
    assert ran == ["demo", ("pidcfg", "demo")]
    assert "demo" in COMMANDS


def test_a_second_run_installs_nothing(tasks, monkeypatch, tmp_path):
    monkeypatch.setattr(tasks, "VENV", tmp_path)
    (tmp_path / "pidcfg-demo.stamp").write_text(tasks.fingerprint(), "utf-8")
    monkeypatch.setattr(tasks, "run", lambda *command: pytest.fail(f"runs {command}"))

    tasks.prepare("demo")


# --- the fast tests ---------------------------------------------------------------------------------------------------


def test_every_slow_test_is_there():
    """`test --fast` leaves out what this list names; a test that is renamed would come back unseen."""
    names = (ROOT / "tests/slow.txt").read_text("utf-8").split()
    assert names == sorted(set(names))
    for file, _, name in (name.partition("::") for name in names):
        assert f"def {name}(" in (ROOT / "tests" / file).read_text("utf-8"), f"{file}::{name}: renew tests/slow.txt"
