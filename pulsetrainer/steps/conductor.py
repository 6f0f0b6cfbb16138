"""The conductor: turns decisions, a beat at a time, into the current of a session, with pauses to cool.

A part of a session is what the device plays in one go: once around the major loop, up to the foot of the
first beat, beats, down again. A change of anything takes effect at the next beat; where the feet of
two beats differ, the second begins at the level of the first and finds its own within ``BLEND_S``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.core.heartbeat import Pulse
from pulsetrainer.core.learning import BAND_HZ
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.rhythm import Rhythm
from pulsetrainer.device.codes import HEAT_TAU_S
from pulsetrainer.device.heat import added
from pulsetrainer.steps.drive_layout import RAMP_S
from pulsetrainer.steps.invert import DEVICE_SLEW_A_PER_S
from pulsetrainer.steps.invertible import major_loop

if TYPE_CHECKING:
    from pulsetrainer.diagnosis.extended import Extended

RATE_HZ = 1000.0
BLEND_S = 0.15
HOT, COOL = 0.95, 0.75  # of the heat at which the device stops: where a session pauses, and goes on
REST_S = 0.25  # of a pause, between two looks whether it is over
MARGIN_S = 1.0  # before the device's on-time ends


@dataclass(frozen=True, slots=True)
class Play:
    """The decision to play a beat."""

    pulse: int  # number of the pulse
    amplitude: float = 1.0  # of the reach
    bpm: float | None = None  # None: the pulse's own rate
    cut_s: float = np.inf  # time after which even a beat under way ends: a question ends on time

    def changed(self, pulse: int | None, amplitude: float | None, bpm: float | None) -> Play:
        """Return the decision with these in the place of its own; None: as it is."""
        return replace(
            self,
            pulse=self.pulse if pulse is None else pulse,
            amplitude=self.amplitude if amplitude is None else amplitude,
            bpm=self.bpm if bpm is None else bpm,
        )


@dataclass(frozen=True, slots=True)
class Rest:
    """The decision to let the finger rest."""

    seconds: float = REST_S


Decision = Play | Rest | None  # None: the end
Decide = Callable[[int, float], Decision]


@dataclass(frozen=True, slots=True)
class Reach:
    """The forces between which a pulse of full amplitude moves."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Beat:
    """A beat that was given out: where it is, and what was asked."""

    start_s: float
    interval_s: float
    first: int  # number of its first sample
    count: int
    play: Play
    in_record: int
    strength: float
    whole: bool = True  # False: it was cut, so that a question ends on time


@dataclass(frozen=True, slots=True)
class Given:
    """A piece of current with the force it is for; without a beat it is on the way, or rest."""

    first: int
    input: FloatArray
    target: FloatArray
    predicted: FloatArray
    beat: Beat | None = None


@dataclass(frozen=True, slots=True)
class Pause:
    """A rest that nobody asked for: the coil has to cool."""

    at_s: float
    seconds: float

    def __str__(self) -> str:
        return f"a pause of {self.seconds:.0f} s after {self.at_s:.0f} s, to let the coil cool"


@dataclass(frozen=True, slots=True)
class _Place:
    """Where the next beat begins."""

    number: int
    start_s: float
    force: float  # at the end of the beat before
    pulse: int = -1
    in_record: int = -1


class Conductor:
    """Makes the current of a session; ``give`` gets every piece of it before it is played.

    ``decide`` is asked for the beat with a number that begins at a time, s. The same beat is asked for twice:
    to know what comes ahead, and when it is its turn; the second answer counts. ``heat`` is that of the coil
    at the start, of the limit, ``heated`` the heat (n,) that a current (n,) at a rate gives a cold coil.
    ``loss`` is the share of the force that is lost beyond what the model knows, asked for each piece: the
    target is raised by it.
    """

    def __init__(
        self,
        extended: Extended,
        pulses: Sequence[Pulse],
        reach: Reach,
        rhythm: Rhythm,
        decide: Decide,
        give: Callable[[Given], None],
        *,
        heat: float = 0.0,
        heated: Callable[[FloatArray, float], FloatArray] = added,
        cooling_s: float = HEAT_TAU_S,
        loss: Callable[[], float] = lambda: 0.0,
    ) -> None:
        from pulsetrainer.diagnosis.piecewise import Piecewise

        self._pulses, self._reach, self._rhythm = tuple(pulses), reach, rhythm
        self._decide, self._give = decide, give
        self._inverse = Piecewise(extended, 1.0 / RATE_HZ, slew_per_s=DEVICE_SLEW_A_PER_S, band_Hz=BAND_HZ)
        self._static = extended.static
        self._rest_force = extended.polarity * extended.static.saturation[0]
        self._heat, self._heated, self._cooling_s = heat, heated, cooling_s
        self._loss = loss
        self._samples = 0
        self._number = 0
        self.clipped = 0
        self.ended = False
        self.idle = True  # the part holds neither a beat nor a rest
        self.pauses: list[Pause] = []

    @property
    def time_s(self) -> float:
        """Time of the next sample since the session began, without the gaps between parts."""
        return self._samples / RATE_HZ

    def part(self, longest_s: float) -> Iterator[FloatArray]:
        """Yield the currents (n,) in A of a part of at most ``longest_s``; it ends at rest."""
        until = self._samples + round((longest_s - MARGIN_S) * RATE_HZ)
        self.idle = True
        yield self._played(major_loop(self._static.low, self._static.high, RATE_HZ))
        place: _Place | None = None  # None: at rest
        while True:
            decision = self._decide(self._number, place.start_s if place else self.time_s + RAMP_S)
            self.ended = decision is None
            over = self._is_over(decision, place, until)
            if not isinstance(decision, Play) or over or self._heat > HOT:
                if place is not None:
                    yield self._down(place)
                    place = None
                if decision is None or over:
                    return
                self.idle = False
                left_s = (until - self._samples) / RATE_HZ  # the next part decides anew
                yield self._rest(
                    min(decision.seconds, left_s) if isinstance(decision, Rest) else self._cooling(left_s)
                )
                continue
            self.idle = False
            if place is None:
                current, place = self._up(decision)
                yield current
            current, place = self._beat(decision, place)
            yield current

    def _is_over(self, decision: Decision, place: _Place | None, until: int) -> bool:
        """Whether there is no time left in this part for what was decided, and for the way down."""
        seconds = RAMP_S + REST_S
        if isinstance(decision, Play):
            way = place or _Place(self._number, self.time_s, 0.0)
            seconds += self._interval(decision, way)[1] + (0.0 if place else RAMP_S)
        return self._samples + seconds * RATE_HZ > until

    def _cooling(self, longest_s: float) -> float:
        seconds = min(self._cooling_s * float(np.log(self._heat / COOL)), longest_s)
        self.pauses.append(Pause(self.time_s, seconds))
        return seconds

    # --- pieces ------------------------------------------------------------------------------------

    def _played(self, current: FloatArray) -> FloatArray:
        predicted = self._inverse.play(current)
        return self._given(current, predicted, predicted)

    def _given(
        self, current: FloatArray, target: FloatArray, predicted: FloatArray, beat: Beat | None = None
    ) -> FloatArray:
        self._give(Given(self._samples, current, target, predicted, beat))
        self._samples += current.size
        left = float(np.exp(-current.size / (RATE_HZ * self._cooling_s)))
        self._heat = self._heat * left + float(self._heated(current, RATE_HZ)[-1])
        return current

    def _rest(self, seconds: float) -> FloatArray:
        return self._played(np.full(max(round(seconds * RATE_HZ), 1), self._static.low))

    def _up(self, play: Play) -> tuple[FloatArray, _Place]:
        count = round(RAMP_S * RATE_HZ)
        place = _Place(self._number, (self._samples + count) / RATE_HZ, 0.0)
        foot = float(self._force(play, place, np.zeros(1))[0])
        place = replace(place, force=foot)
        rise = self._rest_force + (foot - self._rest_force) * _smooth(np.arange(count) / count)
        return self._inverted(rise, self._target(play, place, self._samples + count)[0]), place

    def _down(self, place: _Place) -> FloatArray:
        current = self._inverted(self._fall(place.force), np.full(self._inverse.reach, self._rest_force))
        return np.append(current, self._played(np.asarray([self._static.low])))

    def _fall(self, force: float) -> FloatArray:
        count = round(RAMP_S * RATE_HZ)
        return force + (self._rest_force - force) * _smooth(np.arange(count) / count)

    def _inverted(self, target: FloatArray, ahead: FloatArray, beat: Beat | None = None) -> FloatArray:
        left = 1.0 - self._loss()
        rest = self._rest_force
        piece = self._inverse.next(rest + (target - rest) / left, rest + (ahead - rest) / left)
        if beat is not None:
            self.clipped += piece.clipped
        return self._given(piece.input, target, rest + (piece.predicted - rest) * left, beat)

    def _beat(self, play: Play, place: _Place) -> tuple[FloatArray, _Place]:
        target, beat, then = self._target(play, place, self._samples)
        self._number += 1
        coming = self._decide(self._number, then.start_s)
        if isinstance(coming, Play):
            ahead = self._target(coming, then, self._samples + target.size)[0]
        else:
            ahead = self._fall(then.force)
        if ahead.size < self._inverse.reach:
            ahead = np.append(ahead, np.full(self._inverse.reach - ahead.size, ahead[-1]))
        return self._inverted(target, ahead, beat), then

    # --- a beat ------------------------------------------------------------------------------------

    def _interval(self, play: Play, place: _Place) -> tuple[int, float, float]:
        """Which beat of the record it is, how long it lasts in s, and how strong it is."""
        pulse = self._pulses[play.pulse]
        at = (place.in_record + 1) % pulse.beats if play.pulse == place.pulse else 0
        timing = self._rhythm.timing(place.number, place.start_s)
        own = pulse.own_interval_s(at) * (pulse.own_bpm / play.bpm if play.bpm else 1.0)
        return at, own * timing.interval, timing.strength

    def _force(self, play: Play, place: _Place, level_at: FloatArray) -> FloatArray:
        at, interval_s, strength = self._interval(play, place)
        level = self._pulses[play.pulse].level(at, interval_s, level_at)
        return self._reach.low + (self._reach.high - self._reach.low) * play.amplitude * strength * level

    def _target(self, play: Play, place: _Place, first: int) -> tuple[FloatArray, Beat, _Place]:
        """Return the force (n,) of a beat from sample ``first`` on, and where the next one begins."""
        at, interval_s, strength = self._interval(play, place)
        end_s = min(place.start_s + interval_s, max(play.cut_s, place.start_s + 2.0 / RATE_HZ))
        last = int(np.ceil(end_s * RATE_HZ - 1e-6))
        since = np.arange(first, last) / RATE_HZ - place.start_s
        step = place.force - float(self._force(play, place, np.zeros(1))[0])

        def force(since_s: FloatArray) -> FloatArray:
            blend = 1.0 - _smooth(np.clip(since_s / min(BLEND_S, interval_s), 0.0, 1.0))
            return self._force(play, place, since_s) + step * blend

        end = float(force(np.asarray([end_s - place.start_s]))[0])
        then = _Place(place.number + 1, end_s, end, play.pulse, at)
        whole = end_s == place.start_s + interval_s
        beat = Beat(place.start_s, end_s - place.start_s, first, since.size, play, at, strength, whole)
        return force(since), beat, then


def _smooth(share: FloatArray) -> FloatArray:
    """From 0 to 1 without a jump of the slope."""
    return np.asarray(share**2 * (3.0 - 2.0 * share))
