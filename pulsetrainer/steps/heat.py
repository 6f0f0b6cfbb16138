"""Heat: the coil's temperature in a play, and the drive that makes up for it (in a session: conductor)."""

from __future__ import annotations

import math
from dataclasses import asdict

import numpy as np

from pulsetrainer.artefacts import Model, Waveform
from pulsetrainer.artefacts.run import Coil
from pulsetrainer.core import inversion
from pulsetrainer.core.learning import BAND_HZ
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.temperature import WINDOW_S, CoilRecord, Thermal, Thermometer
from pulsetrainer.device.device import Device
from pulsetrainer.diagnosis.prediction import extended_of, operator_of
from pulsetrainer.errors import DataError, DeviceError
from pulsetrainer.steps.invert import DEVICE_SLEW_A_PER_S
from pulsetrainer.steps.invertible import invertible
from pulsetrainer.steps.own_device import check_same_device
from pulsetrainer.steps.recording import conditioning_loop
from pulsetrainer.steps.stopped import raise_if_stopped

_RATE_HZ = 1000.0
_COLDEST_K, _HOTTEST_K = -80.0, 150.0  # against calibration: beyond, it is another coil or another supply
_NEW = 3e-4  # of the force: a change of the loss that is worth another inverse


def thermal_of(model: Model) -> Thermal | None:
    """Return the thermal term of a model; None where it has none, or one that says where it is cold."""
    for extension in model.extensions:
        value = {parameter.name: parameter.value for parameter in extension.parameters}
        if extension.cause == "thermal-drift" and "cold" not in value:
            return Thermal(value["coefficient"], value["tau"])
    return None


def thermometer_of(model: Model | None, device: Device, *, asked: bool | None) -> Thermometer | None:
    """Return the thermometer for a play, with the temperature before it; None where heat is not tracked.

    ``asked`` None: it is where the model has a thermal term, was captured with the duty, and the device tells
    it.

    DataError where it is asked for and the model does not know the coil; DeviceError where it is asked for
    and the device does not tell the duty, and as ``take_temperature``.
    """
    coil = coil_of(model, asked=asked)
    if coil is None or model is None:
        return None
    if asked is None and (model.serial not in ("", device.info.serial) or not device.tells_duty):
        return None
    device.needs_duty("tracking heat")
    check_same_device(model, device)
    meter = thermometer(coil, thermal_of(model))
    take_temperature(device, meter, operator_of(model).high)
    return meter


def coil_of(model: Model | None, *, asked: bool | None) -> Coil | None:
    """Return the coil whose heat is tracked on the model's own device; None where none is.

    ``asked`` and DataError are those of ``thermometer_of``.
    """
    if asked is False or model is None:
        return None
    if asked is None and thermal_of(model) is None:
        return None
    if asked and model.coil is None:
        raise DataError(
            "the model holds no resistance of its coil, so no heat can be tracked: its run was shorter than "
            "a minute, had pauses, or came from firmware older than protocol 2.2",
            hint="leave `track_heat` out, or make a new model and a drive of it: pulsetrainer capture "
            "identification -o long.h5, then pulsetrainer identify long.h5 -o long-model.h5, then "
            "pulsetrainer invert normal --model long-model.h5 -o long-drive.h5",
        )
    return model.coil


def thermometer(coil: Coil, thermal: Thermal | None) -> Thermometer:
    """Return the thermometer of a coil."""
    return Thermometer(CoilRecord(**asdict(coil)), thermal)


def take_temperature(device: Device, thermometer: Thermometer, high_A: float) -> None:
    """Take the temperature before a play: around the major loop, which comes first in every play anyway.

    DeviceError, Interrupted where the loop could not be completed, it tells nothing, or no room explains what
    it tells.
    """
    loop = conditioning_loop(high_A, _RATE_HZ)
    loops = 1 + math.floor(WINDOW_S * _RATE_HZ / loop.size)  # a window lies in one play, however low it is
    trace = device.play(np.tile(loop, loops), _RATE_HZ)
    raise_if_stopped(trace.fault, trace.remedy, "taking the temperature")
    thermometer.add(trace.time_s, trace.reference_A, trace.current_A, trace.duty)
    if not thermometer.known:
        raise DeviceError(
            f"the duty does not give the coil's temperature: {trace.samples} samples came back, "
            f"{trace.dropped_samples} were lost",
            hint="check the cable to the device, then run the command again; `no_track_heat` leaves heat out",
        )
    kelvin = thermometer.temperature_K
    if not _COLDEST_K <= kelvin <= _HOTTEST_K:
        raise DeviceError(
            f"by the duty the coil is {kelvin:+.0f} K against calibration, expected "
            f"{_COLDEST_K:+.0f} to {_HOTTEST_K:+.0f} K: this is a different coil or supply",
            hint="connect those used at calibration, or capture and identify again; `no_track_heat` leaves "
            "heat out",
        )


class Tracked:
    """A play whose heat is tracked: the compensated drive is made again where that has changed.

        u' = u + M^-1[y0 + (target - y0) / (1 - loss)] - M^-1[target],   y0 the force without current

    so that what was learnt beyond the model stays. What is out of reach is clipped, as the inverse does.
    """

    def __init__(self, drive: Waveform, model: Model, thermometer: Thermometer) -> None:
        part = invertible(model, drive.rate_Hz)
        self._model, self._part, self._drive, self._thermometer = model, part, drive, thermometer
        self._body = slice(part.lead.size, drive.target.size - part.tail.size)
        self._kept = (0.0, drive.compensated)
        self._cold: FloatArray | None = None
        self.temperatures: list[float] = []  # at each compensated drive, K

    @classmethod
    def of(cls, drive: Waveform, device: Device, asked: bool | None) -> Tracked | None:
        """Return the play of a drive; None where heat is not tracked. Raises as ``thermometer_of``."""
        thermometer = thermometer_of(drive.model, device, asked=asked)
        return cls(drive, drive.model, thermometer) if drive.model and thermometer else None

    def take(self, rows: FloatArray, duty: FloatArray) -> None:
        """Take in what a play brought back: reference, current and force (3, n), and the duty (n,)."""
        self._thermometer.restart()
        there = np.isfinite(duty)
        self._thermometer.add(self._drive.time_s[there], rows[0][there], rows[1][there], duty[there])

    def current(self) -> FloatArray:
        """Current (n,) in A of the compensated drive for the heat of now."""
        self._thermometer.restart()
        self.temperatures.append(self._thermometer.temperature_K)
        loss = self._thermometer.extra
        if abs(loss - self._kept[0]) > _NEW:
            if self._cold is None:
                self._cold = self._made(0.0)
            changed = self._drive.compensated + self._made(loss) - self._cold
            whole = self._part.whole
            self._kept = (loss, np.clip(changed, whole.low, whole.high))
        return self._kept[1]

    def _made(self, loss: float) -> FloatArray:
        drive, part = self._drive, self._part
        rest = rest_force(self._model)
        wanted = rest + (drive.target[self._body] - rest) / (1.0 - loss)
        if self._model.extensions:
            dt_s = 1.0 / drive.rate_Hz
            extended = extended_of(self._model)
            exact = extended.invert(wanted, dt_s, lead=part.lead, band_Hz=BAND_HZ).input
        else:
            exact = part.inverse(np.clip(wanted, *part.reach)).input
        current = inversion.slew_limited(exact, drive.rate_Hz, DEVICE_SLEW_A_PER_S)
        return np.concatenate((part.lead, current, part.tail))


def rest_force(model: Model) -> float:
    """Force of a model at the low end of its current, which no heat changes, N."""
    return operator_of(model).saturation[0]
