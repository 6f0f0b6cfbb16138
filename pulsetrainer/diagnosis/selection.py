"""The procedure: gates, baseline, screen, joint refit, null, effect size, several causes, what is left.

A cause is accepted when all hold: its score is beyond what noise alone reaches with probability 0.01 over
the whole library; the joint refit lowers the held-out error by at least a twentieth of what can be
lowered; what it repairs is larger than the discretisation error and than 0.3 of the noise. Then the
next one is sought from the extended model. The answer is a set: causes that repair the data equally well are
named together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray, IntArray, Plane
from pulsetrainer.core.smoothing import blocks
from pulsetrainer.diagnosis import gates
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.base import Cause, Values
from pulsetrainer.diagnosis.design import Measured, bins_of, frames_of
from pulsetrainer.diagnosis.extended import Term, in_order
from pulsetrainer.diagnosis.fitting import Fitted, Problem, refit, slopes, weights_for
from pulsetrainer.diagnosis.residual import excitation_limits
from pulsetrainer.diagnosis.screening import Score, Screen, screen
from pulsetrainer.errors import DataError

LEVELS = 32  # of the plane on which causes are sought: finer ones take longer and decide the same
COARSE_LEVELS = 22
SMOOTHING = 0.035  # share of the range
P_MAX = 0.01
HELD_OUT_MIN = 0.05  # of the reducible part
NOISE_SHARE = 0.3
SPAN_SHARE = 0.0005  # a smaller effect than this is irrelevant on any device
MOST = 5
TRIED = 3  # candidates refitted in each round
FOLD_BLOCKS = 20
JACKKNIFE = 10
STUDENT = 2.26  # 95 % of Student's t with nine degrees of freedom
# These leave a residual that no refit can take away: what is left is theirs.
# At one rate these are all a loop a little wider than it is at rest.
_RATE_FAMILIES = ("lag", "viscous")
_JAGGED = ("stick-slip", "quantisation")


@dataclass(frozen=True)
class Estimate:
    """One parameter with its interval."""

    name: str
    value: float
    unit: str
    lower: float
    upper: float


@dataclass(frozen=True)
class Finding:
    """What the data say about one cause."""

    cause: Cause
    found: bool
    p_value: float
    explains_percent: float  # of the reducible part of the baseline's error
    parameters: tuple[Estimate, ...] = ()
    confounded_with: tuple[str, ...] = ()
    held_out_gain_percent: float = 0.0  # of the reducible part
    text: str = ""


@dataclass(frozen=True)
class Answer:
    """The whole diagnosis of one set of records."""

    verdict: str
    findings: tuple[Finding, ...]
    problem: Problem
    baseline: Fitted
    final: Fitted
    noise: float  # rms of the white noise of single samples
    floor: float  # rms of what is left in an average when nothing is wrong
    discretisation: float  # rms
    quick: bool
    remarks: tuple[str, ...] = ()
    terms: tuple[tuple[Term, tuple[Estimate, ...]], ...] = field(default=())


Progress = Callable[[float], None]


def problem_for(records: Sequence[Measured], low: float, high: float, levels: int = LEVELS) -> Problem:
    """The records with masks applied, ready to be fitted.

    Raises
    ------
    DataError
        Input or output does not vary, or too few samples are left.
    """
    bins = bins_of(records)
    measured = bins.average([r.output for r in records])
    moved = np.concatenate([np.clip(r.input[r.weight > 0], low, high) for r in records])
    if np.ptp(measured) == 0 or np.ptp(moved) == 0:
        what = "output" if np.ptp(measured) == 0 else "input"
        raise DataError(
            f"the {what} does not vary, so nothing can be said about a cause",
            hint="record a signal that sweeps the range: pulsetrainer capture diagnostic -o run.h5",
        )
    span = float(np.ptp(measured))
    frames = frames_of(records, span, high - low)
    return Problem(tuple(records), tuple(frames), Plane.uniform(low, high, levels), bins, measured, SMOOTHING)


def diagnose(
    records: Sequence[Measured],
    low: float,
    high: float,
    *,
    rng: np.random.Generator,
    quick: bool = False,
    progress: Progress = lambda _share: None,
) -> Answer:
    """Diagnose records of one device.

    Parameters
    ----------
    records
        Polarity 1, even steps.
    low, high
        Range of the input that was identified.
    quick
        Only screen: figures are those of the linearised scores.

    Raises
    ------
    DataError
        The data do not suffice for any statement.
    """
    firings = [(k, f) for k, record in enumerate(records) for f in gates.check(record, low, high)]
    records = [_masked(r, [f for j, f in firings if j == k]) for k, r in enumerate(records)]
    problem = problem_for(records, low, high)
    progress(0.05)
    baseline = weights_for(problem, (), None)
    noise = float(np.sqrt(np.mean([gates.noise_of(r.output) ** 2 for r in records])))
    coarse_step = max(gates.coarse_step(r.output) for r in records)
    jump = max((f.value for _, f in firings if f.cause == "stick-slip"), default=0.0)
    held = (coarse_step**2 + jump**2) / 12.0  # does not average out
    white = float(np.sqrt(noise**2 * np.mean(1.0 / problem.bins.sizes) + held))
    coarse = problem_for(records, low, high, COARSE_LEVELS)
    search = _Search(problem, coarse, baseline, white, rng, progress)
    search.measure_discretisation(baseline)
    progress(0.15)
    return search.quick(firings, noise) if quick else search.full(firings, noise)


def _masked(record: Measured, firings: Sequence[gates.Firing]) -> Measured:
    weight = record.weight.copy()
    output = record.output
    for firing in firings:
        if firing.mask is not None:
            weight[firing.mask] = 0.0
    bad = weight == 0
    if bad.any() and not bad.all():
        output = output.copy()  # causes filter the output: wild samples must not reach the filters
        good = np.flatnonzero(~bad)
        output[bad] = np.interp(np.flatnonzero(bad), good, output[good])
    return replace(record, weight=weight, output=output)


@dataclass
class _Search:
    """The state of one diagnosis."""

    problem: Problem
    coarse: Problem
    baseline: Fitted
    white: float  # rms of white noise in an average
    rng: np.random.Generator
    progress: Progress
    discretisation: float = 0.0  # rms

    def __post_init__(self) -> None:
        self.count = self.problem.bins.count
        self.span = float(np.ptp(self.problem.measured))
        self.folds = self._folds()
        self.lacks = excitation_limits(self.problem)

    def measure_discretisation(self, fitted: Fitted) -> None:
        """Estimate the discretisation error by refitting on a coarser plane.

        The error of a piecewise constant density falls with the cell at least in proportion, so
        d^2 <= (fall of the mean square) / ((fine / coarse)^2 - 1). A cause that is still missing makes the
        estimate too large, never too small, so it is made again whenever one has been added.
        """
        coarse = weights_for(self.coarse, fitted.terms, None)
        fall = max(coarse.squares - fitted.squares, 0.0) / self.count
        self.discretisation = float(np.sqrt(fall / ((LEVELS / COARSE_LEVELS) ** 2 - 1.0)))

    @property
    def floor_squares(self) -> float:
        """Sum of squares that no cause can lower."""
        return float(self.count * (self.white**2 + self.discretisation**2))

    @property
    def reducible(self) -> float:
        """What causes could lower the baseline's sum of squares by."""
        return max(self.baseline.squares - self.floor_squares, 1e-12 * self.baseline.squares, 1e-300)

    @property
    def relevant(self) -> float:
        """Fall of the sum of squares below which an effect is irrelevant."""
        size = max(NOISE_SHARE * self.white, self.discretisation, SPAN_SHARE * self.span)
        return float(self.count * size**2)

    def _folds(self) -> IntArray:
        """Block of every average; the cuts are where the memory is wiped out."""
        plane, bins = self.problem.plane, self.problem.bins
        fold = np.zeros(self.count, dtype=np.int64)
        for record, number in zip(self.problem.records, bins.number, strict=True):
            part = blocks(record.input, plane.low, plane.high, FOLD_BLOCKS)
            inside = number >= 0
            fold[number[inside]] = part[inside]
        return fold

    def _without_folds(
        self, fitted: Fitted, folds: int
    ) -> Iterator[tuple[NDArray[np.bool_], FloatArray, FloatArray]]:
        """For each fold: its averages, their errors, and the changes of the parameters, when it is left out.

        Weights and parameters are refitted on the rest, linearised around the joint fit, with the cells
        that are positive there.
        """
        design = fitted.design
        free = np.flatnonzero(fitted.passive)
        extra = slopes(self.problem, fitted)
        columns = np.hstack((design.matrix[:, free], extra))
        ridge = np.zeros((columns.shape[1],) * 2)
        ridge[: free.size, : free.size] = design.smooth[np.ix_(free, free)]
        size = np.sum(columns**2, axis=0)
        ridge[np.diag_indices_from(ridge)] += 1e-9 * size + 1e-300
        wanted = self.problem.measured - fitted.added
        masses = (fitted.simulator.operator.weights * self.problem.plane.areas)[free]
        start = np.concatenate((masses, np.zeros(extra.shape[1])))
        for fold in range(folds):
            test = self.folds % folds == fold
            train = ~test
            if train.sum() < 2 * columns.shape[1] or not test.any():
                return
            mean = columns[train].mean(axis=0)
            inside = columns[train] - mean
            target = wanted[train] - wanted[train].mean()
            share = 1.0 - 1.0 / folds
            rhs = inside.T @ (target - inside @ start) - share * ridge @ start
            normal = inside.T @ inside + share * ridge
            factor = linalg.cho_factor(normal, lower=True, check_finite=False)
            change = linalg.cho_solve(factor, rhs, check_finite=False)
            error = wanted[test] - wanted[train].mean() - (columns[test] - mean) @ (start + change)
            yield test, error, change[free.size :]

    def held_out(self, fitted: Fitted) -> float:
        """Sum of squares on each half of the blocks, predicted from the other half."""
        halves = list(self._without_folds(fitted, 2))
        return sum(float(error @ error) for _, error, _ in halves) if len(halves) == 2 else float("nan")

    def held_out_gain(self, before: Fitted, after: Fitted) -> float:
        """Share of the reducible held-out error that the extension removes."""
        first, second = self.held_out(before), self.held_out(after)
        if not (np.isfinite(first) and np.isfinite(second)):
            return float("nan")
        return (first - second) / max(first - self.floor_squares, self.relevant)

    def quick(self, firings: Sequence[tuple[int, gates.Firing]], noise: float) -> Answer:
        """Screen only."""
        first = screen(self.problem, self.baseline, self.rng)
        findings = [
            Finding(
                s.cause,
                s is first.scores[0] and self._significant(s),
                s.p_value,
                100.0 * min(s.gain / self.reducible, 1.0),
                tuple(
                    Estimate(q.name, v, q.unit, float("nan"), float("nan"))
                    for q, v in zip(s.cause.parameters, s.start, strict=True)
                ),
                _alike(s, first) if s is first.scores[0] else (),
                float("nan"),
            )
            for s in first.scores
        ]
        return self._answer(findings, firings, noise, self.baseline, quick=True)

    def _significant(self, score: Score) -> bool:
        return score.p_value <= P_MAX and score.gain > self.relevant

    def full(self, firings: Sequence[tuple[int, gates.Firing]], noise: float) -> Answer:
        """Screen, refit, accept, repeat; then eliminate, bound and compare."""
        current, last = self.baseline, None
        first: Screen | None = None
        p_values: dict[str, float] = {}
        for _ in range(MOST):
            last = screen(self.problem, current, self.rng)
            first = first or last
            chosen = self._next(current, last)
            if chosen is None:
                break
            current, name, p = chosen
            self.measure_discretisation(current)
            p_values[name] = p
            self.progress(0.15 + 0.12 * len(current.terms))
        current = self._eliminate(current)
        assert last is not None
        if set(current.names) != set(p_values):
            last = screen(self.problem, current, self.rng)
        self.progress(0.8)
        estimates = self._estimates(current, last)
        found = [
            self._finding(current, term, p_values[term.cause.id], estimates[term.cause.id])
            for term in current.terms
        ]
        rest = [
            Finding(s.cause, False, s.p_value, 100.0 * min(s.gain / self.reducible, 1.0))
            for s in last.scores
            if s.cause.id not in current.names
        ]
        self.progress(0.95)
        return self._answer([*found, *rest], firings, noise, current, quick=False, estimates=estimates)

    def _next(self, current: Fitted, scores: Screen) -> tuple[Fitted, str, float] | None:
        """The best acceptable cause after a joint refit, with its p-value."""
        trials: list[tuple[Fitted, Score]] = []
        for score in scores.scores:
            if len(trials) == TRIED or not self._significant(score):
                break
            if score.cause.family in {term.cause.family for term in current.terms}:
                continue  # what a cause of its own kind leaves is its imperfect formula, not a second one
            trial = refit(self.problem, (*current.terms, Term(score.cause, score.start)), current, rounds=3)
            trials.append((trial, score))
        trials.sort(key=lambda pair: pair[0].squares)
        for trial, score in trials:
            if current.squares - trial.squares < self.relevant:
                continue
            gain = self.held_out_gain(current, trial)
            if np.isfinite(gain) and gain < HELD_OUT_MIN:
                continue
            changes_input = any(t.cause.stage == "input" for t in trial.terms)
            return (
                refit(self.problem, trial.terms, trial, rebuild=changes_input),
                score.cause.id,
                score.p_value,
            )
        return None

    def _eliminate(self, current: Fitted) -> Fitted:
        """Drop causes that the others have made superfluous."""
        while len(current.terms) > 1:
            without = [
                (refit(self.problem, [t for t in current.terms if t is not term], current, rounds=1), term)
                for term in current.terms
            ]
            weakest, _ = min(without, key=lambda pair: pair[0].squares)
            self.leave_one_out = {term.cause.id: fitted for fitted, term in without}
            if weakest.squares - current.squares >= self.relevant:
                return current
            current = weakest
        self.leave_one_out = {term.cause.id: self.baseline for term in current.terms}
        return current

    def _estimates(self, fitted: Fitted, noise: Screen) -> dict[str, tuple[Estimate, ...]]:
        """Parameters with 95 % intervals.

        The spread is the larger of two: of the joint refit, linearised, on redrawn noise; and of the
        jackknife over blocks (Efron and Stein, Annals of Statistics 9, 1981), which also sees what the
        fitted model misses. To it comes the discretisation error, as if a fifth of it were aligned.
        """
        columns = fitted.projector()(slopes(self.problem, fitted))
        if columns.shape[1] == 0:
            return {}
        size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        drawn = np.linalg.lstsq(columns / size, noise.draws, rcond=None)[0] / size[:, None]
        spread = np.std(drawn, axis=1)
        bias = 0.2 * self.discretisation * np.sqrt(self.count) / size
        changes = np.asarray([change for _, _, change in self._without_folds(fitted, JACKKNIFE)])
        if changes.shape[0] == JACKKNIFE:  # what the fitted model misses moves with the blocks
            left_out = np.sum((changes - changes.mean(axis=0)) ** 2, axis=0)
            spread = np.maximum(spread, np.sqrt((1.0 - 1.0 / JACKKNIFE) * left_out))
        half = STUDENT * spread + bias
        estimates: dict[str, tuple[Estimate, ...]] = {}
        at = 0
        for term in fitted.terms:
            rows = []
            for quantity, value in zip(term.cause.parameters, term.values, strict=True):
                low, high = value - float(half[at]), value + float(half[at])
                rows.append(
                    Estimate(
                        quantity.name, value, quantity.unit, max(low, quantity.low), min(high, quantity.high)
                    )
                )
                at += 1
            estimates[term.cause.id] = tuple(rows)
        return estimates

    def _finding(
        self, fitted: Fitted, term: Term, p_value: float, estimates: tuple[Estimate, ...]
    ) -> Finding:
        without = self.leave_one_out[term.cause.id]
        gain = without.squares - fitted.squares
        return Finding(
            term.cause,
            found=True,
            p_value=p_value,
            explains_percent=100.0 * min(max(gain / self.reducible, 0.0), 1.0),
            parameters=estimates,
            confounded_with=self._rivals(fitted, without, term, gain),
            held_out_gain_percent=100.0 * self.held_out_gain(without, fitted),
        )

    def _rivals(self, fitted: Fitted, without: Fitted, term: Term, gain: float) -> tuple[str, ...]:
        """Causes that repair the same data as well, within the noise of the comparison."""
        scores = screen(self.problem, without, self.rng, draws=20)
        margin = max(0.005 * gain, 0.3 * self.relevant, 12.0 * fitted.squares / self.count)
        rivals = []
        for score in scores.scores[:3]:
            if score.cause.id in (term.cause.id, *fitted.names) or score.gain < 0.5 * gain:
                continue
            trial = refit(self.problem, (*without.terms, Term(score.cause, score.start)), without, rounds=2)
            if trial.squares - fitted.squares < margin:
                rivals.append(score.cause.id)
        if "one single rate" in self.lacks and term.cause.family in _RATE_FAMILIES:
            alike = [c.id for c in library().values() if c.family in _RATE_FAMILIES and c is not term.cause]
            rivals += [name for name in alike if name not in (*rivals, *fitted.names)]
        return tuple(rivals)

    def _answer(
        self,
        findings: Sequence[Finding],
        firings: Sequence[tuple[int, gates.Firing]],
        noise: float,
        final: Fitted,
        *,
        quick: bool,
        estimates: dict[str, tuple[Estimate, ...]] | None = None,
    ) -> Answer:
        found = sorted((f for f in findings if f.found), key=lambda f: -f.explains_percent)
        rest = sorted((f for f in findings if not f.found), key=lambda f: -f.explains_percent)
        gated = _gated(firings, len(self.problem.records))
        left = final.squares - self.floor_squares
        unexplained = left > max(0.5 * self.reducible, 4.0 * self.relevant) and not quick
        verdict = "none"
        if unexplained:
            verdict = "unknown"
        elif found:
            verdict = found[0].cause.id
        elif gated:
            verdict = gated[0].cause.id
        if unexplained and any(f.cause.id in _JAGGED for f in gated):
            verdict = next(f.cause.id for f in gated if f.cause.id in _JAGGED)
        named = {f.cause.id for f in gated}
        missing = [
            Finding(c, False, 1.0, 0.0)
            for c in library().values()
            if c.stage == "record" and c.id not in named
        ]
        return Answer(
            verdict,
            (*found, *gated, *rest, *missing),
            self.problem,
            self.baseline,
            final,
            noise,
            float(np.sqrt(self.floor_squares / self.count)),
            self.discretisation,
            quick,
            terms=tuple((t, (estimates or {}).get(t.cause.id, ())) for t in final.terms),
        )


def _alike(best: Score, scores: Screen) -> tuple[str, ...]:
    """Causes whose columns are hardly to be told from those of the best: |cos| above 0.9."""
    return tuple(
        s.cause.id
        for s in scores.scores
        if s is not best and float(np.linalg.norm(best.basis.T @ s.basis, ord=2)) > 0.9
    )


def _gated(firings: Sequence[tuple[int, gates.Firing]], records: int) -> list[Finding]:
    """Findings of the raw-data gates, one per cause."""
    found: dict[str, Finding] = {}
    for k, firing in firings:
        where = f"record {k + 1}: " if records > 1 else ""
        unit = {"y": "{y}", "u": "{u}"}.get(firing.unit, firing.unit)
        if firing.cause not in found:
            found[firing.cause] = Finding(
                library()[firing.cause],
                found=True,
                p_value=0.0,
                explains_percent=0.0,
                parameters=(Estimate("size", firing.value, unit, firing.value, firing.value),),
                held_out_gain_percent=float("nan"),
                text=where + firing.text,
            )
    return list(found.values())


def predictor(answer: Answer) -> tuple[Preisach, tuple[tuple[Term, tuple[Estimate, ...]], ...]]:
    """The static part on the diagnosis's own plane, and the lasting terms."""
    return answer.final.simulator.operator, tuple(p for p in answer.terms if p[0].cause.lasting)


def lasting_terms(names: Sequence[tuple[str, Values]]) -> tuple[Term, ...]:
    """Terms of stored causes, in the order of the chain."""
    return in_order([Term(library()[name], values) for name, values in names])
