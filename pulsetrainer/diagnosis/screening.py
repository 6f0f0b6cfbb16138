"""The fast screen: how much of a residual each cause could explain, and how much it would by chance.

For every start value of every cause not yet in the model: the change of the output that it makes, less
what the weights can do, is a column; the score is the fall of the sum of squares when the column (or the
few columns of one block) is fitted to the residual. That is a linearisation around the fitted model: it
ranks in a second, but shrinks strong causes; ``fitting.refit`` gives the figures.

The null distribution is that of the largest score over the whole library on noise that looks like the
residual: an autoregressive process fitted to what no cause can explain, drawn again and again and
projected the same way. Exact in it: the projection, the maximum over the library, the refit of the
offset and of all weights that are positive. Not exact: weights at zero stay there, and parameters
that enter nonlinearly are taken on the grid of start values instead of being refitted.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import linalg, signal

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.base import Cause, Frame, Values
from pulsetrainer.diagnosis.extended import Term, in_order
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.problem import Problem
from pulsetrainer.diagnosis.thresholds import LIMITS


@dataclass(frozen=True)
class Score:
    """The best block of one cause on one residual."""

    cause: Cause
    gain: float  # fall of the sum of squares
    start: Values  # where a joint refit should start
    p_value: float
    basis: FloatArray  # (count, k) orthonormal columns of the best block, weights projected off


@dataclass(frozen=True)
class Screen:
    """Scores of all causes, best first, and the noise they were judged against."""

    scores: tuple[Score, ...] = ()
    draws: FloatArray = field(
        default_factory=lambda: np.empty((0, 0))
    )  # (count, draws), weights projected off


@dataclass(frozen=True)
class _Block:
    """One block of columns, made orthonormal."""

    cause: Cause
    values: tuple[Values, ...]
    basis: FloatArray  # (count, k)
    back: FloatArray  # (k, k) from coordinates along the basis to coefficients of the columns
    one_sided: bool  # the strength must not be negative
    as_it_is: bool  # no strength to be fitted: the column is inserted whole

    def gains(self, signals: FloatArray) -> FloatArray:
        """Falls of the sum of squares (m,) for signals (count, m)."""
        along = self.basis.T @ signals
        if self.as_it_is:
            size = 1.0 / float(self.back[0, 0])
            return np.asarray(2.0 * size * along[0] - size**2)
        gain = np.sum(along**2, axis=0)
        if self.one_sided:
            gain = np.where((self.back @ along)[0] > 0, gain, 0.0)
        return np.asarray(gain)


def screen(problem: Problem, fitted: Fitted, rng: np.random.Generator, draws: int = LIMITS.draws) -> Screen:
    """Score every cause that is not in the model yet."""
    project = fitted.projector
    residual = project(fitted.residual[:, None])[:, 0]
    blocks = _blocks(problem, fitted, residual)
    everything = np.hstack([b.basis for b in blocks]) if blocks else np.empty((residual.size, 0))
    noise = coloured(_unexplained(residual, everything), draws, rng)
    noise = project(noise)
    best: dict[str, tuple[float, _Block]] = {}
    largest = np.zeros(draws)
    for block in blocks:
        gain = float(block.gains(residual[:, None])[0])
        if block.cause.id not in best or gain > best[block.cause.id][0]:
            best[block.cause.id] = gain, block
        largest = np.maximum(largest, block.gains(noise))
    scores = [
        Score(
            block.cause,
            gain,
            _start(block, residual, problem.frames[0]),
            p_value(gain, largest),
            block.basis,
        )
        for gain, block in best.values()
    ]
    return Screen(tuple(sorted(scores, key=lambda s: -s.gain)), noise)


def p_value(observed: float, drawn: FloatArray) -> float:
    """Probability of as much as ``observed`` by chance: (1 + k) / (1 + B) where k of B draws (B,) reach it.

    Davison and Hinkley, Bootstrap Methods and their Application, 1997, section 4.2.
    """
    return (1.0 + float(np.count_nonzero(drawn >= observed))) / (1.0 + drawn.size)


def _blocks(problem: Problem, fitted: Fitted, residual: FloatArray) -> list[_Block]:
    """All blocks of columns, weights and the causes already in the model projected off."""
    project = fitted.projector
    own = project(fitted.slopes)
    known = linalg.orth(own) if own.shape[1] else own
    parts = [problem.bins.even(residual, k) for k in range(len(problem.records))]
    timed = all(record.timed for record in problem.records)
    tried: list[tuple[Cause, list[Values]]] = [
        (cause, values)
        for cause in library().values()
        if cause.stage != "record" and cause.id not in fitted.names and (timed or not cause.needs_time)
        for values in cause.starts(problem.frames, parts)
    ]
    if not tried:
        return []
    # all at once: the projection is bound by reading the rows
    columns = np.stack(
        [
            fitted.simulator(in_order((*fitted.terms, Term(cause, one)))) - fitted.simulated
            for cause, values in tried
            for one in values
        ],
        axis=1,
    )
    free = project(columns)
    free -= known @ (known.T @ free)
    size, whole_size = np.linalg.norm(free, axis=0), np.linalg.norm(columns, axis=0)
    visible = np.isfinite(size) & (size > LIMITS.visible * whole_size)  # else the weights can do all of it
    found: list[_Block] = []
    end = 0
    for cause, values in tried:
        part = slice(end, end + len(values))
        end = part.stop
        if np.all(visible[part]):
            basis, upper = np.linalg.qr(free[:, part])
            whole = cause.strengths == 0
            one_sided = not whole and len(values) == 1 and cause.parameters[0].low >= 0
            found.append(_Block(cause, tuple(values), basis, np.linalg.inv(upper), one_sided, whole))
    return found


def _start(block: _Block, residual: FloatArray, frame: Frame) -> Values:
    """Parameter values scaled by the fitted strengths, within a factor of those tried."""
    strength = block.back @ (block.basis.T @ residual)
    values = list(block.values[0])
    for j, quantity in enumerate(block.cause.quantities(frame)[: block.cause.strengths]):
        tried = block.values[j][j]
        one = tried * float(strength[j])
        if quantity.low >= 0:
            one = min(max(one, LIMITS.start_falls * tried), LIMITS.start_rises * tried)
        values[j] = min(max(one, quantity.low), quantity.high)
    return tuple(float(v) for v in values)


def _unexplained(residual: FloatArray, columns: FloatArray) -> FloatArray:
    """The residual less all that any cause could explain: what is left is taken for noise."""
    if columns.shape[1] == 0:
        return residual
    left, size, _ = linalg.svd(columns, full_matrices=False, check_finite=False)
    left = left[:, size > LIMITS.rank * size[0]]
    return residual - left @ (left.T @ residual)


def coloured(like: FloatArray, draws: int, rng: np.random.Generator) -> FloatArray:
    """Noise (count, draws) with the spectrum of ``like`` (count,): an autoregression (Yule-Walker)."""
    lags = np.asarray([like[: like.size - k] @ like[k:] for k in range(LIMITS.ar_order + 1)]) / like.size
    if lags[0] <= 0:
        return np.zeros((like.size, draws))
    lags[0] *= 1.0 + LIMITS.ar_ridge
    phi = linalg.solve_toeplitz(lags[:-1], lags[1:])
    power = max(float(lags[0] - phi @ lags[1:]), 0.0)
    warm = LIMITS.ar_warm_up * LIMITS.ar_order
    white = rng.standard_normal((like.size + warm, draws)) * np.sqrt(power)
    return np.asarray(signal.lfilter([1.0], np.concatenate(([1.0], -phi)), white, axis=0)[warm:])
