"""Check: is a model still true of its device? Ten seconds say what moved, and mend what they can."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from pulsetrainer.artefacts import Model
from pulsetrainer.core import beside_hysteresis, excitations
from pulsetrainer.core.dual import Dual
from pulsetrainer.core.edges import thinned
from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.core.temperature import COPPER_PER_K
from pulsetrainer.device.device import Device
from pulsetrainer.device.limits import check_peak
from pulsetrainer.device.trace import Trace
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.frame import low_pass
from pulsetrainer.diagnosis.prediction import operator_of, predict
from pulsetrainer.errors import DataError
from pulsetrainer.steps.heat import rest_force, thermal_of, thermometer
from pulsetrainer.steps.own_device import check_same_device, check_units
from pulsetrainer.steps.progress import Progress, silent
from pulsetrainer.steps.recording import condition
from pulsetrainer.steps.stopped import raise_if_lost, raise_if_stopped

RATE_HZ = 1000.0
SPEED_A_PER_S = 1.5  # slow, as an identification: lags and creep are not the static model's
# Corners of the current, of the range: the major loop, then loops that cross the whole plane.
_CORNERS = (0, 1, 0, 0.75, 0.1, 0.9, 0.35, 1, 0.6, 0.85, 0.25, 0.55, 0.05, 0.4, 0)
_REST_S = 0.4
_BLOCKS = 24  # of the record: what the intervals are made from
_QUANTILE = 1.96
# What a device that nobody touched shows on as-built ones; set on seeds 1 to 20, judged on others.
OFFSET_N = 0.12
GAIN = 0.015
TEMPERATURE_K = 5.0
SHAPE_PERCENT = 0.2
_SHAPE_OF_FIT = 2.0  # times what the model left of its own record, without noise
AGAIN = (
    "identify again: pulsetrainer capture identification -o new.h5, "
    "then pulsetrainer identify new.h5 -o new-model.h5"
)
_LAG_S = 0.02  # lags of this and less are alike at the pace of a check
_CREEPS_S = (0.3, 1.0, 3.0)


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value with its 95 % interval."""

    value: float
    interval: tuple[float, float]

    @classmethod
    def of(cls, value: float, error: float) -> Estimate:
        """Return a value with this standard deviation."""
        return cls(value, (value - _QUANTILE * error, value + _QUANTILE * error))


@dataclass(frozen=True, slots=True)
class Error:
    """Mean absolute error of the prediction, % of the model's span."""

    before: float
    after: float


@dataclass(frozen=True, slots=True)
class Checked:
    """What ten seconds say of a model."""

    serial: str
    verdict: str  # "true" | "shifted" | "changed"
    offset: Estimate  # N, of the zero
    gain: Estimate  # of the force, 1 as at calibration
    shape_percent: Estimate  # rms of what offset and gain leave, without noise, of the span
    temperature_K: Estimate | None  # of the copper against calibration; None where it cannot be told
    temperature_unknown: str  # why it cannot be told, empty where it can
    error_percent: Error
    seconds: float
    reasons: tuple[str, ...] = ()


def check(model: Model, device: Device, *, progress: Progress = silent) -> Checked:
    """Measure for ten seconds and say whether a model still describes a device.

        y = y_rest + offset + gain (M[u] - y_rest) + a lag + creep + what is left

    Lag and creep are those that the calibration did not take for hysteresis (``core.beside_hysteresis``): an
    unchanged device has them too, so they neither move the offset nor count as another shape.

    Parameters
    ----------
    model
        Of the device.
    device
        The device, with its force sensor.
    progress
        Called with the share of the work done, 0 to 1.

    Raises
    ------
    DataError
        The model is of another device, of another kind of device, or goes beyond the limit in force.
    DeviceError, Interrupted
        The measurement could not be finished.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> model = pt.load("tests/data/files-0.1/model.h5")
    >>> with pt.open_device("bench:?ideal") as device:
    ...     checked = pt.check(model, device)
    >>> checked.error_percent.after <= checked.error_percent.before
    True
    """
    check_units(model)
    check_same_device(model, device)
    operator = operator_of(model)  # the edges of a dual model are forces
    low, high = operator.low, operator.high
    limit_A = device.info.current_limit_A
    again = AGAIN.replace(" -o", f" --current-max {limit_A:g} -o", 1)
    check_peak(np.asarray([low, high]), limit_A, hint=again)
    condition(device, high, RATE_HZ)
    progress(0.2)
    reference = signal(max(low, 0.0), high)
    trace = device.play(reference, RATE_HZ)
    raise_if_stopped(trace.fault, trace.remedy, "the check")
    raise_if_lost(trace.samples, trace.dropped_samples, "the check")
    progress(0.9)
    # a lost sample counts nowhere; it turned where its reference did, which its neighbours cannot tell
    told, force = np.searchsorted(10 * np.arange(reference.size), trace.tick), trace.force_N
    off = np.interp(np.arange(reference.size), told, trace.current_A - reference[told])
    current = reference + off
    predicted = predict(model, current, 1.0 / RATE_HZ)
    beside, predicted = _beside(model, current, predicted)[told], predicted[told]
    rest = rest_force(model)
    span = float(np.ptp(predicted))
    offset, gain, left = _fitted(predicted - rest, beside, force - rest)
    shape = _shape(left, span)
    temperature, unknown = _temperature(model, device, trace)
    reasons = _reasons(model, offset, gain, shape, temperature)
    changed = any(reason.startswith("shape") for reason in reasons)
    mended = rest + offset.value + gain.value * (predicted - rest)
    error = Error(*(100.0 * float(np.mean(np.abs(force - one))) / span for one in (predicted, mended)))
    progress(1.0)
    return Checked(
        serial=device.info.serial,
        verdict="changed" if changed else "shifted" if reasons else "true",
        offset=offset,
        gain=gain,
        shape_percent=shape,
        temperature_K=temperature,
        temperature_unknown=unknown,
        error_percent=error,
        seconds=reference.size / RATE_HZ,
        reasons=tuple(reasons),
    )


def signal(low_A: float, high_A: float) -> FloatArray:
    """Current (n,) of a check: nine seconds over the range of our device."""
    corners = low_A + (high_A - low_A) * np.asarray(_CORNERS, dtype=np.float64)
    way = excitations.through(corners, SPEED_A_PER_S, RATE_HZ)
    rest = np.full(round(_REST_S * RATE_HZ), low_A)
    return np.concatenate((rest, way, rest))


def updated(model: Model, checked: Checked) -> Model:
    """Return a model with offset and gain as a check found them; its coil counts from the heat of now.

    DataError where the shape changed, which ten seconds do not mend, or the model has causes that a gain
    would change.
    """
    if checked.verdict == "changed":
        raise DataError(
            f"the shape of the hysteresis changed ({checked.shape_percent.value:.1f} % of the span is left): "
            "no offset or gain puts that right",
            hint=AGAIN,
        )
    check_updatable(model)
    gain, rest = checked.gain.value, rest_force(model)
    coil = model.coil
    if coil is not None and checked.temperature_K is not None:
        warmer = 1.0 + COPPER_PER_K * checked.temperature_K.value
        coil = replace(coil, duty_per_A=coil.duty_per_A * warmer, rise_per_A2=coil.rise_per_A2 / warmer)

    def scaled(weights: FloatArray | None) -> FloatArray | None:
        return None if weights is None else gain * weights

    return replace(
        model,
        weights=gain * model.weights,
        weights_lower=scaled(model.weights_lower),
        weights_upper=scaled(model.weights_upper),
        offset=rest + checked.offset.value + gain * (model.offset - rest),
        coil=coil,
    )


def check_updatable(model: Model) -> None:
    """Raise DataError for a model that an offset and a gain do not mend, as ``hindrance`` says."""
    if what := hindrance(model):
        raise DataError(
            f"an offset and a gain cannot put right a model with {what}", hint="identify it again"
        )


def hindrance(model: Model) -> str:
    """Return what of a model an offset and a gain do not mend, empty where they mend it."""
    hindered = [one.cause for one in model.extensions if not library()[one.cause].scales]
    if model.form == "direct" and not hindered:
        return ""
    return f"the causes {', '.join(hindered)}" if hindered else f"the form {model.form}"


def _beside(model: Model, current: FloatArray, predicted: FloatArray) -> FloatArray:
    """What a lag and creeps add to a prediction (n,), each for its unit, (n, k).

    None, k = 0, where the model does not keep the record it was made from.
    """
    fit = model.fit
    if fit is None or fit.time_s is None:
        return np.empty((current.size, 0))
    # a coarse model could take no more for hysteresis than its own levels hold
    operator, levels = operator_of(model), beside_hysteresis.LEVELS
    if isinstance(operator, Dual):
        plane = Plane.uniform(operator.low, operator.high, levels)
    else:
        plane = thinned(operator.plane, levels)
    dt_s = float(np.median(np.diff(fit.time_s)))
    then, now = _effects(predict(model, fit.input, dt_s), dt_s), _effects(predicted, 1.0 / RATE_HZ)
    return beside_hysteresis.missed(plane, fit.input, then, current, now)


def _effects(predicted: FloatArray, dt_s: float) -> FloatArray:
    """A lag of a prediction (n,) and its creeps, (n, k)."""
    slow = [low_pass(predicted, tau, dt_s) for tau in (_LAG_S, *_CREEPS_S)]
    return np.stack((predicted - slow[0], *slow[1:]), axis=1)


def _fitted(
    model_N: FloatArray, beside_N: FloatArray, force_N: FloatArray
) -> tuple[Estimate, Estimate, FloatArray]:
    """Offset and gain by least squares, their intervals by leaving out blocks, and what is left (n,).

    What is ``beside_N`` (n, k) is fitted as well and taken out of what is left.
    """
    design = np.column_stack((np.ones(model_N.size), model_N, beside_N))
    edges = np.linspace(0, model_N.size, _BLOCKS + 1).astype(int)
    parts = [slice(a, b) for a, b in pairwise(edges)]
    normal = [(design[p].T @ design[p], design[p].T @ force_N[p]) for p in parts]
    whole = sum(n for n, _ in normal), sum(r for _, r in normal)
    found = np.linalg.solve(whole[0], whole[1])
    without = np.stack([np.linalg.solve(whole[0] - n, whole[1] - r) for n, r in normal])
    spread = np.sqrt((_BLOCKS - 1) / _BLOCKS * np.sum((without - without.mean(axis=0)) ** 2, axis=0))
    offset, gain = (Estimate.of(float(found[k]), float(spread[k])) for k in range(2))
    return offset, gain, np.asarray(force_N - design @ found)


def _shape(left: FloatArray, span: float) -> Estimate:
    """Rms of what is left without its noise, % of the span, from means of neighbours in blocks."""
    pairs = 10
    means = left[: left.size // pairs * pairs].reshape(-1, pairs).mean(axis=1)
    noise = float(np.median(np.abs(np.diff(left)))) / 0.6745 / np.sqrt(2.0)
    square = means**2 - noise**2 / pairs
    blocks = np.array([block.mean() for block in np.array_split(square, _BLOCKS)])
    error = float(blocks.std(ddof=1)) / np.sqrt(_BLOCKS)
    value, low, high = (
        100.0 * float(np.sqrt(max(x, 0.0))) / span
        for x in (blocks.mean(), blocks.mean() - _QUANTILE * error, blocks.mean() + _QUANTILE * error)
    )
    return Estimate(value, (low, high))


def _temperature(model: Model, device: Device, trace: Trace) -> tuple[Estimate | None, str]:
    """Temperature of the copper, K, in the mean of the windows; None where it cannot be told, and why."""
    if model.coil is None:
        return (
            None,
            "the model's capture was too short, or had pauses, so it does not give the coil's resistance",
        )
    if not device.tells_duty:
        return None, "the device does not report the duty of its output"
    meter = thermometer(model.coil, thermal_of(model))
    told = []
    for start in range(0, trace.tick.size, 250):
        piece = slice(start, start + 250)
        if meter.add(
            trace.time_s[piece], trace.reference_A[piece], trace.current_A[piece], trace.duty[piece]
        ):
            told.append(meter.temperature_K)
    if len(told) < 3:
        return None, "too few seconds of the check show it"
    mean, error = float(np.mean(told)), float(np.std(told, ddof=1)) / np.sqrt(len(told))
    return Estimate.of(mean, error), ""


def _shape_of_fit(model: Model) -> float:
    """What a model left of its own record, without noise, % of the span."""
    fit = model.fit
    if fit is None:
        return 0.0
    return _shape(fit.output - fit.predicted, float(np.ptp(fit.predicted))).value


def _reasons(
    model: Model, offset: Estimate, gain: Estimate, shape: Estimate, temperature: Estimate | None
) -> list[str]:
    """What moved, by more than a device does that nobody touched."""
    reasons = []
    limit = max(SHAPE_PERCENT, _SHAPE_OF_FIT * _shape_of_fit(model))
    if shape.value > limit:
        left = f"{shape.value:.2f} % of the span (limit {limit:.2f} %)"
        reasons.append(f"shape: offset and gain leave {left}")
    if abs(offset.value) > OFFSET_N and not offset.interval[0] <= 0 <= offset.interval[1]:
        reasons.append(f"offset: the zero moved by {offset.value:+.2f} N (limit {OFFSET_N:g} N)")
    if abs(gain.value - 1.0) > GAIN and not gain.interval[0] <= 1 <= gain.interval[1]:
        moved = 100 * (gain.value - 1.0)
        reasons.append(f"gain: the force moved by {moved:+.1f} % (limit {100 * GAIN:g} %)")
    if temperature is not None and abs(temperature.value) > TEMPERATURE_K:
        warmer = f"{temperature.value:+.0f} K from calibration (limit {TEMPERATURE_K:g} K)"
        reasons.append(f"temperature: the coil is {warmer}")
    return reasons
