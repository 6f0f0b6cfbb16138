"""Random artefacts of every kind, made from the same annotations the store reads; and when two are equal."""

from __future__ import annotations

import dataclasses
from datetime import UTC, datetime
from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pulsetrainer import artefacts as kinds
from pulsetrainer.files.provenance import Device, Header, make_header
from pulsetrainer.files.schema import TIME, FieldPlan, plan_of

NOW = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
# what a text attribute holds: any Unicode but NUL and lone surrogates, which are escaped on writing
TEXTS = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=12)
ATTRIBUTES = {
    str: TEXTS,
    int: st.integers(-(2**63), 2**63 - 1),
    float: st.floats(),
    bool: st.booleans(),
}


def header(title: str = "an example", **more: Any) -> Header:
    """Return a header as a command would make it."""
    return make_header(
        title, argv=["capture", "-o", "run.h5"], now=NOW, device=Device("1", "2", "bench:"), **more
    )


def run(n: int = 50, **more: Any) -> kinds.Run:
    """Return a plain run of n samples."""
    time = np.arange(n) / 1000
    fields = {"time_s": time, "input": np.sin(time), "output": np.cos(time), "reference": np.sin(time)}
    return kinds.Run(**fields | more)


def model(n_h: int = 3, **more: Any) -> kinds.Model:
    """Return a plain model with n_h levels."""
    cells = n_h * (n_h + 1) // 2
    return kinds.Model(np.linspace(0, 1, n_h + 1), np.ones(cells), 0.5, np.ones(cells, bool), **more)


def waveform(n: int = 20, **more: Any) -> kinds.Waveform:
    """Return a plain waveform of n samples."""
    time, ones = np.arange(n) / 100, np.ones(n)
    scored = np.ones(n, bool)
    return kinds.Waveform(time, ones, ones, ones, ones, scored, "normal", "drawn", "continuous", 0, **more)


def playback(n: int = 20, repeats: int = 2) -> kinds.Playback:
    """Return a plain playback."""
    measured = kinds.DrivePlayback(*(np.ones((repeats, n)) for _ in range(3)))
    return kinds.Playback(np.arange(n) / 100, waveform(n, model=model()), measured, measured, 1.5)


def diagnosis(m: int = 12) -> kinds.Diagnosis:
    """Return a diagnosis that found one cause."""
    time, ones, group = np.arange(m) / 200, np.ones(m), np.ones(3)
    tau = kinds.Parameter("tau", 0.008, "s", 0.007, 0.009)
    cause = kinds.Cause("output-lag", True, 0.005, 98.0, 97.0, (tau,), ("delay",), "the sensor is slow")
    extended = model(extensions=(kinds.Extension("output-lag", (tau,)),))
    profile = kinds.Profile("rate", "1/s", group, group, group)
    numbers = (0.1, 1.0, 0.3, 0.9, 0.2, 0.2)
    return kinds.Diagnosis(
        "output-lag", False, *numbers, (cause,), ("why",), "next", (profile,), time, *(ones,) * 4, extended
    )


def session(n: int = 40) -> kinds.Session:
    """Return a session of two beats with a quiz of two questions."""
    time, ones, two = np.arange(n) / 1000, np.ones(n), np.ones(2)
    beats = kinds.Beats(np.array([0.0, 0.02]), 0.02 * two, np.array([0, 1]), *(two,) * 5)
    quiz = kinds.Quiz(("normal", "bifid"), ("normal", "bifid"), ("bifid", "bifid"), two)
    return kinds.Session(
        time, ones, ones, ones, ones, beats, ("normal", "bifid"), *(1.0,) * 8, mean_force=1.0, quiz=quiz
    )


EXAMPLES = {
    "session": session,
    "diagnosis": diagnosis,
    "run": run,
    "model": model,
    "waveform": waveform,
    "playback": playback,
    "evaluation": kinds.Evaluation,
}


# Units of somebody's bench, all of them units that pint knows
UNITS = st.sampled_from(
    ["1", "s", "A", "N", "mN", "V", "A/m", "T", "percent", "N/A^2", "N/(A)^2", "1/s", "Hz"]
)


@st.composite
def artefacts(draw: st.DrawFn, cls: type, inherited: int | None = None, *, full: bool = False) -> Any:
    """Draw an artefact: shapes, NaN, missing optional parts and texts at random, axes as annotated.

    A ``full`` one has every optional part, at least one of each group, and units that are units.
    """
    plans = plan_of(cls)
    own_time = any(plan.is_time_axis for plan in plans)
    level = draw(st.integers(1, 5))
    least = 2 if cls is kinds.Waveform else 0
    lengths = {
        TIME: inherited if inherited is not None and not own_time else draw(st.integers(least, 700)),
        "level": level,
        "cell": level * (level - 1) // 2,
        "repeat": draw(st.integers(0, 3)),
        "group": draw(st.integers(0, 6)),
        "place": draw(st.integers(0, 6)),
        "beat": draw(st.integers(0, 6)),
        "window": draw(st.integers(0, 6)),
        "question": draw(st.integers(0, 4)),
        "wild": draw(st.integers(0, 6)),
    }
    values = {}
    for plan in plans:
        if plan.optional and not full and draw(st.booleans()):
            values[plan.name] = None
        elif cls is kinds.Model and plan.name == "form":
            values[plan.name] = draw(st.sampled_from(["direct", "dual", "signed"]))
        elif full and plan.role == "attribute" and plan.name.endswith("unit"):
            values[plan.name] = draw(UNITS)
        elif full and plan.role == "attribute" and plan.name.endswith("quantity"):
            values[plan.name] = draw(st.sampled_from(["current", "force", "field strength"]))
        else:
            values[plan.name] = draw(_values(plan, lengths, full=full))
    return cls(**values)


def _values(plan: FieldPlan, lengths: dict[str, int], *, full: bool) -> st.SearchStrategy[Any]:
    """Return the strategy for one field."""
    quantities = st.floats(-kinds.LARGEST, kinds.LARGEST)
    if plan.data is not None and not plan.data.finite:
        quantities |= st.just(np.nan)
    floats = quantities if plan.data is None or plan.data.finite else quantities | st.just(np.inf)
    if plan.is_time_axis:
        return st.integers(0, 2**32 - 1).map(
            lambda seed: np.cumsum(np.random.default_rng(seed).uniform(1e-4, 1, lengths[TIME]))
        )
    if plan.role == "array":
        elements = {np.bool_: st.booleans(), np.int64: st.integers(0, 99)}.get(plan.type, quantities)
        return hnp.arrays(plan.type, tuple(lengths[axis] for axis in plan.dims), elements=elements)
    if plan.role == "number":
        return {float: floats, int: ATTRIBUTES[int], bool: st.booleans()}[plan.type]
    if plan.role == "attribute":
        return ATTRIBUTES[plan.type]
    if plan.role == "list":
        return st.lists(ATTRIBUTES[plan.type], max_size=3).map(tuple)
    inner = artefacts(plan.type, lengths[TIME], full=full)
    return inner if plan.role == "group" else st.lists(inner, min_size=int(full), max_size=2).map(tuple)


def equal(a: Any, b: Any) -> bool:
    """Whether two artefacts are the same to the last bit, dtypes included; NaN equals NaN."""
    if dataclasses.is_dataclass(a):
        fields = dataclasses.fields(a)
        return type(a) is type(b) and all(equal(getattr(a, f.name), getattr(b, f.name)) for f in fields)
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and np.array_equal(a, b, equal_nan=True)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(equal, a, b))
    return type(a) is type(b) and (a == b or (a != a and b != b))  # noqa: PLR0124 - NaN
