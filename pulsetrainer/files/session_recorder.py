"""A session that is on disk while it is pressed: killed at any moment, it is readable as far as it went."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from pulsetrainer.artefacts import Session
from pulsetrainer.files.journal import BEAT, CUT_OFF, GOAL, PRESSED, WINDOW
from pulsetrainer.files.provenance import Header
from pulsetrainer.files.recorder import RunRecorder


class SessionRecorder(RunRecorder):
    """Writes a session batch by batch into a journal: samples, their targets, and the beats that are over.

    A batch has the columns ``journal.PRESSED``, (n,) in s, N, A, A and N; ``judge`` comes first.
    All else is as in ``RunRecorder``.
    """

    _kind = Session
    _columns = PRESSED
    _tag = GOAL

    def __init__(self, *args: Any, **options: Any) -> None:
        self._fields: Mapping[str, Any] = {}
        self._beats = self._windows = 0  # that are written
        super().__init__(*args, **options)

    def judge(self, fields: Mapping[str, Any]) -> None:
        """Take in what the session amounts to so far, its fields that are no samples; fails as ``append``."""
        beats, quiz = fields["beats"], fields["quiz"]
        rows = beats.columns.T[self._beats :]
        told = [np.zeros(0) if fields[name] is None else fields[name] for name in WINDOW]
        windows = np.stack(told, axis=1)[self._windows :]
        plain = {name: value for name, value in fields.items() if name not in ("beats", "quiz", *WINDOW)}
        asked = None if quiz is None else asdict(quiz) | {"response_s": quiz.response_s.tolist()}
        said = {"beats": rows.tolist(), "windows": windows.tolist(), "fields": plain, "quiz": asked}
        self._beats, self._windows = self._beats + len(rows), self._windows + len(windows)
        self._add(BEAT, json.dumps(said).encode())
        self._fields = {**fields, "fault": CUT_OFF}

    def keep(self, fields: Mapping[str, Any], header: Header) -> None:
        """Take in what the whole session was, and what the artefact says about itself."""
        self._fields, self._header = fields, header

    def forget(self) -> None:
        """Take what was recorded for nothing: a block that ends with an error then leaves no file."""
        self.samples = 0

    def _known_fields(self) -> dict[str, Any]:
        return dict(self._fields)
