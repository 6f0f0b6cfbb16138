"""A session that is on disk while it is pressed: killed at any moment, it is readable as far as it went."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pulsetrainer.artefacts import Session
from pulsetrainer.files.journal import BEAT, GOAL, PRESSED
from pulsetrainer.files.provenance import Header
from pulsetrainer.files.recorder import RunRecorder
from pulsetrainer.files.session_journal import CUT_OFF, SessionWriter


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
        self._writer = SessionWriter()
        super().__init__(*args, **options)

    def judge(self, fields: Mapping[str, Any]) -> None:
        """Take in what the session amounts to so far, its fields that are no samples; fails as ``append``."""
        self._add(BEAT, self._writer.block(fields))
        self._fields = {**fields, "fault": CUT_OFF}

    def keep(self, fields: Mapping[str, Any], header: Header) -> None:
        """Take in what the whole session was, and what the artefact says about itself."""
        self._fields, self._header = fields, header

    def forget(self) -> None:
        """Take what was recorded for nothing: a block that ends with an error then leaves no file."""
        self._samples = 0

    def _known_fields(self) -> dict[str, Any]:
        return dict(self._fields)
