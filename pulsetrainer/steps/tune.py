"""Tune: measure the coil with the device itself, set the gains of its current loop by a rule, verify them."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pulsetrainer.artefacts import Waveform
from pulsetrainer.core import coil as electrical
from pulsetrainer.core.coil import Coil, Margins
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray, positive
from pulsetrainer.core.pulses import Shape, train
from pulsetrainer.device.device import Device
from pulsetrainer.device.gains import Gains
from pulsetrainer.device.limits import Limits, Rehearsal, check_peak
from pulsetrainer.errors import ArgumentError, DeviceError, PulsetrainerError
from pulsetrainer.steps.loop_gains import MOST_PROPORTIONAL, OPEN_LOOP, from_wire, to_wire
from pulsetrainer.steps.measure_coil import MEAN_S, RATE_HZ, Measurement, Step, check_range, planned, rest_of
from pulsetrainer.steps.own_device import check_units
from pulsetrainer.steps.progress import Progress, silent

_DIODE_V = (0.15, 2.0)  # what any diode drops
_SUPPLY_OFF = 0.05  # share of the supply: what the diode's drop tells is hardly better
_FOLLOWS = 0.01  # of the range: what nobody can do better than is no fault of the gains
_SINE_HZ = 4.0
_SINE = (0.5, 0.25)  # of the range: middle and amplitude
_STEP = (0.45, 0.65)  # of the range
_STEP_HOLD_S = 0.1
_STEPS = 4
_SETTLED = 0.02  # of the step, above three times the noise
_NOISE_A = 0.0015
_BEATS = 2
_SOUND_GAIN, _SOUND_PHASE = 1.6, 20.0  # margins below which gains are not tried


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
        drives, which rise faster than the pulses that they press. ``pt.tune`` takes names and tables too.
    supply_V
        Voltage of the supply where it has been measured; ohms and henries then follow from it. None: they
        follow from the drop of the free-wheeling diode, 0.6 V. The gains need neither.
    progress
        Called with the share of the work done, 0 to 1.

    Raises
    ------
    ArgumentError
        A drive goes beyond the device's range, or no diode explains the coil at that supply.
    DeviceError
        No coil, a shorted one, one that the supply cannot drive over the pulses (with the reason), a force at
        rest, a fault, or a firmware that does not report the duty. The output is off and the gains are those
        from before.
    Interrupted
        Ctrl-C: the output was stopped first.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> with pt.open_device("bench:") as device:
    ...     tuned = pt.tune(device, pulses=["normal"])
    >>> round(tuned.resistance_ohm, 1), tuned.tracking_percent.after < 1.0
    (5.0, True)
    """
    _check(pulses, supply_V, device.info.current_limit_A)
    device.needs_duty("tuning")
    before = device.gains
    try:
        return _Tuning(device, pulses, supply_V, progress).run(before)
    except BaseException:
        with contextlib.suppress(PulsetrainerError):  # it stops by itself; what went wrong first is told
            device.stop()
        device.set_gains(before)
        raise


def _check(pulses: Sequence[Shape | Waveform], supply_V: float | None, limit_A: float) -> None:
    if supply_V is not None:
        positive(supply_V=supply_V)
    check_range(limit_A)
    for pulse in pulses:
        if isinstance(pulse, Waveform):
            check_units(pulse)
            check_peak(pulse.compensated, limit_A)


@dataclass(frozen=True, slots=True)
class Plan:
    """What would be played."""

    steps: tuple[Step, ...]
    seconds: float  # at most: the first look ends as soon as a current flows
    current_limit_A: float
    force_limit_N: float  # the force is known once it is measured
    heat_percent: float  # the most, of that at which the device stops
    peak_current_A: float
    rms_current_A: float


def plan(
    pulses: Sequence[Shape | Waveform], *, supply_V: float | None = None, limits: Limits | None = None
) -> Plan:
    """Return what ``tune`` would play at most on a device as it is delivered, with a cold coil; fails as it.

    What the coil, its supply and the force sensor are like nobody knows before.
    """
    rehearsal = Rehearsal(limits or Limits())
    range_A = rehearsal.current_A
    _check(pulses, supply_V, range_A)
    names = ["sine", *(pulse.name for pulse in pulses)]
    verified = list(zip(names, references(pulses, range_A), strict=True))
    played = [(*one, "none") for one in planned(range_A)]
    played += [(*one, gains) for gains in ("before", "new") for one in verified]
    played += [("steps", step_reference(range_A), "new"), (*rest_of(), "none")]
    steps = []
    for what, current, gains in played:
        rehearsal.play(current, RATE_HZ)
        steps.append(Step(what, float(current.max()), current.size / RATE_HZ, gains))
    currents = np.concatenate([current for _, current, _ in played])
    return Plan(
        steps=tuple(steps),
        seconds=currents.size / RATE_HZ,
        current_limit_A=range_A,
        force_limit_N=rehearsal.force_N,
        heat_percent=100.0 * rehearsal.most_heat,
        peak_current_A=float(currents.max()),
        rms_current_A=root_mean_square(currents),
    )


def references(pulses: Sequence[Shape | Waveform], range_A: float) -> list[FloatArray]:
    """Return what is followed to verify, A: a sine of half the range, then the pulses over all of it."""
    phase = 2.0 * math.pi * np.arange(round(2 * RATE_HZ / _SINE_HZ) + 1) * _SINE_HZ / RATE_HZ
    middle, swing = _SINE
    up = np.linspace(0.0, middle - swing, round(MEAN_S * RATE_HZ))
    sine = np.concatenate((up, middle - swing * np.cos(phase), up[::-1]))
    return [range_A * sine, *(_current(pulse, range_A) for pulse in pulses)]


def _current(pulse: Shape | Waveform, range_A: float) -> FloatArray:
    """Return the current (n,) of a pulse, A."""
    if isinstance(pulse, Shape):
        return train(pulse, periods=_BEATS, rate_Hz=RATE_HZ, low=0.0, high=range_A)
    samples = np.arange(round(float(pulse.time_s[-1]) * RATE_HZ) + 1)
    return np.interp(samples / RATE_HZ, pulse.time_s, pulse.compensated)


def step_reference(range_A: float) -> FloatArray:
    """Return some steps up and down, (n,) in A."""
    low, high = (share * range_A for share in _STEP)
    half = round(_STEP_HOLD_S * RATE_HZ)
    one = np.concatenate((np.full(half, low), np.full(half, high)))
    return np.concatenate((np.linspace(0.0, low, half), np.tile(one, _STEPS), np.linspace(low, 0.0, half)))


class _Tuning(Measurement):
    """One device being tuned."""

    def __init__(
        self, device: Device, pulses: Sequence[Shape | Waveform], supply_V: float | None, progress: Progress
    ) -> None:
        super().__init__(device, supply_known=supply_V is not None, progress=progress)
        self._pulses, self._supply_V = pulses, supply_V

    def run(self, before: Gains) -> Tuned:
        device = self._device
        device.set_gains(OPEN_LOOP)
        rest_N = self.rest()
        coil = self.coil()
        self.same_rest(rest_N)
        self._progress(0.4)
        ohm, henry, volts = self._scaled(coil)
        followed = references(self._pulses, self._range_A)
        self._check_drivable(coil, followed[1:], ohm, volts)
        rule = electrical.tuned_gains(
            coil, self._dt_s, top_A=self._range_A, most_proportional=MOST_PROPORTIONAL
        )
        gains = to_wire(rule, self._dt_s)
        was = electrical.margins(coil, from_wire(before, self._dt_s), self._dt_s)
        now = electrical.margins(coil, from_wire(gains, self._dt_s), self._dt_s)
        error_before = self._before(before, was, followed)
        self._progress(0.7)
        device.set_gains(gains)
        error = max(self._error_percent(reference) for reference in followed)
        settle_ms, overshoot = self._step()
        self.same_rest(rest_N)
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
            notes=tuple(self.notes),
        )

    def _scaled(self, coil: Coil) -> tuple[float, float, float]:
        """Resistance, ohm, inductance, H, and supply, V."""
        if self._supply_V is None:
            return coil.resistance_ohm, coil.inductance_H, coil.supply_V
        drop_V = electrical.DIODE_V * self._supply_V / coil.supply_V
        low, high = _DIODE_V
        if not low <= drop_V <= high:
            raise ArgumentError(
                f"a supply of {self._supply_V:g} V does not fit the coil's current: the free-wheeling diode "
                f"would drop {drop_V:.2g} V, expected {low:g} to {high:g} V",
                hint="measure the supply again, or leave `supply_V` out",
            )
        if abs(self._supply_V / coil.supply_V - 1.0) > _SUPPLY_OFF:
            self.notes.append(
                f"a supply of {self._supply_V:g} V was taken as given, as the device does not measure it; a "
                f"diode of the usual {electrical.DIODE_V:g} V makes it {coil.supply_V:.1f} V. Ohms and "
                "henries are as good as the volts, the loop gains are the same with either"
            )
        return (*coil.scaled_to(self._supply_V), self._supply_V)

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
                if steady < volts:  # the duty says so all the same: the voltage falls as the current rises
                    said = (
                        f"{what} (voltage): {top:.2f} A need {steady:.1f} V, and the supply, {volts:.1f} V "
                        "without a load, sags below that under this one"
                    )
            else:
                way = "rise" if error[at] > 0 else "fall"
                said = (
                    f"{what} (time constant): with {1e3 * coil.tau_s:.0f} ms and {volts:.1f} V the current "
                    f"cannot {way} as fast as they do, by {1e3 * abs(error[at]):.0f} mA"
                )
            raise DeviceError(
                said,
                hint="use a supply of more voltage that holds it, a coil of fewer turns, or a lower current "
                "limit",
            )

    # --- verifying -------------------------------------------------------------------------------

    def _before(self, gains: Gains, sound: Margins, references: Sequence[FloatArray]) -> float | None:
        """Return the error with the gains from before, where they are fit to be tried on this coil."""
        if not (sound.stable and sound.gain >= _SOUND_GAIN and sound.phase_deg >= _SOUND_PHASE):
            self.notes.append(
                f"the gains from before were not tried: on this coil they would ring (gain margin "
                f"{sound.gain:.2f}, phase margin {sound.phase_deg:.0f} degrees)"
            )
            return None
        self._device.set_gains(gains)
        try:
            return max(self._error_percent(reference) for reference in references)
        except DeviceError as error:
            self.notes.append(f"with the gains from before: {error.message}")
            return None

    def _error_percent(self, reference_A: FloatArray) -> float:
        trace = self.play(reference_A, "the verification")
        return 100.0 * float(np.abs(trace.current_A - trace.reference_A).max()) / self._range_A

    def _step(self) -> tuple[float, float]:
        """Settling time, ms, and overshoot, % of the step, in the mean of some steps."""
        low, high = (share * self._range_A for share in _STEP)
        half = round(_STEP_HOLD_S * RATE_HZ)
        reference = step_reference(self._range_A)
        trace = self.play(reference, "the verification", decimation=1)
        told = np.full(reference.size * round(self._device.info.tick_rate_Hz / RATE_HZ), np.nan)
        told[trace.tick] = trace.current_A
        ticks = round(_STEP_HOLD_S / self._dt_s)
        begins = [(half * (2 + 2 * k)) * (ticks // half) - ticks // half for k in range(_STEPS)]
        mean = np.nanmean([told[begin : begin + ticks] for begin in begins], axis=0)
        size = high - low
        off = np.abs(mean - high) > max(_SETTLED * size, _NOISE_A)
        settled = float(np.flatnonzero(off)[-1] + 1) * self._dt_s if off.any() else 0.0
        return 1e3 * settled, 100.0 * max(float(np.nanmax(mean)) - high, 0.0) / size
