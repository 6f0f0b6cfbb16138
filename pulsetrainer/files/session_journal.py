"""The beats of a session in its journal: written as they are over, so that a killed program leaves a session.

A block is JSON: the beats and the windows of temperature that are new since the block before it, the quiz as
far as it is answered, and the other fields of the session as they stand now.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from pulsetrainer.artefacts import Beats, FloatArray, Quiz, Session
from pulsetrainer.artefacts.session import BEAT_COLUMNS
from pulsetrainer.errors import DamagedFileError

CUT_OFF = "the record ends before the session does: it was cut off, or is still going on"
_WINDOW = ("temperature_s", "temperature_K")


class SessionWriter:
    """Turns what a session amounts to so far into blocks, each beat once."""

    def __init__(self) -> None:
        self._beats = self._windows = 0  # that are written

    def block(self, fields: Mapping[str, Any]) -> bytes:
        """Return the next block, from the fields of a session that are no samples."""
        beats, quiz = fields["beats"], fields["quiz"]
        rows = beats.columns.T[self._beats :]
        told = [np.zeros(0) if fields[name] is None else fields[name] for name in _WINDOW]
        windows = np.stack(told, axis=1)[self._windows :]
        self._beats, self._windows = self._beats + len(rows), self._windows + len(windows)
        plain = {name: value for name, value in fields.items() if name not in ("beats", "quiz", *_WINDOW)}
        asked = None if quiz is None else asdict(quiz) | {"response_s": quiz.response_s.tolist()}
        said = {"beats": rows.tolist(), "windows": windows.tolist(), "fields": plain, "quiz": asked}
        return json.dumps(said).encode()


def session_of(path: Path, samples: Mapping[str, FloatArray], blocks: Sequence[bytes]) -> Session:
    """Return the session in a journal, not complete, from its samples and what ``SessionWriter`` gave.

    DamagedFileError where the blocks are not what it gives.
    """
    try:
        said = [json.loads(block) for block in blocks]
        rows = np.asarray([row for one in said for row in one["beats"]], dtype=np.float64)
        beats = Beats.of(rows.reshape(-1, len(BEAT_COLUMNS)).T)
        windows = np.asarray([row for one in said for row in one["windows"]], dtype=np.float64)
        warm = dict(zip(_WINDOW, windows.reshape(-1, len(_WINDOW)).T, strict=True)) if windows.size else {}
        plain = {name: _tupled(value) for name, value in said[-1]["fields"].items()}
        fields: dict[str, Any] = {**samples, **plain, **warm, "complete": False, "fault": CUT_OFF}
        return Session(beats=beats, quiz=_quiz(said[-1]["quiz"]), **fields)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise DamagedFileError(
            f"{path} does not say what was pressed: {error}", path=path, artefact="session"
        ) from error


def _quiz(said: Mapping[str, Any] | None) -> Quiz | None:
    if said is None:
        return None
    times = {"response_s": np.asarray(said["response_s"], dtype=np.float64)}
    return Quiz(**{name: _tupled(value) for name, value in said.items()} | times)


def _tupled(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
