"""A session under way: what is sent to the device, what comes back, and what it amounts to so far."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any, Protocol

import numpy as np

from pulsetrainer.artefacts import Model
from pulsetrainer.artefacts.session import Beats
from pulsetrainer.core.heartbeat import Pulse
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.rhythm import Rhythm
from pulsetrainer.core.temperature import Thermometer
from pulsetrainer.device.device import Device
from pulsetrainer.device.follower import INTERRUPTED
from pulsetrainer.device.plausibility import judge_against
from pulsetrainer.device.trace import Block
from pulsetrainer.device.wording import FORCE_REMEDY
from pulsetrainer.diagnosis.prediction import extended_of
from pulsetrainer.errors import DeviceError
from pulsetrainer.steps.beat_errors import Ledger
from pulsetrainer.steps.conductor import RATE_HZ, Beat, Conductor, Decide, Reach
from pulsetrainer.steps.recording import PAUSE_S
from pulsetrainer.steps.stopped import in_part

# what is wrong where a part ends without a beat, and what to do
TOO_SHORT = ("the device stays on too short for one beat", "raise its on-time limit, or press shorter beats")
_NO_FIELDS = ("figures", "reach", "parts", "remedy")  # of the artefact, which has each figure by its name
_FOLLOW = 0.3  # of a new reading of the loss: a window of a second is noisier than the room


class Sink(Protocol):
    """Where a session goes while it is pressed."""

    def append(self, *columns: FloatArray) -> None:
        """Take in time, target, reference, current and force, (n,) in s, N, A, A and N."""

    def judge(self, fields: Mapping[str, Any], /) -> None:
        """Take in what the session amounts to so far: before the first samples, and after every beat."""


@dataclass(frozen=True, slots=True)
class Now:
    """What a screen may show while a session goes on."""

    time_s: float
    target: FloatArray  # (n,) N, the samples that came last
    current: FloatArray  # (n,) A
    force: FloatArray  # (n,) N
    beat: Beat | None  # the one that is under way
    leading: bool  # no beat of this part has come: the first stroke, or the rest before it or after it


@dataclass(frozen=True, slots=True)
class Performed:
    """How a session went, without its samples; all but ``_NO_FIELDS`` are fields of the artefact."""

    figures: dict[str, float]
    reach: Reach
    parts: int
    remedy: str
    beats: Beats
    full_force: float
    mean_force: float
    clipped_samples: int
    dropped_samples: int
    underruns: int
    fault: str
    notes: tuple[str, ...]
    pulses: tuple[str, ...]
    temperature_s: FloatArray | None = None  # where heat was tracked
    temperature_K: FloatArray | None = None  # against calibration
    stopped_by_key: str = ""  # where, in words

    @property
    def fields(self) -> dict[str, Any]:
        """Fields of the artefact that are neither samples nor a quiz."""
        own = {one.name: getattr(self, one.name) for one in fields(self) if one.name not in _NO_FIELDS}
        return self.figures | own | {"complete": not self.fault}


class Performance:
    """A session under way: what is given out, what comes back."""

    def __init__(
        self,
        model: Model,
        device: Device,
        pulses: Sequence[Pulse],
        rhythm: Rhythm,
        decide: Decide,
        sink: Sink,
        reach: Reach,
        watch: Callable[[Now], None],
        thermometer: Thermometer | None = None,
    ) -> None:
        self._device, self._sink, self._watch = device, sink, watch
        self._thermometer = thermometer
        self._loss = 0.0 if thermometer is None else thermometer.extra
        self._warmth: list[tuple[float, float]] = []  # s and K, of each window
        self._pulses = tuple(pulse.name for pulse in pulses)
        self._ledger = Ledger()
        self._reach = reach
        self._conductor = Conductor(
            extended_of(model), pulses, reach, rhythm, decide, self._ledger.give,
            heat=device.heat, loss=lambda: self._loss,
        )  # fmt: skip
        self._begun = 0  # sample at which the part began
        self._begins_s: list[float] = []  # of the parts, without the pauses between them
        self._next = 0  # sample that comes, where none is lost
        self._parts = self._dropped = self._underruns = 0
        self._taken = 0  # samples of the part that are kept
        self._fault = self._remedy = self._implausible = ""
        self._leading = True

    def run(self, lead_s: float) -> Performed:
        """Press part after part until the end is decided, or the device or the user stops it."""
        conductor, device = self._conductor, self._device
        decimation = round(device.info.tick_rate_Hz / RATE_HZ)
        self._sink.judge(self._so_far().fields)
        while not conductor.ended and not self._fault:
            dropped, self._taken, self._leading = self._dropped, 0, True
            self._begun = self._next = round(conductor.time_s * RATE_HZ)
            self._begins_s.append(conductor.time_s)
            if self._thermometer is not None:
                self._thermometer.begin_part()
            try:
                trace = device.stream(
                    partial(next, conductor.part(device.longest_play_s), None),
                    RATE_HZ,
                    lead_s=lead_s,
                    decimation=decimation,
                    on_block=lambda block: self._take(block, decimation),
                    should_stop=lambda: bool(self._implausible),
                )
            except KeyboardInterrupt:  # while the beginning of a part is made
                self._fault = INTERRUPTED
                break
            except DeviceError as error:  # between two parts: what was pressed is kept
                if not self._parts:
                    raise
                self._fault, self._remedy = error.message, error.hint
                break
            self._parts += 1
            # a Ctrl-C in the middle of writing costs what was being written
            self._dropped = dropped + trace.dropped_samples + trace.samples - self._taken
            begun_s = self._begins_s[-1] + PAUSE_S * (self._parts - 1)
            self._fault = in_part(trace.fault, begun_s)
            self._remedy, self._underruns = trace.remedy, int(trace.underrun)
            if self._implausible:
                self._fault, self._remedy = self._implausible, FORCE_REMEDY
            if not self._fault and not conductor.ended and conductor.idle:
                self._fault, self._remedy = TOO_SHORT
        return self._so_far()

    def _so_far(self) -> Performed:
        ledger = self._ledger
        warm = np.asarray(self._warmth).reshape(-1, 2).T if self._warmth else (None, None)
        return Performed(
            figures=ledger.figures(),
            reach=self._reach,
            parts=self._parts,
            remedy=self._remedy,
            beats=self._beats(),
            full_force=ledger.full_force,
            mean_force=ledger.mean_force,
            clipped_samples=self._conductor.clipped,
            dropped_samples=self._dropped,
            underruns=self._underruns,
            fault=self._fault,
            notes=tuple(map(str, self._conductor.pauses)),
            pulses=self._pulses,
            temperature_s=warm[0],
            temperature_K=warm[1],
        )

    def _beats(self) -> Beats:
        """Return the beats that are over, in the time of the samples: with the pauses between parts."""
        beats = self._ledger.beats("N")
        pauses = np.searchsorted(self._begins_s, beats.start_s, side="right") - 1
        return replace(beats, start_s=beats.start_s + PAUSE_S * pauses)

    def _take(self, block: Block, decimation: int) -> None:
        sample = self._begun + block.tick // decimation
        self._dropped += int(sample[-1]) + 1 - self._next - sample.size
        self._next = int(sample[-1]) + 1
        target, done, measured = self._ledger.measure(sample, block.force_N)
        measured_s, paused_s = float(sample[-1]) / RATE_HZ, PAUSE_S * self._parts
        meter = self._thermometer
        if meter is not None and meter.add(sample / RATE_HZ, block.reference_A, block.current_A, block.duty):
            self._loss += _FOLLOW * (meter.extra - self._loss)
            self._warmth.append((measured_s + paused_s, meter.temperature_K))
        self._sink.append(
            sample / RATE_HZ + paused_s, target, block.reference_A, block.current_A, block.force_N
        )
        self._taken += sample.size
        for piece, force in zip(done, measured, strict=True):
            if piece.beat is not None:
                time_s = (piece.first + np.arange(force.size)) / RATE_HZ
                self._implausible = self._implausible or judge_against(time_s, piece.predicted, force)
        if any(piece.beat is not None for piece in done):
            self._sink.judge(self._so_far().fields)
        beat = self._ledger.under_way
        self._leading = self._leading and beat is None
        now = Now(measured_s, target, block.current_A, block.force_N, beat, leading=self._leading)
        self._watch(now)
