"""Set up, show and test pidcfg with nothing but Python: `python tasks.py demo`, `python tasks.py test`.

demo      install pidcfg into .venv, and show what it does on one screen
test      install everything and run all tests; further arguments go to pytest; --fast: a minute of them, without those
          that tests/slow.txt names
docs      build the documentation site into build/site
generate  renew everything that is generated: pages, schemas, messages, golden files; where rules of a vendor alone
          have changed what is made of them, unless --all is given; --check only says what differs
check     ruff, mypy --strict, the import rules, and whether what is generated is up to date
bench     print the benchmarks: speed of the command and of the simulation, beside their goals; --quick: fewer rounds;
          --write-costs: measure anew what `--engine auto` decides by, and write it into src/pidcfg/sim/costs.py
torture   throw hostile files, changed examples and signals at pidcfg for --minutes N, and write docs/reliability.md
mutants   put faults into the code and see whether a test ends them: --package NAME --count N --seed N; --again: those
          that were left; --map FILES: which functions their tests call
whatif-runtime
          collect Python for the browser from npm and PyPI, which `pidcfg whatif` puts into its pages; needs Node
playground
          write the playground into build/playground, for any static server; whatif-runtime first
release   build what is committed twice, look at it as an index would, date the changelog, commit, tag, and fill dist/;
          --dry-run only says what the release would be. Nothing is sent anywhere
kit       write build/pidcfg-kit-VERSION.zip for computers without a network; --check: try it in an empty environment
onedir    write build/onedir/pidcfg, a folder with Python and pidcfg in it, for this system
lock      renew requirements/ from pyproject.toml, or the files that are named

Runs on Windows, macOS and Linux. A second run is quick: what is installed is remembered in .venv.
"""

import sys

if sys.version_info < (3, 11):
    sys.exit("pidcfg needs Python 3.11 or newer; this is Python {}.{}".format(*sys.version_info[:2]))

import hashlib
import os
import re
import subprocess
import tempfile
import tomllib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
BIN = VENV / ("Scripts" if os.name == "nt" else "bin")
PYTHON = BIN / ("python.exe" if os.name == "nt" else "python")
REQUIREMENTS = ROOT / "requirements"

GENERATED = "tests/generated.py"
SITE = ("-m", "sphinx", "-E", "-W", "--keep-going", "-q", "-d", "build/doctrees")
"""Sphinx from source folder to site, as offline as everything else."""

NEEDED_BY = {
    "demo": ("build", "run"),
    "test": ("build", "run", "report", "png", "live", "lsp", "dev", "docs"),
    "release": ("build", "run", "release"),
}
"""Files of requirements/ by what they are installed for."""

WINDOWS_ONLY = {"run": ("colorama",), "onedir": ("pefile", "pywin32-ctypes")}
"""What click, pytest and pyinstaller need on Windows alone: the lock is made on Linux and would miss it."""


def run(*command: str | Path) -> int:
    """Show a command, run it in the project's folder and return its exit code."""
    words = [str(word) for word in command]
    print("$", *words, flush=True)
    return subprocess.run(words, cwd=ROOT, check=False).returncode


def printed(arguments: tuple[str, ...]) -> subprocess.CompletedProcess[bytes]:
    """What Python prints on some arguments, errors among the rest, in the project's folder."""
    return subprocess.run((PYTHON, *arguments), cwd=ROOT, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def show(arguments: tuple[str, ...], done: subprocess.CompletedProcess[bytes]) -> int:
    """Show a command with what it has printed and return its exit code."""
    print("$", PYTHON, *arguments, flush=True)
    sys.stdout.buffer.write(done.stdout)
    sys.stdout.flush()
    return done.returncode


def must(*command: str | Path) -> None:
    """Run a command and end with its exit code when it fails."""
    code = run(*command)
    if code:
        sys.exit(code)


# --- the virtual environment ------------------------------------------------------------------------------------------


MAKER = f"{sys.version} {ROOT}"
"""An environment serves one Python and one folder: its scripts name both."""


def fingerprint() -> str:
    """What an installation depends on; another one means to install again."""
    digest = hashlib.sha256(MAKER.encode())
    for path in (ROOT / "pyproject.toml", *sorted(REQUIREMENTS.glob("*.txt"))):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def prepare(purpose: str) -> None:
    """Make .venv and install what `purpose` needs, unless that was done before."""
    stamp = VENV / f"pidcfg-{purpose}.stamp"
    wanted = fingerprint()
    if stamp.is_file() and stamp.read_text("utf-8") == wanted:
        return
    make_venv()
    print(f"installing into {VENV} (a minute or two the first time)", flush=True)
    if not install_locked(purpose):
        install_ranges(purpose)
    if purpose == "test":
        install_fast()
    must(PYTHON, *PIP, "--no-deps", "--no-build-isolation", "--editable", ".")
    run(PYTHON, "-m", "compileall", "-qq", "-j", "0", VENV / ("Lib" if os.name == "nt" else "lib"))
    stamp.write_text(wanted, "utf-8")


def make_venv() -> None:
    """Make .venv, anew when another Python or another folder made it."""
    stamp = VENV / "pidcfg-python.stamp"
    if PYTHON.exists() and (not stamp.exists() or stamp.read_text("utf-8") == MAKER):
        return
    if run(sys.executable, "-m", "venv", "--clear", VENV):
        sys.exit("no virtual environment could be made; on Debian and Ubuntu install python3-venv first")
    stamp.write_text(MAKER, "utf-8")


PIP = ("-m", "pip", "--disable-pip-version-check", "--no-input", "install", "--quiet", "--no-compile")
"""Modules are compiled at the end, on all processors."""


def install_locked(purpose: str) -> bool:
    """Install the tested versions, checked by their hashes."""
    files = [word for name in NEEDED_BY[purpose] for word in ("-r", f"requirements/{name}.txt")]
    return run(PYTHON, *PIP, "--require-hashes", *files) == 0


def install_ranges(purpose: str) -> None:
    """Install whatever pyproject.toml allows, for a Python that the locked versions do not know. Not in CI."""
    if "CI" in os.environ:
        sys.exit("the locked requirements do not install")
    print("the locked versions do not install here; trying what pyproject.toml allows", flush=True)
    must(PYTHON, *PIP, *(line for name in NEEDED_BY[purpose] for line in ranges(name)))


def install_fast() -> None:
    """Numba is optional: without it the simulation runs in Python, and so do its tests. CI needs it."""
    if run(PYTHON, *PIP, "--require-hashes", "-r", "requirements/fast.txt"):
        if "CI" in os.environ:
            sys.exit("numba does not install")
        print("numba does not install here; going on without the extra `fast`", flush=True)


# --- locking ----------------------------------------------------------------------------------------------------------


def ranges(name: str) -> list[str]:
    """What pyproject.toml says for one file of requirements/."""
    pyproject = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    project, groups = pyproject["project"], pyproject["dependency-groups"]
    lines: list[str] = {
        "build": groups["build"],
        "run": project["dependencies"],
        "fast": project["optional-dependencies"]["fast"],
        "report": project["optional-dependencies"]["report"],
        "png": project["optional-dependencies"]["png"],
        "live": project["optional-dependencies"]["live"],
        "lsp": project["optional-dependencies"]["lsp"],
        "dev": groups["dev"],
        "docs": groups["docs"],
        "onedir": groups["onedir"],
        "release": groups["release"],
    }[name]
    return [*lines, *WINDOWS_ONLY.get(name, ())]


LOCK_OPTIONS = (
    "--quiet",
    "--generate-hashes",
    "--strip-extras",
    "--allow-unsafe",  # setuptools is a package like others; pyinstaller needs it
    "--no-header",
    "--no-annotate",
    # a lock names packages, not the servers they came from
    "--no-emit-index-url",
    "--no-emit-find-links",
    "--no-emit-trusted-host",
    "--no-emit-options",
)


def compile_lock(python: Path, folder: Path, name: str, earlier: list[str]) -> None:
    """Write requirements/<name>.txt, in agreement with the files locked before it."""
    source, result = folder / f"{name}.in", folder / f"{name}.txt"
    agreeing = [f"-c {folder / other}.txt" for other in earlier]
    source.write_text("\n".join(agreeing + ranges(name)), "utf-8")
    must(python, "-m", "piptools", "compile", *LOCK_OPTIONS, "--output-file", result, source)
    text = re.sub(r"^(#.*)?\n", "", result.read_text("utf-8"), flags=re.MULTILINE)
    for package in (package for packages in WINDOWS_ONLY.values() for package in packages):
        text = re.sub(rf"^({package}==\S+)", r'\1 ; sys_platform == "win32"', text, flags=re.MULTILINE)
    header = f"# {name}: made by `python tasks.py lock` from pyproject.toml; do not edit.\n"
    (REQUIREMENTS / f"{name}.txt").write_text(header + text, "utf-8", newline="\n")


# --- the tasks --------------------------------------------------------------------------------------------------------


def demo() -> None:
    """Install, then show a mistake, the words and a run of a loop."""
    prepare("demo")
    must(BIN / "pidcfg", "demo")


def test(*arguments: str) -> None:
    """Install everything and run all tests, in a process more than there are processors; or what the arguments name.

    Some tests wait for a browser, a PLC or another process. Modules are kept compiled, as they are when installed:
    hundreds of tests start the command as a process.
    """
    prepare("test")
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    shared_out = ("--numprocesses", str(processors + 1), "--dist", "worksteal")
    must(PYTHON, "-m", "pytest", *(arguments if arguments and arguments != ("--fast",) else (*shared_out, *arguments)))


CHECKS: tuple[tuple[str, ...], ...] = (
    ("-m", "ruff", "check", "."),
    ("-m", "ruff", "format", "--check", "."),
    ("-m", "mypy", "--strict"),
    ("-m", "pytest", "-q", "tests/test_layers.py", "-k", "not a_command"),
    (GENERATED, "--check", "pages", "places", "messages", "typical"),
)
"""What the tests do not hold anyway: they run the commands of the import rules, and hold the other golden files."""


def check() -> None:
    """Run every check, beside each other and also after one has failed; show them in order and say which failed."""
    prepare("test")
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        shown = pool.map(printed, CHECKS)
        failed = [" ".join(step) for step, code in zip(CHECKS, map(show, CHECKS, shown), strict=True) if code]
    if failed:
        sys.exit("failed: " + "; ".join(failed))
    print("all checks passed")


def generate(*arguments: str) -> None:
    """Write anew what is generated and differs, or the parts of it that the arguments name."""
    prepare("test")
    must(PYTHON, GENERATED, *arguments)


def docs() -> None:
    """Build the documentation site; what it warns of is an error."""
    prepare("test")
    must(PYTHON, *SITE, "docs", "build/site")
    print(f"open {(ROOT / 'build' / 'site' / 'index.html').as_uri()}")


def bench(*arguments: str) -> None:
    """Print every benchmark, or write what a loop-step takes; modules are kept compiled, as they are when installed."""
    prepare("test")
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    if "--write-costs" in arguments:
        must(PYTHON, "tests/benchmarks/costs.py")
        return
    for script in sorted((ROOT / "tests" / "benchmarks").glob("bench_*.py")):
        must(PYTHON, script.relative_to(ROOT), *arguments)


def torture(*arguments: str) -> None:
    """Run the programme of reliability, or parts of it, for so many minutes, and write its page."""
    prepare("test")
    must(PYTHON, "tools/reliability/torture.py", *arguments)


def mutants(*arguments: str) -> None:
    """Try faults in the code against the tests; the first run maps the tests, which takes about as long as they do."""
    prepare("test")
    must(PYTHON, "tools/reliability/mutation.py", *arguments)


def whatif_runtime() -> None:
    """Make the file that `pidcfg whatif` takes Python for the browser from."""
    prepare("test")
    must(PYTHON, "tools/whatif/runtime.py")


def playground() -> None:
    """Write the playground into build/playground."""
    prepare("test")
    must(PYTHON, "tools/whatif/playground.py")


def release(*arguments: str) -> None:
    """Look at what a release would be, or make it."""
    prepare("release")
    must(PYTHON, "tools/release/make.py", *arguments)


def kit(*arguments: str) -> None:
    """Make the kit, or try the one that was made."""
    prepare("test")
    if "--check" not in arguments:
        whatif_runtime()
        must(PYTHON, *SITE, "docs", "build/site")
    must(PYTHON, "tools/kit/make.py", *arguments)


def onedir() -> None:
    """Make the folder that runs without Python, in an environment of its own."""
    must(sys.executable, "tools/release/onedir.py")


LOCKS = ("run", "build", "fast", "report", "png", "live", "lsp", "dev", "docs", "onedir", "release")
"""Files of requirements/, each in agreement with those before it."""


def lock(*names: str) -> None:
    """Renew requirements/, or the files that are named. On the oldest Python: newer ones never need more packages."""
    if sys.version_info[:2] != (3, 11):
        sys.exit("lock with Python 3.11, the oldest that pidcfg supports")
    with tempfile.TemporaryDirectory() as folder:
        must(sys.executable, "-m", "venv", Path(folder) / "venv")
        python = Path(folder) / "venv" / PYTHON.relative_to(VENV)
        must(python, *PIP, "pip-tools>=7.5")
        for number, name in enumerate(LOCKS):
            if names and name not in names:
                (Path(folder) / f"{name}.txt").write_bytes((REQUIREMENTS / f"{name}.txt").read_bytes())
            else:
                compile_lock(python, Path(folder), name, list(LOCKS[:number]))
    prepare("release")
    must(PYTHON, "tools/release/sbom.py")


TASKS: dict[str, Callable[..., None]] = {
    "demo": demo,
    "test": test,
    "docs": docs,
    "generate": generate,
    "check": check,
    "bench": bench,
    "torture": torture,
    "mutants": mutants,
    "whatif-runtime": whatif_runtime,
    "playground": playground,
    "release": release,
    "kit": kit,
    "onedir": onedir,
    "lock": lock,
}
TAKES_ARGUMENTS = {"test", "generate", "bench", "torture", "mutants", "release", "kit", "lock"}


def main(arguments: list[str]) -> None:
    """Run the named task."""
    name, *rest = arguments or ["help"]
    if name not in TASKS or (rest and name not in TAKES_ARGUMENTS):
        sys.exit(__doc__)
    os.environ["PYTHONUTF8"] = "1"
    TASKS[name](*rest)


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except KeyboardInterrupt:
        sys.exit(130)
