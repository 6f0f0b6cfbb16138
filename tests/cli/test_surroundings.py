"""Odd surroundings: no UTF-8, no display, no home, a narrow terminal. It works, or says what to mend."""

from __future__ import annotations

import errno
import io
import os
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
from test_screen import on_terminal

from program import PROGRAM, Ran, cold, pulsetrainer
from pulsetrainer.cli.guard import funnel
from wording import refusal

NOWHERE = "/proc/nowhere"  # cannot be made, by root neither
SURROUNDINGS = {
    "no UTF-8": {"LC_ALL": "C", "LANG": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"},
    "no such backend": {"MPLBACKEND": "nonsense", "DISPLAY": ""},
    "no home": {"HOME": NOWHERE} | {f"XDG_{name}_HOME": NOWHERE for name in ("CACHE", "CONFIG", "STATE")},
    "no colour, no terminal": {"TERM": "dumb", "NO_COLOR": "1"},
}
# what a visitor does first, each with what it leaves
COMMANDS = {
    "show played.h5": (),
    "plot played.h5 --data": ("played.png", "played.csv"),
    "evaluate played.h5 -o e.h5 --html e.html": ("e.h5", "e.html"),
    "export run.h5 -o x.csv": ("x.csv",),
    "compare e.h5 e.h5 -o compared.svg": ("compared.svg",),
    "identify run.h5 --levels 12 -o again.h5": ("again.h5",),
    "diagnose run.h5 --model model.h5 --quick -o d.h5 --html d.html": ("d.h5", "d.html"),
}


@pytest.fixture
def there(small_chain, tmp_path) -> Path:
    """A folder with a run, a model, a drive and a playback."""
    shutil.copytree(small_chain, tmp_path, dirs_exist_ok=True)
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize("name", SURROUNDINGS)
def test_every_common_command_works(there, name):
    """Each writes what it should, from a cold start."""
    for line, made in COMMANDS.items():
        done = cold(there, *line.split(), env=SURROUNDINGS[name])
        assert done.code == 0, (line, done)
        assert "Traceback" not in done.err
        assert all((there / file).stat().st_size > 100 for file in made), line


LOCKED = {
    "show locked.h5": (3, "you have no permission to read locked.h5", "chmod u+rX locked.h5"),
    "show closed/run.h5": (3, "you have no permission to read closed/run.h5", "chmod u+rX closed"),
    "import locked.csv --input u --output y -o a.h5": (
        3,
        "permission to read locked.csv",
        "chmod u+rX locked.csv",
    ),
    "--settings locked.toml show run.h5": (2, "permission to read locked.toml", "chmod u+rX locked.toml"),
    "evaluate played.h5 --bounds locked.toml": (
        2,
        "permission to read locked.toml",
        "chmod u+rX locked.toml",
    ),
    "tune -o locked.toml": (3, "locked.toml is write-protected", "chmod u+rw locked.toml"),
    "identify run.h5 -o locked.h5 --overwrite": (3, "locked.h5 is write-protected", "chmod u+rw locked.h5"),
    "identify run.h5 -o closed/m.h5": (2, "no permission for the folder closed", "in another place"),
    "plot run.h5 -o closed/run.png": (2, "no permission for the folder closed", "in another place"),
}


@pytest.mark.skipif(
    os.geteuid() == 0 and shutil.which("setpriv") is None, reason="root, whom no permission stops"
)
@pytest.mark.parametrize("line", LOCKED)
def test_what_may_not_be_read_or_written_is_told_with_what_to_do(there, line):
    """In the same words for every file, none of them the system's or the parser's."""
    for name in ("locked.h5", "locked.csv", "locked.toml"):
        (there / name).touch(mode=0o000)
    (there / "closed").mkdir(mode=0o000)
    as_nobody = ["setpriv", "--bounding-set=-all", "--inh-caps=-all"] if os.geteuid() == 0 else []
    done = subprocess.run(
        [*as_nobody, *PROGRAM, *line.split()], cwd=there, capture_output=True, text=True, check=False
    )
    (there / "closed").chmod(0o700)
    code, said, then = LOCKED[line]
    assert (done.returncode, "Traceback" in done.stderr) == (code, False), done
    assert said in done.stderr.partition("  try: ")[0], done
    assert then in done.stderr.partition("  try: ")[2], done


def test_a_figure_needs_no_backend(there):
    """What the environment asks matplotlib for does not matter to a file."""
    assert cold(there, "plot", "model.h5", env=SURROUNDINGS["no such backend"]).code == 0


@pytest.mark.slow
def test_without_a_home_the_bench_is_compiled_for_the_one_command(there, tmp_path):
    """It plays, and nothing of it stays."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    surroundings = SURROUNDINGS["no home"] | {"TMPDIR": str(temporary)}
    done = cold(there, "play", "drive.h5", "-o", "q.h5", env=surroundings)
    assert (done.code, done.err) == (0, "")
    assert list(temporary.iterdir()) == []


def test_a_terminal_of_twenty_columns(there):
    """Names and values are folded to it; what is to be copied in one piece, a command, is not."""
    said = on_terminal(there, "show", "played.h5", COLUMNS="20", TERM="dumb").decode()
    lines = [line.rstrip("\r") for line in said.partition("history")[0].splitlines()]
    facts = lines[next(k for k, line in enumerate(lines) if line.strip() == "waveform") :]
    assert len(facts) > 15
    assert max(map(len, facts)) <= 20
    evaluated = on_terminal(there, "evaluate", "played.h5", COLUMNS="20", TERM="dumb").decode()
    assert max(len(line.rstrip("\r")) for line in evaluated.splitlines()) <= 20
    assert "mean error, compensated" in " ".join(evaluated.split())


@pytest.mark.slow
def test_without_a_home_a_library_says_nothing_about_it(there):
    """What matplotlib does without a folder for its cache is its own business."""
    done = cold(there, "plot", "model.h5", env=SURROUNDINGS["no home"])
    assert (done.code, done.err) == (0, "")


@pytest.mark.parametrize("number", [errno.EACCES, errno.EROFS])
def test_what_may_not_be_written_is_no_bug(monkeypatch, number):
    """Such as the file of a shell that --install-completion wants to extend."""

    def program(**_words):
        raise OSError(number, os.strerror(number), "/home/x/.bashrc")

    said = io.StringIO()
    monkeypatch.setattr("sys.stderr", said)
    assert funnel(program, ["--install-completion"]) == 3
    assert f"error: /home/x/.bashrc: {os.strerror(number)}" in said.getvalue()
    assert "try: make it writable" in said.getvalue()
    assert "bug" not in said.getvalue()


def test_a_folder_that_was_deleted_is_no_bug(tmp_path):
    """The shell is still in it: no output can be written there."""
    line = shlex.join([*PROGRAM, "capture", "identification", "-o", "out.h5"])
    job = f"mkdir gone && cd gone && rmdir ../gone && {line}"
    done = subprocess.run(["sh", "-c", job], cwd=tmp_path, capture_output=True, text=True)  # noqa: PLW1510
    refusal(Ran(done.returncode, done.stdout, done.stderr), 3, "folder deleted")


@pytest.mark.parametrize(
    ("closed", "line", "code"),
    [(">&-", "show run.h5", 0), ("2>&-", "show absent.h5", 3), (">&- 2>&- <&-", "export run.h5 -o x.csv", 0)],
)
def test_closed_streams_are_no_bug(there, closed, line, code):
    """As a scheduler leaves them: nothing is printed, nothing goes into a file that took their number."""
    words = shlex.join([*PROGRAM, *line.split()])
    done = subprocess.run(["sh", "-c", f"{words} {closed}"], cwd=there, capture_output=True, text=True)  # noqa: PLW1510
    assert (done.returncode, done.stdout, "Traceback" in done.stderr) == (code, "", False)
    assert pulsetrainer(there, "show", "run.h5").code == 0
    if "x.csv" in line:
        assert (there / "x.csv").read_text().startswith("# ")


def test_a_full_disk_behind_the_results_is_no_bug():
    """They are lost; what to mend is said."""
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*PROGRAM, "ports"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 3, done.stderr
    assert "bug" not in done.stderr
    assert "try: " in done.stderr


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_reader_that_goes_away_is_no_quality_gate(unbuffered):
    """Neither at the end, where all is printed at once, nor in the middle: 141, as of any program."""
    with subprocess.Popen(
        [*PROGRAM, "ports"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
    ) as running:
        running.stdout.close()
        assert running.stderr.read() == b""
        assert running.wait() == 141
