"""Does the force that a device reports fit the current that it reports? A second opinion beside its own.

The firmware trips on what is certainly wrong within milliseconds. Here a few seconds are looked at together,
so that a sensor is found that is dead, stuck or far from its gain while neither stroke nor force is large.

What is plausible is that of this solenoid and finger: between the rising and the falling branch of the major
loop lies every force that a current can leave. The branches below are the lowest and the highest force seen
at each current over ten drawn devices (seeds 1 to 10, six kinds of signal each); the thresholds were set on
them and judged on ten others, with three times the noise. They are wide: a gain wrong by less than a factor
of about two, or an offset below a newton, is the business of `diagnose` and `check`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

WINDOW_S = 5.0  # looked at together: some beats of a slow pulse
OVERLAP_S = 0.2  # carried into the next window, for what a force owes to the current just before
_LEAST_S = 0.5  # less says nothing

# Major loop: the least force at a current held or exceeded, the most at a current held or fallen below.
_CURRENT_A = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5)
_RISING_N = (0.0, 0.6, 1.9, 6.1, 10.4, 11.9, 12.7)
_FALLING_N = (1.1, 2.6, 8.2, 10.8, 12.2, 13.2, 13.9)
_LEAST_GAIN, _MOST_GAIN = 0.4, 1.6  # of what is plausible; drawn devices lie within 0.9 and 1.1
_OFFSET_N = 0.5  # noise of three times the usual, a drifted zero
_SETTLES_S = 0.1  # delays and lags are below that: the force may still belong to a current of so long ago
_SHARE = 0.5  # of the samples of 0.2 s that lie outside: single wild samples are none of this

_MOVES_A = 0.05  # rms of a current that moves enough for a slope
_LEAST_SLOPE_N_PER_A = 0.3  # drawn devices: 1.9 at least over 5 s
_STUCK_PATH_A = 1.0  # travelled by the current under a reading without one count of change
_STUCK_SPAN_A = 0.1


def judge_force(time_s: FloatArray, current_A: FloatArray, force_N: FloatArray) -> str:
    """Return what is wrong with the force of a window, shapes (n,); empty if it is plausible.

    Time in s, rising; current in A, force in N. Missing samples are simply left out.
    """
    if time_s.size < 2 or time_s[-1] - time_s[0] < _LEAST_S:
        return ""
    return _stuck(current_A, force_N) or _dead(current_A, force_N) or _outside(time_s, current_A, force_N)


def _stuck(current_A: FloatArray, force_N: FloatArray) -> str:
    """Not one count of change while the current went a long way."""
    borders = np.flatnonzero(np.diff(force_N)) + 1
    starts, ends = np.append(0, borders), np.append(borders, force_N.size)
    longest = int(np.argmax(ends - starts))
    still = current_A[starts[longest] : ends[longest]]
    if np.abs(np.diff(still)).sum() < _STUCK_PATH_A or np.ptp(still) < _STUCK_SPAN_A:
        return ""
    return (
        f"the force reading is stuck at {force_N[starts[longest]]:.2f} N "
        f"while the current moves between {still.min():.2f} and {still.max():.2f} A"
    )


def _dead(current_A: FloatArray, force_N: FloatArray) -> str:
    """The force does not go with the current: cov(i, F) / var(i)."""
    moved = float(np.var(current_A))
    if moved < _MOVES_A**2:
        return ""
    slope = float(np.mean((current_A - current_A.mean()) * force_N)) / moved
    if slope >= _LEAST_SLOPE_N_PER_A:
        return ""
    return (
        f"the force reading does not follow the current: {slope:.2f} N/A while the current moves between "
        f"{current_A.min():.2f} and {current_A.max():.2f} A"
    )


def _outside(time_s: FloatArray, current_A: FloatArray, force_N: FloatArray) -> str:
    """The force lies outside what the currents of the last moments can leave."""
    step = float(np.median(np.diff(time_s)))
    width = max(1, round(_SETTLES_S / step))
    back = (width - 1) // 2  # the filter's window then ends at the sample itself
    least = minimum_filter1d(current_A, width, mode="nearest", origin=back)
    most = maximum_filter1d(current_A, width, mode="nearest", origin=back)
    low = _LEAST_GAIN * np.interp(least, _CURRENT_A, _RISING_N) - _OFFSET_N
    high = _MOST_GAIN * np.interp(most, _CURRENT_A, _FALLING_N) + _OFFSET_N
    out = (force_N < low) | (force_N > high)
    out[: width - 1] = False  # of the currents before nothing is known
    run = max(1, round(OVERLAP_S / step))
    shares = np.convolve(out, np.full(run, 1.0 / run), "valid") if out.size >= run else np.zeros(1)
    worst = int(np.argmax(shares))
    if shares[worst] < _SHARE:
        return ""
    at = slice(worst, worst + run)
    return (
        f"the force reading of {np.median(force_N[at]):.2f} N is implausible at {np.median(current_A[at]):.2f} A: "
        f"between {np.median(low[at]):.1f} and {np.median(high[at]):.1f} N could be"
    )


class ForceWatch:
    """Judges the force while it comes in, window by window; ``fault`` is the first that was found."""

    def __init__(self) -> None:
        self.fault = ""
        self._rows = np.empty((3, 0))
        self._fresh_s = 0.0  # time up to which all has been judged

    def add(self, time_s: FloatArray, current_A: FloatArray, force_N: FloatArray) -> None:
        """Take in samples, shapes (n,); a window is judged when it is full."""
        self._rows = np.concatenate((self._rows, np.stack((time_s, current_A, force_N))), axis=1)
        while self._rows.shape[1] and self._rows[0, -1] >= self._rows[0, 0] + WINDOW_S:
            end = int(np.searchsorted(self._rows[0], self._rows[0, 0] + WINDOW_S))
            self._judge(self._rows[:, :end])
            # The rest of a play may be short: it is judged together with the end of this window.
            self._rows = self._rows[:, int(np.searchsorted(self._rows[0], self._rows[0, end - 1] - OVERLAP_S)) :]

    def finish(self) -> str:
        """Judge what is left; return the fault."""
        self._judge(self._rows)
        return self.fault

    def _judge(self, rows: FloatArray) -> None:
        self.fault = self.fault or judge_force(*rows)
