"""What CONTRIBUTING.md, the pre-commit hooks and CI promise is what the Makefile and the tree have."""

from __future__ import annotations

import ast
import re
import subprocess
import sys

import yaml
from pages import ROOT

PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
TARGETS = set(re.findall(r"^([a-z0-9-]+):", MAKEFILE, flags=re.MULTILINE))


def recipe(target: str) -> list[str]:
    """Return the commands of a target."""
    found = re.search(rf"^{target}:.*\n((?:\t.*\n)+)", MAKEFILE, flags=re.MULTILINE)
    assert found, target
    return [line.strip().replace("$(BIN)", ".venv/bin") for line in found[1].splitlines()]


def test_hooks_run_what_make_lint_runs():
    """The same tools with the same words, from the project's own environment; nothing is fetched."""
    (repository,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    assert repository["repo"] == "local"
    assert [hook["entry"] for hook in repository["hooks"]] == recipe("lint")
    assert {hook["language"] for hook in repository["hooks"]} == {"system"}


def test_ci_runs_lint_and_all_tests():
    """In that order, the slow ones last."""
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert re.findall(r"^make (\S+)", script, flags=re.MULTILINE) == ["lint", "test", "test-slow"]


def test_quick_and_slow_tests_are_all_tests():
    """The four selections share no test and leave none out."""
    lines = [line for name in ("test", "test-slow") for line in recipe(name)]
    assert lines.pop().startswith("HYPOTHESIS_PROFILE=full "), "the laws once more, on more examples"
    selections = [re.search(r'-m "([^"]+)"', line)[1] for line in lines]
    for realtime in (True, False):
        for slow in (True, False):
            truth = {"realtime": realtime, "slow": slow}
            assert sum(bool(eval(words, {}, truth)) for words in selections) == 1, truth


def test_every_target_and_file_that_is_named_is_there():
    """Names in capitals stand for those of a newcomer."""
    named = set(re.findall(r"`make ([a-z-]+)", PAGE)) | set(
        re.findall(r"^make ([a-z-]+)", PAGE, re.MULTILINE)
    )
    assert len(named) >= 8
    assert named <= TARGETS
    paths = {path for path in re.findall(r"`([\w./-]+/[\w.-]*)`", PAGE) if not re.search(r"[A-Z]{4}", path)}
    assert len(paths) >= 15
    assert not [path for path in paths if not (ROOT / path).exists()]


def test_what_keeps_pace_with_the_clock_is_where_it_is_sought():
    """Make looks for these tests in two folders only."""
    named = re.search(r"^REALTIME := (.*)$", MAKEFILE, flags=re.MULTILINE)[1].split()
    mark = re.compile(r"\bpytest\.mark\.realtime\b")
    marked = [path for path in (ROOT / "tests").rglob("test_*.py") if mark.search(path.read_text())]
    assert {str(path.parent.relative_to(ROOT)) for path in marked} == set(named)


MARKS = """
import sys, pytest
class Marks:
    def pytest_collection_modifyitems(self, items):
        found = {tuple(one.get_closest_marker(name) is not None for name in sys.argv[1:]) for one in items}
        sys.stderr.write(repr(found))
files = ["tests/blind/test_pitfalls.py", "tests/link/test_qemu.py"]
pytest.main(["--collect-only", "-q", "-p", "no:cacheprovider", *files], [Marks()])
"""


def test_no_selection_is_empty():
    """An empty one would end make with an error."""
    words = [sys.executable, "-c", MARKS, "slow", "realtime"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    both = (False, True)
    assert ast.literal_eval(done.stderr) == {(slow, realtime) for slow in both for realtime in both}
