"""Tune: measure the coil with the device itself, set the gains of its current loop by a rule, verify them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.artefacts import Waveform
from pulsetrainer.core import coil as electrical
from pulsetrainer.core.coil import Coil, Hold, LoopGains, Margins
from pulsetrainer.core.plane import FloatArray, positive
from pulsetrainer.core.pulses import Shape, train
from pulsetrainer.device.codes import CURRENT_UNIT_A, DUTY_FULL, PARAMETERS, Fault
from pulsetrainer.device.gains import Gains
from pulsetrainer.device.limits import check_peak
from pulsetrainer.errors import DeviceError
from pulsetrainer.steps.play import check_current
from pulsetrainer.steps.progress import Progress, silent
from pulsetrainer.steps.stopped import raise_if_stopped

if TYPE_CHECKING:
    from pulsetrainer.device.device import Device
    from pulsetrainer.device.trace import Trace

RATE_HZ = 1000.0
# The firmware compares voltage and current over 205 ms; a coil that nobody knows yet must be told sooner.
_HOLD_S = 0.17
_REST_S = 0.3
_FIRST_DUTY = 0.03  # 0.14 V at 24 V: a coil of 0.1 ohm takes 1.4 A
_STEP_UP = 1.6  # from one try to the next
_ENOUGH_A = 0.15
_TOP_SHARE = 0.7  # of the range, for the holds that are measured
_HOLDS = (0.15, 0.35, 0.65, 1.0)  # of that
_NO_CURRENT_A = 0.02
_FOLLOWS = 0.01  # of the range: what nobody can do better than is no fault of the gains
_SHORTED_OHM = 1.0
_UNEXPLAINED_A = 0.004  # ten times what noise and converter leave
_FINGER_N = 1.5  # zero of the sensor 0.6 N, what a stroke leaves behind 0.8 N
_MOVES_N = 0.25  # of means over 50 ms at rest: a finger trembles, a table does not
_SHIFTED_N = 1.2  # from the first rest to the last
_MEAN_S = 0.05
_SINE_HZ = 4.0
_SINE = (0.5, 0.25)  # of the range: middle and amplitude
_STEP = (0.45, 0.65)  # of the range
_STEP_HOLD_S = 0.1
_STEPS = 4
_SETTLED = 0.02  # of the step, above three times the noise
_NOISE_A = 0.0015
_BEATS = 2
_SOUND_GAIN, _SOUND_PHASE = 1.6, 20.0  # margins below which gains are not tried
_TOO_MUCH = {Fault.OVER_CURRENT, Fault.COMPARATOR}
_MOST = {p.name: p.maximum for p in PARAMETERS}


@dataclass(frozen=True, slots=True)
class Tracking:
    """Largest error of the current over 4 Hz and the pulses, % of the range; None: not played."""

    before: float | None
    after: float


@dataclass(frozen=True, slots=True)
class Tuned:
    """A coil and the gains that suit it."""

    serial: str
    resistance_ohm: float
    inductance_H: float
    supply_V: float
    gains: Gains
    tracking_percent: Tracking
    settle_ms: float  # of a step by a fifth of the range, to 2 %
    overshoot_percent: float  # of that step
    margins: Margins
    margins_before: Margins
    notes: tuple[str, ...] = ()


def tune(
    device: Device,
    *,
    pulses: Sequence[Shape | Waveform],
    supply_V: float | None = None,
    progress: Progress = silent,
) -> Tuned:
    """Measure resistance and inductance by steps, set the gains of the current loop by a rule, and verify.

    The gains are those of ``core.coil.tuned_gains``; they stay set until the device is closed.

    Parameters
    ----------
    pulses
        What the current must be able to follow: shapes, over the whole range, and the compensated currents of
        drives, which rise faster than the pulses that they press.
    supply_V
        Voltage of the supply where it has been measured: ohms and henries are then by it. None: by the
        drop of the free-wheeling diode, 0.6 V. The gains need neither.

    Raises
    ------
    ArgumentError
        A drive goes beyond the device's range.
    DeviceError
        No coil, a shorted one, one that the supply cannot drive over the pulses (with the reason), a force at
        rest, a fault, or a firmware that does not tell the duty. The output is off and the gains are those
        from before.
    Interrupted
        Ctrl-C: the output was stopped first.
    """
    if supply_V is not None:
        positive(supply_V=supply_V)
    for pulse in pulses:
        if isinstance(pulse, Waveform):
            check_current(pulse)
            hint = "invert again with a lower `force_max`"
            check_peak(pulse.compensated, device.info.current_limit_A, hint=hint)
    device.needs_duty("tuning")
    before = device.gains
    try:
        return _Tuning(device, pulses, supply_V, progress).run(before)
    except BaseException:
        device.stop()
        device.set_gains(before)
        raise


class _Tuning:
    """One device being tuned."""

    def __init__(
        self,
        device: Device,
        pulses: Sequence[Shape | Waveform],
        supply_V: float | None,
        progress: Progress,
    ) -> None:
        self._device, self._pulses, self._supply_V, self._progress = device, pulses, supply_V, progress
        self._dt_s = 1.0 / device.info.tick_rate_Hz
        self._range_A = device.info.current_limit_A
        self._notes: list[str] = []

    def run(self, before: Gains) -> Tuned:
        device = self._device
        device.set_gains(_OPEN)
        rest_N = self._rest()
        coil = self._measure(self._first_look())
        self._same_rest(rest_N)
        self._progress(0.4)
        ohm, henry, volts = self._scaled(coil)
        references = self._references()
        self._check_drivable(coil, references[1:], ohm, volts)
        gains = to_wire(self._rule(coil), self._dt_s)
        was = electrical.margins(coil, from_wire(before, self._dt_s), self._dt_s)
        now = electrical.margins(coil, from_wire(gains, self._dt_s), self._dt_s)
        error_before = self._before(before, was, references)
        self._progress(0.7)
        device.set_gains(gains)
        error = max(self._error_percent(reference) for reference in references)
        settle_ms, overshoot = self._step()
        self._same_rest(rest_N)
        self._progress(1.0)
        return Tuned(
            serial=device.info.serial,
            resistance_ohm=ohm,
            inductance_H=henry,
            supply_V=volts,
            gains=gains,
            tracking_percent=Tracking(error_before, error),
            settle_ms=settle_ms,
            overshoot_percent=overshoot,
            margins=now,
            margins_before=was,
            notes=tuple(self._notes),
        )

    # --- measuring -------------------------------------------------------------------------------

    def _rest(self) -> float:
        """Return the force at rest, N; refuse one where nothing should press, or that moves."""
        trace = self._play(np.zeros(round(_REST_S * RATE_HZ)), "the look at the force at rest")
        width = round(_MEAN_S * RATE_HZ)
        means = trace.force_N[: trace.force_N.size // width * width].reshape(-1, width).mean(axis=1)
        force = float(means.mean())
        if abs(force) > _FINGER_N or np.ptp(means) > _MOVES_N:
            raise DeviceError(
                f"a force of {force:.2f} N that moves by {np.ptp(means):.2f} N, where nothing should press",
                hint="take the finger off the device and keep it off while it is tuned",
            )
        return force

    def _same_rest(self, before_N: float) -> None:
        gains = self._device.gains
        self._device.set_gains(_OPEN)
        now_N = self._rest()
        self._device.set_gains(gains)
        if abs(now_N - before_N) > _SHIFTED_N:
            raise DeviceError(
                f"the force at rest went from {before_N:.2f} to {now_N:.2f} N meanwhile",
                hint="keep the finger off the device while it is tuned",
            )

    def _hold(self, duty: float, seconds: float) -> tuple[Hold, Trace]:
        """Return what a constant duty drives, from rest, at every tick."""
        counts = round(min(duty, 1.0) * DUTY_FULL) + 1  # 65535/65536 of it is rounded down
        reference = np.full(round(seconds * RATE_HZ), counts * CURRENT_UNIT_A)
        trace = self._device.play(np.append(0.0, reference), RATE_HZ, decimation=1)
        last = int(trace.tick[-1]) + 1 if trace.tick.size else 1
        told = np.full((2, last), np.nan)
        told[:, trace.tick] = (trace.duty, trace.current_A)
        return Hold(told[0], told[1]), trace

    def _first_look(self) -> Hold:
        """Raise the duty until a current flows."""
        most = min(1.0, self._range_A / CURRENT_UNIT_A / DUTY_FULL - 0.001)
        duty = _FIRST_DUTY
        while True:
            hold, trace = self._hold(duty, _HOLD_S)
            self._check_first(trace, duty)
            top = float(np.nanmax(hold.current_A))
            if top >= min(_ENOUGH_A, 0.2 * self._range_A) or duty >= most:
                break
            duty = min(duty * _STEP_UP, most)
        if top < _NO_CURRENT_A:
            raise _no_coil(duty)
        return hold

    def _check_first(self, trace: Trace, duty: float) -> None:
        dead = trace.fault_code in {Fault.NO_CURRENT, Fault.CURRENT_FROZEN}
        if dead and trace.current_A.max(initial=0.0) < _NO_CURRENT_A:
            raise _no_coil(duty)
        if trace.fault_code in _TOO_MUCH:
            raise _shorted(f"{100 * duty:.0f} % of the supply drove more than the device permits")
        raise_if_stopped(trace.fault, trace.remedy, "the first look at the coil")

    def _measure(self, first: Hold) -> Coil:
        """Return the coil by holds up to most of the range, each by what is known so far."""
        holds = [first]
        coil = electrical.identify_coil(holds, self._dt_s)
        for number, share in enumerate(_HOLDS):
            if coil.resistance_ohm < _SHORTED_OHM and self._supply_V is None:
                raise _shorted(f"it has {coil.resistance_ohm:.2g} ohm")
            top = min(_TOP_SHARE * self._range_A, 0.9 * (coil.gain_A - coil.diode_A))
            hold, trace = self._hold(coil.duty_at(share * top), _HOLD_S)
            if trace.fault_code in _TOO_MUCH:
                raise _shorted(f"{share * top:.2f} A were asked for and more than the device permits flowed")
            raise_if_stopped(trace.fault, trace.remedy, "the measurement of the coil")
            holds.append(hold)
            coil = electrical.identify_coil(holds, self._dt_s, start=coil)
            self._progress(0.1 + 0.3 * (number + 1) / len(_HOLDS))
        if coil.residual_A > _UNEXPLAINED_A:
            self._notes.append(
                f"no coil explains the current to better than {1e3 * coil.residual_A:.1f} mA rms: "
                "does the iron saturate?"
            )
        return coil

    def _scaled(self, coil: Coil) -> tuple[float, float, float]:
        """Resistance, ohm, inductance, H, and supply, V."""
        if self._supply_V is None:
            return coil.resistance_ohm, coil.inductance_H, coil.supply_V
        return (*coil.scaled_to(self._supply_V), self._supply_V)

    # --- the rule --------------------------------------------------------------------------------

    def _rule(self, coil: Coil) -> LoopGains:
        most = _MOST["pid_kp"] / _PER["pid_kp"]
        return electrical.tuned_gains(coil, self._dt_s, top_A=self._range_A, most_proportional=most)

    def _check_drivable(self, coil: Coil, references: Sequence[FloatArray], ohm: float, volts: float) -> None:
        """Refuse a coil that no gains can make follow the pulses: R i + L di/dt is beyond what drives it."""
        ticks = round(1.0 / (RATE_HZ * self._dt_s))
        for reference in references:
            fine = np.interp(np.arange(reference.size * ticks) / ticks, np.arange(reference.size), reference)
            error = fine - coil.best_possible(fine, self._dt_s)
            at = int(np.argmax(np.abs(error)))
            if abs(error[at]) <= _FOLLOWS * self._range_A:
                continue
            top = float(reference.max())
            steady, henry = ohm * top, coil.tau_s * ohm
            what = f"the coil of {ohm:.2f} ohm and {1e3 * henry:.1f} mH cannot follow the pulses"
            if not coil.duty_at(top) < 1.0:
                said = f"{what} (voltage): {top:.2f} A need {steady:.1f} V and the supply gives {volts:.1f} V"
            else:
                way = "rise" if error[at] > 0 else "fall"
                said = (
                    f"{what} (time constant): with {1e3 * coil.tau_s:.0f} ms and {volts:.1f} V the current "
                    f"cannot {way} as fast as they do, by {1e3 * abs(error[at]):.0f} mA"
                )
            raise DeviceError(
                said, hint="use a supply of more voltage, a coil of fewer turns, or a lower current limit"
            )

    # --- verifying -------------------------------------------------------------------------------

    def _references(self) -> list[FloatArray]:
        """A sine of half the range, then the pulses over all of it."""
        phase = 2.0 * math.pi * np.arange(round(2 * RATE_HZ / _SINE_HZ) + 1) * _SINE_HZ / RATE_HZ
        pulses = [self._current(pulse) for pulse in self._pulses]
        middle, swing = _SINE
        up = np.linspace(0.0, middle - swing, round(_MEAN_S * RATE_HZ))
        sine = np.concatenate((up, middle - swing * np.cos(phase), up[::-1]))
        return [self._range_A * sine, *pulses]

    def _current(self, pulse: Shape | Waveform) -> FloatArray:
        """Return the current (n,) of a pulse, A."""
        if isinstance(pulse, Shape):
            return train(pulse, periods=_BEATS, rate_Hz=RATE_HZ, low=0.0, high=self._range_A)
        samples = np.arange(round(float(pulse.time_s[-1]) * RATE_HZ) + 1)
        return np.interp(samples / RATE_HZ, pulse.time_s, pulse.compensated)

    def _before(self, gains: Gains, sound: Margins, references: Sequence[FloatArray]) -> float | None:
        """Return the error with the gains from before, where they are fit to be tried on this coil."""
        if not (sound.stable and sound.gain >= _SOUND_GAIN and sound.phase_deg >= _SOUND_PHASE):
            self._notes.append(
                f"the gains from before were not tried: on this coil they would ring (gain margin "
                f"{sound.gain:.2f}, phase margin {sound.phase_deg:.0f} degrees)"
            )
            return None
        self._device.set_gains(gains)
        try:
            return max(self._error_percent(reference) for reference in references)
        except DeviceError as error:
            self._notes.append(f"with the gains from before: {error.message}")
            return None

    def _error_percent(self, reference_A: FloatArray) -> float:
        trace = self._play(reference_A, "the verification")
        return 100.0 * float(np.abs(trace.current_A - trace.reference_A).max()) / self._range_A

    def _step(self) -> tuple[float, float]:
        """Settling time, ms, and overshoot, % of the step, in the mean of some steps."""
        low, high = (share * self._range_A for share in _STEP)
        half = round(_STEP_HOLD_S * RATE_HZ)
        one = np.concatenate((np.full(half, low), np.full(half, high)))
        run_up = np.linspace(0.0, low, half)
        reference = np.concatenate((run_up, np.tile(one, _STEPS), np.linspace(low, 0.0, half)))
        trace = self._play(reference, "the verification", decimation=1)
        told = np.full(reference.size * round(self._device.info.tick_rate_Hz / RATE_HZ), np.nan)
        told[trace.tick] = trace.current_A
        ticks = round(_STEP_HOLD_S / self._dt_s)
        begins = [(half * (2 + 2 * k)) * (ticks // half) - ticks // half for k in range(_STEPS)]
        mean = np.nanmean([told[begin : begin + ticks] for begin in begins], axis=0)
        size = high - low
        off = np.abs(mean - high) > max(_SETTLED * size, _NOISE_A)
        settled = float(np.flatnonzero(off)[-1] + 1) * self._dt_s if off.any() else 0.0
        return 1e3 * settled, 100.0 * max(float(np.nanmax(mean)) - high, 0.0) / size

    def _play(self, reference_A: FloatArray, what: str, decimation: int = 10) -> Trace:
        trace = self._device.play(reference_A, RATE_HZ, decimation=decimation)
        raise_if_stopped(trace.fault, trace.remedy, what)
        if trace.samples == 0:
            raise DeviceError("the device told no samples", hint="check the line to it")
        return trace


def _shorted(why: str) -> DeviceError:
    return DeviceError(
        f"the coil is shorted: {why}",
        hint="measure the coil's resistance; look for bare wire at its terminals",
    )


def _no_coil(duty: float) -> DeviceError:
    return DeviceError(
        f"no coil: {100 * duty:.0f} % of the supply drive no current",
        hint="check the coil's plug and its wire, and that the supply is on",
    )


# Counts of a parameter for one unit of a gain in A, s and duty: see ``firmware/core/pid.h``.
_COUNTS = DUTY_FULL * CURRENT_UNIT_A
_PER = {
    "pid_kp": 4096 * _COUNTS,
    "pid_ki": 65536 * _COUNTS,  # times a tick
    "feed_resistance": 65536 * _COUNTS,
    "feed_inductance": 256 * _COUNTS,  # over a tick
    "feed_offset": float(DUTY_FULL),
}
# The duty is the reference: its counts, in units of the current.
_OPEN = Gains(pid_kp=0, pid_ki=0, feed_resistance=65535, feed_inductance=0, feed_offset=0)


def to_wire(gains: LoopGains, dt_s: float) -> Gains:
    """Return gains in the device's units, at ticks of ``dt_s``; beyond a parameter's range its end."""
    wanted = {
        "pid_kp": gains.proportional,
        "pid_ki": gains.integral * dt_s,
        "feed_resistance": gains.feed_resistance,
        "feed_inductance": gains.feed_inductance / dt_s,
        "feed_offset": gains.feed_offset,
    }
    return Gains.of({name: min(round(value * _PER[name]), _MOST[name]) for name, value in wanted.items()})


def from_wire(gains: Gains, dt_s: float) -> LoopGains:
    """Return gains of the device in A, s and duty."""
    value = {name: counts / _PER[name] for name, counts in gains.values().items()}
    return LoopGains(
        proportional=value["pid_kp"],
        integral=value["pid_ki"] / dt_s,
        feed_resistance=value["feed_resistance"],
        feed_inductance=value["feed_inductance"] * dt_s,
        feed_offset=value["feed_offset"],
    )
