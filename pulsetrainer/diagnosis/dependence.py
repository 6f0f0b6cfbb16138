"""Which state of the device explains the residual: each state of a bank is scored on time left out.

The columns of a fit are curves over the state, added to the output or to its gain, less what the weights and
the causes in the model can do; there are some for each kind of state and each time constant of a grid. A
ridge fit on the rest of the time predicts each of a few whole pieces of the record. The score is the fall of
the squares there. The same is done again and again with noise that looks like what the best state leaves.
The p-value is the share of draws in which any state of the bank scores as much (Davison and Hinkley,
Bootstrap Methods and their Application, 1997, section 4.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import scipy  # its parts load when they are first used
from numpy.typing import NDArray

from pulsetrainer.core.plane import FloatArray, IntArray
from pulsetrainer.diagnosis.causes.base import Values, spread
from pulsetrainer.diagnosis.causes.unlisted import KNOTS, STATES, Part
from pulsetrainer.diagnosis.extended import shown_output
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.held_out import HeldOut
from pulsetrainer.diagnosis.noise import Noise, noise_in
from pulsetrainer.diagnosis.screening import p_value
from pulsetrainer.diagnosis.thresholds import LIMITS


@dataclass(frozen=True)
class Dependence:
    """The best state, with the starts of joint refits."""

    starts: tuple[tuple[Part, Values], ...]  # each with its time constant, then the curve: the best one first
    fall: float  # of the squares, on pieces that were left out
    p_value: float  # over the whole bank


class Bank:
    """The states that go with one fitted model, and how they are projected."""

    def __init__(self, fitted: Fitted, held_out: HeldOut, order: int) -> None:
        self.fitted = fitted
        self.piece = held_out.piece
        simulator = fitted.simulator
        before = [term for term in fitted.terms if term.cause.order < order]
        self.outputs = [
            shown_output(before, y, frame)
            for y, frame in zip(simulator.inner(fitted.terms), simulator.frames, strict=True)
        ]
        self.output = fitted.problem.bins.average(self.outputs)  # (count,)
        self.project = fitted.beyond
        self.residual = self.project(fitted.residual[:, None])[:, 0]

    def state(self, kind: int, tau: float) -> FloatArray:
        """Averages (count,) of one state."""
        frames = self.fitted.simulator.frames
        signals = [STATES[kind].at(y, tau, f, "") for y, f in zip(self.outputs, frames, strict=True)]
        return self.fitted.problem.bins.average(signals)

    def columns(self, kind: int, tau: float, *, gain: bool) -> tuple[Part, FloatArray] | None:
        """What curves (count, KNOTS - 1) over one state add; None where it does not vary."""
        z = self.state(kind, tau)
        low, high = self._ends(z)
        if not high > low:
            return None
        part = Part(kind, low, high, gain)
        return part, part.added(self.output, z, self.fitted.simulator.frames[0].zero)

    def _ends(self, z: FloatArray) -> tuple[float, float]:
        """Ends of the curve over a state (count,): how far it comes on two pieces at least.

        What is beyond was seen once, such as the beginning of a record, and nothing can show that it repeats.
        """
        pieces = [z[self.piece == k] for k in range(LIMITS.pieces)]
        reached = np.sort([np.quantile(one, LIMITS.state_ends) for one in pieces if one.size], axis=0)
        if len(reached) == 1:  # all that counts lies in one piece
            return 0.0, 0.0
        return float(reached[1, 0]), float(reached[-2, 1])

    def curve(self, free: FloatArray) -> FloatArray:
        """Ridge fit (KNOTS - 1,) of projected columns to the residual."""
        gram = free.T @ free
        return np.asarray(np.linalg.solve(gram + _penalty(gram), free.T @ self.residual))


def best_dependence(
    fitted: Fitted, held_out: HeldOut, order: int, rng: np.random.Generator
) -> Dependence | None:
    """Return the state that predicts best what is left, its time constant refined; None where none varies."""
    bank = Bank(fitted, held_out, order)
    frame = fitted.problem.frames[0]
    slowest = LIMITS.slowest_state * frame.length_s
    fastest = min(max(LIMITS.fastest_state_s, 2.0 * frame.dt_s), slowest)
    taus = spread(fastest, slowest, LIMITS.state_ratio)
    found = []
    for kind, gain in product(range(len(STATES)), (False, True)):
        made = [(tau, one) for tau in taus if (one := bank.columns(kind, tau, gain=gain)) is not None]
        if made:
            free = bank.project(np.hstack([columns for _, (_, columns) in made]))
            parts = np.split(free.astype(np.float32), len(made), axis=1)
            found += [(tau, part, own) for (tau, (part, _)), own in zip(made, parts, strict=True)]
    if not found:
        return None
    seen = [own for _, _, own in found]
    scores = _falls(seen, bank.residual[:, None], bank.piece)[:, 0]
    first = int(np.argmax(scores))
    tau, part, own = found[first]
    axes = scipy.linalg.orth(own.astype(np.float64))
    problem = fitted.problem
    like = noise_in(bank.residual, bank.project, axes, problem.bins, problem.measured, rng)
    noise = bank.project(_drawn(like, LIMITS.bank_draws, rng))
    largest = np.max(_falls(seen, noise, bank.piece), axis=0)
    best = float(scores[first])
    # added to the output or to its gain: where both predict, a joint refit tells
    near = [
        one.coded for (_, one, _), score in zip(found, scores, strict=True) if score > LIMITS.as_well * best
    ]
    twin = replace(part, gain=not part.gain)
    both = [part, twin] if twin.coded in near else [part]
    starts = tuple(_refined(bank, one, tau, fastest, slowest) for one in both)
    return Dependence(starts, best, p_value(best, largest))


def of_a_wandering_zero(fitted: Fitted, held_out: HeldOut, order: int) -> float:
    """Return by how much a zero that follows the time alone, smoothly, lowers the squares of a fit."""
    share = np.linspace(0.0, 1.0, fitted.residual.size)
    knots = LIMITS.wander_knots
    curves = scipy.interpolate.CubicSpline(np.linspace(0.0, 1.0, knots), np.eye(knots))(share)
    bank = Bank(fitted, held_out, order)
    axes = scipy.linalg.orth(bank.project(curves))
    return float(np.sum((axes.T @ bank.residual) ** 2))


def _drawn(noise: Noise, draws: int, rng: np.random.Generator) -> FloatArray:
    """Noise (count, draws) with a spectrum and a local size."""
    drawn = np.empty((draws, noise.bins.count))
    for own, at in noise.bins.places:
        size = scipy.fft.next_fast_len(int(at[-1]) + 1, real=True)
        lines = scipy.fft.rfft(rng.standard_normal((draws, size)), axis=1)
        lines *= np.sqrt(noise.at(scipy.fft.rfftfreq(size)))
        drawn[:, own] = np.take(scipy.fft.irfft(lines, size, axis=1), at, axis=1)
    return np.asarray((drawn * noise.scale).T)


def _refined(bank: Bank, found: Part, tau: float, fastest: float, slowest: float) -> tuple[Part, Values]:
    """Return the time constant near ``tau``, from fastest to slowest, that fits best, and its curve."""

    def left(log_tau: float) -> float:
        made = bank.columns(found.state, float(np.exp(log_tau)), gain=found.gain)
        if made is None:
            return float("inf")
        free = bank.project(made[1])
        return float(np.sum((bank.residual - free @ bank.curve(free)) ** 2))

    near = np.log((max(tau / LIMITS.state_ratio, fastest), min(tau * LIMITS.state_ratio, slowest)))
    best = scipy.optimize.minimize_scalar(
        left, bounds=near, method="bounded", options={"xatol": LIMITS.state_settled}
    )
    tau = float(np.exp(best.x))
    made = bank.columns(found.state, tau, gain=found.gain)
    assert made is not None
    part, columns = made
    return part, (tau, *bank.curve(bank.project(columns)).tolist())


def _penalty(gram: FloatArray) -> FloatArray:
    """Second differences of a curve whose first value is 0, weighted."""
    bend = np.diff(np.eye(KNOTS), 2, axis=0)[:, 1:]
    size = float(np.trace(gram)) / gram.shape[0]
    return np.asarray(
        LIMITS.curve_ridge * size * (bend.T @ bend + LIMITS.curve_ridge * np.eye(gram.shape[0]))
    )


def _falls(states: Sequence[NDArray[np.float32]], signals: FloatArray, piece: IntArray) -> FloatArray:
    """Falls (k, m) of the squares of signals (count, m) on pieces left out of the fit, for each state."""
    ends = np.cumsum([one.shape[1] for one in states])[:-1]
    grams, along = [], []
    for k in range(LIMITS.pieces):
        inside = np.flatnonzero(piece == k)
        own = np.hstack([one[inside] for one in states])
        # all states at once: one by one the product is bound by reading the signals
        product = (own.T @ signals[inside].astype(np.float32)).astype(np.float64)
        along.append(np.split(product, ends))
        grams.append([(one.T @ one).astype(np.float64) for one in np.split(own, ends, axis=1)])
    return np.stack([_fall([one[k] for one in grams], [one[k] for one in along]) for k in range(len(states))])


def _fall(grams: Sequence[FloatArray], along: Sequence[FloatArray]) -> FloatArray:
    """Fall (m,) for one state from its products (k, k) and those with the signals (k, m), of each piece."""
    gram, whole = np.sum(grams, axis=0), np.sum(along, axis=0)
    fall = np.zeros(whole.shape[1])
    if not gram.any():  # a state that never changes
        return fall
    for inner, here in zip(grams, along, strict=True):
        curve = np.linalg.solve(gram - inner + _penalty(gram), whole - here)
        fall += 2.0 * np.sum(curve * here, axis=0) - np.sum(curve * (inner @ curve), axis=0)
    return fall
