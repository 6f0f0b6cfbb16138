"""A mistake in a name is told before anything heavy is loaded, whatever the command."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import typer

from command_lines import READS_ONLY, WRITERS
from mistakes import INSIDE, TABLES, Mistake, at_once, lay_out
from pulsetrainer.cli.app import app

HEAVY = ("numpy", "scipy", "h5py", "matplotlib", "jinja2", "serial", "rich", "pydantic")
# each takes longer to load than all else that such an answer needs; scipy loads them when they are first used
PARTS = tuple(f"scipy.{name}" for name in ("interpolate", "linalg", "ndimage", "optimize", "signal", "stats"))
EVERYTHING = """
import importlib, pkgutil, pulsetrainer
for module in pkgutil.walk_packages(pulsetrainer.__path__, "pulsetrainer."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
"""
# each in a child of one interpreter that has loaded the parser and nothing else
JOB = """
import json, os, sys, typer
from pulsetrainer.cli import app, guard
program = typer.main.get_command(app.app)
ended = {}
for name, (words, *_) in json.load(sys.stdin).items():
    reading, writing = os.pipe()
    if os.fork() == 0:
        os.dup2(writing, 2)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        code = guard.funnel(program, words)
        sys.stderr.write(json.dumps([name for name in HEAVY if name in sys.modules]))
        sys.stderr.flush()
        os._exit(code)
    os.close(writing)
    with open(reading) as pipe:
        said = pipe.read()
    ended[name] = [os.waitstatus_to_exitcode(os.wait()[1]), said]
print(json.dumps(ended))
"""


def check(folder: Path, cases: dict[str, Mistake], heavy: tuple[str, ...], first: str = "") -> None:
    """Make every mistake in ``folder``: it ends as it must, nothing is written and nothing heavy loaded."""
    before = sorted(path.name for path in folder.iterdir())
    done = subprocess.run(
        [sys.executable, "-c", f"{first}\nHEAVY = {heavy!r}\n{JOB}"],
        input=json.dumps(cases),
        capture_output=True,
        text=True,
        cwd=folder,
        check=True,
    )
    wrong = {}
    for name, (code, said) in json.loads(done.stdout).items():
        told = said.startswith("error: ") and "\n  try: " in said and "Traceback" not in said
        told = told and said.count("try: ") == 1  # of an exception it is a note too, for Python
        told = told and cases[name].where in said and cases[name].then in said.partition("\n  try: ")[2]
        if code != cases[name].code or not told or not said.endswith("\n[]"):
            wrong[name] = (code, said)
    assert not wrong
    assert sorted(path.name for path in folder.iterdir()) == before


def test_a_mistake_in_a_name_loads_nothing_heavy(tmp_path):
    """Speed is not timed here: what would make the answer slow is not there."""
    lay_out(tmp_path)
    check(tmp_path, at_once(), HEAVY)


def test_every_command_that_takes_a_file_is_among_them():
    """A new command cannot be forgotten: its file arguments and its outputs need a line of their own."""
    commands = typer.main.get_command(app).commands
    tried = {one.words[0] for one in (*WRITERS, *READS_ONLY)}
    assert tried | {"ports", "doctor"} == set(commands), "the two take no file"


def test_a_mistake_that_a_look_inside_tells_needs_no_part_of_scipy(small_chain, tmp_path):
    """The artefacts are opened, or the device is asked: an error in words, nothing written."""
    shutil.copytree(small_chain, tmp_path, dirs_exist_ok=True)
    for name, text in TABLES.items():
        (tmp_path / name).write_text(text)
    check(tmp_path, INSIDE, PARTS, first=EVERYTHING)
