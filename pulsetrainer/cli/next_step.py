"""What to do next about an error: the library says what is wrong, this names the command or the option."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pulsetrainer import errors
from pulsetrainer.files.input_file import TABLES, likely_kind, near_names, to_import
from pulsetrainer.files.output_name import free

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
    ("model", "diagnosis"): "give the model that was diagnosed: `pulsetrainer show {file}` shows its history",
    ("waveform", "model"): "run `pulsetrainer invert normal --model {file} -o drive.h5`",
    ("waveform", "run"): "run `pulsetrainer identify {file} -o model.h5`, "
    "then `pulsetrainer invert normal --model model.h5 -o drive.h5`",
    ("waveform", "playback"): "it was played already: give the drive file it was played from",
    ("playback", "waveform"): "run `pulsetrainer play {file} -o played.h5`; "
    "if your own amplifier played it, import what was measured, and evaluate that with --model",
    ("playback", "model"): "run `pulsetrainer invert normal --model {file} -o drive.h5`, "
    "then `pulsetrainer play drive.h5 -o played.h5`",
    ("playback", "evaluation"): "it was evaluated already: see `pulsetrainer show {file}`",
    ("evaluation", "playback"): "run `pulsetrainer evaluate {file} -o evaluation.h5`",
    ("evaluation", "run"): "run `pulsetrainer evaluate {file} --model model.h5 -o evaluation.h5`",
    ("evaluation", "waveform"): "run `pulsetrainer play {file} -o played.h5`, "
    "then `pulsetrainer evaluate played.h5 -o evaluation.h5`",
    ("diagnosis", "run"): "run `pulsetrainer diagnose {file} --model model.h5 -o diagnosis.h5`",
    ("diagnosis", "model"): "run `pulsetrainer diagnose RUN.h5 --model {file} -o diagnosis.h5`",
    ("run", "playback"): "make a run with `pulsetrainer capture`; for the errors of a playback, run "
    "`pulsetrainer evaluate {file} -o evaluation.h5`",
    ("run", "model"): "give the run it was identified from: `pulsetrainer show {file}` shows its history",
    ("run", "diagnosis"): "give the run that was diagnosed: `pulsetrainer show {file}` shows its history",
}


def next_step(problem: errors.PulsetrainerError) -> str:
    """Return what to do about an error: a command or an option where there is one, else its own hint."""
    if isinstance(problem, errors.ExistsError) and problem.hint == errors.ExistsError.usual:
        other = shlex.quote(str(free(problem.path)))
        return f"name another file, such as {other}, or give --overwrite to replace it"
    if isinstance(problem, errors.WrongKindError) and problem.hint.endswith(" instead"):  # nobody knew better
        return _after_wrong_kind(problem)
    if isinstance(problem, errors.DamagedFileError):
        known = problem.artefact in MAKES
        how = f"with `{to_make(problem.artefact, problem.path)} --overwrite`" if known else ""
        return f"restore it from a copy, or make it again {how or '(see pulsetrainer --help)'}"
    if isinstance(problem, errors.NotAnArtefactError) and not problem.foreign:
        if problem.path.suffix.lower() in TABLES:
            return to_import(problem.path)
        elsewhere = "to read a recording from elsewhere, use `pulsetrainer import`"
        return f"give a file that pulsetrainer wrote; {elsewhere}"
    return problem.hint


def to_make(kind: str, path: Path) -> str:
    """Return the command that makes a file of this kind and name; of a single run beside it, from that."""
    line, _, _ = MAKES[kind].rpartition(" ")
    runs = near_names(path.with_name("RUN.h5"), ("run",)) if "RUN.h5" in line else []
    if len(runs) == 1:
        line = line.replace("RUN.h5", shlex.quote(str(path.with_name(runs[0]))))
    return f"{line} {shlex.quote(str(path))}"


_PARAMETER = re.compile(r"`([a-z]+(?:_[a-z]+)*)(?:_[A-Z]\w*)?`")  # without the unit at its end


def as_options(text: str) -> str:
    """Return a text with the parameters in it as options: ```force_min_N``` is ``--force-min`` here."""
    return _PARAMETER.sub(lambda found: f"--{found[1].replace('_', '-')}", text)


# what the file of an argument holds; others take any artefact, or a table
HOLDS = {
    "model": ("model",),
    "run": ("run",),
    "runs": ("run",),
    "verify": ("run",),
    "drive": ("waveform",),
    "diagnosis": ("diagnosis",),
    "inputs": ("playback", "session"),
    "evaluations": ("evaluation", "session"),
    "file": (),
}

# what a hint calls a file that the command line may name: the parameter that does
_PLACEHOLDERS = {
    "RUN.h5": ("run", "runs", "inputs"),
    "DIAGNOSIS.h5": ("diagnosis",),
    "MODEL.h5": ("model",),
    "REFINED.h5": ("learnt",),
}


def with_files(text: str, parameters: Mapping[str, Any]) -> str:
    """Return a text with the files that a command was given in the place of RUN.h5 and the like."""
    for placeholder, names in _PLACEHOLDERS.items():
        given: Any = next((value for name in names if (value := parameters.get(name))), None)
        if isinstance(given, list | tuple) and (len(given) == 1 or "model" in names):  # the first one
            given = given[0]
        if isinstance(given, str | Path):
            text = text.replace(placeholder, shlex.quote(str(given)))
    return text


def the_other_way(problem: errors.PulsetrainerError, given: Mapping[str, Any], words: Sequence[str]) -> str:
    """Return words with two files exchanged, where each is what the other should be; else empty."""
    if not isinstance(problem, errors.WrongKindError):
        return ""
    for name, kinds in HOLDS.items():
        file = given.get(name)
        other = Path(file) if isinstance(file, str | Path) else Path()
        if problem.found in kinds and likely_kind(other) in problem.expected:
            there = {problem.path: other, other: problem.path}
            return shlex.join(str(there.get(Path(word), word)) for word in words)
    return ""


def _after_wrong_kind(problem: errors.WrongKindError) -> str:
    if problem.expected[:2] == ("playback", "run") and problem.found == "model":
        given = shlex.quote(str(problem.path))
        return f"give each model after a --model of its own: pulsetrainer evaluate run.h5 --model {given}"
    known = next(filter(None, (_NEXT.get((kind, problem.found)) for kind in problem.expected)), "")
    for name in re.findall(r"-o ([\w.]+)", known):
        known = known.replace(name, str(free(Path(name))))
    ways = [known.format(file=shlex.quote(str(problem.path)))] if known else []
    if near := near_names(problem.path, problem.expected):
        files = ", ".join(shlex.quote(str(problem.path.with_name(name))) for name in near)
        ways.insert(0, f"{problem.hint.removesuffix(' instead')}, such as {files}")
    return "; or ".join(ways) or f"run `{MAKES.get(problem.expected[0], 'pulsetrainer --help')}`"
