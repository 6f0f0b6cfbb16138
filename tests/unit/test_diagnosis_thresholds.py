"""Numbers that decide: each is written down once, with its reason, and is the one that was frozen."""

from __future__ import annotations

import ast
import contextlib
import dataclasses
import importlib
import re
from pathlib import Path

import pytest

from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.thresholds import LIMITS, Thresholds

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "pulsetrainer" / "diagnosis"
PAGE = ROOT / "docs" / "how-a-verdict-is-reached.md"
TRIVIAL = {-1, 0, 1, 2, 0.5}
# Declarations: the thresholds, the causes' own (at the top of their files), signals on paper, shares of a bar
DECLARED = ("thresholds.py", "causes/", "experiment.py", "procedure.py", "piecewise.py")


def _numbers(tree: ast.AST, *, inside: bool) -> list[ast.Constant]:
    """Numbers in a module: all of them, or only those inside its functions."""
    roots = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef | ast.Lambda)] if inside else [tree]
    found = {id(n): n for root in roots for n in ast.walk(root) if isinstance(n, ast.Constant)}
    return [n for n in found.values() if type(n.value) in (int, float) and n.value not in TRIVIAL]


def _stray(path: str, source: str) -> list[str]:
    """Numbers of a file of the diagnosis that stand where none may be declared."""
    declared = any(path.startswith(name) for name in DECLARED)
    return [f"{path}:{n.lineno}: {n.value}" for n in _numbers(ast.parse(source), inside=declared)]


def test_no_number_stands_inline():
    """Nothing but 0, 1, 2, -1 and a half: everything else has a name, a place and a comment."""
    files = sorted(FOLDER.rglob("*.py"))
    assert len(files) > 40
    stray = [one for file in files for one in _stray(file.relative_to(FOLDER).as_posix(), file.read_text())]
    assert stray == []


@pytest.mark.parametrize(
    ("path", "line"),
    [
        ("stages/verdict.py", "def f(x):\n    return x > 0.3"),
        ("stages/verdict.py", "_LIMIT = 0.3"),
        ("causes/creep.py", "def f(x):\n    return x > 0.3"),
        ("screening.py", "f = lambda x: x > 3"),
    ],
)
def test_an_inline_number_would_be_found(path, line):
    """In a function of any file, and at the top of those that decide."""
    assert len(_stray(path, line)) == 1
    assert _stray("causes/creep.py", "_LIMIT = 0.3  # a reason") == []


def test_every_number_has_a_reason():
    """A comment beside each field of the thresholds, and beside each number that a cause declares."""
    lines = (FOLDER / "thresholds.py").read_text().splitlines()
    fields = [line for line in lines if re.match(r"    \w+: [\w\[\], .]+ = ", line)]
    assert len(fields) == len(dataclasses.fields(Thresholds))
    assert [line for line in fields if "  # " not in line] == []
    assert dataclasses.fields(LIMITS) is not None
    with pytest.raises(dataclasses.FrozenInstanceError):
        LIMITS.p_max = 1.0  # type: ignore[misc]


def _frozen() -> dict[str, str]:
    """Names and values in the tables of the page."""
    rows = re.findall(r"^\| `(\w+)` \| `([^`]+)` \|", PAGE.read_text(), re.MULTILINE)
    return dict(rows)


def test_the_thresholds_are_those_that_the_blind_grid_judged():
    """The page holds what was frozen: a number that moves must be judged again, knowingly."""
    frozen = _frozen()
    for field in dataclasses.fields(Thresholds):
        assert ast.literal_eval(frozen[field.name]) == getattr(LIMITS, field.name), field.name


@pytest.mark.parametrize("name", library())
def test_the_numbers_of_a_cause_are_those_of_the_page(name):
    """The same for what stands in its own file."""
    section = PAGE.read_text().partition(f"\n### {name}: ")[2].partition("\n### ")[0]
    rows = re.findall(r"^\| `(\w+)` \| `([^`]+)` \|", section, re.MULTILINE)
    module = importlib.import_module(type(library()[name]).__module__)
    declared = [n for n in vars(module) if re.fullmatch(r"_[A-Z]\w+", n)]
    assert sorted(n for n, _ in rows) == sorted(n.lstrip("_") for n in declared)
    for constant, value in rows:
        with contextlib.suppress(ValueError):  # a formula of another one
            assert ast.literal_eval(value) == getattr(module, f"_{constant}"), constant
