"""How true the beats of a session are, counted while it goes on; only one line per beat is kept.

Of each beat the force y (n,) is fitted to the target x (n,), moved, stretched and lifted,

    y = g x - d x' + c,

by least squares: g is the height pressed of that asked for, d how late the beat came.
"""

from __future__ import annotations

from array import array
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.artefacts.session import FIGURES, Beats
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.steps.conductor import RATE_HZ, Beat, Given

_ENOUGH = 0.9  # of a beat's samples must be there
_PHASES = 800  # of the mean beat
_SYSTOLE_S = 0.40  # at one beat a second, with the root of the interval
_STANDS_OUT = 0.02  # of the sharpest bend: a smaller one is no wave


@dataclass
class Ledger:
    """What was given out and not yet measured, and the sums of what was."""

    _given: deque[Given] = field(default_factory=deque)
    _measured: FloatArray = field(default_factory=lambda: np.zeros(0))  # of the first given piece
    _rows: array[float] = field(default_factory=lambda: array("d"))
    _means: dict[tuple[int, int], _MeanBeat] = field(default_factory=dict)
    _count: int = 0
    _absolute: float = 0.0
    _square: float = 0.0
    _largest: float = 0.0
    _sum: float = 0.0
    _low: float = np.inf
    _high: float = -np.inf
    _last: Given | None = None  # what was measured last belongs to it

    def give(self, given: Given) -> None:
        """Take in a piece that will be played."""
        self._given.append(given)
        if len(self._given) == 1:
            self._measured = np.full(given.input.size, np.nan)

    def measure(
        self, sample: NDArray[np.int64], force: FloatArray
    ) -> tuple[FloatArray, list[Given], list[FloatArray]]:
        """Take in forces (n,) at increasing sample numbers.

        Returns the targets (n,) of these samples, and the pieces that are over with what was measured.
        """
        target, done, measured, at = np.full(sample.size, np.nan), [], [], 0
        while at < sample.size and self._given:
            piece = self._given[0]
            end = piece.first + piece.input.size
            upto = int(np.searchsorted(sample, end))
            place = sample[at:upto] - piece.first
            target[at:upto] = piece.target[place]
            self._measured[place] = force[at:upto]
            self._last = piece
            at = upto
            if upto < sample.size or (upto and sample[upto - 1] == end - 1):
                done.append(piece)
                measured.append(self._measured)
                self._next(piece)
        return target, done, measured

    def _next(self, piece: Given) -> None:
        if piece.beat is not None:
            self._score(piece, piece.beat, self._measured)
        self._given.popleft()
        self._measured = np.full(self._given[0].input.size if self._given else 0, np.nan)

    def _score(self, piece: Given, beat: Beat, force: FloatArray) -> None:
        there = np.isfinite(force)
        x, y = piece.target, force
        error = np.abs(y - x)[there]
        gain = late = mean = most = np.nan
        if error.size:
            self._count += error.size
            self._absolute += float(error.sum())
            self._square += float((error**2).sum())
            self._largest = max(self._largest, float(error.max()))
            self._sum += float(x[there].sum())
            self._low, self._high = min(self._low, float(x.min())), max(self._high, float(x.max()))
        if error.size > max(_ENOUGH * x.size, 4):
            mean, most = float(error.mean()), float(error.max())
        if beat.whole and np.isfinite(mean):  # a few samples of a foot have neither height nor time
            slope = np.gradient(x) * RATE_HZ
            rows = np.stack((x, -slope, np.ones_like(x)))[:, there]
            gain, late, _ = np.linalg.lstsq(rows.T, y[there], rcond=None)[0].tolist()
            if there.all():
                key = beat.play.pulse, beat.in_record
                self._means.setdefault(key, _MeanBeat()).add(beat, x, y)
        asked = 100.0 * beat.play.amplitude * beat.strength
        self._rows.extend((beat.start_s, beat.interval_s, beat.play.pulse, asked, gain, late, mean, most))

    @property
    def under_way(self) -> Beat | None:
        """The beat that what is being measured belongs to, None of a stroke before beats and of a rest.

        On a busy computer all that was given out may be measured before more is: that is no rest.
        """
        piece = self._given[0] if self._given else self._last
        return piece.beat if piece else None

    def beats(self, unit: str) -> Beats:
        """Return every beat that is over."""
        return Beats.of(np.array(self._rows).reshape(-1, 8).T, unit)  # a copy: the rows go on growing

    @property
    def full_force(self) -> float:
        """Largest target of the beats."""
        return self._high if self._count else np.nan

    @property
    def mean_force(self) -> float:
        """Mean target of the beats."""
        return self._sum / self._count if self._count else np.nan

    def figures(self) -> dict[str, float]:
        """Return the figures of ``FIGURES``, and those that go with them; NaN where there is no beat."""
        if not self._count:
            return dict.fromkeys(FIGURES, np.nan)
        rows = np.asarray(self._rows).reshape(-1, 8)
        interval, gain, late = rows[:, 1], rows[:, 4], rows[:, 5]
        joined = np.isclose(rows[1:, 0], rows[:-1, 0] + interval[:-1], atol=0.5 / RATE_HZ)
        pressed = interval[:-1] / (interval[:-1] + np.diff(late))
        return {
            "rate_cv_percent": _cv_percent(pressed[joined]),
            "amplitude_cv_percent": _cv_percent(gain),
            "beat_timing_max_ms": 1e3 * _largest(np.abs(late)),
            "mean_abs_error_percent": 100.0 * self._absolute / self._count / self._high,
            "max_abs_error_percent": 100.0 * self._largest / self._high,
            "nrmse": float(np.sqrt(self._square / self._count)) / (self._high - self._low),
            "augmentation_index_error_percent": _largest(
                np.asarray([one.index_error_percent() for one in self._means.values()])
            ),
        }


class _MeanBeat:
    """The mean of a beat as asked and as pressed, over the phase."""

    def __init__(self) -> None:
        self._sums = np.zeros((2, _PHASES))
        self._count = 0
        self._interval = 0.0

    def add(self, beat: Beat, asked: FloatArray, pressed: FloatArray) -> None:
        """Take in one."""
        time_s = np.arange(beat.first, beat.first + beat.count) / RATE_HZ - beat.start_s
        phase = (np.arange(_PHASES) + 0.5) / _PHASES * beat.interval_s
        self._sums += [np.interp(phase, time_s, asked), np.interp(phase, time_s, pressed)]
        self._count += 1
        self._interval += beat.interval_s

    def index_error_percent(self) -> float:
        """Error of the augmentation index, % of the index; NaN where a beat has only one systolic wave.

        The index is the height of the late systolic wave over that of the early one, each above the foot
        (Kelly et al., Circulation 1989, 80, 1652-1659): the two sharpest bends of the target in systole.
        """
        asked, pressed = self._sums / self._count
        interval = self._interval / self._count
        step = interval / _PHASES
        bend = np.gradient(np.gradient(asked, step), step)
        systole = int(min(_SYSTOLE_S * np.sqrt(interval), 0.6 * interval) / step)
        lows = np.flatnonzero((bend[1:-1] < bend[:-2]) & (bend[1:-1] <= bend[2:])) + 1
        waves = [k for k in lows.tolist() if k < systole and bend[k] < _STANDS_OUT * bend.min()]
        if len(waves) < 2:
            return np.nan
        early, late = sorted(sorted(waves, key=lambda k: float(bend[k]))[:2])
        foot = int(np.argmin(asked[:early]))
        index = [float((y[late] - y[foot]) / (y[early] - y[foot])) for y in (asked, pressed)]
        return 100.0 * abs(index[1] / index[0] - 1.0)


def _cv_percent(values: FloatArray) -> float:
    there = values[np.isfinite(values)]
    return 100.0 * float(there.std() / there.mean()) if there.size > 1 else np.nan


def _largest(values: FloatArray) -> float:
    there = values[np.isfinite(values)]
    return float(there.max()) if there.size else np.nan
