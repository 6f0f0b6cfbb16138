"""Which command makes which kind of artefact, and what to run when the wrong kind was given."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

_MAKES = {
    "run": "pulsetrainer capture identification -o run.h5",
    "model": "pulsetrainer identify RUN.h5 -o model.h5",
    "waveform": "pulsetrainer invert normal --model model.h5 -o drive.h5",
    "playback": "pulsetrainer play drive.h5 -o played.h5",
    "evaluation": "pulsetrainer evaluate played.h5 -o evaluation.h5",
    "diagnosis": "pulsetrainer diagnose RUN.h5 --model model.h5 -o diagnosis.h5",
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


def maker(kind: str) -> str:
    """Return the command that makes an artefact of this kind."""
    return _MAKES.get(kind, "pulsetrainer --help")


def next_step(expected: Sequence[str], got: str, file: str) -> str:
    """Return what to do when a file of kind ``got`` was given where ``expected`` was wanted."""
    for kind in expected:
        if (kind, got) in _NEXT:
            return _NEXT[kind, got].format(file=shlex.quote(file))
    return f"run `{maker(expected[0])}`"


def with_article(kinds: Sequence[str]) -> str:
    """Return ``a run``, ``an evaluation``, ``a playback or a run``."""
    return " or ".join(f"{'an' if kind[:1] in 'aeiou' else 'a'} {kind}" for kind in kinds)
