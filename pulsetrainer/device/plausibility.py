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

import numpy as np

from pulsetrainer.device.trace import FloatArray

WINDOW_S = 5.0  # looked at together: some beats of a slow pulse
STEP_S = 0.5  # looked at again after so long
_LEAST_S = 0.5  # less says nothing

# Major loop: the least force at a current held or exceeded, the most at a current held or fallen below.
_CURRENT_A = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5)
_RISING_N = (0.0, 0.6, 1.9, 6.1, 10.4, 11.9, 12.7)
_FALLING_N = (1.1, 2.6, 8.2, 10.8, 12.2, 13.2, 13.9)
_LEAST_GAIN, _MOST_GAIN = 0.4, 1.6  # of what is plausible; drawn devices lie within 0.9 and 1.1
_OFFSET_N = 0.5  # noise of three times the usual, a drifted zero
_SETTLES_S = 0.05  # delays and lags are below that: the force may still belong to a current of so long ago
_OUTSIDE_S = 0.1  # at least half of so long outside: single wild samples are none of this

# The slope of the force over the current, cov(i, F) / var(i), over so long and at so much rms of the current.
# The drawn devices have 1.8 N/A at least over 1 s, 1.4 N/A over 3 s and more.
_SLOPES = ((1.0, 0.1), (WINDOW_S, 0.05))
_LEAST_SLOPE_N_PER_A = 0.5
# A force that swings by more than noise does is that of a living sensor, whatever its slope: a finger that
# rings is behind the current by half a period and more. Three times the usual noise is 0.13 N.
_SWING_N = 0.15
_OVER_NOISE = 3.0
_MIRRORED = 0.7  # correlation with the current, negative: no lag, but a sensor the wrong way round

_MODEL_FACTOR, _MODEL_OFFSET_N = 2.0, 1.5

# One drive pressed again presses the same, from its second beat on. Means over 50 ms of drawn devices (seeds
# 1 to 10, six pulses to 0.4, 0.8 and 1.4 A, up to three times the usual noise) differ by 0.14 N at most; a
# finger may move a little besides.
_REPEAT_S = 0.05
_REPEAT_N = 0.5

# A reading that does not change by one count: under a current that went a long way, or of a sensor whose
# noise otherwise shows in every other sample.
_STUCK_PATH_A = 1.0
_STUCK_SPAN_A = 0.1
_STUCK_S = 0.1
_FEW = 20  # samples, at low rates: neither noise nor a wild sample is that persistent
_NOISY = 0.4  # share of the samples that are turning points: 2/3 in white noise
_RAIL_N = 5.0  # from here on the amplifier may be at its end: a flat top is a matter for `diagnose`
_FLAT = 0.05  # share of the samples at the very top that make it flat


def judge_force(time_s: FloatArray, current_A: FloatArray, force_N: FloatArray) -> str:
    """Return what is wrong with the force of a window, shapes (n,); empty if it is plausible.

    Time in s, rising; current in A, force in N. Missing samples are simply left out.
    """
    if time_s.size < 2 or time_s[-1] - time_s[0] < _LEAST_S:
        return ""
    return (
        _stuck(time_s, current_A, force_N)
        or _dead(time_s, current_A, force_N)
        or _outside(time_s, current_A, force_N)
    )


def _stuck(time_s: FloatArray, current_A: FloatArray, force_N: FloatArray) -> str:
    """Not one count of change where there should be some."""
    changes = np.flatnonzero(np.diff(force_N)) + 1
    starts, ends = np.append(0, changes), np.append(changes, force_N.size)
    longest = int(np.argmax(ends - starts))
    start, end = int(starts[longest]), int(ends[longest])
    held_N, still = float(force_N[start]), current_A[start:end]
    if held_N >= _RAIL_N and held_N >= force_N.max() and end - start < force_N.size:
        return ""
    noisy = _turns(np.delete(force_N, np.s_[start:end])) > _NOISY
    too_long = noisy and end - start >= _FEW and time_s[end - 1] - time_s[start] >= _STUCK_S
    too_far = np.abs(np.diff(still)).sum() >= _STUCK_PATH_A and np.ptp(still) >= _STUCK_SPAN_A
    if not (too_long or too_far):
        return ""
    return (
        f"force reading frozen at {held_N:.2f} N while the current moves between {still.min():.2f} "
        f"and {still.max():.2f} A"
    )


def _turns(values: FloatArray) -> float:
    """Share of the samples above or below both neighbours: 2/3 for noise, near 0 for what is smooth."""
    steps = np.diff(values)
    return float(np.mean(steps[1:] * steps[:-1] < 0)) if steps.size > 1 else 0.0


def _dead(time_s: FloatArray, current_A: FloatArray, force_N: FloatArray) -> str:
    """The force does not go with the current."""
    for seconds, moves_A in _SLOPES:
        begin = int(np.searchsorted(time_s, time_s[-1] - seconds))
        current, force = current_A[begin:], force_N[begin:]
        at_rail = force >= max(float(force.max()), _RAIL_N)
        if np.mean(at_rail) > _FLAT:
            current, force = current[~at_rail], force[~at_rail]
        if force.size < 2:
            continue
        moved = float(np.var(current))
        if moved < moves_A**2:
            continue
        slope = float(np.mean((current - current.mean()) * force)) / moved
        mirrored = slope * np.sqrt(moved) < -_MIRRORED * float(np.std(force))
        if slope < _LEAST_SLOPE_N_PER_A and (mirrored or not _swings(force)):
            return (
                f"the force reading does not follow the current: {slope:.2f} N/A while it moves between "
                f"{current.min():.2f} and {current.max():.2f} A"
            )
    return ""


def _swings(force_N: FloatArray) -> bool:
    """Whether the force does more than its noise, whose rms is that of second differences over sqrt(6)."""
    noise = float(np.sqrt(np.mean(np.diff(force_N, 2) ** 2) / 6.0)) if force_N.size > 2 else 0.0
    return float(np.std(force_N)) >= max(_SWING_N, _OVER_NOISE * noise)


def _outside(time_s: FloatArray, current_A: FloatArray, force_N: FloatArray) -> str:
    """The force lies outside what the currents of the last moments can leave."""
    least, most = _recent(time_s, current_A)
    low = settled_least(least)
    high = _MOST_GAIN * np.interp(most, _CURRENT_A, _FALLING_N) + _OFFSET_N
    at = _first_outside(time_s, force_N, low, high)
    if at is None:
        return ""
    return (
        f"the force reading of {np.median(force_N[at]):.2f} N is implausible at "
        f"{np.median(current_A[at]):.2f} A: between {np.median(low[at]):.1f} and {np.median(high[at]):.1f} N "
        "would be plausible"
    )


def least_force(current_A: FloatArray, rate_Hz: float) -> FloatArray:
    """Return the force (n,) in N below which a reading would be implausible, for a current (n,) in A."""
    least, _ = _recent(np.arange(current_A.size) / rate_Hz, current_A)
    return settled_least(least)


def settled_least(current_A: FloatArray) -> FloatArray:
    """Return the same for currents (n,) that have stood: no current that peaks there gives a higher one."""
    return _LEAST_GAIN * np.interp(current_A, _CURRENT_A, _RISING_N) - _OFFSET_N


def judge_against(time_s: FloatArray, expected_N: FloatArray, force_N: FloatArray) -> str:
    """Return what is wrong with a force, shapes (n,), that a model has foretold; empty if it is plausible.

    A force within a factor of two of what was expected, and 1.5 N, is plausible: a tenth of the sensor's
    range, more than a compensated drive ever leaves. NaN marks samples that were lost.
    """
    there = np.isfinite(force_N) & np.isfinite(expected_N)
    if np.count_nonzero(there) < 2:
        return ""
    time, force = time_s[there], force_N[there]
    least, most = _recent(time, expected_N[there])
    low = np.minimum(least / _MODEL_FACTOR, least * _MODEL_FACTOR) - _MODEL_OFFSET_N
    high = np.maximum(most / _MODEL_FACTOR, most * _MODEL_FACTOR) + _MODEL_OFFSET_N
    at = _first_outside(time, force, low, high)
    if at is None:
        return ""
    return (
        f"the force reading of {np.median(force[at]):.2f} N at {time[at][0]:.2f} s is far from the "
        f"{np.median(expected_N[there][at]):.2f} N that the model predicts"
    )


def judge_repeat(time_s: FloatArray, earlier_N: FloatArray, force_N: FloatArray) -> str:
    """Return where a force, shapes (n,), is not that of the same drive a repeat earlier; empty if it is.

    It finds the sensor that dies in the last moments of a play, where little else moves. To be left out is
    what follows a rest, where the state before still shows. NaN marks samples that were lost.
    """
    there = np.isfinite(earlier_N) & np.isfinite(force_N)
    width = max(1, round(_REPEAT_S / float(np.median(np.diff(time_s)))))
    if np.count_nonzero(there) < width:
        return ""
    time, mean = time_s[there][width - 1 :], np.ones(width) / width
    earlier, force = (np.convolve(values[there], mean, "valid") for values in (earlier_N, force_N))
    away = np.abs(force - earlier)
    at = int(np.argmax(away))
    if away[at] <= _REPEAT_N:
        return ""
    return (
        f"the force reading of {force[at]:.2f} N at {time[at]:.2f} s was {earlier[at]:.2f} N when the same "
        "drive was played before"
    )


def _recent(time_s: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the least and the most of what a lagging force may still belong to, at each sample."""
    width = max(1, round(_SETTLES_S / float(np.median(np.diff(time_s))))) if time_s.size > 1 else 1
    back = (width - 1) // 2  # the filter's window then ends at the sample itself
    from scipy.ndimage import maximum_filter1d, minimum_filter1d  # noqa: PLC0415 - what plays nothing waits

    return (
        minimum_filter1d(values, width, mode="nearest", origin=back),
        maximum_filter1d(values, width, mode="nearest", origin=back),
    )


def _first_outside(
    time_s: FloatArray, force_N: FloatArray, low_N: FloatArray, high_N: FloatArray
) -> slice | None:
    """Return the first stretch of 0.1 s of which at least half lies outside."""
    out = (force_N < low_N) | (force_N > high_N)
    out &= time_s >= time_s[0] + _SETTLES_S  # of what came before nothing is known
    run = max(_FEW, round(_OUTSIDE_S / float(np.median(np.diff(time_s)))))
    if out.size < run:
        return None
    counts = np.convolve(out, np.ones(run), "valid")
    first = int(np.argmax(2 * counts >= run))
    return slice(first, first + run) if 2 * counts[first] >= run else None


class ForceWatch:
    """Judges the force while it comes in; ``fault`` is the first that was found."""

    def __init__(self) -> None:
        self.fault = ""
        self._window = np.empty((3, 0))
        self._judge_at_s = WINDOW_S / 2  # the start of a play has too little before it to be judged alone

    def add(self, time_s: FloatArray, current_A: FloatArray, force_N: FloatArray) -> None:
        """Take in samples, shapes (n,), time rising from one call to the next."""
        fresh = np.stack((time_s, current_A, force_N))
        while fresh.shape[1]:
            count = int(np.searchsorted(fresh[0], self._judge_at_s))
            begin = int(np.searchsorted(self._window[0], self._judge_at_s - WINDOW_S))
            self._window = np.concatenate((self._window[:, begin:], fresh[:, :count]), axis=1)
            fresh = fresh[:, count:]
            if fresh.shape[1]:
                self.finish()
                self._judge_at_s += STEP_S

    def finish(self) -> str:
        """Judge the last of what came; return the fault."""
        self.fault = self.fault or judge_force(*self._window)
        return self.fault
