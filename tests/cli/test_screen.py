"""The screen: completion in a real shell, no colour when NO_COLOR is set, nothing but text in a pipe."""

from __future__ import annotations

import io
import json
import os
import pty
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import report_examples
from store_examples import header

import pulsetrainer.cli
from program import PROGRAM
from program import pulsetrainer as piped
from pulsetrainer.cli.console import say
from pulsetrainer.files import store

BIN = Path(sys.executable).parent
COLOUR = re.compile(rb"\x1b\[(?:[0-9;]*;)?(?:3[0-8]|4[0-8]|9[0-7]|10[0-7])(?:;[0-9;]*)?m")


def completed(folder: Path, line: str) -> list[str]:
    """Return what bash proposes for the last word of ``line``, by the script that the program hands out."""
    words = line.split(" ")
    asked = " ".join(f"'{word}'" for word in words)
    script = f"""
        eval "$(pulsetrainer --show-completion; true)"
        COMP_WORDS=({asked}) COMP_CWORD={len(words) - 1}
        $(complete -p pulsetrainer | sed 's/.*-F \\([^ ]*\\) .*/\\1/') pulsetrainer
        printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    environment = {**os.environ, "PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "--norc", "-c", script],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    return [line for line in done.stdout.splitlines() if line]


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
def test_bash_completes_commands_and_options(tmp_path):
    """Of a command the first letters, of an option the dashes."""
    assert completed(tmp_path, "pulsetrainer id") == ["identify"]
    assert {"capture", "compare"} <= set(completed(tmp_path, "pulsetrainer c"))
    assert "--reading" in completed(tmp_path, "pulsetrainer identify --re")
    assert {"--out", "--overwrite", "--json"} <= set(completed(tmp_path, "pulsetrainer capture --"))


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
def test_a_line_with_a_mistake_is_completed_all_the_same(tmp_path):
    """What is wrong is told when it is run, not in the middle of the typing."""
    assert completed(tmp_path, "pulsetrainer diagnose --model a --model b --qu") == ["--quick"]


def on_terminal(folder: Path, *words: str, **more: str) -> bytes:
    """Return everything that a command writes to a terminal of its own."""
    environment = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "FORCE_COLOR")}
    environment |= {"TERM": "xterm-256color", "COLUMNS": "100", **more}
    main, terminal = pty.openpty()
    program = subprocess.Popen(
        [*PROGRAM, *words], cwd=folder, env=environment, stdin=terminal, stdout=terminal, stderr=terminal
    )
    os.close(terminal)
    said = b""
    try:
        while piece := os.read(main, 4096):
            said += piece
    except OSError:  # the other end was closed: Linux says so with an error
        pass
    assert program.wait() == 0, said
    os.close(main)
    return said


class _Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


def test_a_note_is_folded_between_words(monkeypatch):
    """On a terminal; a warning is called one, and no note."""
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setattr(sys, "stderr", shown := _Terminal())
    text = "the model leaves 0.9 % of the span (rms), 3 times the noise from sample to sample"
    say("note: ", text)
    say("warning: ", "the model expects large errors")
    lines = shown.getvalue().splitlines()
    assert max(map(len, lines)) <= 40
    assert " ".join(" ".join(lines[:-1]).split()) == f"note: {text}"
    assert lines[-1].startswith("warning: ")


def test_a_next_step_is_folded_around_its_commands(monkeypatch):
    """On a narrow terminal between words; what is copied stays in one piece."""
    terminal = io.StringIO()
    terminal.isatty = lambda: True
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(shutil, "get_terminal_size", lambda: os.terminal_size((40, 24)))
    say(
        "  try: ",
        "give the run it was identified from: `pulsetrainer show model.h5 --json` tells, or name it",
    )
    say("  try: ", "pulsetrainer identify run.h5 --form direct -o a-long-name.h5, and then go on")
    say("  try: ", "or pulsetrainer session --model m.h5 --pulses normal,bifid --minutes 2, which is short")
    say("  try: ", "or let the shell have it printed: _PULSETRAINER_COMPLETE=source_zsh pulsetrainer")
    lines = terminal.getvalue().splitlines()
    kept = (
        "pulsetrainer session --model m.h5 --pulses normal,bifid --minutes 2",
        "_PULSETRAINER_COMPLETE=source_zsh pulsetrainer",
        "`pulsetrainer show model.h5 --json`",
        "pulsetrainer identify run.h5 --form direct -o a-long-name.h5",
    )
    assert all(sum(command in line for line in lines) == 1 for command in kept)
    assert all(len(line) <= 40 or any(command in line for command in kept) for line in lines)
    assert len(lines) > 4


def test_the_list_of_commands_is_not_cut(tmp_path):
    """What a command does stands in one line of eighty columns, to its full stop."""
    done = piped(tmp_path, "--help", env={"COLUMNS": "80"})
    listed = done.out.split("Commands:")[1].strip().splitlines()
    assert len(listed) > 15
    assert all(line.endswith(".") and not line.endswith("...") for line in listed), listed


@pytest.fixture
def recorded(tmp_path):
    """A folder with a run."""
    store.write(tmp_path / "run.h5", report_examples.run(), header())
    return tmp_path


def test_no_color_is_honoured(recorded):
    """The progress bar is coloured on a terminal, and plain there when NO_COLOR is set."""
    fitting = ("identify", "run.h5", "--levels", "6", "--overwrite", "-o", "model.h5")
    assert COLOUR.search(on_terminal(recorded, *fitting))
    plain = on_terminal(recorded, *fitting, NO_COLOR="1")
    assert not COLOUR.search(plain)
    assert b"Preisach model of 6 levels" in plain


def test_a_pipe_gets_text_alone(recorded):
    """No escape sequence on either stream, whatever the terminal is said to be."""
    words = ("identify", "run.h5", "--levels", "6", "-o", "model.h5")
    done = piped(recorded, *words, env={"TERM": "xterm-256color"})
    assert done.code == 0
    assert "\x1b" not in done.out + done.err


ESCAPE = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


@pytest.mark.parametrize(
    "columns", [20, 40, 200, *(pytest.param(columns, marks=pytest.mark.slow) for columns in (60, 80))]
)
def test_no_figure_is_cut_on_a_narrow_terminal(tmp_path, columns):
    """Where a table does not fit there is a list of the same figures; no line is too long."""
    store.write(tmp_path / "evaluation.h5", report_examples.evaluation(), header())
    words = ("show", "evaluation.h5")
    said = ESCAPE.sub("", on_terminal(tmp_path, *words, COLUMNS=str(columns)).decode())
    whole = piped(tmp_path, *words).out
    table = re.compile(r"(?<![\w.-])-?\d+\.\d\d(?![\w.-])")
    figures, _, _ = said.partition("history")
    expected, _, _ = whole.partition("history")
    assert sorted(table.findall(figures)) == sorted(table.findall(expected))
    assert len(table.findall(expected)) > 5
    lines = [line for line in figures.replace("\r", "").splitlines() if "reading" not in line]
    assert not [line for line in lines if "…" in line]
    assert max(map(len, lines)) <= max(columns, 22)  # a time stamp is one word


def test_a_look_at_the_computer_fits_a_narrow_terminal(tmp_path):
    """What is found goes on below what was looked at, where there is no room beside it."""
    said = on_terminal(tmp_path, "doctor", "--no-capture", COLUMNS="20", PULSETRAINER_PORT="bench:").decode()
    lines = re.split("[\r\n]+", ESCAPE.sub("", said))
    long = [line for line in lines if len(line) > 20 and " fix: " not in line and "looking" not in line]
    assert [line for line in long if len(line.split()) > 1] == []


def test_long_words_are_folded_between_words_and_commands_are_not(tmp_path):
    """A message reads well on a narrow terminal; what is to be copied stays in one piece."""
    main, terminal = pty.openpty()
    words = [*PROGRAM, "capture", "nothing", "-o", "run.h5"]
    environment = {**os.environ, "COLUMNS": "40"}
    program = subprocess.Popen(
        words, cwd=tmp_path, env=environment, stdout=subprocess.DEVNULL, stderr=terminal
    )
    os.close(terminal)
    assert program.wait() == 2
    said = os.read(main, 4096).decode().replace("\r", "").splitlines()
    os.close(main)
    whole = piped(tmp_path, *words[len(PROGRAM) :]).err.splitlines()
    assert len(said) > len(whole) == 2
    assert all(len(line) <= 40 for line in said[:-1])
    assert " ".join(" ".join(said[:-1]).split()) == whole[0]
    assert said[-1] == whole[1]


def test_a_pipe_gets_whole_lines_without_blanks_at_their_ends(tmp_path):
    """One row of a table a line, however long: a pipe has no width."""
    store.write(tmp_path / "evaluation.h5", report_examples.evaluation(), header())
    done = piped(tmp_path, "compare", *["evaluation.h5"] * 12, env={"COLUMNS": "40"})
    assert done.code == 0
    lines = done.out.splitlines()
    assert all(line == line.rstrip() for line in lines)
    assert any(line.count("evaluation.h5") == 12 for line in lines)
    assert "…" not in done.out


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_a_name_that_the_terminal_cannot_spell_is_no_error(tmp_path, encoding):
    """Escapes for a person; the JSON is the same everywhere."""
    name = "größe-脈.h5"
    store.write(tmp_path / name, report_examples.run(), header())
    environment = {**os.environ, "PYTHONIOENCODING": encoding}
    for more in ([], ["--json"]):
        done = subprocess.run(
            [*PROGRAM, "show", name, *more], cwd=tmp_path, env=environment, capture_output=True, check=False
        )
        assert done.returncode == 0, done.stderr
        if more:
            assert json.loads(done.stdout.decode("utf-8"))["file"] == name
        else:
            assert done.stdout.startswith(name.encode(encoding, "backslashreplace"))


def test_what_a_terminal_cannot_spell_is_written_in_letters(tmp_path):
    """A square as the importer reads it, anything else as an escape."""
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    job = "from pulsetrainer.report import spelling; spelling.speak_any_encoding(); "
    job += "print('N/A², 5 µs, 1 kΩ, 10⁻³, 脈')"
    done = subprocess.run([sys.executable, "-c", job], env=environment, capture_output=True, check=True)
    assert done.stdout.split(b"\n")[0].strip() == rb"N/A^2, 5 us, 1 kOhm, 10^-3, \u8108"


def test_results_have_one_writer():
    """Two writers to one stream, each with its own memory, leave the order of the lines to luck."""
    other = re.compile(r"typer\.echo\((?!.*err=True)|click\.echo|\bprint\(")
    found = {
        path.name
        for path in Path(pulsetrainer.cli.__file__).parent.glob("*.py")
        if other.search(path.read_text().replace("console.print(", ""))
    }
    assert found == {"app.py"}  # --version, before any command
