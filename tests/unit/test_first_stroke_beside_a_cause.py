"""A device that was never cycled, and creeps: its first stroke shows once the creep is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from pulsetrainer.core.initial_state import first_stroke_words, known_from
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.procedure import diagnose
from pulsetrainer.diagnosis.state import Question

DT_S = 0.02
RADII = np.linspace(0.1, 1.5, 8)
AMPLITUDE, TAU_S = 0.3, 3.0


def _record(*, cycled: bool) -> tuple[np.ndarray, np.ndarray]:
    """Input and output of eight plays that begin on their own loop, or within it, and what follows slowly."""
    rng = np.random.default_rng(5)
    levels = np.concatenate(([0.0, 5.0, 0.5, 4.5, 0.0], rng.uniform(0.0, 5.0, 24), [5.0, 0.0, 5.0, 0.0, 2.0]))
    pieces = [
        np.concatenate((np.linspace(a, b, round(abs(b - a) / rate / DT_S) + 2)[:-1], np.full(rest, b)))
        for a, b, rate, rest in zip(
            levels[:-1], levels[1:], rng.choice([1.0, 3.0, 9.0], 33), 50 * rng.integers(0, 3, 33), strict=True
        )
    ]
    u = np.concatenate(pieces)
    plays, found = RADII * (1.0 if cycled else 0.6), []
    for value in u.tolist():
        plays = np.clip(plays, value - RADII, value + RADII)
        found.append(plays.sum() + 2.0 * value)
    y = np.asarray(found)
    slow = sum(share * _lagged(y, TAU_S * times) for share, times in ((0.3, 0.25), (0.4, 1.0), (0.3, 4.0)))
    y = (y + AMPLITUDE * slow) / (1.0 + AMPLITUDE)
    return u, y + 0.002 * np.ptp(y) * rng.standard_normal(y.size)


def _lagged(y: np.ndarray, tau_s: float) -> np.ndarray:
    a = np.exp(-DT_S / tau_s)
    return signal.lfilter([1.0 - a], [1.0, -a], y, zi=[a * y[0]])[0]


@pytest.mark.slow
@pytest.mark.parametrize("cycled", [True, False])
def test_a_first_stroke_that_creep_hides_is_left_out_once_the_creep_is_known(cycled):
    """Then the creep has its own strength again; of a cycled device no sample is lost."""
    u, y = _record(cycled=cycled)
    assert known_from(u, 0.0, 5.0, y) == 0
    assert first_stroke_words(u, y, 0.0, 5.0) == ""
    rng = np.random.default_rng(0)
    said = diagnose(Question([Record(u, y, dt_s=DT_S)], 0.0, 5.0, rng))
    assert [one.cause.id for one in said.findings if one.found] == ["creep"]
    assert len(said.question.notes) == (0 if cycled else 1)
    assert all("is left out: it differs from all later ones" in note for note in said.question.notes)
    left_out = int(np.argmax(said.question.records[0].sample_weight > 0.0))
    assert u[max(left_out - 1, 0)] == pytest.approx(0.0 if cycled else 5.0, abs=0.1)
    amplitude = said.findings[0].parameters[0]
    assert amplitude.lower < AMPLITUDE < amplitude.upper


@pytest.mark.parametrize(
    "seed", [3, pytest.param(4, marks=pytest.mark.slow), pytest.param(5, marks=pytest.mark.slow)]
)
def test_a_first_stroke_too_short_to_be_compared_is_no_cause(seed):
    """Of six samples: it was called heat, and most of what that explained lay within it."""
    rng = np.random.default_rng(seed)
    turns = np.concatenate(([0.0, 5.0, 0.0], np.ravel(rng.uniform([2.2, 0.0], [5.0, 2.7], (60, 2)))))
    rates = np.resize([0.8, 0.25], turns.size - 1)
    steps = np.maximum(np.abs(np.diff(turns)) // rates, 1.0)
    u = np.interp(np.arange(1200.0), np.cumsum([0, *steps]), turns)
    plays, found = np.zeros(8), []
    for value in u.tolist():
        plays = np.clip(plays, value - RADII, value + RADII)
        found.append(plays.sum() + 2.0 * value)
    y = np.asarray(found) + 0.003 * np.ptp(found) * rng.standard_normal(u.size)
    said = diagnose(Question([Record(u, y, dt_s=DT_S)], 0.0, 5.0, np.random.default_rng(0)))
    assert [one.cause.id for one in said.findings if one.found] == []
    assert [note.partition(" samples)")[0][-1] for note in said.question.notes] == ["6"]
