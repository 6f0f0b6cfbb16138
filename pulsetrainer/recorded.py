"""Captures and sessions, written to a file while they are measured: the data survive if the program dies."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from pulsetrainer.artefacts import FloatArray, Model
from pulsetrainer.artefacts.session import Quiz
from pulsetrainer.core.course import Course
from pulsetrainer.core.pulses import Shape
from pulsetrainer.device.device import Device
from pulsetrainer.device.wording import FORCE_REMEDY
from pulsetrainer.errors import DeviceError, Interrupted, PulsetrainerError
from pulsetrainer.files.provenance import Header
from pulsetrainer.files.recorder import RunRecorder
from pulsetrainer.files.resume import Earlier
from pulsetrainer.files.session_recorder import SessionRecorder
from pulsetrainer.steps.capture import tally_of
from pulsetrainer.steps.conductor import Decide
from pulsetrainer.steps.performance import Performed
from pulsetrainer.steps.progress import Progress
from pulsetrainer.steps.quiz import Blind
from pulsetrainer.steps.recording import Watch, decimation_for, record
from pulsetrainer.steps.session import perform
from pulsetrainer.steps.steering import Steering
from pulsetrainer.steps.stopped import kept_in, raise_if_stopped


class Captured(NamedTuple):
    """What there is to say of a capture; its samples are in the file."""

    samples: int
    seconds: float
    rate_Hz: float
    reversals: int
    parts: int
    coverage_percent: float
    current_range_A: tuple[float, float]
    force_range_N: tuple[float, float]
    dropped_samples: int
    complete: bool


def capture_into(
    out: Path,
    header: Header,
    course: Course,
    device: Device,
    *,
    levels: int,
    earlier: Earlier | None,
    at: int,
    overwrite: bool,
    condition: bool,
    progress: Progress,
    watch: Watch | None,
) -> Captured:
    """Play a course from sample ``at`` on and record it into a file, or go on with one that was cut off.

    ArgumentError where the device cannot play the course; UsageError or DataError where the file is there
    already, or the disk is full or failed; DeviceError, Interrupted where the device or the user stopped it;
    the message says where the samples are.
    """
    signal = course.signal
    decimation_for(device.info.tick_rate_Hz, signal.rate_Hz)  # before anything is written
    tally, before, parts = tally_of(signal, levels), None, 0
    if earlier is not None:
        tally.take_over(earlier.run)
        before, parts = (earlier.path, earlier.run), len(earlier.run.parts())
        overwrite = overwrite or earlier.contains_final
    recorder = RunRecorder(out, header, signal=signal.name, overwrite=overwrite, earlier=before)
    try:
        with recorder:
            ending = record(
                course, device, recorder, tally,
                at=at, condition_first=condition, progress=progress, watch=watch,
            )  # fmt: skip
            recorder.coil = ending.coil
            recorder.finish(complete=ending.complete)
        raise_if_stopped(ending.fault, ending.remedy, "the capture")
    except (DeviceError, Interrupted, KeyboardInterrupt) as stopped:
        error = Interrupted("stopped by you") if isinstance(stopped, KeyboardInterrupt) else stopped
        if recorder.samples:
            where = recorder.partial if recorder.partial.exists() else out
            error.message += kept_in(where, recorder.samples, "sample")
            error.hint = _then(error.hint)
        raise error from stopped.__cause__
    return Captured(
        recorder.samples,
        recorder.end_s,
        signal.rate_Hz,
        course.reversals,
        parts + ending.parts,
        tally.coverage_percent,
        tally.current_A,
        tally.force_N,
        recorder.dropped_samples,
        ending.complete,
    )


def _then(remedy: str) -> str:
    """Return what to do about a capture that broke off, and whether to go on with what there is."""
    if "`" in remedy:  # it names options: with others it is another capture
        return remedy
    if remedy == FORCE_REMEDY:
        return f"{remedy}; then record again with --overwrite: the force recorded just before this was wrong"
    return (f"{remedy}; then " if remedy else "") + "continue with the same command and --resume"


def session_into(
    out: Path,
    begun: Header,
    header: Callable[[], Header],
    model: Model,
    device: Device,
    pulses: Sequence[Shape],
    decide: Decide,
    *,
    blind: Blind | None,
    overwrite: bool,
    **options: Any,
) -> tuple[Performed, Quiz | None]:
    """Press a session as ``perform`` does, with its ``options``, and record it into a file.

    The file has the header ``begun`` until the session is over, and then ``header``; of a quiz, ``blind``,
    it tells what was asked when that is answered.

    UsageError, DataError where the file is there already, the disk is full or failed, or the model cannot be
    used; DeviceError, Interrupted where it was stopped before a beat was over; after that the result says why
    it ended.
    """
    with SessionRecorder(out, begun, overwrite=overwrite, signal="session") as recorder:
        done = perform(model, device, pulses, decide, _Sink(recorder, blind, out.stem), **options)
        if done.fault and not done.beats.start_s.size:
            recorder.forget()
            try:
                raise_if_stopped(done.fault, done.remedy, "the session")
            except PulsetrainerError as error:
                error.message += f"; no beat was pressed, so {out} was not written"
                error.hint = error.hint or "run the command again"
                raise
        if isinstance(decide, Steering):
            done = replace(done, stopped_by_key=decide.stopped_by_key)
        quiz = blind.quiz(out.stem) if blind else None
        recorder.keep(done.fields | {"quiz": quiz}, header())
        recorder.dropped_samples = done.dropped_samples
        recorder.finish(complete=not done.fault)
    return done, quiz


class _Sink:
    """The file of a session, without what would tell the answer to a question of its quiz."""

    def __init__(self, recorder: SessionRecorder, blind: Blind | None, learner: str) -> None:
        self._recorder, self._blind, self._learner = recorder, blind, learner

    def append(self, *columns: FloatArray) -> None:
        self._recorder.append(*columns)

    def judge(self, fields: Mapping[str, Any]) -> None:
        told: dict[str, Any] = {"quiz": None}
        if self._blind is not None:
            told = {"quiz": self._blind.quiz(self._learner), "beats": self._blind.told(fields["beats"])}
        self._recorder.judge({**fields, **told})
