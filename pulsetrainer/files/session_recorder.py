"""A session that is on disk while it is pressed: killed at any moment, it is readable as far as it went."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

from pulsetrainer.artefacts import FloatArray, Session
from pulsetrainer.errors import DataError
from pulsetrainer.files import journal, store
from pulsetrainer.files.atomic_write import cannot_write
from pulsetrainer.files.encode import Later
from pulsetrainer.files.provenance import Header
from pulsetrainer.files.recorder import RunRecorder
from pulsetrainer.files.schema import plan_of
from pulsetrainer.files.session_journal import CUT_OFF, SessionWriter

_COLUMNS = ("time_s", "reference", "input", "output")  # as a run's
_COPIED_SAMPLES = 1 << 16  # at a time


class SessionRecorder(RunRecorder):
    """Writes a session batch by batch into a journal: samples, their targets, and the beats that are over.

    ``judge`` comes before the first samples. Parameters, use and errors are those of ``RunRecorder``.
    """

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
        """Append a batch, arrays (n,) in s, N, A, A and N; when this returns, it survives the program.

        Raises
        ------
        ArgumentError, DataError
            As ``append``.
        """
        self.append(time_s, reference, current, force)
        self._add(journal.GOAL, np.asarray(target, dtype="<f8").tobytes())

    def judge(self, fields: Mapping[str, Any]) -> None:
        """Take in what the session amounts to so far: its fields that are no samples.

        Raises
        ------
        DataError
            The disk is full or failed.
        """
        self._add(journal.BEAT, self._writer.block(fields))
        self._fields = {**fields, "fault": CUT_OFF}

    def keep(self, fields: Mapping[str, Any], header: Header) -> None:
        """Take in what the whole session was, and what the artefact says about itself."""
        self._fields, self._header = fields, header

    def _add(self, tag: bytes, content: bytes) -> None:
        try:
            self._journal.append(tag, content, self.dropped_samples)
        except OSError as error:
            raise cannot_write(self.partial, error) from error

    def _convert(self) -> None:
        samples = dict.fromkeys((*_COLUMNS, "target"), Later(self._samples))
        defaults = {plan.name: plan.default for plan in plan_of(Session)}
        ending = {"complete": self._complete, "dropped_samples": self.dropped_samples}
        values = {**defaults, **self._fields, **samples, **ending}
        store.write_fields(
            self._final, Session, values, self._header, overwrite=self._overwrite, fill=self._fill_session
        )

    def _fill_session(self, file: h5py.File) -> None:
        paths = {plan.name: plan.path for plan in plan_of(Session)}
        start, kept, goals = 0, [np.zeros((len(_COLUMNS), 0))], [np.zeros(0)]
        for block in itertools.chain(journal.blocks(self.partial), [None]):
            if block is not None and block.tag == journal.GOAL:
                goals.append(np.frombuffer(block.content, dtype="<f8"))
            elif block is not None:
                kept.append(block.samples)
            count = sum(part.shape[1] for part in kept)
            complete = block is None or (block.tag == journal.GOAL and count >= _COPIED_SAMPLES)
            if not complete or count == 0:
                continue
            goal = np.concatenate(goals)
            if goal.size != count:
                raise DataError(f"{self.partial} lacks the last targets", hint="it can be read as it is")
            for name, values in zip(_COLUMNS, np.concatenate(kept, axis=1), strict=True):
                file[paths[name]][start : start + count] = values
            file[paths["target"]][start : start + count] = goal
            start, kept, goals = start + count, kept[:1], goals[:1]
