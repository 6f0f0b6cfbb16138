"""Rules that no import contract can say: who may print, exit, read the clock, draw a random number."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import pulsetrainer

ROOT = Path(pulsetrainer.__file__).parent
MODULES = sorted(ROOT.rglob("*.py"))
SPEAKS = {"print", "input", "exit", "quit", "sys.exit", "os._exit"}
CLOCK = {
    "time.time",
    "time.time_ns",
    "time.localtime",
    "datetime.now",
    "datetime.utcnow",
    "datetime.datetime.now",
}
SURROUNDINGS = {"os.getenv", "os.environ.get", "os.getcwd", "Path.cwd"}
OWN_GENERATOR = {"default_rng", "Generator", "SeedSequence"}


def _dotted(node: ast.expr) -> str:
    """Return ``a.b.c`` of an expression that is a name, else ``""``."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute) and (before := _dotted(node.value)):
        return f"{before}.{node.attr}"
    return ""


def calls(source: str) -> list[tuple[int, str]]:
    """Return line and dotted name of every call."""
    found = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call))
    return [(node.lineno, name) for node in found if (name := _dotted(node.func))]


def forbidden(path: Path, source: str) -> list[tuple[int, str]]:
    """Return the calls of a module that its place in the package does not allow."""
    place = path.relative_to(ROOT).parts[0]
    no = set() if place in ("cli", "__main__.py") else set(SPEAKS)
    if place in ("core", "diagnosis", "artefacts"):
        no |= CLOCK | SURROUNDINGS
    found = []
    for line, name in calls(source):
        module, _, last = name.rpartition(".")
        lottery = module in ("np.random", "numpy.random", "random") and last not in OWN_GENERATOR
        unseeded = last == "default_rng" and "default_rng()" in source.splitlines()[line - 1]
        if name in no or ((lottery and name != "random.Random") or unseeded):
            found.append((line, name))
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_module_does_only_what_its_place_allows(path):
    """Nothing prints or exits outside cli; no global random state; core and diagnosis know no clock."""
    assert forbidden(path, path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("place", "line"),
    [
        ("core/x.py", "print(1)"),
        ("files/x.py", "sys.exit(3)"),
        ("core/x.py", "time.time()"),
        ("diagnosis/x.py", "os.environ.get('A')"),
        ("steps/x.py", "np.random.normal(0, 1)"),
        ("core/x.py", "rng = np.random.default_rng()"),
        ("cli/x.py", "random.random()"),
    ],
)
def test_a_module_that_does_more_is_found(place, line):
    """The check can fail."""
    assert forbidden(ROOT / place, line)


def test_what_is_allowed_is_not_found():
    """A seeded generator anywhere; words in cli; the clock where a device is timed."""
    assert not forbidden(ROOT / "core/x.py", "rng = np.random.default_rng(3)")
    assert not forbidden(ROOT / "cli/x.py", "print(1)")
    assert not forbidden(ROOT / "device/x.py", "time.time()")
