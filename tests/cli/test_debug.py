"""No traceback without --debug; with it the whole one, down to the line that failed and what caused it."""

from __future__ import annotations

import pytest

from mistakes import SIGNATURE
from program import cold
from pulsetrainer.cli.guard import funnel
from wording import refusal

# A script of the user's own that has the name of a library hides the library: the commonest way in which a
# sound program breaks on somebody's computer. Nothing inside the program is replaced.
OWN_SCRIPT = """\
def _read(name):
    return {}[name]


_read("force")
"""


@pytest.fixture
def run(tmp_path):
    """Run commands in the test's own folder from the start of an interpreter: what is loaded is the point."""
    return lambda *words: cold(tmp_path, *words)


@pytest.fixture
def broken(tmp_path):
    """A folder with such a script beside the files."""
    (tmp_path / "h5py.py").write_text(OWN_SCRIPT)
    (tmp_path / "run.h5").write_bytes(SIGNATURE)
    return tmp_path


@pytest.mark.parametrize("words", [("show", "run.h5"), ("identify", "run.h5", "-o", "model.h5")])
def test_what_nobody_expected_is_a_bug_in_words(broken, run, words):
    """Exit 70, what happened, and how to see the rest; no traceback."""
    done = run(*words)
    refusal(done, 70, "bug")
    assert 'File "' not in done.err


@pytest.mark.parametrize("place", [0, 2], ids=["first", "last"])
def test_debug_shows_every_frame_of_it(broken, run, place):
    """From the funnel over the command and its flow to the line that failed; then the same words."""
    words = ["show", "run.h5"]
    words.insert(place, "--debug")
    done = run(*words)
    assert done.code == 70
    assert done.err.count("Traceback (most recent call last)") == 1
    places = ["cli/guard.py", "cli/show.py", "files/", "h5py.py", "return {}[name]", "KeyError: 'force'"]
    found = [done.err.find(place) for place in places]
    assert -1 not in found
    assert found == sorted(found), "outermost first"
    assert "error: a bug: KeyError: 'force'" in done.err.partition("\nKeyError: 'force'\n")[2]


def test_debug_leaves_the_json_object_alone(broken, run):
    """The traceback goes to stderr, stdout stays one object."""
    done = run("show", "run.h5", "--json", "--debug")
    assert done.code == 70
    assert done.json["error"]["kind"] == "bug"
    assert "Traceback (most recent call last)" in done.err


def test_debug_shows_what_caused_an_expected_error(tmp_path, run):
    """The parser's own complaint about the file, then ours: both tracebacks, in that order."""
    (tmp_path / "bench.toml").write_text("levels = = 48\n")
    words = ("--settings", "bench.toml", "ports")
    plain = run(*words)
    whole = run("--debug", *words)
    assert plain.code == whole.code == 2
    assert "Traceback" not in plain.err
    assert whole.err.count("Traceback (most recent call last)") == 2
    assert "TOMLDecodeError" in whole.err.partition("direct cause of the following exception")[0]
    assert whole.err.endswith(plain.err), "the same words at the end"


def test_a_command_that_is_stopped_says_so(capsys):
    """Whatever the parser makes of Ctrl-C: exit 130, and words."""
    assert funnel(lambda **_: 130, ["identify"]) == 130
    assert "stopped by you" in capsys.readouterr().err
