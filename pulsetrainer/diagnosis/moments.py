"""When something happened: the moments at which a sudden change fits as well as at the best one.

As a function of the moment of a step the sum of squares has many minima, and a refit stays in the one where
it began. Nor does the curvature of a minimum show how far away others are as deep: a gain that changes while
the output rests near its zero does not show before the output moves again. So the strengths are fitted anew
at moments farther and farther from a given one. That fit is linear, with the change as sharp as the samples
show it, and with all that the weights and the other causes can do projected off. At the true moment t the
squares S(t) are larger than the least, S(t*), by chance only:

    (S(t) - S(t*)) |d|^2 / var(d'n) <= -2 log(1 - sqrt(0.95)) = 7.35    in 95 of 100

where d is the difference between the two changes, and n the noise as it is (Hansen, Econometrica 68, 2000,
theorem 2: for a moment that is searched for the distribution is not chi-square). What the error of the levels
may have in common with d is added.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.extended import Term, in_order
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.floor import Floor
from pulsetrainer.diagnosis.noise import Noise
from pulsetrainer.diagnosis.thresholds import LIMITS, TINY


@dataclass(frozen=True)
class Profile:
    """Fits of one cause at several moments, all else free."""

    terms: tuple[Term, ...]  # (m,) by their moments, with the strengths that fit there
    fits: FloatArray  # (count, m) what each explains
    squares: FloatArray  # (m,) what each leaves, sums of squares
    own: int  # number of the moment of the fit

    @property
    def best(self) -> int:
        """Number of the moment that leaves least."""
        return int(np.argmin(self.squares))

    @property
    def gain(self) -> float:
        """Fall of the sum of squares from the fit's own moment to the best one."""
        return float(self.squares[self.own] - self.squares[self.best])

    def interval(self, noise: Noise, floor: Floor) -> tuple[float, float]:
        """First and last moment that cannot be told from the best; the next ones tried can."""
        apart = self.fits - self.fits[:, [self.best]]
        square = np.maximum(np.sum(apart**2, axis=0), TINY)
        chance = LIMITS.of_a_moment * np.diagonal(noise.covariance(apart)) / square
        aligned = floor.count * (LIMITS.aligned * floor.discretisation) ** 2
        alike = np.flatnonzero(self.squares - self.squares[self.best] <= chance + aligned)
        ends = max(int(alike[0]) - 1, 0), min(int(alike[-1]) + 1, len(self.terms) - 1)
        low, high = (self.terms[k].values[-1] for k in ends)
        return low, high


_KNOWN: WeakKeyDictionary[Fitted, dict[str, Profile]] = WeakKeyDictionary()


def profile(fitted: Fitted, term: Term) -> Profile:
    """Fits of a sudden cause of a model at moments ever farther from its own; made once for all who ask."""
    known = _KNOWN.setdefault(fitted, {})
    if term.cause.id not in known:
        known[term.cause.id] = _profile(fitted, term)
    return known[term.cause.id]


def _profile(fitted: Fitted, term: Term) -> Profile:
    others = [one for one in fitted.terms if one.cause is not term.cause]
    simulator, frames = fitted.simulator, fitted.problem.frames
    moments = _moments(fitted, term.values[-1])
    blocks = [term.cause.at(moment, frames) for moment in moments]
    none = simulator(others)
    tried = [Term(term.cause.sharp, one) for block in blocks for one in block]
    columns = [simulator(in_order((*others, one))) - none for one in tried]
    free = fitted.projector(np.stack((*columns, fitted.residual + fitted.simulated - none), axis=1))
    beside = _slopes_of_others(fitted, term)
    free -= beside @ (beside.T @ free)
    wide, wanted = term.cause.strengths, free[:, -1]
    terms, fits = [], []
    for k, (moment, block) in enumerate(zip(moments, blocks, strict=True)):
        size = [values[j] for j, values in enumerate(block)]
        part = free[:, wide * k : wide * (k + 1)]
        strengths = np.linalg.lstsq(part, wanted, rcond=LIMITS.rank)[0]
        terms.append(replace(term, values=(*(strengths * size).tolist(), moment)))
        fits.append(part @ strengths)
    whole = np.stack(fits, axis=1)
    squares = np.sum((wanted[:, None] - whole) ** 2, axis=0)
    return Profile(tuple(terms), whole, squares, moments.index(term.values[-1]))


def _moments(fitted: Fitted, moment: float) -> list[float]:
    """Moments of all records on both sides of one, the nearest ones half a sample apart."""
    last = fitted.problem.frames[-1]
    end = last.begin_s + last.input.size * last.dt_s
    near = 0.5 * last.dt_s
    count = int(np.log(end / near) / np.log(LIMITS.farther)) + 1
    apart = near * LIMITS.farther ** np.arange(count)
    tried = np.concatenate((moment - apart[::-1], [moment], moment + apart))
    inside = (tried > LIMITS.moments_from * end) & (tried < (1.0 - LIMITS.moments_from) * end)
    return [float(one) for one in tried[inside | (tried == moment)]]


def _slopes_of_others(fitted: Fitted, term: Term) -> FloatArray:
    """Orthonormal columns (count, k) of what the parameters of the other causes change, weights taken off."""
    owner = [one.cause for one in fitted.terms for _ in one.values]
    kept = [k for k, cause in enumerate(owner) if cause is not term.cause]
    return np.asarray(np.linalg.qr(fitted.projector(fitted.slopes[:, kept]))[0])
