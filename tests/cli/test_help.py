"""Help is quick, complete, and shows an example for every command."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer

import pulsetrainer
from pulsetrainer.cli.app import app as program
from pulsetrainer.cli.help_text import Folded
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


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_a_narrow_terminal_folds_help_between_words(command, monkeypatch, capsys):
    """Nothing of it is cut, no word is broken, and no line of several words is too long."""
    told, parser = {}, typer.main.get_command(program)
    for columns in (200, 20, 30, 40, 49, 60, 79):
        monkeypatch.setenv("COLUMNS", str(columns))
        parser.main([*command.split(), "--help"], standalone_mode=False)
        told[columns] = capsys.readouterr().out
        assert told[columns].split() == told[200].split(), columns
        long = (line for line in told[columns].splitlines() if len(line) > columns)
        assert [line for line in long if len(line.split()) > 1] == [], columns
    assert command or "..." not in told[200].replace("[ARGS]...", "")


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


@pytest.mark.parametrize(("columns", "width"), [(1, 16), (18, 16), (19, 17), (79, 77), (80, 78), (200, 78)])
def test_help_is_as_wide_as_the_terminal_less_two_letters(monkeypatch, columns, width):
    """But no narrower than 16, and no wider than is easily read."""
    monkeypatch.setenv("COLUMNS", str(columns))
    assert Folded().width == width
