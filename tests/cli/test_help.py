"""Help is quick, complete, and shows an example for every command."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer

import pulsetrainer
from pulsetrainer.cli.app import app as program
from pulsetrainer.cli.next_step import as_options

COMMANDS = (
    *("capture", "import", "identify", "invert", "play", "evaluate", "diagnose", "extend", "correct"),
    *("session", "refine", "tune", "check", "export", "show", "plot", "ports", "compare", "doctor"),
)
HEAVY = ("numpy", "scipy", "h5py", "matplotlib", "jinja2", "serial", "rich")


def test_help_imports_nothing_heavy():
    """Speed is not timed here: what would make it slow is not there."""
    code = (
        "import sys\n"
        "from pulsetrainer.cli import app, guard\n"
        "assert guard.funnel(app.app, ['--help']) == 0\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"
    for command in COMMANDS:
        assert command in done.stdout


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_with_an_example(run, command):
    """What it does, its options, one line to copy."""
    done = run(command, "--help")
    assert done.code == 0
    assert f"Example: pulsetrainer {command}" in " ".join(done.out.split())
    assert "--json" in done.out


def test_what_is_told_as_an_option_is_one():
    """A name alone between backticks becomes an option; a command is told in two words."""
    commands = typer.main.get_command(program).commands.values()
    options = {
        name.lstrip("-") for one in commands for p in one.params for name in (*p.opts, *p.secondary_opts)
    }
    told = {}
    for path in sorted(Path(pulsetrainer.__file__).parent.rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        docs = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
                for name in re.findall("--([a-z-]+)", as_options(node.value)):
                    if f"--{name}" not in node.value:
                        told[name] = f"{path.name}:{node.lineno}"
    assert len(told) > 30
    # `doctor --capture` is the one option that has the name of a command: no message is about it
    assert {name: where for name, where in told.items() if name not in options - {"capture"}} == {}


def test_a_narrow_terminal_folds_what_a_command_does():
    """Nothing of it is cut."""
    found = {}
    for width in ("60", "200"):
        words = [sys.executable, "-m", "pulsetrainer", "--help"]
        done = subprocess.run(
            words, capture_output=True, text=True, check=True, env={**os.environ, "COLUMNS": width}
        )
        assert "..." not in done.stdout.replace("[ARGS]...", "")
        found[width] = done.stdout.split()
    assert found["60"] == found["200"]


def test_version(run):
    """The version of the package."""
    from pulsetrainer.version import __version__

    done = run("--version")
    assert (done.code, done.out.strip()) == (0, f"pulsetrainer {__version__}")


def test_no_words_show_the_help(run):
    """The program alone explains itself; that is no error, and still no command."""
    done = run()
    assert (done.code, done.err) == (2, "")
    assert done.out.startswith("Usage: pulsetrainer")
    assert "identify" in done.out


def test_the_short_help_is_the_long_one(run):
    """-h as everywhere."""
    assert run("-h").out == run("--help").out
    assert run("play", "-h").out == run("play", "--help").out
