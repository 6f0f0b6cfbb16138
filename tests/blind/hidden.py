"""What is hidden: effects drawn by seed, put into the bench, and given to the judge only afterwards.

``draw`` makes a case from a seed; ``measure`` plays it on the real firmware and returns nothing but what a
device reports. The judge sees the case when the verdict is in.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import scipy

import pulsetrainer.simulation  # noqa: F401 - announces bench: and qemu:
from pulsetrainer.core import excitations
from pulsetrainer.core.record import Record
from pulsetrainer.device.opening import open_device

RATE_HZ = 1000.0
HIGH_A = 1.5
DT_S = 1.0 / RATE_HZ
REST_S = 0.2
# The bench's current filter makes the measured current late. Nothing in a record tells this from the device:
# what can be identified is each lag relative to the measured current, and a force that leads it by this much.
FILTER_S = 0.0001
SLOPE_N_A = 9.5  # the bench's force over its current, on the whole


def _log(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _sign(rng):
    return float(rng.choice([-1, 1]))


# For each cause, given a generator and a factor of its strength (1: half a per cent of the span or more): the
# bench's parameters, and the truth of the diagnosis's own.
LIBRARY = {
    "output-lag": lambda r, s: ({"output-lag": (v := s * _log(r, 0.0016, 0.016))}, {"tau": v - FILTER_S}),
    "field-lag": lambda r, s: ({"field-lag": (v := s * _log(r, 0.0018, 0.016))}, {"tau": v - FILTER_S}),
    "delay": lambda r, s: ({"delay": (v := s * _log(r, 0.0016, 0.012))}, {"delay": v - FILTER_S}),
    "rate-widening": lambda r, s: ({"rate-widening": (v := s * _log(r, 0.005, 0.025))}, {"coefficient": v}),
    "viscous": lambda r, s: (
        {"viscous": (v := s * _log(r, 0.017, 0.06))},
        {"coefficient": v + FILTER_S * SLOPE_N_A},
    ),
    "creep": lambda r, s: (
        {"creep": (v := s * _log(r, 0.024, 0.1)), "creep-tau": (t := _log(r, 0.5, 2.0))},
        {"amplitude": v, "tau": t},
    ),
    "thermal-drift": lambda r, s: (
        {"thermal-drift": (v := s * _log(r, 0.014, 0.05)), "thermal-tau": (t := _log(r, 10, 30))},
        {"coefficient": v, "tau": t},
    ),
    "offset-drift": lambda r, s: (
        {"offset-drift": (v := max(s * _sign(r) * _log(r, 0.0015, 0.008), LOWEST_DRIFT))},
        {"rate": v},
    ),
    "resonance": lambda r, s: (
        {"resonance": (f := _log(r, 8, 40) / s), "resonance-zeta": (z := _log(r, 0.08, 0.4))},
        {"frequency": f, "damping": z},
    ),
    "periodic": lambda r, s: (
        {"periodic": s * _log(r, 0.11, 0.4), "periodic-frequency": (f := _log(r, 2, 60))},
        {"frequency": f},
    ),
    "step": lambda r, s: (
        {"step": (v := s * _sign(r) * _log(r, 0.15, 0.5)), "step-time": r.uniform(25, 75)},
        {"offset": v},
    ),
    "load-dependence": lambda r, s: (
        {"load-dependence": (v := s * _sign(r) * _log(r, 0.001, 0.01))},
        {"coefficient": v},
    ),
    "accommodation": lambda r, s: (
        {"accommodation": (v := s * _log(r, 0.02, 0.25)), "accommodation-path": (p := _log(r, 15, 60))},
        {"amplitude": v, "path": p},
    ),
    "stick-slip": lambda r, s: ({"stick-slip": s * _log(r, 0.2, 0.6)}, {}),
    "saturation": lambda r, _: ({"saturation": (v := r.uniform(10.5, 12.5))}, {"size": v}),
    "quantisation": lambda r, s: ({"quantisation": (v := s * _log(r, 0.25, 0.6))}, {"size": v}),
    "outliers": lambda r, s: ({"outliers": s * _log(r, 0.001, 0.01), "outlier-size": _log(r, 2, 6)}, {}),
    # on the measurement itself: the bench has no second clock, no second condition and no other range
    "clock-skew": lambda r, s: ({}, {"skew": s * _sign(r) * _log(r, 3e-5, 2.5e-4)}),
    "late-input": lambda r, s: ({}, {"delay": s * _log(r, 0.0016, 0.012) + FILTER_S}),
    "input-lag": lambda r, s: ({}, {"tau": s * _log(r, 0.0018, 0.016) + FILTER_S}),
    "gain-drift": lambda r, s: ({}, {"gain": s * _sign(r) * _log(r, 0.0003, 0.0015)}),
    "condition-change": lambda r, s: (
        {},
        {"offset": s * _sign(r) * _log(r, 0.1, 0.4), "gain": s * _sign(r) * _log(r, 0.01, 0.04)},
    ),
    "leak": lambda r, s: (
        {},
        {"rate": s * _log(r, 0.004, 0.3), "at first": r.uniform(-4, 4)},
    ),
    "frozen": lambda r, s: ({}, {"stretches": max(3, round(s * r.uniform(10, 40)))}),
    # what a driver delivers whose supply is too low; on the bench itself the firmware stops such a play
    "current-tracking": lambda r, _: ({}, {"top": r.uniform(1.24, 1.44)}),
    "out-of-range": lambda r, _: ({}, {"high": r.uniform(1.2, 1.4)}),
    "clipped-input": lambda r, _: ({}, {"size": r.uniform(1.1, 1.4)}),
}
LOWEST_DRIFT = -0.006  # N/s: with more the zero falls below what the device takes for a sound sensor
SETTINGS = ("seed", "noise-seed", "noise")
# what the library does not hold, put on the measured output
OUTSIDE = ("gain wander", "hidden load", "bursts")
FAMILIES = (
    {"delay", "field-lag", "output-lag", "rate-widening", "viscous", "late-input", "input-lag"},
    {"offset-drift", "step", "gain-drift"},
    {"thermal-drift", "gain-drift"},
    {"creep", "accommodation", "leak"},
)
# The bench clips and digitises its output before a gain is made to drift: rails and steps would drift, too.
NOT_TOGETHER = ({"gain-drift", "saturation"}, {"gain-drift", "quantisation"})
# Not in pairs: an amplifier behind all that the bench measures, a second record, effects that take data
# away, and a feedback that the weights of this bench can hold as a whole (what is left of it is below a
# fortieth of a per cent of the span).
ALONE = (
    "leak",
    "frozen",
    "condition-change",
    "out-of-range",
    "clipped-input",
    "current-tracking",
    "load-dependence",
)


@dataclass(frozen=True)
class Case:
    """A hidden truth."""

    seed: int
    causes: tuple[str, ...]  # empty: a control
    settings: dict = field(default_factory=dict)
    truth: dict = field(default_factory=dict)  # cause: parameters
    outside: str = ""

    @property
    def port(self) -> str:
        """The bench that hides it."""
        words = [f"{name}={value}" for name, value in self.settings.items()]
        return "bench:?" + "&".join(["ideal", *words])

    @property
    def healthy(self) -> Case:
        """The same device and noise with nothing hidden."""
        return Case(self.seed, (), {k: v for k, v in self.settings.items() if k in SETTINGS})


@dataclass(frozen=True)
class Data:
    """What the judge gets to see."""

    records: list[Record]
    high: float  # of the range that was identified
    played: float  # highest current


def draw(kind: str, seed: int) -> Case:
    """Draw a case: ``control``, ``single:NAME``, ``weak:NAME``, ``pair``, ``triple`` or ``unknown``."""
    rng = np.random.default_rng([seed, *kind.encode()])
    settings = {
        "seed": int(rng.integers(1, 10_000)),
        "noise-seed": int(rng.integers(1, 1000)),
        "noise": round(_log(rng, 0.001, 0.004), 5),
    }
    kind, _, name = kind.partition(":")
    if kind == "unknown":
        return Case(seed, (), settings, {}, OUTSIDE[int(rng.integers(len(OUTSIDE)))])
    # a generator of its own: a name more in the library must not change what the others draw
    several = _of_different_families(np.random.default_rng([seed, *b"families"]))
    names = {"control": [], "pair": several[:2], "triple": several}.get(kind, [name])
    factor = _log(rng, 0.02, 0.5) if kind == "weak" else 1.0
    truth = {}
    for one in names:
        more, truth[one] = LIBRARY[one](rng, factor)
        settings |= more
    return Case(seed, tuple(names), settings, truth)


def _of_different_families(rng):
    """Three causes of different families: two of one family are one cause to any eye."""
    names: list[str] = []
    for name in rng.permutation([name for name in LIBRARY if name not in ALONE]).tolist():
        others = any(name in f and set(names) & f for f in (*FAMILIES, *NOT_TOGETHER))
        if len(names) < 3 and not others:
            names.append(name)
    return names


class RefusedByTheDeviceError(RuntimeError):
    """The device trips at every amplitude: by the force, or as its sensor tells what cannot be."""


class NothingHiddenError(RuntimeError):
    """What was drawn never acts: the device does not reach the output at which it is clipped."""


def measure(case: Case) -> Data:
    """Play the diagnostic signal on the bench; return what the device reports.

    A device that trips its force limit, as a ringing one may, is played at less.
    RefusedByTheDeviceError where it trips at all; NothingHiddenError where nothing of the effect is there.
    """
    for high in (HIGH_A, 1.2, 0.9, 0.6, 0.4):
        record = _play(case, high)
        if record is not None:
            break
    else:
        raise RefusedByTheDeviceError(case.port)
    if "saturation" in case.causes:
        twin = _play(case.healthy, high)
        if twin is not None and twin.output.max() < case.truth["saturation"]["size"]:
            raise NothingHiddenError(f"{case.port}: reaches {twin.output.max():.4g} N")
    records, range_high = [_spoilt(case, record)], high
    if "condition-change" in case.causes:
        change = case.truth["condition-change"]
        later = _play(replace(case, settings=case.settings | {"noise-seed": 1001}), high, seconds=30.0)
        assert later is not None
        # the offset is that at the output of empty memory
        changed = later.output + change["gain"] * (later.output - _empty(case, high)) + change["offset"]
        records.append(replace(later, output=changed))
    if "out-of-range" in case.causes:
        range_high = min(case.truth["out-of-range"]["high"], 0.9 * high)
    return Data(records, range_high, high)


def _play(case: Case, high: float, seconds: float | None = None) -> Record | None:
    value = excitations.diagnostic(0.0, high, rate_Hz=RATE_HZ).value
    if seconds is not None:
        value = value[: round(seconds * RATE_HZ)]
    with open_device(case.port) as device:
        if device.play(_lead(high), RATE_HZ).fault:
            return None
        top = case.truth.get("current-tracking", {}).get("top", np.inf)
        got = device.play(np.minimum(value, top), RATE_HZ)
    if got.fault:
        return None
    asked = got.reference_A if np.isinf(top) else value[got.tick // round(device.info.tick_rate_Hz / RATE_HZ)]
    return Record(got.current_A, got.force_N, dt_s=DT_S, reference=asked)


def _lead(high: float) -> np.ndarray:
    """Once around the major loop, and a rest: the memory is empty then."""
    return excitations.conditioning(0.0, high, speed=3.0, rate_Hz=RATE_HZ, rest_s=REST_S)


def _empty(case: Case, high: float) -> float:
    """Output of empty memory."""
    with open_device(case.port) as device:
        return float(np.median(device.play(_lead(high), RATE_HZ).force_N[-round(REST_S / 2 * RATE_HZ) :]))


def size_percent(case: Case, data: Data) -> float:
    """Rms of what the effect changes in the output, in per cent of its span, against the healthy device."""
    last = data.records[-1]
    twin = _play(case.healthy, data.played, last.input.size * DT_S)
    if "condition-change" in case.causes:
        twin = _play(
            replace(case.healthy, settings=case.healthy.settings | {"noise-seed": 1001}), data.played, 30.0
        )
    assert twin is not None
    count = min(twin.output.size, last.output.size)
    if "current-tracking" in case.causes:  # the device is healthy: its driver is not
        return float(100 * np.sqrt(np.mean((last.input - last.reference) ** 2)) / data.played)
    difference = last.output[:count] - twin.output[:count]
    if "clipped-input" in case.causes:  # the device is healthy: its recorder is not
        lost = twin.input[:count] - last.input[:count]
        return float(100 * np.sqrt(np.mean(lost**2)) / data.played)
    if "out-of-range" in case.causes:
        outside = np.maximum(last.input - data.high, 0.0)
        return float(100 * np.sqrt(np.mean(outside**2)) / data.played)
    return float(100 * np.sqrt(np.mean(difference**2)) / np.ptp(twin.output))


def _spoilt(case: Case, record: Record) -> Record:
    """The record with what the bench itself cannot hide."""
    rng = np.random.default_rng([case.seed, 77])
    t, y = np.arange(record.output.size) * DT_S, record.output.copy()
    if "clock-skew" in case.causes:
        y = np.interp(t * (1.0 + case.truth["clock-skew"]["skew"]), t, y)
        if "quantisation" in case.causes:  # the other clock's converter has the same steps
            step = case.truth["quantisation"]["size"]
            y = np.round(y / step) * step
    if "gain-drift" in case.causes:  # of the sensor, which knows no output of an empty memory
        y = y * (1.0 + case.truth["gain-drift"]["gain"] * t)
    if "leak" in case.causes:  # z' = y' - k z, for an output that is straight between samples
        left = np.exp(-case.truth["leak"]["rate"] * DT_S)
        into = (1.0 - left) / (case.truth["leak"]["rate"] * DT_S)
        moves = np.diff(y, prepend=y[0]) * into
        moves[0] = case.truth["leak"]["at first"]
        y = scipy.signal.lfilter([1.0], [1.0, -left], moves)
    for _ in range(case.truth.get("frozen", {}).get("stretches", 0)):  # of 0.05 to 0.4 s
        begin, length = int(rng.integers(0, y.size - 400)), int(rng.integers(50, 400))
        y[begin : begin + length] = y[begin]
    if case.outside == "gain wander":
        y = y * (1.0 + 0.02 * np.sin(2 * np.pi * t / rng.uniform(7, 13) + rng.uniform(0, 6)))
    if case.outside == "hidden load":  # somebody leans on the device now and then
        edges = np.sort(rng.uniform(0, t[-1], 24)).reshape(-1, 2)
        y = y + 0.35 * np.any([(t > a) & (t < b) for a, b in edges], axis=0)
    if case.outside == "bursts":
        burst = np.sin(2 * np.pi * 11 * t + 3 * np.sin(2 * np.pi * 0.7 * t)) * (
            np.sin(2 * np.pi * t / 17) > 0.3
        )
        y = y + 0.25 * burst * np.sin(2 * np.pi * t / 3.1)
    top = case.truth.get("clipped-input", {}).get("size", np.inf)
    u = np.minimum(record.input, top)
    if "late-input" in case.causes:
        u = np.interp(t - (case.truth["late-input"]["delay"] - FILTER_S), t, u)
    if "input-lag" in case.causes:  # tau z' + z = u, for an input that is straight between samples
        lag = (case.truth["input-lag"]["tau"] - FILTER_S) / DT_S
        left = np.exp(-1.0 / lag)
        b = np.asarray([1.0 - lag * (1.0 - left), lag * (1.0 - left) - left])
        u = scipy.signal.lfilter(b, [1.0, -left], u, zi=[(1.0 - b[0]) * u[0]])[0]
    # a recorder that is late is not the driver's own: it knows no reference
    late = {"late-input", "input-lag"} & set(case.causes)
    return replace(record, input=u, output=y, reference=None if late else record.reference)
