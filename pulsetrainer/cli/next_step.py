"""What to do next about an error: the library says what is wrong, this names the command or the option."""

from __future__ import annotations

import itertools
import re
import shlex
from pathlib import Path

from pulsetrainer.errors import (
    DamagedFileError,
    ExistsError,
    NotAnArtefactError,
    PulsetrainerError,
    WrongKindError,
)

_TABLES = (".csv", ".tsv", ".txt", ".dat")

MAKES = {
    "run": "pulsetrainer capture identification -o run.h5",
    "model": "pulsetrainer identify RUN.h5 -o model.h5",
    "waveform": "pulsetrainer invert normal --model model.h5 -o drive.h5",
    "playback": "pulsetrainer play drive.h5 -o played.h5",
    "evaluation": "pulsetrainer evaluate played.h5 -o evaluation.h5",
    "diagnosis": "pulsetrainer diagnose RUN.h5 --model model.h5 -o diagnosis.h5",
    "session": "pulsetrainer session --model model.h5 -o session.h5",
}

# (expected, got): what to do; {file} is the file that was given
_NEXT = {
    ("model", "run"): "run `pulsetrainer identify {file} -o model.h5`",
    ("model", "diagnosis"): "run `pulsetrainer extend {file} --model model.h5 -o extended.h5`",
    ("waveform", "model"): "run `pulsetrainer invert normal --model {file} -o drive.h5`",
    ("waveform", "run"): "run `pulsetrainer identify {file} -o model.h5`, "
    "then `pulsetrainer invert normal --model model.h5 -o drive.h5`",
    ("waveform", "playback"): "it was played already: give the drive file it was played from",
    ("playback", "waveform"): "run `pulsetrainer play {file} -o played.h5`",
    ("playback", "model"): "run `pulsetrainer invert normal --model {file} -o drive.h5`, "
    "then `pulsetrainer play drive.h5 -o played.h5`",
    ("playback", "evaluation"): "it was evaluated already: see `pulsetrainer show {file}`",
    ("evaluation", "playback"): "run `pulsetrainer evaluate {file} -o evaluation.h5`",
    ("evaluation", "run"): "run `pulsetrainer evaluate {file} --model model.h5 -o evaluation.h5`",
    ("evaluation", "waveform"): "run `pulsetrainer play {file} -o played.h5`, "
    "then `pulsetrainer evaluate played.h5 -o evaluation.h5`",
    ("diagnosis", "run"): "run `pulsetrainer diagnose {file} --model model.h5 -o diagnosis.h5`",
    ("diagnosis", "model"): "run `pulsetrainer diagnose RUN.h5 --model {file} -o diagnosis.h5`",
    ("run", "model"): "give the run it was identified from: `pulsetrainer show {file}` tells its history",
    ("run", "diagnosis"): "give the run that was diagnosed: `pulsetrainer show {file}` tells its history",
}


def next_step(problem: PulsetrainerError) -> str:
    """Return what to do about an error: a command or an option where there is one, else its own hint."""
    if isinstance(problem, ExistsError):
        other = shlex.quote(str(_free(problem.path)))
        return f"name another file, such as {other}, or give --overwrite to replace it"
    if isinstance(problem, WrongKindError):
        return _after_wrong_kind(problem)
    if isinstance(problem, DamagedFileError):
        how = (
            f"with `{MAKES[problem.artefact]}`" if problem.artefact in MAKES else "(see pulsetrainer --help)"
        )
        return f"restore it from a copy, or make it again {how}"
    if isinstance(problem, NotAnArtefactError):
        return _after_foreign_file(problem.path)
    return problem.hint


def _free(path: Path) -> Path:
    """Return a name like this one that is not taken."""
    return next(
        other
        for number in itertools.count(2)
        if not (other := path.with_name(f"{path.stem}-{number}{path.suffix}")).exists()
    )


_PARAMETER = re.compile(r"`([a-z]+(?:_[a-z]+)*)(?:_[A-Z]\w*)?`")  # without the unit at its end


def as_options(text: str) -> str:
    """Return a text with the parameters in it as options: ```force_min_N``` is ``--force-min`` here."""
    return _PARAMETER.sub(lambda found: f"--{found[1].replace('_', '-')}", text)


def _after_wrong_kind(problem: WrongKindError) -> str:
    if problem.expected == ("playback", "run") and problem.found == "model":
        given = shlex.quote(str(problem.path))
        return f"a model goes with the run: pulsetrainer evaluate run.h5 --model {given}"
    for kind in problem.expected:
        if (kind, problem.found) in _NEXT:
            return _NEXT[kind, problem.found].format(file=shlex.quote(str(problem.path)))
    return f"run `{MAKES.get(problem.expected[0], 'pulsetrainer --help')}`"


def _after_foreign_file(path: Path) -> str:
    if path.suffix.lower() in _TABLES:
        return f"import the table first: pulsetrainer import {shlex.quote(str(path))} -o run.h5"
    return (
        "give a file that pulsetrainer wrote; a recording from elsewhere comes in with `pulsetrainer import`"
    )
