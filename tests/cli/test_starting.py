"""Ctrl-C before a command is at work: one line and a next step, whatever is being loaded."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

# raises the signal when a module is looked for, then goes in as the installed program does
PROGRAM = """
import os, signal, sys
class Presses:
    def find_spec(self, name, *_):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Presses())
sys.argv[1:] = {words!r}
from {entry} import main
main()
"""


@pytest.mark.skipif(os.name != "posix", reason="the signal is one of POSIX")
@pytest.mark.parametrize("module", ["typer", "pulsetrainer.cli.play", "numpy", "h5py"])
@pytest.mark.parametrize("as_json", [False, True])
def test_ctrl_c_while_the_program_loads(tmp_path, module, as_json):
    """Exit 130, no traceback, nothing written; as JSON one object."""
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    entry = project["scripts"]["pulsetrainer"].partition(":")[0]
    words = ["invert", "normal", "--model", "model.h5", "-o", "x.h5", *["--json"] * as_json]
    (tmp_path / "model.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(module=module, words=words, entry=entry)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 130, done
    assert done.stderr.startswith("error: stopped by you; nothing was written\n  try: ")
    assert len(done.stderr.splitlines()) == 2
    assert done.stdout.count('"kind": "interrupted"') == len(done.stdout.splitlines()) == as_json
    assert not (tmp_path / "x.h5").exists()
