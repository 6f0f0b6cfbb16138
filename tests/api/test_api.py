"""The Python API: its names, what it costs to import, how artefacts show themselves, what it refuses."""

from __future__ import annotations

import inspect
import os
import re
import subprocess
import sys
import traceback
from html import unescape
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.axes import Axes

import pulsetrainer as pt
from pulsetrainer.errors import ArgumentError, DataError, NotAnArtefactError, PulsetrainerError, UsageError
from pulsetrainer.files import store
from pulsetrainer.report.tables import ESCAPE
from wording import raises

KEPT = Path(__file__).resolve().parents[1] / "data" / "files-0.1"
NOUNS = {"Run", "Model", "Waveform", "Playback", "Evaluation", "Diagnosis", "Session"}
VERBS = {
    "load", "save", "read_table", "open_device", "capture", "identify", "invert", "play", "evaluate",
    "compare", "diagnose", "extend", "correct", "refine", "transfer", "session", "tune", "check",
}  # fmt: skip


def test_the_names_are_those_of_the_contract():
    """All are there, and every one has a docstring with an example that runs as a doctest."""
    assert set(pt.__all__) == NOUNS | VERBS | {"__version__"}
    for name in VERBS:
        text = inspect.getdoc(getattr(pt, name))
        assert text, name
        assert ">>>" in text, name
    with pytest.raises(AttributeError):
        _ = pt.identfy


@pytest.mark.parametrize("name", sorted(VERBS))
def test_every_option_has_its_name(name):
    """In the help of an editor none hides behind ``**options``."""
    assert "options" not in inspect.signature(getattr(pt, name)).parameters


def test_the_import_loads_nothing():
    """Neither numpy nor any module of the package but the version."""
    job = "import sys, pulsetrainer; print(*sorted(m for m in sys.modules if m[:5] in ('numpy', 'pulse')))"
    done = subprocess.run([sys.executable, "-c", job], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "pulsetrainer pulsetrainer.version"


@pytest.mark.parametrize("path", sorted(KEPT.glob("*.h5")), ids=lambda path: path.stem)
def test_every_artefact_shows_itself(path):
    """As one line, as text, as HTML with its figure, as axes; and quietly."""
    artefact = pt.load(path)
    assert repr(artefact).startswith(f"<{artefact.kind}")
    assert "\n" not in repr(artefact)
    assert len(str(artefact).splitlines()) > 3
    page = artefact._repr_html_()
    assert page.startswith('<pre style="white-space: pre')  # a table is not broken where a column ends
    assert "font-family: monospace" in page.partition(">")[0]  # a rule of nbconvert's page sets another one
    lines = unescape(page.partition(">")[2].partition("</pre>")[0]).splitlines()
    sentences = [line for line in lines if re.match(r" {0,20}\w+( \S+)*$", line)]  # no rows of a table
    assert max(map(len, sentences)) <= 80
    assert page.rstrip().endswith("</svg>")
    assert isinstance(artefact.plot(), Axes)


def test_errors_are_python_exceptions(tmp_path, capfd):
    """Nothing exits, nothing is printed; a ValueError where a caller expects one."""
    model = pt.load(KEPT / "model.h5")
    with raises(ArgumentError, "not such an argument", argument="`levels`", got="1") as caught:
        pt.identify(pt.load(KEPT / "run.h5"), levels=1)
    assert isinstance(caught.value, ValueError)
    with pytest.raises(UsageError):
        pt.invert("normel", model)
    with pytest.raises(UsageError):
        pt.invert("normal", model, method="extended")
    with pytest.raises(DataError):
        pt.invert("normal", model, force_min=-99.0)
    with pytest.raises(UsageError):
        pt.evaluate(pt.load(KEPT / "run.h5"))
    (tmp_path / "table.csv").write_text("t_s,u,y\n0,0,0\n")
    with pytest.raises(NotAnArtefactError):
        pt.load(tmp_path / "table.csv")
    pt.save(model, tmp_path / "m.h5")
    header = store.read_header(tmp_path / "m.h5")
    assert header.history[-1].split()[1:4] == ["Python", "pulsetrainer.save", "model"]  # no command line
    with pytest.raises(UsageError):
        pt.save(model, tmp_path / "m.h5")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("verb", "given", "argument", "count"),
    [
        ("identify", ["run"], "names", 1),
        ("diagnose", ["run", "model"], "names", 2),
        ("evaluate", ["played"], "names", 1),
        ("evaluate", ["run", "model"], "model_names", 1),
        ("compare", [["evaluation"] * 3], "names", 3),
        ("extend", ["model", "diagnosis"], "names", 2),
        ("correct", ["run", "diagnosis"], "names", 2),
    ],
)
def test_names_are_one_for_each(verb, given, argument, count):
    """Too few or too many are a ValueError that says how many and what was given, in every verb."""

    def loaded(of):
        return list(map(loaded, of)) if isinstance(of, list) else pt.load(KEPT / f"{of}.h5")

    for wrong in filter(None, (["a"] * (count - 1), ["a"] * (count + 1))):
        with raises(
            ArgumentError, "not one name for each", argument=argument, count=count, got=len(wrong)
        ) as caught:
            getattr(pt, verb)(*map(loaded, given), **{argument: wrong})
        assert isinstance(caught.value, ValueError)


def test_a_pulse_may_be_given_as_arrays_a_name_or_a_drive():
    """All three give the same drive."""
    model = pt.load(KEPT / "model.h5")
    named = pt.invert("normal", model)
    one = named.time_s[: round(named.period_s * named.rate_Hz)]
    shape = named.target[np.flatnonzero(named.scored)[0] :][: one.size]
    for pulse in ((one, shape), named):
        again = pt.invert(pulse, model)
        assert np.allclose(again.target[again.scored], named.target[named.scored], atol=1e-3)


@pytest.mark.parametrize(
    ("asked", "left"), [("nonsense", ""), pytest.param("svg", "svg", marks=pytest.mark.slow)]
)
def test_an_artefact_shows_itself_whatever_backend_is_asked_for(asked, left):
    """Its figure needs none; one that exists is still that of whoever draws beside it."""
    code = (
        f"import os, pulsetrainer as pt\nmodel = pt.load({str(KEPT / 'model.h5')!r})\n"
        "assert '<svg' in model._repr_html_()\nmodel.plot()\n"
        f"import matplotlib\nassert os.environ['MPLBACKEND'] == {asked!r}\n"
        f"assert {left!r} in ('', matplotlib.rcParams['backend'])\n"
    )
    environment = {**os.environ, "MPLBACKEND": asked, "DISPLAY": ""}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (pt.extend, "expected a Model, got a Diagnosis"),
        (lambda diagnosis, model: pt.correct(model, diagnosis), "expected a Run, got a Model"),
        (lambda _, model: pt.evaluate(model), "expected a Playback or a Run, got a Model"),
        (lambda _, model: pt.compare(model), "expected an Evaluation or a Session, got a Model"),
        (lambda diagnosis, _: pt.save(diagnosis.causes, "out.h5"), "got a tuple"),
        (lambda _, model: pt.refine(model, None), "expected a Waveform, got a Model"),
        (
            lambda *_: pt.identify(pt.load(KEPT / "run.h5"), levels=1),
            "whole number from 2 to 500",
        ),
        (
            lambda *_: pt.identify(pt.load(KEPT / "run.h5"), levels=501),
            "whole number from 2 to 500",
        ),
        (lambda *_: pt.read_table("x.csv"), "name of a column for input and for output"),
        (lambda *_: pt.read_table([], input="u", output="y"), "read_table needs a file, got none"),
        (
            lambda *_: pt.read_table("tests/data/pneu_oring_3bar.csv", input="u", output="y", resample="odd"),
            "`resample` must be a rate in Hz or 'even', got 'odd'",
        ),
        (lambda _, model: pt.invert("normal", model, rate_Hz=-5), "`rate_Hz` must be more than 0, got -5"),
        (
            lambda *_: pt.play(pt.load(KEPT / "drive.h5"), SimpleNamespace(info=0), repeats=1.5),
            "`repeats` must be a whole number",
        ),
        (lambda *_: pt.identify(pt.load(KEPT / "run.h5"), bootstrap=-1), "`bootstrap` must be 0, or 2 draws"),
        (lambda _, model: pt.invert("normal", model, force_max="20 N"), "`force_max` must be a number"),
        (lambda _, model: pt.identify(None), "expected a Run, got None"),
        (lambda diagnosis, _: pt.load(diagnosis), "`path` must name a file, got a Diagnosis"),
        (lambda *_: pt.load(" "), "`path` must name a file, got ' '"),
        (lambda *_: pt.capture("identification", "bench:"), "expected a device, got 'bench:'"),
        (lambda *_: pt.tune("bench:"), "expected a device, got 'bench:'"),
        (lambda _, model: pt.session(model, "bench:"), "expected a device, got 'bench:'"),
        (lambda *_: pt.identify(pt.load(KEPT / "run.h5"), seed=-1), "`seed` must be a whole number, 0 or"),
        (lambda _, model: pt.invert([0, 1, 2], model), "a pulse must be a name, .* got a list"),
        (lambda _, model: pt.invert(([0, 1, 2, 3], [1, 2, 3, "x"]), model), "value must be numbers: "),
        (
            lambda _, model: pt.invert(([0, 1, 2, 3], [1, 2, 3, 4, 5]), model),
            "needs one value for each time, got shapes",
        ),
        (lambda _, model: pt.invert(([0, 2, 1, 3], [1, 2, 3, 4]), model), "not increase: 1 s after 2 s"),
    ],
)
def test_what_is_of_another_kind_is_refused_with_what_was_expected(call, said):
    """By every verb in the same way, as a ValueError too, with a hint."""
    with pytest.raises(ArgumentError, match=said) as caught:
        call(pt.load(KEPT / "diagnosis.h5"), pt.load(KEPT / "model.h5"))
    assert isinstance(caught.value, ValueError)
    assert caught.value.hint


def test_a_keyword_that_is_none_is_told_of_the_function_that_was_called():
    """Not of one behind it, which is on no page."""
    with pytest.raises(TypeError, match=r"^read_table\(\) got an unexpected keyword argument 'separator'"):
        pt.read_table("x.csv", input="u", output="y", separator=";")


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (pt.load, "pt.read_table('"),
        (lambda _: pt.identify("scope.h5"), "pt.load('scope.h5')"),
        (lambda _: pt.open_device("bench?seed=3"), "`port` 'bench:?seed=3'"),
    ],
)
def test_a_traceback_says_what_to_do(tmp_path, call, said):
    """Below the message, in words of Python: the hint."""
    (tmp_path / "table.csv").write_text("t_s,u,y\n0,0,0\n")
    with pytest.raises(PulsetrainerError) as caught:
        call(tmp_path / "table.csv")
    last = traceback.format_exception_only(caught.value)[-1]
    assert last.startswith("try: ")
    assert said in last
    assert "--" not in last


@pytest.mark.parametrize("name", ["out.csv", "figure.PNG", ".h5", "-"])
def test_an_artefact_gets_no_name_that_promises_another_format(tmp_path, name):
    """HDF5 in a file called .csv would be taken for a table."""
    with pytest.raises(UsageError, match="is saved as HDF5, but") as caught:
        pt.save(pt.load(KEPT / "model.h5"), tmp_path / name)
    assert ".h5" in caught.value.hint
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("port", ["", " "])
def test_a_port_that_was_left_empty_is_not_the_simulated_device(port):
    """As --port "" at a shell."""
    with pytest.raises(UsageError, match="must name a port") as caught:
        pt.open_device(port)
    assert "bench:" in caught.value.hint


@pytest.mark.parametrize("name", sorted(VERBS))
def test_help_is_readable(name):
    """No address of a function, no quotes around a type; progress and seed are told with the rest."""
    verb = getattr(pt, name)
    head, text = str(inspect.signature(verb)), inspect.getdoc(verb)
    assert "0x" not in head
    assert ": '" not in head
    for parameter in {"progress", "seed"} & set(inspect.signature(verb).parameters):
        assert f"\n{parameter}\n    " in text.partition("Parameters\n---")[2].partition("\nRaises\n---")[0]


def test_a_line_is_left_free_between_tables():
    """One, as in the command."""
    assert "\n\n\n" not in ESCAPE.sub("", str(pt.load(KEPT / "diagnosis.h5")))


def test_what_is_listed_is_public():
    """Completion in a shell shows nothing else."""
    assert set(dir(pt)) == set(pt.__all__)


def test_a_name_that_is_no_file_is_not_to_be_loaded():
    """As where pulse and model are swapped."""
    with pytest.raises(ArgumentError) as caught:
        pt.invert(pt.load(KEPT / "model.h5"), "normal")
    assert "order of the arguments" in caught.value.hint
    with pytest.raises(ArgumentError) as caught:
        pt.identify("run.h5")
    assert "pt.load('run.h5')" in caught.value.hint
