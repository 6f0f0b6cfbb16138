"""An output that is held at a level before noise is added: told by the model as given."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import pulsetrainer as pt
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.raw import Raw
from pulsetrainer.diagnosis.stages.raw_data import masked_by

STEP_S = 0.01
RADII = np.linspace(0.02, 0.5, 10)


def _plays(u: np.ndarray) -> np.ndarray:
    """Ten plays from -1, with a straight part."""
    y = 0.4 * u
    for radius in RADII:
        at = -1.0 + radius
        y = y + 0.06 * np.asarray([at := min(max(at, x - radius), x + radius) for x in u.tolist()])
    return y


def _input(rng: np.random.Generator, turns: int = 60) -> np.ndarray:
    """Straight strokes between random turns, first over the whole range."""
    at = [-1.0, 1.0, -1.0, *rng.uniform(-1.0, 1.0, turns), 1.0, -1.0]
    return np.concatenate(
        [np.linspace(a, b, max(3, int(abs(b - a) / 0.01)), endpoint=False) for a, b in pairwise(at)]
    )


def _run(u: np.ndarray, y: np.ndarray) -> pt.Run:
    return pt.Run(time_s=STEP_S * np.arange(u.size), input=u, output=y)


def _gate(u: np.ndarray, y: np.ndarray, said: np.ndarray):
    record = Record(u, y, np.ones(u.size), dt_s=STEP_S)
    return library()["saturation"].gate(Raw(record, -1.0, 1.0, said=said))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_rail_is_found_at_either_end_within_its_error(seed, sign):
    """Every sample that is held has no weight, and few others."""
    rng = np.random.default_rng(seed)
    u = _input(rng)
    clean, noise = _plays(u), 0.002 * 1.6
    cut = rng.uniform(0.03, 0.2)
    rail = sign * (np.max(sign * clean) - cut * np.ptp(clean))
    held = sign * clean > sign * rail
    y = np.where(held, rail, clean) + noise * rng.standard_normal(u.size)
    firing = _gate(u, y, clean)
    assert firing is not None
    assert firing.kind == "held"
    assert abs(firing.value - rail) < 1.7 * firing.spread < noise  # within 3.3 standard errors
    weight = masked_by(Record(u, y, np.ones(u.size), dt_s=STEP_S), [firing]).sample_weight
    assert np.all(weight[held] == 0)
    assert weight[sign * clean < sign * rail - 10 * noise].mean() > 0.98


@pytest.mark.parametrize("seed", range(5))
def test_what_is_no_rail_is_none(seed):
    """A bend, another gain, a shift, a drift, noise alone, a model that errs at the top."""
    rng = np.random.default_rng(100 + seed)
    u = _input(rng)
    clean = _plays(u)
    span = np.ptp(clean)
    top, noise = clean.max(), 0.002 * span * rng.standard_normal(u.size)
    bend = top - 0.2 * span
    others = {
        "nothing": clean,
        "bend": np.where(clean > bend, bend + 0.1 * span * np.tanh((clean - bend) / (0.1 * span)), clean),
        "gain": 0.97 * clean,
        "shift": clean - 0.03 * span,
        "drift": clean - 0.03 * span * np.arange(u.size) / u.size,
        "slope": np.where(clean > bend, bend + 0.6 * (clean - bend), clean),
    }
    assert {name: _gate(u, y + noise, clean) for name, y in others.items()} == dict.fromkeys(others)


@pytest.mark.slow
def test_a_clipped_record_is_named_corrected_and_costs_the_model_nothing():
    """Refitted weights describe a clipped record as they describe a device: only the model as given tells."""
    rng = np.random.default_rng(7)
    u, v = _input(rng), _input(rng, 90)
    noise = 0.002 * np.ptp(_plays(u))
    clean = _plays(v)
    rail = clean.max() - 0.06 * np.ptp(clean)
    model = pt.identify(_run(u, _plays(u) + noise * rng.standard_normal(u.size)))
    clipped = _run(v, np.minimum(clean, rail) + noise * rng.standard_normal(v.size))
    found = pt.diagnose(clipped, model)
    assert (found.verdict, found.correctable) == ("saturation", ("saturation",))
    assert found.found[0].parameters[0].value == pytest.approx(rail, abs=noise)
    assert pt.diagnose(clipped, model, quick=True).verdict == "saturation"
    corrected = pt.correct(clipped, found)
    assert corrected.masked is not None
    assert np.all(corrected.masked[clean > rail])
    assert corrected.masked[clean < rail - 10 * noise].mean() < 0.02
    unseen = _input(np.random.default_rng(8), 90)
    models = [pt.identify(clipped), pt.identify(corrected)]
    spoilt, mended = pt.evaluate(_run(unseen, _plays(unseen)), models).models
    assert mended.rms_percent < 0.5 * spoilt.rms_percent
