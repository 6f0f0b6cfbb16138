"""Measure the device's coil by itself: constant duties from rest, each by what is known so far."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pulsetrainer.core import coil as electrical
from pulsetrainer.core.coil import Coil, Hold
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.device.codes import CURRENT_UNIT_A, DUTY_FULL, Fault
from pulsetrainer.device.device import Device
from pulsetrainer.device.trace import Trace
from pulsetrainer.device.wording import FORCE_READING, FORCE_REMEDY
from pulsetrainer.errors import ArgumentError, DeviceError
from pulsetrainer.steps.loop_gains import OPEN_LOOP
from pulsetrainer.steps.progress import Progress
from pulsetrainer.steps.stopped import raise_if_lost, raise_if_stopped

RATE_HZ = 1000.0
# The firmware compares voltage and current over 205 ms; a coil that nobody knows yet must be told sooner.
_HOLD_S = 0.17
_REST_S = 0.3
_FIRST_DUTY = 0.03  # 0.14 V at 24 V: a coil of 0.1 ohm takes 1.4 A
_STEP_UP = 1.6  # from one try to the next
_TRIES = 1 + math.ceil(math.log(1.0 / _FIRST_DUTY, _STEP_UP))  # at most
_ENOUGH_A = 0.15
_FIRST_SHARE = 0.2  # of the range, where that is less
_TOP_SHARE = 0.7  # of the range, for the holds that are measured
_HOLDS = (0.15, 0.35, 0.65, 1.0)  # of that
_NO_CURRENT_A = 0.02
_SHORTED_OHM = 1.0
_UNEXPLAINED_A = 0.004  # ten times what noise and converter leave
_LEAST_A = 0.05  # of a range: below it the coil draws what noise and diode hide
_FINGER_N = 1.5  # zero of the sensor 0.6 N, what a stroke leaves behind 0.8 N
_MOVES_N = 0.25  # of means over 50 ms at rest: a finger trembles, a table does not
_SHIFTED_N = 1.2  # from the first rest to the last
_TOO_MUCH = {Fault.OVER_CURRENT, Fault.COMPARATOR}
MEAN_S = 0.05
_SENSOR = "check the force sensor and its plug, and keep the finger off the device while it is tuned"
# Nobody presses here: what a play advises about fingers and forces does not apply.
_REMEDY: dict[int, str] = {
    Fault.OVER_FORCE: "keep everything off the device while it is tuned, and check its force and current "
    "sensors; or raise `limit_force_N` where it was lowered",
    Fault.CURRENT_IMPLAUSIBLE: "check the supply, its plug, and the current sensor",
    **dict.fromkeys(FORCE_READING, _SENSOR),
}


@dataclass(frozen=True, slots=True)
class Step:
    """One of the things that tuning plays."""

    what: str
    peak_A: float
    seconds: float
    gains: str = "none"  # of the current loop; none: the reference is the duty


def planned(range_A: float) -> list[tuple[str, FloatArray]]:
    """Return what a measurement asks for at most, up to the coil that is known: what, and current (n,) in A.

    Its currents are those that a duty is to drive; ArgumentError where the range is too small to measure in.
    """
    check_range(range_A)
    hold = round(_HOLD_S * RATE_HZ)
    look = np.full(hold * _TRIES, min(_ENOUGH_A, _FIRST_SHARE * range_A))
    holds = [("coil", np.full(hold, share * _TOP_SHARE * range_A)) for share in _HOLDS]
    return [rest_of(), ("first look", look), *holds, rest_of()]


def rest_of() -> tuple[str, FloatArray]:
    """Return what is played to look at the force at rest."""
    return "rest", np.zeros(round(_REST_S * RATE_HZ))


def check_range(range_A: float) -> None:
    """Raise ArgumentError for a current limit in force that leaves no current to measure a coil with."""
    if range_A < _LEAST_A:
        raise ArgumentError(
            f"a coil cannot be measured below {_LEAST_A:g} A; the limit is {range_A:g} A (`limit_current_A`)",
            hint=f"raise `limit_current_A` to {_LEAST_A:g} or more",
        )


class Measurement:
    """What is played on one device to know its coil; ``supply_known``: ohms are not by the diode's drop."""

    def __init__(self, device: Device, *, supply_known: bool, progress: Progress) -> None:
        self._device, self._supply_known, self._progress = device, supply_known, progress
        self._dt_s = 1.0 / device.info.tick_rate_Hz
        self._range_A = device.info.current_limit_A
        # the duty goes over the wire as a current, which the limit cuts off
        self._most = min(1.0, self._range_A / CURRENT_UNIT_A / DUTY_FULL - 0.001)
        self.notes: list[str] = []

    def rest(self) -> float:
        """Return the force at rest, N; refuse one where nothing should press, or that moves."""
        trace = self.play(rest_of()[1], "the measurement of the force at rest")
        width = round(MEAN_S * RATE_HZ)
        means = trace.force_N[: trace.force_N.size // width * width].reshape(-1, width).mean(axis=1)
        force = float(means.mean())
        if abs(force) > _FINGER_N or np.ptp(means) > _MOVES_N:
            raise DeviceError(
                f"a force of {force:.2f} N that moves by {np.ptp(means):.2f} N, where nothing should press",
                hint="take the finger off the device and keep it off while it is tuned",
            )
        return force

    def same_rest(self, before_N: float) -> None:
        """Refuse a device that has been pressed meanwhile."""
        gains = self._device.gains
        self._device.set_gains(OPEN_LOOP)
        now_N = self.rest()
        self._device.set_gains(gains)
        if abs(now_N - before_N) > _SHIFTED_N:
            raise DeviceError(
                f"the force at rest went from {before_N:.2f} to {now_N:.2f} N meanwhile",
                hint="keep the finger off the device while it is tuned",
            )

    def _hold(self, duty: float) -> tuple[Hold, Trace]:
        """Return what a constant duty drives, from rest, at every tick."""
        counts = round(min(duty, self._most) * DUTY_FULL) + 1  # 65535/65536 of it is rounded down
        reference = np.full(round(_HOLD_S * RATE_HZ), counts * CURRENT_UNIT_A)
        trace = self._device.play(np.append(0.0, reference), RATE_HZ, decimation=1)
        last = int(trace.tick[-1]) + 1 if trace.tick.size else 1
        told = np.full((2, last), np.nan)
        told[:, trace.tick] = (trace.duty, trace.current_A)
        return Hold(told[0], told[1]), trace

    def _first_look(self) -> Hold:
        """Raise the duty until a current flows."""
        duty = _FIRST_DUTY
        while True:
            hold, trace = self._hold(duty)
            self._check_first(trace, duty)
            top = float(np.nanmax(hold.current_A))
            if top >= min(_ENOUGH_A, _FIRST_SHARE * self._range_A) or duty >= self._most:
                break
            duty = min(duty * _STEP_UP, self._most)
        if top < _NO_CURRENT_A:
            raise _no_coil(duty)
        return hold

    def _check_first(self, trace: Trace, duty: float) -> None:
        dead = trace.fault_code in {Fault.NO_CURRENT, Fault.CURRENT_FROZEN}
        if dead and trace.current_A.max(initial=0.0) < _NO_CURRENT_A:
            raise _no_coil(duty)
        if trace.fault_code in _TOO_MUCH:
            raise _shorted(f"{100 * duty:.0f} % of the supply drove more than the device permits")
        _raise_if_stopped(trace, "the first measurement of the coil")

    def coil(self) -> Coil:
        """Return the coil by holds up to most of the range, each by what is known so far."""
        holds = [self._first_look()]
        coil = electrical.identify_coil(holds, self._dt_s)
        for number, share in enumerate(_HOLDS):
            if coil.resistance_ohm < _SHORTED_OHM and not self._supply_known:
                raise _shorted(f"it has {coil.resistance_ohm:.2g} ohm")
            top = min(_TOP_SHARE * self._range_A, 0.9 * (coil.gain_A - coil.diode_A))
            hold, trace = self._hold(coil.duty_at(share * top))
            if trace.fault_code in _TOO_MUCH:
                raise _shorted(f"{share * top:.2f} A were asked for and more than the device permits flowed")
            _raise_if_stopped(trace, "the measurement of the coil")
            holds.append(hold)
            coil = electrical.identify_coil(holds, self._dt_s, start=coil)
            self._progress(0.1 + 0.3 * (number + 1) / len(_HOLDS))
        if coil.residual_A > _UNEXPLAINED_A:
            self.notes.append(
                f"no coil explains the current to better than {1e3 * coil.residual_A:.1f} mA rms: "
                "does the iron saturate?"
            )
        return coil

    def play(self, reference_A: FloatArray, what: str, decimation: int = 10) -> Trace:
        """Play a current (n,) in A to its end, and return what was measured."""
        trace = self._device.play(reference_A, RATE_HZ, decimation=decimation)
        _raise_if_stopped(trace, what)
        return trace


def _raise_if_stopped(trace: Trace, what: str) -> None:
    remedy = _SENSOR if trace.remedy == FORCE_REMEDY else trace.remedy
    raise_if_stopped(trace.fault, _REMEDY.get(trace.fault_code, remedy), what)
    raise_if_lost(trace.samples, trace.dropped_samples, what)


def _shorted(why: str) -> DeviceError:
    return DeviceError(
        f"the coil is shorted: {why}",
        hint="measure the coil's resistance; look for bare wire at its terminals",
    )


def _no_coil(duty: float) -> DeviceError:
    return DeviceError(
        f"no coil: {100 * duty:.0f} % of the supply drives no current",
        hint="check the coil's plug and its wire, and that the supply is on",
    )
