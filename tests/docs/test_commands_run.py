"""Every command block of README, tutorial and how-tos is run, in order, in an empty folder."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from pages import ROOT, Block, blocks

from program import program_on_path

HOW_TO = ROOT / "docs" / "how-to"
# Blocks that a test cannot run inside itself: they install into .venv and start this very test.
NOT_RUN = ("make install", ". .venv/bin/activate", "make demo", "make test")


@pytest.fixture(scope="session")
def given(made_once) -> Path:
    """What the pages take for granted: artefacts of the tutorial, records of the reader's bench."""
    return made_once("given", _give)


def _give(folder: Path) -> None:
    for line in (
        "pulsetrainer capture identification -o run.h5",
        "pulsetrainer capture diagnostic -o other.h5",  # several rates and stops, as the page asks for
        "pulsetrainer identify run.h5 --levels 24 -o model.h5",
        "pulsetrainer invert normal --model model.h5 -o drive.h5",
        "pulsetrainer play drive.h5 -o played.h5",
        "pulsetrainer evaluate played.h5 -o last-week.h5",
    ):
        done = shell(line, folder)
        assert done.returncode == 0, done.stderr
    for name, source, step in (("scope.csv", "run.h5", 20), ("other.csv", "other.h5", 1)):
        with h5py.File(folder / source) as file:
            columns = np.column_stack([file[key][::step] for key in ("time", "input", "output")])
        np.savetxt(folder / name, columns, delimiter=",", header="t_s,current_A,force_N", comments="")
    shutil.copytree(ROOT / "workflow", folder / "workflow")


def shell(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run one command as a shell would, with the program and this interpreter's programs first."""
    first = (str(program_on_path()), str(Path(sys.executable).parent))
    return subprocess.run(
        ["sh", "-c", command],
        cwd=folder,
        env={
            **os.environ,
            "PATH": os.pathsep.join((*first, os.environ["PATH"])),
            "COLUMNS": "100",
        },
        capture_output=True,
        text=True,
        check=False,
    )


# page, what must be there before
RUN = {
    ROOT / "README.md": ("scope.csv",),
    ROOT / "docs/tutorial.md": (),
    HOW_TO / "own-bench.md": ("scope.csv", "other.csv"),
    HOW_TO / "settings.md": (),
    ROOT / "docs/measured.md": tuple(path.name for path in sorted((ROOT / "tests/data").glob("*.csv"))),
    HOW_TO / "ci.md": ("played.h5", "last-week.h5"),
    HOW_TO / "teach.md": ("model.h5",),
    HOW_TO / "tune.md": (),
    HOW_TO / "track-heat.md": ("drive.h5", "model.h5"),
    HOW_TO / "check.md": ("model.h5",),
    HOW_TO / "batches.md": ("workflow",),
    HOW_TO / "diagnose.md": ("model.h5",),
}
SLOW = ("README", "measured", "tutorial", "own-bench", "ci", "teach", "diagnose")
PAGES = [
    pytest.param(page, id=page.stem, marks=pytest.mark.slow if page.stem in SLOW else ()) for page in RUN
]


@pytest.mark.slow
@pytest.mark.timeout(900)  # a page is a dozen commands; on a busy machine each takes its time
@pytest.mark.parametrize("page", PAGES)
def test_commands_of_a_page_run(page, given, tmp_path):
    """In the order of the page; what a page shows as output is what came out."""
    for name in RUN[page]:
        there = ROOT / "tests/data" / name
        there = there if there.exists() else given / name
        (shutil.copytree if there.is_dir() else shutil.copy)(there, tmp_path / name)
    for block in blocks(page, "toml"):  # a file that the page shows, its name in the first line
        name = re.match(r"# (\S+\.toml):", block.text)
        if name:
            (tmp_path / name[1]).write_text(block.text)
    said, ran = "", 0
    for block in blocks(page, "sh", "text"):
        if block.language == "text":
            if ran:
                _shows(said, block)
            continue
        said = ""
        for command in block.commands:
            if command.startswith(NOT_RUN):
                continue
            done = shell(command, tmp_path)
            assert done.returncode == 0, (f"{page.name}:{block.line}", command, done.stdout, done.stderr)
            said += done.stdout + done.stderr
            ran += 1
    assert ran >= 2


FROM_THE_TUTORIAL = ("real-device", "settings", "tune", "track-heat", "check", "refine", "diagnose", "teach")


@pytest.mark.parametrize("name", FROM_THE_TUTORIAL)
def test_a_reader_of_the_tutorial_goes_on_in_its_folder(name):
    """No page that it leads to names an output of its own like one that is already there."""
    there, new = (
        {out for block in blocks(page, "sh", "console") for out in re.findall(r"-o (\S+)", block.text)}
        for page in (ROOT / "docs/tutorial.md", HOW_TO / f"{name}.md")
    )
    assert there
    assert not there & new


def test_what_is_not_run_is_there():
    """The blocks that are left out are targets of the Makefile."""
    left_out = [
        c for block in blocks(ROOT / "README.md", "sh") for c in block.commands if c.startswith(NOT_RUN)
    ]
    assert len(left_out) == len(NOT_RUN)
    makefile = (ROOT / "Makefile").read_text()
    for command in left_out:
        if not command.startswith("make"):
            continue
        assert re.search(rf"^{command.split()[1]}:", makefile, flags=re.MULTILINE)


_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


def _shows(said: str, block: Block) -> None:
    """Hold that each line of the block came out: the words exactly, decimals to two per cent."""
    came = [(_NUMBER.sub("#", " ".join(line.split())), _NUMBER.findall(line)) for line in said.splitlines()]
    for line in block.text.splitlines():
        skeleton, numbers = _NUMBER.sub("#", " ".join(line.split())), _NUMBER.findall(line)
        candidates = [found for words, found in came if words == skeleton]
        assert any(_close(numbers, found) for found in candidates), (block.line, line, candidates)


def _close(shown: list[str], found: list[str]) -> bool:
    pairs = zip(shown, found, strict=True)
    return all(
        float(b) == pytest.approx(float(a), rel=0.02, abs=0.02) if "." in a else a == b for a, b in pairs
    )
