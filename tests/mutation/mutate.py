"""``make mutate``: whether the tests notice small faults in the code.

Faults are drawn by seed and put one at a time into a copy of the tree; the tests that run the faulty line are
tried, the quickest first (coverage says which). The table says noticed or not, file, line and change.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import defaultdict
from collections.abc import Iterable
from itertools import accumulate
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import coverage
import hypothesis
import numpy as np
import pytest
import scipy.linalg
import scipy.signal
import scipy.sparse.linalg

from faults import Fault, faults_in

Runs = dict[str, dict[str, list[str]]]  # file, line, the tests that run it: "file::test (call)", or "(setup)"
Times = dict[str, float]  # test, seconds
WARM = (hypothesis, np, scipy)  # loaded once: every fork has them

ROOT = Path(__file__).resolve().parents[2]
UNIT = "tests/unit/test_"
PACKAGES = {  # the tests that answer for a package
    "core": (
        "tests/law",
        *(f"{UNIT}{one}*.py" for one in ("core_", "waveform")),
        *(f"{UNIT}{one}.py" for one in ("beats", "beside_hysteresis", "coil", "conductor", "first_stroke")),
        *(f"{UNIT}{one}.py" for one in ("minor_coverage", "rhythm", "scale", "short_records")),
        *(f"{UNIT}{one}.py" for one in ("signal_table", "steps_correct", "steps_evaluate", "steps_refine")),
        *(f"{UNIT}{one}.py" for one in ("steps_transfer", "temperature")),
    ),
    "diagnosis": (
        *(
            f"{UNIT}{one}*.py"
            for one in ("clipped", "coarse_input", "congruency", "conductor", "falling", "heat")
        ),
        *(f"{UNIT}{one}*.py" for one in ("pinched", "scale", "slow_noise", "sticking", "unlisted")),
        f"{UNIT}diagnosis*.py",
        f"{UNIT}steps_correct.py",
        "tests/law/test_piecewise.py",
        "tests/law/test_scale_free_diagnosis.py",
        "tests/blind/test_p*.py",
        "tests/api",
    ),
    "files": (
        *(f"{UNIT}{one}*.py" for one in ("drawn", "file", "provenance", "recorder", "series", "session")),
        *(f"{UNIT}{one}*.py" for one in ("short_records", "signal", "store", "table", "units", "waveform")),
        *(f"tests/cli/test_{one}*.py" for one in ("foreign", "import", "long_capture", "recorded_pulse")),
        *(f"tests/cli/test_{one}*.py" for one in ("session", "settings", "tune", "units_of", "untidy")),
    ),
    "device": ("tests/link", f"{UNIT}coil.py"),
    "simulation": ("tests/link", "tests/blind/test_p*.py"),
    "report": (
        *(f"{UNIT}{one}*.py" for one in ("core_wild", "diagnosis_text", "figures", "html", "names")),
        "tests/api",
        "tests/cli",
    ),
    "artefacts": (
        *(f"{UNIT}{one}*.py" for one in ("artefacts", "diagnosis_text", "figures", "file", "quiz")),
        *(f"{UNIT}{one}*.py" for one in ("series", "store", "table", "unlisted", "units", "unseen_turns")),
        "tests/api",
    ),
    "steps": (
        *(f"{UNIT}{one}*.py" for one in ("coil", "conductor", "core_wild", "extend_notes", "first_stroke")),
        *(f"{UNIT}{one}*.py" for one in ("quiz", "short_records", "steps", "unseen_turns")),
        *(f"tests/link/test_{one}.py" for one in ("dry_run", "heat", "plausibility", "true", "tune")),
        "tests/api",
        "tests/cli",
    ),
    "cli": ("tests/cli", "tests/api"),
}
MEMORY = 6_000_000_000  # a fault must not take the machine with it


def main() -> int:
    """Run the table for one package."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("package", choices=PACKAGES)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--tests", nargs="+", help="files or folders instead of the package's own")
    parser.add_argument("--budget", type=float, default=300.0, help="seconds of tests for one fault")
    parser.add_argument("--only", default="", help="files whose path holds this text")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="mutate-") as folder:
        tree = _copied(Path(folder) / "tree")
        chosen = _tests(tree, options.tests or PACKAGES[options.package])
        source = f"pulsetrainer/{options.package}"
        runs, times = _recorded(tree, Path(folder), chosen)
        faults = [
            fault
            for path in sorted((tree / source).rglob("*.py"))
            if options.only in str(path.relative_to(tree))
            for fault in faults_in(str(path.relative_to(tree)), path.read_bytes())
        ]
        drawn = random.Random(options.seed).sample(faults, min(options.count, len(faults)))
        print(f"{options.package}, seed {options.seed}: {len(drawn)} of {len(faults)} faults", flush=True)
        return _table(tree, Path(folder), drawn, runs, times, options.budget)


def _table(tree: Path, folder: Path, drawn: list[Fault], runs: Runs, times: Times, budget_s: float) -> int:
    """Try the faults one by one and print what came of each; 1 where one went unnoticed."""
    equal = {(e["file"], e["line"], e["change"]): e["why"] for e in _equivalent()}
    tally: defaultdict[str, int] = defaultdict(int)
    for fault in sorted(drawn, key=lambda one: (one.path, one.line)):
        why = equal.get((fault.path, fault.text, fault.change))
        begun = time.monotonic()
        tests = _order(fault, runs.get(fault.path, {}), times, budget_s)
        result = f"equal: {why}" if why else _tried(tree, folder, fault, tests, times)
        tally[result.split(":", maxsplit=1)[0]] += 1
        took = f"{time.monotonic() - begun:.0f} s, {len(tests)} tests"
        said = result.upper() if result == "unnoticed" else result
        print(f"{said} | {fault.path}:{fault.line} | {fault.change} | {took}", flush=True)
    count = tally["noticed"] + tally["unnoticed"]
    print(f"noticed {tally['noticed']} of {count}" + (f", {tally['equal']} equal" if tally["equal"] else ""))
    return int(tally["unnoticed"] > 0)


def _equivalent() -> list[dict[str, str]]:
    """Faults that change nothing, looked at one by one."""
    return tomllib.loads((Path(__file__).parent / "equivalent.toml").read_text()).get("fault", [])


def _copied(tree: Path) -> Path:
    """Copy what git knows, or would know, of the working tree."""
    words = ["git", "ls-files", "-co", "--exclude-standard", "-z"]
    listed = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, tree / name)
    return tree


def _tests(tree: Path, patterns: Iterable[str]) -> list[str]:
    """The test files that there are."""
    found = [path for one in patterns for path in tree.glob(one)]
    files = [file for path in found for file in (path.rglob("test_*.py") if path.is_dir() else [path])]
    return sorted({str(file.relative_to(tree)) for file in files})


def _pytest(tree: Path, *words: str, limit_s: float | None = None, **env: str) -> int:
    """Run pytest on the copy, in a fork that has numpy already; return its exit code, -9 if too slow."""
    child = multiprocessing.get_context("fork").Process(target=_child, args=(tree, words, env))
    child.start()
    child.join(limit_s)
    if child.is_alive():
        os.killpg(child.pid, signal.SIGKILL)
        child.join()
    return child.exitcode


def _child(tree: Path, words: tuple[str, ...], env: dict[str, str]) -> None:
    os.setsid()
    os.chdir(tree)
    paths = [str(tree), str(tree / "tests/mutation"), *filter(None, [env.get("PYTHONPATH")])]
    os.environ.update(env, PYTHONPATH=os.pathsep.join(paths))
    sys.path[:0] = paths
    log = os.open("pytest.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(log, 1)
    os.dup2(log, 2)
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    coverage.process_startup()
    sys.exit(pytest.main(["-q", "-p", "chosen", "-p", "no:cacheprovider", *words]))


def _recorded(tree: Path, folder: Path, tests: list[str]) -> tuple[Runs, Times]:
    """Which tests run each line of the package, and how long they take.

    Kept in build/ for each test file, until it, what lies beside it or some code that it runs changes.
    """
    runs: Runs = defaultdict(lambda: defaultdict(list))
    times: Times = {}
    for test in tests:
        beside = [path for path in (tree / test).parent.glob("*.py") if not path.name.startswith("test_")]
        digest = hashlib.sha256(test.encode())
        for path in (*sorted((tree / "tests").glob("*.py")), *sorted(beside), tree / test):
            digest.update(path.read_bytes())
        kept = ROOT / "build" / "mutation" / f"{digest.hexdigest()[:16]}.json"
        known = json.loads(kept.read_text()) if kept.exists() else {"code": {"": "none yet"}}
        if any(_digest(tree / path) != was for path, was in known["code"].items()):
            known = _record(tree, folder, test)
            kept.parent.mkdir(parents=True, exist_ok=True)
            kept.write_text(json.dumps(known))
        times |= known["times"]
        for path, lines in known["runs"].items():
            for line, contexts in lines.items():
                runs[path][line] += contexts
    return runs, times


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""


def _record(tree: Path, folder: Path, test: str) -> dict[str, Any]:
    """Run one test file under coverage, the programs that it starts too."""
    print(f"recording {test}", file=sys.stderr, flush=True)
    data, rc = folder / "coverage", folder / "rc"
    rc.write_text(
        f"[run]\nparallel = true\nsource = {tree / 'pulsetrainer'}\ndata_file = {data}\n"
        "context = ${PYTEST_CURRENT_TEST-}\n"
    )
    (folder / "sitecustomize.py").write_text("import coverage\ncoverage.process_startup()\n")
    env = {"COVERAGE_PROCESS_START": str(rc), "MUTATION_TIMES": f"{folder}/times", "PYTHONPATH": str(folder)}
    if _pytest(tree, test, "--timeout=0", "-m", "not slow and not realtime", **env) not in (0, 1, 5):
        raise SystemExit(f"{test} cannot be run:\n{(tree / 'pytest.log').read_text()[-3000:]}")
    combined = coverage.Coverage(config_file=str(rc))
    combined.combine()
    found = combined.get_data()
    runs = {
        str(Path(path).relative_to(tree)): {
            str(line): sorted(filter(None, contexts))
            for line, contexts in found.contexts_by_lineno(path).items()
        }
        for path in found.measured_files()
    }
    data.unlink()
    code = {path: _digest(tree / path) for path in runs}
    return {"code": code, "runs": runs, "times": json.loads((folder / "times").read_text())}


def _order(fault: Fault, lines: dict[str, list[str]], times: Times, budget_s: float) -> list[str]:
    """The tests that may notice a fault: those that run its statement, the quickest first.

    What no single test runs (a constant) concerns all tests, first those that run anything in the file.
    What is run while a test is set up may serve the others of its file. What would take longer than the
    budget is left out. A program that was forked off a warm one names the test that this was warmed in as
    well: "one (setup)|other (call)", and the last one counts.
    """
    wanted = lines if fault.at_import else {str(k) for k in fault.lines}
    contexts = {one.rpartition("|")[2] for line in wanted for one in lines.get(line, [])}
    direct = {one.rsplit(" (", 1)[0] for one in contexts} & times.keys()
    shared = {one.split("::")[0] for one in contexts if one.endswith("(setup)")}
    besides = [
        name for name in times if name not in direct and (fault.at_import or name.split("::")[0] in shared)
    ]
    order = [one for group in (direct, besides) for one in sorted(group, key=times.__getitem__)]
    return [
        one for one, until in zip(order, accumulate(map(times.get, order)), strict=True) if until < budget_s
    ]


def _tried(tree: Path, folder: Path, fault: Fault, tests: list[str], times: Times) -> str:
    """Put a fault in, run the tests, take it out again."""
    if not tests:
        return "unnoticed"
    path, chosen = tree / fault.path, folder / "chosen.json"
    source = path.read_bytes()
    chosen.write_text(json.dumps(tests))
    shutil.rmtree(
        path.parent / "__pycache__", ignore_errors=True
    )  # as old and as long as before: it would be used
    path.write_bytes(fault.put_into(source))
    try:
        limit = 30.0 + 4.0 * sum(times[one] for one in tests)
        files = sorted({one.split("::")[0] for one in tests})
        slowest = 20 + round(5 * max(times[one] for one in tests))
        code = _pytest(tree, "-x", f"--timeout={slowest}", *files, limit_s=limit, MUTATION_TESTS=str(chosen))
    finally:
        path.write_bytes(source)
        shutil.rmtree(path.parent / "__pycache__", ignore_errors=True)
    if code == 5:
        raise SystemExit(f"none of the tests that run {fault.path}:{fault.line} is there any more")
    return "unnoticed" if code == 0 else "noticed"


if __name__ == "__main__":
    sys.exit(main())
