"""The fast screen: how much of a residual each cause could explain, and how much it would by chance.

Every cause that is not in the model yet has start values. Each of them gives a column: the change of the
output that the cause makes, less what the weights can do. The score is the fall of the sum of squares when
the column (or the few columns of one block) is fitted to the residual. That is a linearisation around the
fitted model: it ranks all causes in a second, but makes strong ones too small. ``fitting.refit`` gives the
figures.

The null distribution is that of the most unlikely score in the whole library on noise like that of the
record (``noise``). Its spectrum and its dependence on the level are estimated from what no cause can explain.
Along the columns such noise is normally distributed, with a covariance that follows from the spectrum. The
score of each block therefore has a known distribution, chi-square. The smallest p over the library is drawn
again and again.

The projection, the minimum over the library, and the refit of the offset and of all positive weights are
exact. What is chosen from the data is chosen anew in each draw: the smallest p of a line over all frequencies
is known (Baluev, MNRAS 385, 2008, equation 6), and a step is tried at all its moments. Two things are not
exact: weights at zero stay there, and other parameters that enter nonlinearly are taken on the grid of start
values.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.base import Cause, Values
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.causes.late import FirstOrder, Late, RecordedLate
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.noise import Noise, noise_in
from pulsetrainer.diagnosis.thresholds import LIMITS, TINY


@dataclass(frozen=True)
class Score:
    """The best block of one cause on one residual."""

    cause: Cause
    gain: float  # fall of the sum of squares
    start: Values  # where a joint refit should start
    p_value: float
    basis: FloatArray  # (count, k) orthonormal columns of the best block, weights projected off
    sight: Sight | None = None  # None: no null was drawn


@dataclass(frozen=True)
class Sight:
    """How small an effect of one cause a record would show."""

    share: float  # of the effect's norm that the weights leave
    noise: float  # standard deviation along what is left
    critical: float  # of these, that the test asks for

    def least(self, relevant: float, there: float = 0.0, unsure: float = LIMITS.share_unsure) -> float:
        """Norm of the smallest effect that nine records of ten show, given the relevant fall of squares.

        An ``unsure`` of 1 is for effects of which the weights leave as much as of those that are tried; of
        others half of the records would show so much. What looks like the cause already, a gain of
        ``there``, may be the error of the levels against it.
        """
        sure = LIMITS.nine_of_ten * self.noise
        tested = self.critical * self.noise + sure
        relevantly = unsure * (sure + float(np.sqrt(sure**2 + relevant)))
        return (max(tested, relevantly) + float(np.sqrt(max(there, 0.0)))) / self.share


@dataclass(frozen=True)
class Screen:
    """Scores of all causes, best first, and the noise they were judged against."""

    scores: tuple[Score, ...] = ()
    noise: Noise | None = None  # None: no null was drawn


@dataclass(frozen=True)
class _Block:
    """One block of columns, made orthonormal."""

    cause: Cause
    values: tuple[Values, ...]
    basis: FloatArray  # (count, k)
    back: FloatArray  # (k, k) from coordinates along the basis to coefficients of the columns
    one_sided: bool  # the strength must not be negative
    as_it_is: bool  # no strength to be fitted: the column is inserted whole
    choices: float = 0.0  # so many values its parameters were chosen from by the data; 0: they were not
    share: float = 1.0  # of the columns' norm that the weights leave

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

    def critical(self, surprise: float) -> float:
        """Standard deviations along the basis that have p of ``exp(surprise)``."""
        if self.choices:
            half = np.linspace(*LIMITS.halves)
            own = np.log(self.choices) + 0.5 * np.log(half) - half
            return float(np.sqrt(2.0 * half[np.argmax(own <= surprise)]))
        if self.as_it_is:
            return float(scipy.stats.norm.isf(np.exp(surprise)))
        chance = np.exp(surprise) * (2.0 if self.one_sided else 1.0)
        return float(np.sqrt(scipy.stats.chi2.isf(chance, self.basis.shape[1])))

    def surprises(self, along: FloatArray, covariance: FloatArray) -> FloatArray:
        """Logarithms of p (m,) for parts along the basis (k, m), of which noise has a covariance."""
        if self.as_it_is:
            return np.asarray(scipy.special.log_ndtr(-along[0] / np.sqrt(covariance[0, 0])))
        size = np.sum(along * np.linalg.solve(covariance, along), axis=0)
        surprise = _log_tail(size, self.basis.shape[1])
        if self.choices:
            half = 0.5 * np.maximum(size, TINY)
            return np.asarray(np.minimum(np.log(self.choices) + 0.5 * np.log(half) - half, 0.0))
        if self.one_sided:
            return np.where((self.back @ along)[0] > 0, surprise - np.log(2.0), 0.0)
        return np.asarray(surprise)


def _log_tail(square: FloatArray, count: int) -> FloatArray:
    """Logarithm of the chance (m,) that chi-square of ``count`` squares is larger; the usual ones by hand."""
    if count == 1:
        return np.asarray(np.log(2.0) + scipy.special.log_ndtr(-np.sqrt(square)))
    if count == 2:
        return -0.5 * square
    return np.asarray(scipy.stats.chi2.logsf(square, count))


_RANKED: WeakKeyDictionary[Fitted, tuple[Score, ...]] = WeakKeyDictionary()


def screen(fitted: Fitted, rng: np.random.Generator) -> Screen:
    """Score every cause that is not in the model yet, with the chance that noise scores as much."""
    project, problem = fitted.projector, fitted.problem
    residual = project(fitted.residual[:, None])[:, 0]
    blocks = _blocks(fitted, fitted)
    if not blocks:
        return Screen()
    noise = noise_in(residual, project, _axes(blocks), problem.bins, problem.measured, rng)
    covariance = noise.covariance(project(_side_by_side(blocks)))
    known, critical = _p_values(blocks, residual, covariance, rng)
    return Screen(_scores(fitted, blocks, residual, known, _sights(blocks, covariance, critical)), noise)


def ranked(fitted: Fitted, whole: Fitted) -> tuple[Score, ...]:
    """Scores of every cause that is not in the model yet, best first; made once for all who ask.

    What a cause changes is taken from the ``whole`` model, of which ``fitted`` lacks a cause: a second one
    changes that by a small share of a small share, and the scores only choose what is refitted.
    """
    if fitted not in _RANKED:
        residual = fitted.projector(fitted.residual[:, None])[:, 0]
        blocks = _blocks(fitted, whole)
        _RANKED[fitted] = _scores(fitted, blocks, residual, np.ones(len(blocks)), {})
    return _RANKED[fitted]


def _scores(
    fitted: Fitted,
    blocks: Sequence[_Block],
    residual: FloatArray,
    known: FloatArray,
    sights: Mapping[str, Sight],
) -> tuple[Score, ...]:
    """Return the score of each cause's best block, best first."""
    gains = [float(block.gains(residual[:, None])[0]) for block in blocks]
    best: dict[str, int] = {}
    p_values: dict[str, float] = {}
    for k, block in enumerate(blocks):
        name = block.cause.id
        p_values[name] = min(p_values.get(name, 1.0), float(known[k]))
        if name not in best or gains[k] > gains[best[name]]:
            best[name] = k
    frames, left = fitted.problem.frames, at_full_rate(fitted)
    scores = [
        Score(
            block.cause,
            gains[k],
            block.cause.sharpened(_start(block, residual, frames[0]), frames, left),
            p_values[name],
            block.basis,
            sights.get(name),
        )
        for name, k in best.items()
        for block in [blocks[k]]
    ]
    return tuple(sorted(scores, key=lambda s: -s.gain))


def _side_by_side(blocks: Sequence[_Block]) -> FloatArray:
    return np.hstack([block.basis for block in blocks])


def _p_values(
    blocks: Sequence[_Block], residual: FloatArray, covariance: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, float]:
    """Family-wise p (blocks,) of every block on a residual, and the logarithm of its own p that is asked for.

    From draws of noise with a covariance.
    """
    ends = np.cumsum([block.basis.shape[1] for block in blocks])
    size, axes = np.linalg.eigh(covariance)
    white = rng.standard_normal((ends[-1], LIMITS.draws))
    drawn = axes @ (np.sqrt(np.maximum(size, 0.0))[:, None] * white)
    least, seen = np.zeros(LIMITS.draws), np.zeros(len(blocks))
    for k, (block, end) in enumerate(zip(blocks, ends, strict=True)):
        part = slice(end - block.basis.shape[1], end)
        own = covariance[part, part] + TINY * np.eye(block.basis.shape[1])
        seen[k] = block.surprises(block.basis.T @ residual[:, None], own)[0]
        # what was chosen from the data has its own p, which under the null is any number alike
        alike = np.log(rng.uniform(size=LIMITS.draws)) if block.choices else block.surprises(drawn[part], own)
        least = np.minimum(least, alike)
    return np.asarray([p_value(-one, -least) for one in seen]), float(np.quantile(least, LIMITS.p_max))


def _sights(blocks: Sequence[_Block], covariance: FloatArray, critical: float) -> dict[str, Sight]:
    """For each cause how small an effect would show: that of the block in the middle of its own."""
    found: dict[str, list[Sight]] = {}
    end = 0
    for block in blocks:
        part = slice(end, end + block.basis.shape[1])
        end = part.stop
        noise = float(np.sqrt(np.trace(covariance[part, part]) / block.basis.shape[1]))
        found.setdefault(block.cause.id, []).append(Sight(block.share, noise, block.critical(critical)))
    return {
        name: sorted(some, key=lambda one: one.critical * one.noise / one.share)[len(some) // 2]
        for name, some in found.items()
    }


def _axes(blocks: Sequence[_Block]) -> FloatArray:
    """Orthonormal columns (count, k) of all that causes could explain."""
    everything = _side_by_side(blocks)
    size, axes = np.linalg.eigh(everything.T @ everything)
    kept = size > LIMITS.rank**2 * size[-1]
    return np.asarray(everything @ (axes[:, kept] / np.sqrt(size[kept])))


def at_full_rate(fitted: Fitted) -> list[FloatArray]:
    """Residual (n,) of every record at its own rate, zero where samples have no weight."""
    problem = fitted.problem
    wrong = problem.measured - fitted.simulated
    start = problem.bins.free @ (problem.bins.free.T @ wrong)
    found = []
    for record, number, said in zip(
        problem.records, problem.bins.number, fitted.simulator.full(fitted.terms), strict=True
    ):
        left = record.output - said - start[np.maximum(number, 0)]
        found.append(np.where(number >= 0, left, 0.0))
    return found


def p_value(observed: float, drawn: FloatArray) -> float:
    """Probability of as much as ``observed`` by chance: (1 + k) / (1 + B) where k of B draws (B,) reach it.

    Davison and Hinkley, Bootstrap Methods and their Application, 1997, section 4.2.
    """
    return (1.0 + float(np.count_nonzero(drawn >= observed))) / (1.0 + drawn.size)


def _blocks(fitted: Fitted, changed: Fitted) -> list[_Block]:
    """All blocks of columns, weights and the causes already in the model projected off.

    A column is what a cause changes in ``changed``.
    """
    problem, parts = fitted.problem, at_full_rate(fitted)
    timed = all(record.timed for record in problem.records)
    tried: list[tuple[Cause, list[Values]]] = [
        (kind, values)
        for cause in library().values()
        if cause.stage != "record" and cause.id not in changed.names and (timed or not cause.needs_time)
        for kind in cause.kinds(problem.frames)
        for values in kind.starts(problem.frames, parts)
    ]
    if not tried:
        return []
    # all at once: the projection is bound by reading the rows
    columns = np.asarray([changed.change(Term(cause, one)) for cause, values in tried for one in values]).T
    free = fitted.beyond(columns)
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
            back, choices = np.linalg.inv(upper), cause.choices(problem.frames)
            share = float(np.linalg.norm(size[part]) / np.linalg.norm(whole_size[part]))
            found.append(_Block(cause, tuple(values), basis, back, one_sided, whole, choices, share))
    return found


def _start(block: _Block, residual: FloatArray, frame: Frame) -> Values:
    """Parameter values scaled by the fitted strengths, within a factor of those tried."""
    strength = block.back @ (block.basis.T @ residual)
    values = list(block.values[0])
    strengths = len(block.values) if block.cause.strengths else 0
    for j, quantity in enumerate(block.cause.quantities(frame)[:strengths]):
        tried = block.values[j][j]
        one = tried * float(strength[j])
        if quantity.low >= 0:
            one = min(max(one, LIMITS.start_falls * tried), LIMITS.start_rises * tried)
        values[j] = min(max(one, quantity.low), quantity.high)
    return tuple(float(v) for v in values)


def in_place(term: Term, score: Score) -> Term:
    """Return the cause of a score in the place of another, and as late where both are late."""
    if not both_late(score, term):
        return Term(score.cause, score.start)
    if isinstance(score.cause, FirstOrder) and isinstance(term.cause, FirstOrder):
        return Term(score.cause.as_fine_as(term.cause), term.values)
    return Term(score.cause, term.values[:1])


def both_late(score: Score, term: Term) -> bool:
    """Whether both begin with a parameter that says how late they make the output, or the input."""
    return any(isinstance(score.cause, one) and isinstance(term.cause, one) for one in (Late, RecordedLate))
