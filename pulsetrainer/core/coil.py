"""The coil as its driver sees it: resistance and inductance from duty and current, gains by a rule, margins.

The coil is switched between the supply V and a free-wheeling diode of drop D; over a tick with the duty d

    L di/dt + R i = d V - (1 - d) D,   that is   tau di/dt + i = d gain - diode,   i >= 0,

with tau = L/R, gain = (V + D)/R and diode = D/R. Duty and current tell these three; D alone, or the supply's
voltage where somebody has measured it, makes ohms and henries of them. The loop needs no volt. A supply of
inner resistance S gives V - S d i: where a steady supply explains too little, sag = S/R is fitted as well.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.errors import DataError

DIODE_V = 0.6  # drop of a silicon diode at a fraction of an ampere
FILTER_HZ = 2500.0  # Butterworth of the fifth order between the shunt and the converter
_FILTER_ORDER = 5
# What the loop waits for: the tick until a duty shows, half a tick for which it is held, the filter's delay
# (the sum of 1/sin over its poles' angles, 3.236, over the corner's angular frequency).
_COMPUTE_TICKS = 1.5
NOISE_A = 4e-4  # of the converter and before it, rms: 0.5 mA steps, 0.3 mA noise
_UNEXPLAINED = 3.0  # times that: something else is at work
_LOWEST = (1e-4, 1e-6, 2e-5, 1e-6)  # gain, diode, tau, sag
_HIGHEST = (1e5, 1e3, 10.0, 10.0)
_FILTER_DELAY_S = 3.236 / (2.0 * math.pi * FILTER_HZ)


@dataclass(frozen=True, slots=True)
class Coil:
    """An electrical identity: what duty and current tell."""

    gain_A: float  # (V + D)/R: what full duty would drive without the diode
    diode_A: float  # D/R
    tau_s: float  # L/R
    sag: float = 0.0  # S/R
    residual_A: float = 0.0  # rms of what this does not explain

    @property
    def resistance_ohm(self) -> float:
        """Resistance by the diode's drop."""
        return DIODE_V / self.diode_A

    @property
    def inductance_H(self) -> float:
        """Inductance by the diode's drop."""
        return self.tau_s * self.resistance_ohm

    @property
    def supply_V(self) -> float:
        """Supply by the diode's drop."""
        return (self.gain_A - self.diode_A) * self.resistance_ohm

    def scaled_to(self, supply_V: float) -> tuple[float, float]:
        """Resistance, ohm, and inductance, H, where the supply's voltage has been measured."""
        ohm = supply_V / (self.gain_A - self.diode_A)
        return ohm, self.tau_s * ohm

    @property
    def most_A(self) -> float:
        """Current at full duty: gain - sag i = i + diode."""
        return (self.gain_A - self.diode_A) / (1.0 + self.sag)

    def duty_at(self, current_A: float) -> float:
        """Duty that holds a current: gain d - sag d^2 i = i + diode; infinite where the supply cannot."""
        needed, bent = current_A + self.diode_A, 4.0 * self.sag * current_A
        root = self.gain_A**2 - bent * needed
        return 2.0 * needed / (self.gain_A + math.sqrt(root)) if root >= 0 else math.inf

    def best_possible(self, reference_A: FloatArray, dt_s: float) -> FloatArray:
        """Current (n,) nearest to a reference (n,) that any gains can drive: duty within 0..1, from rest."""
        loss = -math.expm1(-dt_s / self.tau_s)
        current = np.empty(reference_A.size)
        now = 0.0
        for k, wanted in enumerate(reference_A.tolist()):
            settles_at = now + (wanted - now) / loss
            highest = self.gain_A - self.sag * now - self.diode_A
            now = max(now + loss * (min(max(settles_at, -self.diode_A), highest) - now), 0.0)
            current[k] = now
        return current


@dataclass(frozen=True, slots=True)
class Hold:
    """A response at every tick: duty (n,) of the tick before each sample, measured current (n,), A.

    NaN where a sample was lost. It begins at rest.
    """

    duty: FloatArray
    current_A: FloatArray


def simulated(coil: Coil, duty: FloatArray, dt_s: float) -> FloatArray:
    """Current (n,) as the converter reads it, A, from rest, for the duty (n,) of each tick.

    i_k = i_(k-1) + (1 - exp(-dt/tau)) (gain d_k - diode - (1 + sag d_k^2) i_(k-1)), never below 0,
    and then the filter.
    """
    loss = -math.expm1(-dt_s / coil.tau_s)
    current = np.empty(duty.size)
    now = 0.0
    ends = (coil.gain_A * duty - coil.diode_A).tolist()
    for k, (settles_at, back) in enumerate(zip(ends, (1.0 + coil.sag * duty**2).tolist(), strict=True)):
        now = max(now + loss * (settles_at - back * now), 0.0)
        current[k] = now
    numerator, denominator = _filter(dt_s)
    return np.asarray(scipy.signal.lfilter(numerator, denominator, current))


def _filter(dt_s: float) -> tuple[FloatArray, FloatArray]:
    """Coefficients of the filter at the ticks."""
    return scipy.signal.butter(_FILTER_ORDER, FILTER_HZ, fs=1.0 / dt_s)


def identify_coil(holds: Sequence[Hold], dt_s: float, start: Coil | None = None) -> Coil:
    """Find the coil that explains some responses to a known duty, by least squares.

    DataError where no current flows in them, or nothing of this kind explains them.
    """
    top = max(float(np.nanmax(hold.current_A)) for hold in holds)
    if not top > 0:
        raise DataError("no current flows", hint="connect the coil")
    duty = max(float(np.nanmax(hold.duty)) for hold in holds)
    begin = start or Coil(gain_A=1.1 * top / duty, diode_A=0.05 * top / duty, tau_s=0.004)
    found = _fitted(holds, dt_s, begin, sagging=False)
    if found.residual_A > _UNEXPLAINED * NOISE_A:
        sagging = _fitted(holds, dt_s, replace(found, sag=0.05), sagging=True)
        if sagging.residual_A < 0.5 * found.residual_A:
            return sagging
    return found


def _fitted(holds: Sequence[Hold], dt_s: float, start: Coil, *, sagging: bool) -> Coil:
    """Least squares of the logarithms: none of them can turn its sign."""
    duties = [np.nan_to_num(_filled(hold.duty)) for hold in holds]

    def residual(log: FloatArray) -> FloatArray:
        coil = Coil(*np.exp(log).tolist())
        parts = [
            simulated(coil, duty, dt_s) - hold.current_A for duty, hold in zip(duties, holds, strict=True)
        ]
        return np.nan_to_num(np.concatenate(parts))

    count = 4 if sagging else 3
    low, high = np.log(_LOWEST[:count]), np.log(_HIGHEST[:count])
    values = np.asarray([start.gain_A, start.diode_A, start.tau_s, max(start.sag, _LOWEST[3])][:count])
    first = np.clip(np.log(np.maximum(values, _LOWEST[:count])), low + 1e-6, high - 1e-6)
    found = scipy.optimize.least_squares(residual, first, bounds=(low, high), x_scale=0.1, xtol=1e-9)
    counted = sum(int(np.isfinite(hold.current_A).sum()) for hold in holds)
    rms = math.sqrt(2.0 * float(found.cost) / counted)
    return replace(Coil(*np.exp(found.x).tolist()), residual_A=rms)


def _filled(duty: FloatArray) -> FloatArray:
    """Fill the duty of lost samples in: it is held or moves evenly."""
    known = np.isfinite(duty)
    at = np.arange(duty.size)
    return np.interp(at, at[known], duty[known]) if known.any() else duty


@dataclass(frozen=True, slots=True)
class LoopGains:
    """Gains of a current loop from A to duty: PI and feed-forward, as in ``firmware/core/pid.c``."""

    proportional: float  # 1/A
    integral: float  # 1/(A s)
    feed_resistance: float  # 1/A
    feed_inductance: float  # s/A
    feed_offset: float  # 1


def delay_s(dt_s: float) -> float:
    """What the loop waits for between a current that is wrong and one that is righted, s."""
    return _COMPUTE_TICKS * dt_s + _FILTER_DELAY_S


def tuned_gains(
    coil: Coil, dt_s: float, *, top_A: float = 1.0, most_proportional: float = math.inf
) -> LoopGains:
    """Gains by internal-model control for a first-order plant with a delay.

        kp = tau / (gain (lambda + theta)),   ki = kp / tau,   lambda = theta

    The controller's zero cancels the coil's pole; what is left is an integrator with a delay theta, of gain
    margin pi and phase margin 90 - 180/(2 pi) = 61 degrees. Feed-forward is the coil itself, exact at no
    current and at ``top_A``, or at full duty where that is less. Where the coil asks for more than
    ``most_proportional``, lambda is longer.

    Source: Rivera, Morari, Skogestad, Internal model control 4: PID controller design, Ind. Eng. Chem.
    Process Des. Dev. 25 (1986) 252; lambda = theta: Skogestad, J. Process Control 13 (2003) 291.
    """
    theta = delay_s(dt_s)
    top_A = min(top_A, coil.most_A)
    proportional = min(coil.tau_s / (coil.gain_A * 2.0 * theta), most_proportional)
    return LoopGains(
        proportional=proportional,
        integral=proportional / coil.tau_s,
        feed_resistance=(coil.duty_at(top_A) - coil.duty_at(0.0)) / top_A,
        feed_inductance=coil.tau_s / coil.gain_A,
        feed_offset=coil.diode_A / coil.gain_A,
    )


@dataclass(frozen=True, slots=True)
class Margins:
    """How far a loop is from swinging by itself."""

    gain: float  # factor of the gain at which it does
    phase_deg: float
    stable: bool


def margins(coil: Coil, gains: LoopGains, dt_s: float) -> Margins:
    """Margins of the sampled loop: PI, one tick, coil, filter; stable if all its poles are inside the circle.

    L(z) = (kp + ki dt z^-1 / (1 - z^-1)) gain (1 - a) z^-1 / (1 - a z^-1) H(z),   a = exp(-dt/tau)
    """
    decay = math.exp(-dt_s / coil.tau_s)
    top, bottom = _filter(dt_s)
    # the integral of a tick takes in the error of the tick before
    controller = np.array([gains.proportional, gains.integral * dt_s - gains.proportional])
    numerator = np.convolve(np.convolve(controller, [0.0, coil.gain_A * (1.0 - decay)]), top)
    denominator = np.convolve(np.convolve([1.0, -1.0], [1.0, -decay]), bottom)
    closed = np.polynomial.polynomial.polyadd(denominator, numerator)
    stable = bool(np.all(np.abs(np.roots(closed)) < 1.0))
    angle = np.geomspace(1e-5, 1.0, 8000) * math.pi
    _, response = scipy.signal.freqz(numerator, denominator, worN=angle)
    size_of, phase = np.abs(response), np.unwrap(np.angle(response))
    turned = np.flatnonzero((phase[:-1] > -math.pi) & (phase[1:] <= -math.pi))
    crossed = np.flatnonzero((size_of[:-1] >= 1.0) & (size_of[1:] < 1.0))
    gain = float(1.0 / size_of[turned].max()) if turned.size else math.inf
    left = 180.0 + np.rad2deg(phase[crossed]).min() if crossed.size else math.inf
    return Margins(gain=gain, phase_deg=float(left), stable=stable)
