"""A session that is on disk while it is pressed: killed at any moment, it is readable as far as it went."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pulsetrainer.artefacts import FloatArray, Session
from pulsetrainer.errors import DataError
from pulsetrainer.files.atomic_write import cannot_write
from pulsetrainer.files.journal import BEAT, COLUMNS, GOAL, Block
from pulsetrainer.files.provenance import Header
from pulsetrainer.files.recorder import RunRecorder
from pulsetrainer.files.session_journal import CUT_OFF, SessionWriter


class SessionRecorder(RunRecorder):
    """Writes a session batch by batch into a journal: samples, their targets, and the beats that are over.

    ``judge`` comes before the first samples. Parameters, use and errors are those of ``RunRecorder``.
    """

    _kind = Session
    _columns = (*COLUMNS, "target")
    _ends_a_piece = (GOAL,)

    def __init__(self, *args: Any, **options: Any) -> None:
        self._fields: Mapping[str, Any] = {}
        self._writer = SessionWriter()
        super().__init__(*args, **options)

    def press(
        self,
        time_s: FloatArray,
        target: FloatArray,
        reference: FloatArray,
        current: FloatArray,
        force: FloatArray,
        /,
    ) -> None:
        """Append a batch, arrays (n,) in s, N, A, A and N, as ``append`` does: it survives the program."""
        self.append(time_s, reference, current, force)
        self._add(GOAL, np.asarray(target, dtype="<f8").tobytes())

    def judge(self, fields: Mapping[str, Any]) -> None:
        """Take in what the session amounts to so far, its fields that are no samples; fails as ``append``."""
        self._add(BEAT, self._writer.block(fields))
        self._fields = {**fields, "fault": CUT_OFF}

    def keep(self, fields: Mapping[str, Any], header: Header) -> None:
        """Take in what the whole session was, and what the artefact says about itself."""
        self._fields, self._header = fields, header

    def _add(self, tag: bytes, content: bytes) -> None:
        try:
            self._journal.append(tag, content, self.dropped_samples)
        except OSError as error:
            raise cannot_write(self.partial, error) from error

    def _known_fields(self) -> dict[str, Any]:
        return dict(self._fields)

    def _rows(self, blocks: list[Block]) -> FloatArray:
        samples, targets = super()._rows(blocks), np.concatenate([block.targets for block in blocks])
        if targets.size != samples.shape[1]:
            raise DataError(f"{self.partial} lacks the last targets", hint="it can be read as it is")
        return np.vstack((samples, targets))
