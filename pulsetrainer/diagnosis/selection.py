"""The procedure: gates, baseline, screen, joint refit, null, effect size, several causes, what is left.

A cause is accepted when all hold: its score is beyond what noise alone reaches with probability 0.01 over
the whole library; the joint refit lowers the held-out error by at least a twentieth of what can be
lowered; what it repairs is relevant (``floor``). Then the next one is sought from the extended model, and
each is exchanged for a better one of its family, since the others may have been missing when it was chosen.
A cause that the weights can hold is sought last, where they cannot (``congruency``). The answer is a set:
causes that repair the data equally well are named together (``rivals``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis import congruency, gates, sticking
from pulsetrainer.diagnosis.answer import Answer, Estimate, Finding
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.base import Cause
from pulsetrainer.diagnosis.extended import Term, in_order
from pulsetrainer.diagnosis.fitting import Fitted, refit, weights_for
from pulsetrainer.diagnosis.floor import COARSE_LEVELS, floor_of
from pulsetrainer.diagnosis.held_out import HeldOut
from pulsetrainer.diagnosis.intervals import estimates_of
from pulsetrainer.diagnosis.problem import problem_for
from pulsetrainer.diagnosis.residual import excitation_limits
from pulsetrainer.diagnosis.rivals import alike, rivals
from pulsetrainer.diagnosis.screening import Score, Screen, screen

P_MAX = 0.01
_CONTRAST_P_MAX = 0.005  # the second of two tests: together they alarm in one or two of a hundred
HELD_OUT_MIN = 0.05  # of the reducible part
MOST = 5
LINEARISED = 0.5  # of what a refit gains: less than that a linearised score hardly shows
TRIED = 3  # candidates refitted in each round
_FEW = 20  # draws where only start values are wanted
# These leave a residual that no refit can take away: what is left is theirs.
_JAGGED = ("stick-slip", "quantisation")

Progress = Callable[[float], None]
Firings = Sequence[tuple[int, gates.Firing]]


def diagnose(
    records: Sequence[Record],
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
    masked = [_masked(r, [f for j, f in firings if j == k]) for k, r in enumerate(records)]
    search = _Search(masked, low, high, firings, rng, progress)
    return search.quick() if quick else search.full()


def _masked(record: Record, firings: Sequence[gates.Firing]) -> Record:
    weight = record.sample_weight.copy()
    output = record.output
    for firing in firings:
        if firing.mask is not None:
            weight[firing.mask] = 0.0
    bad = weight == 0
    if bad.any() and not bad.all():
        output = output.copy()  # causes filter the output: wild samples must not reach the filters
        good = np.flatnonzero(~bad)
        output[bad] = np.interp(np.flatnonzero(bad), good, output[good])
    return replace(record, sample_weight=weight, output=output)


class _Search:
    """The state of one diagnosis."""

    def __init__(
        self,
        records: Sequence[Record],
        low: float,
        high: float,
        firings: Firings,
        rng: np.random.Generator,
        progress: Progress,
    ) -> None:
        self.problem = problem_for(records, low, high)
        self.coarse = problem_for(records, low, high, COARSE_LEVELS)
        self.firings, self.rng, self.progress = firings, rng, progress
        progress(0.05)
        self.baseline = weights_for(self.problem, (), None)
        progress(0.1)
        self.floor = floor_of(records, [f for _, f in firings], self.problem).at(self.coarse, self.baseline)
        self.held_out = HeldOut(self.problem)
        self.lacks = excitation_limits(self.problem)
        progress(0.15)

    def _explains(self, gain: float) -> float:
        """Per cent of what can be explained."""
        return 100.0 * min(max(gain / self.floor.reducible(self.baseline), 0.0), 1.0)

    def _significant(self, score: Score) -> bool:
        return score.p_value <= P_MAX and score.gain > self.floor.relevant

    def _promising(self, score: Score) -> bool:
        """Whether a refit, whose gain is larger, may make it relevant."""
        return score.p_value <= P_MAX and score.gain > LINEARISED * self.floor.relevant

    def quick(self) -> Answer:
        """Screen only."""
        first = screen(self.problem, self.baseline, self.rng)
        findings = [
            Finding(
                s.cause,
                s is first.scores[0] and self._significant(s),
                s.p_value,
                self._explains(s.gain),
                tuple(
                    Estimate(q.name, v, q.unit, float("nan"), float("nan"))
                    for q, v in zip(s.cause.parameters, s.start, strict=True)
                ),
                alike(s, first) if s is first.scores[0] else (),
                float("nan"),
            )
            for s in first.scores
        ]
        return self._answer(findings, self.baseline, {}, quick=True)

    def full(self) -> Answer:
        """Screen, refit, accept, repeat; then eliminate, bound and compare."""
        p_values: dict[str, float] = {}
        current, scores = self._rounds(self.baseline, p_values)
        self.progress(0.55)
        current, scores = self._restarted(current, scores, p_values)
        self.progress(0.6)
        current, without = self._eliminate(self._exchanged(current, p_values))
        if set(current.names) != set(p_values):
            scores = screen(self.problem, current, self.rng)
        self.progress(0.65)
        self.firings = [(k, f) for k, f in self.firings if not self._told_otherwise(k, f, current)]
        if current.squares - self.floor.squares > self.floor.relevant and not self._jagged:
            jumps = sticking.sawtooth(self.problem, current)
            self.firings = [*self.firings, *([] if jumps is None else [(0, jumps)])]
        current, sure = self._by_contrast(current, without, p_values)
        self.progress(0.7)
        estimates = estimates_of(current, scores, self.held_out, self.floor) | sure
        self.progress(0.75)
        found = []
        for term in current.terms:
            name = term.cause.id
            finding = self._finding(current, without[name], term, p_values[name], estimates[name])
            found.append(replace(finding, by_contrast=name in sure))
            self.progress(0.75 + 0.2 * len(found) / len(current.terms))
        rest = [
            Finding(s.cause, False, s.p_value, self._explains(s.gain))
            for s in scores.scores
            if s.cause.id not in current.names
        ]
        return self._answer([*found, *rest], current, estimates, quick=False)

    def _told_otherwise(self, k: int, firing: gates.Firing, current: Fitted) -> bool:
        """Whether the jumps of a record are those of the causes found: a hum also jumps between rests."""
        if firing.cause != "stick-slip" or not current.terms:
            return False
        record, simulator = self.problem.records[k], current.simulator
        added = simulator.full(current.terms)[k] - simulator.inner(current.terms)[k]
        reach = self.problem.plane.high - self.problem.plane.low
        return gates.jumps(replace(record, output=record.output - added), reach) is None

    @property
    def _jagged(self) -> bool:
        return any(firing.cause in _JAGGED for _, firing in self.firings)

    def _by_contrast(
        self, current: Fitted, without: dict[str, Fitted], p_values: dict[str, float]
    ) -> tuple[Fitted, dict[str, tuple[Estimate, ...]]]:
        """Add what only equal loops show, with its intervals; ``without`` and ``p_values`` are filled in."""
        sure: dict[str, tuple[Estimate, ...]] = {}
        if self._unexplained(current) or self._jagged:  # either makes equal loops differ
            return current, sure
        for cause in (c for c in library().values() if c.by_contrast and c.id not in current.names):
            held = congruency.fitted_contrast(self.problem, current, cause, self.rng)
            if held is None or held.p_value > _CONTRAST_P_MAX or held.at_bound:
                continue
            terms = in_order((*current.terms, Term(cause, (held.value,))))
            extended = weights_for(self.problem, terms, current, rebuild=True)
            if extended.squares - current.squares > self.floor.relevant:
                continue  # what the loops say the rest of the record denies
            without[cause.id], p_values[cause.id] = current, held.p_value
            current = extended
            sure[cause.id] = (held.estimate(cause),)
        return current, sure

    def _rounds(self, current: Fitted, p_values: dict[str, float]) -> tuple[Fitted, Screen]:
        """Add one cause after another; ``p_values`` is filled in."""
        while True:
            scores = screen(self.problem, current, self.rng)
            number = len(current.terms)
            chosen = self._next(current, scores, number) if number < MOST else None
            if chosen is None:
                return current, scores
            current, name, p_values[name] = chosen
            self.floor = self.floor.at(self.coarse, current)
            self.progress(_round_begins(number + 1))

    def _restarted(
        self, current: Fitted, scores: Screen, p_values: dict[str, float]
    ) -> tuple[Fitted, Screen]:
        """Where one of a family leaves what another of it could explain, begin again with that one.

        The wrong lag may fit better than the right one while a second cause is missing, and then hide it.
        """
        families = {term.cause.family for term in current.terms}
        left = next((s for s in scores.scores if s.cause.family in families and self._significant(s)), None)
        if left is None:
            return current, scores
        others = [t for t in current.terms if t.cause.family != left.cause.family]
        anew = {t.cause.id: p_values[t.cause.id] for t in others} | {left.cause.id: left.p_value}
        first = refit(self.problem, (*others, Term(left.cause, left.start)), current, rebuild=True)
        floor = self.floor
        found, known = self._rounds(first, anew)
        if current.squares - found.squares < floor.relevant:
            self.floor = floor
            return current, scores
        p_values.clear()
        p_values.update(anew)
        return found, known

    def _next(self, current: Fitted, scores: Screen, number: int) -> tuple[Fitted, str, float] | None:
        """The best acceptable cause after a joint refit, with its p-value."""
        trials: list[tuple[Fitted, Score]] = []
        begins, ends = _round_begins(number), _round_begins(number + 1)
        for score in scores.scores:
            if len(trials) == TRIED or not self._promising(score):
                break
            if score.cause.family in {term.cause.family for term in current.terms}:
                continue  # what a cause of its own kind leaves is its imperfect formula, not a second one
            trial = refit(self.problem, (*current.terms, Term(score.cause, score.start)), current, rounds=3)
            trials.append((trial, score))
            self.progress(begins + (ends - begins) * (len(trials) + 1) / (TRIED + 2))
        trials.sort(key=lambda pair: pair[0].squares)
        for trial, score in trials:
            if current.squares - trial.squares < self.floor.relevant:
                continue
            gain = self.held_out.gain(current, trial, self.floor)
            if np.isfinite(gain) and gain < HELD_OUT_MIN:
                continue
            changes_input = any(t.cause.stage == "input" for t in trial.terms)
            refitted = refit(self.problem, trial.terms, trial, rebuild=changes_input)
            return refitted, score.cause.id, score.p_value
        return None

    def _exchanged(self, current: Fitted, p_values: dict[str, float]) -> Fitted:
        """Try the others of its family in the place of each cause; the new one inherits its p-value."""
        for cause in [term.cause for term in current.terms]:
            name, kin = cause.id, self._kin(cause, current)
            if not kin:
                continue
            # by its cause: an exchange before this one has moved all terms
            others = [t for t in current.terms if t.cause is not cause]
            without = refit(self.problem, others, current, rounds=1)
            best, known = current, screen(self.problem, without, self.rng, draws=_FEW)
            for score in known.scores:
                if score.cause.id in kin:
                    trial = refit(self.problem, (*without.terms, Term(score.cause, score.start)), without)
                    best = min(best, trial, key=lambda fitted: fitted.squares)
            if best is not current:
                (new,) = set(best.names) - set(current.names)
                p_values[new] = p_values.pop(name)
                changes_input = any(t.cause.stage == "input" for t in best.terms)
                current = refit(self.problem, best.terms, best, rebuild=changes_input)
        return current

    def _kin(self, cause: Cause, current: Fitted) -> set[str]:
        """Causes of the same family that are not in the model."""
        return {c.id for c in library().values() if c.family == cause.family and c.id not in current.names}

    def _eliminate(self, current: Fitted) -> tuple[Fitted, dict[str, Fitted]]:
        """Drop causes that the others have made superfluous; the rest with the fits that lack one each."""
        while len(current.terms) > 1:
            without = [
                refit(self.problem, [t for t in current.terms if t is not term], current, rounds=1)
                for term in current.terms
            ]
            weakest = min(without, key=lambda fitted: fitted.squares)
            if weakest.squares - current.squares >= self.floor.relevant:
                return current, {t.cause.id: one for t, one in zip(current.terms, without, strict=True)}
            current = weakest
        return current, {term.cause.id: self.baseline for term in current.terms}

    def _finding(
        self, fitted: Fitted, without: Fitted, term: Term, p_value: float, estimates: tuple[Estimate, ...]
    ) -> Finding:
        return Finding(
            term.cause,
            found=True,
            p_value=p_value,
            explains_percent=self._explains(without.squares - fitted.squares),
            parameters=estimates,
            # equal loops differ by nothing else that is known here
            confounded_with=()
            if term.cause.by_contrast
            else rivals(self.problem, fitted, without, term, self.floor, self.lacks, self.rng),
            held_out_gain_percent=100.0 * self.held_out.gain(without, fitted, self.floor),
        )

    def _unexplained(self, fitted: Fitted) -> bool:
        """Whether more than half of what can be explained is left, and enough to matter."""
        left = fitted.squares - self.floor.squares
        return left > max(0.5 * self.floor.reducible(self.baseline), 4.0 * self.floor.relevant)

    def _answer(
        self,
        findings: Sequence[Finding],
        final: Fitted,
        estimates: dict[str, tuple[Estimate, ...]],
        *,
        quick: bool,
    ) -> Answer:
        found = sorted((f for f in findings if f.found), key=lambda f: -f.explains_percent)
        rest = sorted((f for f in findings if not f.found), key=lambda f: -f.explains_percent)
        gated = _gated(self.firings, len(self.problem.records))
        verdict = "none"
        if self._unexplained(final) and not quick:
            verdict = next((f.cause.id for f in gated if f.cause.id in _JAGGED), "unknown")
        elif found:
            verdict = found[0].cause.id
        elif gated:
            verdict = gated[0].cause.id
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
            self.floor.noise,
            self.floor.rms,
            self.floor.discretisation,
            quick,
            tuple((t, estimates.get(t.cause.id, ())) for t in final.terms),
        )


def _round_begins(number: int) -> float:
    """Share of the work done when a round begins; most records need one to three."""
    return 0.15 + 0.5 * (1.0 - 0.6**number)


def _gated(firings: Firings, records: int) -> list[Finding]:
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
                parameters=(
                    Estimate(
                        "size", firing.value, unit, firing.value - firing.spread, firing.value + firing.spread
                    ),
                ),
                held_out_gain_percent=float("nan"),
                text=where + firing.text,
            )
    return list(found.values())
