"""The coil's temperature, told by the duty that its current needs: copper resists 0.39 % more per kelvin.

Over a window of a second the duty of the current loop is

    d = b + a r i + e di/dt,   a = R/(V + D),   b = D/(V + D),   e = L/(V + D)

with r the resistance over that of the cold coil at calibration. A capture tells a, b and e, and how r rises
with the heat of the current, r = 1 + c h, tau h' = i^2 - h; afterwards every window of a play tells r, and r
the temperature. The supply is taken to be that of the calibration.

Source: the resistance method of IEC 60034-1 for windings; 0.0039 / K is that of copper at room temperature.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pulsetrainer.core.plane import FloatArray

COPPER_PER_K = 0.0039
FORCE_PER_RESISTANCE = 0.5  # the force falls by half of what the resistance rises by, where no record tells
WINDOW_S = 1.0
_LEAST_A = 0.1  # below, the duty is diode and rounding
# Mean square of the current in a window that is believed at once. An error of b, a thousandth of the duty, is
# two kelvin at 0.3 A and five at 0.13 A, the foot of a pulse: such a window moves what is known little.
_FULL_A2 = 0.09
_LEAST_SAMPLES = 50
_LEAST_WINDOWS = 12
_TAUS_S = np.geomspace(4.0, 160.0, 24)
_CLEAR = 8.0  # standard deviations: a rise that is told from none
# Of the duty, at most what di/dt adds: e is known to a quarter where the current is fast, so this is 1 K.
_STEEP = 0.015
_SURE = 0.1  # relative standard deviation of a rise that may set the share of the force


@dataclass(frozen=True, slots=True)
class CoilRecord:
    """What a capture tells of the coil: duty over current when cold, and how it warms."""

    duty_per_A: float  # a, cold
    duty_offset: float  # b
    duty_s_per_A: float  # e
    rise_per_A2: float  # c; 0 where the record shows none
    rise_error_per_A2: float  # its standard deviation
    rise_tau_s: float


class Windows:
    """Cuts telemetry into windows, however it comes: sums of what the regressions need."""

    def __init__(self) -> None:
        self._held = np.empty((4, 0))
        self.rows: list[FloatArray] = []  # seconds, n, mean d, i, di/dt, d i, i^2, i di/dt; mean i^2 of all

    def begin_part(self) -> None:
        """Say that the device was off since the last sample: no window goes across.

        One that held the beginning of a major loop alone, without its way down, would take the error of e for
        two kelvin.
        """
        self._held = np.empty((4, 0))

    def add(
        self, time_s: FloatArray, reference_A: FloatArray, current_A: FloatArray, duty: FloatArray
    ) -> None:
        """Take in samples, shapes (n,)."""
        fresh = np.stack((time_s, reference_A, current_A, duty))
        self._held = np.concatenate((self._held, fresh[:, np.isfinite(duty)]), axis=1)
        while self._held.shape[1] > 1:
            end_s = self._held[0, 0] + WINDOW_S
            count = int(np.searchsorted(self._held[0], end_s - 1e-9))
            if count >= self._held.shape[1]:
                break
            self.rows.append(_row(self._held[:, : count + 1]))
            self._held = self._held[:, count:]


def _row(block: FloatArray) -> FloatArray:
    time_s, reference, current, duty = block
    slope = np.gradient(reference, time_s)
    used = (current > _LEAST_A) & (reference > _LEAST_A)
    count = np.count_nonzero(used[:-1])
    used[-1] = False  # it is the first of the next window
    d, i, s = duty[used], current[used], slope[used]
    if count == 0:
        return np.array([WINDOW_S, 0.0, *np.zeros(6), np.mean(current[:-1] ** 2)])
    means = [np.mean(x) for x in (d, i, s, d * i, i * i, i * s)]
    return np.array([WINDOW_S, count, *means, np.mean(current[:-1] ** 2)])


def heated(rows: FloatArray, tau_s: float, begin: float = 0.0) -> FloatArray:
    """Heat (m,) at the middle of each window (m, 9), A^2: tau h' = i^2 - h from ``begin``."""
    now, found = begin, np.empty(len(rows))
    for k, row in enumerate(rows):
        half = math.exp(-0.5 * row[0] / tau_s)
        now = row[8] + (now - row[8]) * half
        found[k] = now
        now = row[8] + (now - row[8]) * half
    return found


def record_of(windows: Windows) -> CoilRecord | None:
    """Return what a capture tells of the coil, by least squares over its windows; None if it is too short."""
    rows = np.reshape(windows.rows, (-1, 9))
    used = rows[:, 1] >= _LEAST_SAMPLES
    if np.count_nonzero(used) < _LEAST_WINDOWS:
        return None
    some = rows[used]
    weight = np.sqrt(some[:, 1])
    plain = np.stack((np.ones(len(some)), some[:, 3], some[:, 4]), axis=1)

    def with_heat(tau: float) -> _Found:
        warm = heated(rows, tau)[used] * some[:, 3]
        return _least_squares(np.column_stack((plain, warm)), some[:, 2], weight)

    tau = float(min(_TAUS_S, key=lambda one: with_heat(one).squares))
    found = with_heat(tau)
    if found.value[3] > _CLEAR * found.error[3]:
        rise, error, tau_s = found.value[3] / found.value[1], found.error[3] / found.value[1], tau
    else:
        found, rise, error, tau_s = _least_squares(plain, some[:, 2], weight), 0.0, 0.0, 0.0
    offset, per_A, s_per_A = (float(value) for value in found.value[:3])
    return CoilRecord(per_A, offset, s_per_A, float(rise), float(error), tau_s)


@dataclass(frozen=True, slots=True)
class _Found:
    value: FloatArray
    error: FloatArray  # standard deviations
    squares: float


def _least_squares(design: FloatArray, told: FloatArray, weight: FloatArray) -> _Found:
    scaled = design * weight[:, None]
    value, *_ = np.linalg.lstsq(scaled, told * weight, rcond=None)
    left = told * weight - scaled @ value
    squares = float(left @ left)
    covariance = np.linalg.pinv(scaled.T @ scaled) * squares / max(told.size - value.size, 1)
    return _Found(np.asarray(value), np.sqrt(np.diag(covariance)), squares)


@dataclass(frozen=True, slots=True)
class Thermal:
    """A captured model's thermal term: the force falls by ``coefficient`` h, tau h' = i^2 - h."""

    coefficient: float  # 1/A^2
    tau_s: float


class Thermometer:
    """Tells the coil's temperature and what force its heat costs, from telemetry as it comes.

    ``extra`` is the share of the force that is lost beyond what the model's own thermal term says.
    """

    def __init__(self, coil: CoilRecord, thermal: Thermal | None = None) -> None:
        self._coil, self._thermal = coil, thermal
        self._windows = Windows()
        self._own = 0.0  # heat of the model's term, A^2
        sure = thermal is not None and 0 < coil.rise_error_per_A2 < _SURE * coil.rise_per_A2
        self.share = thermal.coefficient / coil.rise_per_A2 if sure and thermal else FORCE_PER_RESISTANCE
        self.rise = 0.0  # of the resistance, of the last window that told
        self.extra = 0.0
        self.known = False

    @property
    def temperature_K(self) -> float:
        """How much warmer the copper is than at the beginning of the calibration."""
        return self.rise / COPPER_PER_K

    @property
    def loss(self) -> float:
        """Share of the force that is lost to heat, against a cold coil at calibration."""
        return self.share * self.rise

    def begin_part(self) -> None:
        """Say that the device was off since the last sample."""
        self._windows.begin_part()

    def restart(self) -> None:
        """Say that the model begins anew with a cold coil, as for each drive that is played by itself."""
        self._windows = Windows()
        self._own = 0.0
        self.extra = self.loss

    def add(
        self, time_s: FloatArray, reference_A: FloatArray, current_A: FloatArray, duty: FloatArray
    ) -> bool:
        """Take in samples, shapes (n,); return whether there is news."""
        self._windows.add(time_s, reference_A, current_A, duty)
        told = [self._take(row) for row in self._windows.rows]
        self._windows.rows.clear()
        return any(told)

    def _take(self, row: FloatArray) -> bool:
        own = self._own
        if self._thermal is not None:
            own = float(heated(row[None], self._thermal.tau_s, self._own)[0])
            left = math.exp(-row[0] / self._thermal.tau_s)
            self._own = row[8] + (self._own - row[8]) * left
        a, b, e = self._coil.duty_per_A, self._coil.duty_offset, self._coil.duty_s_per_A
        if row[1] < _LEAST_SAMPLES or abs(e * row[7]) > _STEEP * a * row[6]:
            return False
        told = float((row[5] - b * row[3] - e * row[7]) / (a * row[6])) - 1.0
        self.rise += (told - self.rise) * (min(1.0, (row[6] / _FULL_A2) ** 2) if self.known else 1.0)
        self.extra = self.loss - (self._thermal.coefficient * own if self._thermal else 0.0)
        self.known = True
        return True
