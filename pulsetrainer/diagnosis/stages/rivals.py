"""Rivals: which causes explain the data as well as the one found.

A name is unique only if no other cause fits as well in its place. The three causes that score best without it
are fitted jointly, each in its place. A rival is named beside the cause found if noise, or what happens
between two samples, could make the difference between the two fits. A cause whose formula holds that of the
one found is no rival: it would fit anyway. One that holds that of a third must fit better. On a record of one
single rate all causes that widen the loop with the rate are named together: there they are just a wider loop.
A creep and a lag as quick as the samples are tried in each other's place, whatever they score. Causes that
equal loops showed have no rivals here: nothing else that is known makes equal loops differ.

What speaks against a cause that was found is written beside it:

- it predicts blocks that were left out worse than the model without it;
- the interval of its strength spans zero;
- a parameter, its interval or the strength itself ends where the search did; for a cause of the device it is
  also written if the cause then takes away less than it leaves;
- it is a hum in step with the input, and the weights would absorb most of it;
- it is slow, and the residual still wanders from one tenth of the time to the next;
- it is a slow fault of the measurement, and all causes together take away less than half of what can be
  lowered on blocks that were left out: in a device of another kind they would do as much;
- it is sudden, its size is uncertain, and nearly all that it takes away lies in one stretch, much shorter
  than the time before and after it: a step changes all that comes after;
- it is sudden, and where the input changes its speed, beside a cause of the device that depends on time: what
  the formula of that one lacks looks like it;
- it follows the speed, like anything that a device does as it moves; more than the noise from sample to
  sample is left, and of what the model leaves without it less than three quarters is predicted on blocks left
  out;
- only equal loops would show it, and there are none;
- a gain that wears off with time, or with the way of the input, fits as well, so that it could equally be
  `accommodation`; or, against a step, whatever settles from the beginning of the record fits as well;
- the record has one rate and no rest, where any cause looks like what a model lacks of the device; and what
  is left is more than noise, or is slow and hardly smaller than what the cause explains; or the cause is a
  memory that is forgotten within a stroke;
- the record has one rate, and the output seems to come before it is asked: there that is a shape of the loop.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis import residual, wear
from pulsetrainer.diagnosis.causes import library, places
from pulsetrainer.diagnosis.causes.accommodation import Accommodation
from pulsetrainer.diagnosis.causes.base import Cause, Quantity
from pulsetrainer.diagnosis.congruency import loops_of
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fast_causes import as_late
from pulsetrainer.diagnosis.finding import AT_BOUND, MAY_BE_WEAR, Estimate, Finding, may_be_nothing
from pulsetrainer.diagnosis.fitting import added, refit
from pulsetrainer.diagnosis.lines import is_a_line
from pulsetrainer.diagnosis.noise import doubt
from pulsetrainer.diagnosis.screening import both_late, in_place, ranked
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT

WORSE, WANDERS, LITTLE, NO_LOOPS = "predicts worse", "wanders", "predicts little", "no equal loops"
OWN_ERROR, STRONGEST, LEAVES_MORE = "own error", "strength at bound", "leaves more"
MAY_BE_NOTHING, SETTLES, IN_STEP = "spans zero", "settles", "in step"
IMITATES, ONE_STRETCH, RATE_CHANGES = "imitates", "one stretch", "rate changes"


def stage(state: State) -> State:
    """Return the state with a finding for every cause that was tried."""
    found = [_finding(state, term) for term in state.current.terms]
    beyond = state.baseline.squares > state.floor.squares  # else there is nothing to be explained
    rest = [
        Finding(score.cause, False, score.p_value, state.explains(score.gain) if beyond else 0.0)
        for score in state.scores.scores
        if score.cause.id not in state.current.names
    ]
    return replace(state, findings=(*found, *rest))


def _finding(state: State, term: Term) -> Finding:
    name = term.cause.id
    without = state.without[name]
    gain = PERCENT * state.held_out.gain_told(without, state.current, state.floor)
    doubts = tuple(_doubts(state, term, gain, without.squares - state.current.squares))
    alone = name in state.by_contrast or is_a_line(state, term, state.current, without)
    tied = () if alone else rivals(state, term)
    if MAY_BE_WEAR in doubts and Accommodation.id not in (*tied, *state.current.names):
        tied = (*tied, Accommodation.id)
    return Finding(
        term.cause,
        found=True,
        p_value=state.p_values[name],
        explains_percent=state.explains(without.squares - state.current.squares),
        parameters=state.estimates[name],
        confounded_with=tied,
        held_out_gain_percent=gain,
        doubts=doubts,
    )


def _doubts(state: State, term: Term, gain: float, fall: float) -> Iterator[str]:
    """Yield what speaks against a cause that was found: it is reported with these words beside it."""
    cause, known = term.cause, state.estimates[term.cause.id]
    yield from _of_its_prediction(state, cause, gain)
    if cause.by_contrast and not _equal_loops(state):
        yield NO_LOOPS
    if cause.drifts:
        yield from _of_a_drift(state, term, fall)
    nothing = may_be_nothing(cause.strengths_of(known))
    if nothing:
        yield MAY_BE_NOTHING
    in_step = term.cause.in_step(term.values, state.problem.frames)
    if in_step and fall < LIMITS.free_of_weights * squares_added(state, term):  # the weights hold most of it
        yield IN_STEP
    if _may_be_own_error(state, term, fall):
        yield OWN_ERROR
    frame = state.problem.frames[0]
    at_end = term.at_bounds(frame)
    if any(at_end[: cause.strengths]) and not nothing:
        yield STRONGEST
    elif any(at_end) or _is_cut(state, known, cause.quantities(frame)):
        yield AT_BOUND
        if cause.lasting and fall < state.current.squares:
            yield LEAVES_MORE


def _of_its_prediction(state: State, cause: Cause, gain: float) -> Iterator[str]:
    """Yield what the prediction of blocks left out says against a cause."""
    if gain < 0 and cause.id not in state.by_contrast:  # the weights hold that: it predicts as well without
        yield WORSE
    left = state.current.squares
    slow = left - state.floor.quick.squares > LIMITS.slow_share * left  # much more than quick noise is left
    if cause.imitates and slow and gain < PERCENT * LIMITS.learned_predicts:
        yield IMITATES


def _of_a_drift(state: State, term: Term, fall: float) -> Iterator[str]:
    """Yield what speaks against a slow cause."""
    left = residual.wander(state.current.residual, state.problem.measured)
    if left > max(LIMITS.wander_left * state.current.squares, LIMITS.wander_fall * fall):
        yield WANDERS
    judged = state.held_out
    of_pieces = (
        judged.gain(state.without[term.cause.id], state.current, state.floor) < 0.0
    )  # told by them alone
    gain_of = judged.gain_of_pieces if of_pieces else judged.gain_told
    of_all = gain_of(state.baseline, state.current, state.floor)
    if not term.cause.lasting and of_all < LIMITS.half:  # one of the device is asked whether it repeats
        yield LITTLE
    sizes = term.cause.strengths_of(state.estimates[term.cause.id]) if term.cause.sudden else ()
    if sizes and all(_is_rough(one) for one in sizes) and _in_one_stretch(state, term):
        yield ONE_STRETCH
    if term.cause.sudden and _where_the_rate_changes(state, term):
        yield RATE_CHANGES
    if wear.is_as_good(state, term):
        yield SETTLES if term.cause.sudden else MAY_BE_WEAR


def _where_the_rate_changes(state: State, term: Term) -> bool:
    """Whether a sudden cause is where the input changes its speed, beside one that depends on time."""
    lasting = any(one.cause.lasting and not one.cause.sudden for one in state.current.terms)
    moment = term.values[-1]
    frames = [one for one in state.problem.frames if one.begin_s <= moment]
    return lasting and bool(frames) and frames[-1].changes_rate(moment - frames[-1].begin_s)


def _is_rough(size: Estimate) -> bool:
    """Whether a strength is known to no better than half of it."""
    return size.upper - size.lower > 2.0 * LIMITS.half * abs(size.value)


def _in_one_stretch(state: State, term: Term) -> bool:
    """Whether what a sudden cause takes away lies in a stretch much shorter than both sides of its moment."""
    after = int(np.count_nonzero(_added(state, term)))
    side = min(after, state.floor.count - after)
    falls = state.without[term.cause.id].residual ** 2 - state.current.residual**2
    return residual.shortest(falls, LIMITS.stretch_holds) < LIMITS.stretch_of_side * side


def squares_added(state: State, term: Term) -> float:
    """Return the sum of squares of what a cause of the model adds to the output, averaged."""
    own = _added(state, term)
    return float(own @ own)


def squares_moved(state: State, term: Term) -> float:
    """Return the same for a slow fault, without the part that is a mere shift of the zero.

    Every model has a zero of its own. A fault that is over soon is mostly a shift. The result is scaled as
    for a drift that goes on evenly, of whose squares a quarter is left without the shift.
    """
    own = _added(state, term)
    return min(float(own @ own), LIMITS.even_drift * own.size * float(np.var(own)))


def _added(state: State, term: Term) -> FloatArray:
    current = state.current
    others = [one for one in current.terms if one is not term]
    return state.problem.bins.average(added(current.simulator, current.terms, others))


def _may_be_own_error(state: State, term: Term, fall: float) -> bool:
    """Whether a cause may be what the model lacks of the device, on records of one rate without rests.

    There, and in samples without time, every effect that takes time follows the input, and so does the error
    of the model. The fall of the squares must be much larger than what is left, and what is left be noise. A
    memory that is forgotten within a stroke is in doubt anyway: it is there a shape of the loop. So is an
    output that comes before the input, also where there are rests.
    """
    cause = term.cause
    missed = {residual.RATES} if cause.comes_before else {residual.RATES, residual.HOLDS}
    if cause.by_contrast or not (residual.TIME in state.lacks or missed <= set(state.lacks)):
        return False
    if cause.comes_before or cause.shapes_strokes(term.values, state.problem.frames):
        return True
    if not state.is_whole(state.current):
        return cause.lasting or cause.drifts  # a drift or step may be a piece of it as well
    slow = state.floor.slow > LIMITS.slow_noise  # noise from sample to sample is no error of a model
    return cause.lasting and slow and fall < LIMITS.own_error**2 * state.current.squares


def _is_cut(state: State, known: Sequence[Estimate], bounds: Sequence[Quantity]) -> bool:
    """Whether an interval ends where the search did; zero is a natural end, and does not count."""
    return any(
        end != 0 and not bound.whole and np.isclose(one, end * state.scale.of_unit(bound.unit), atol=0.0)
        for own, bound in zip(known, bounds, strict=False)
        for one, end in ((own.lower, bound.low), (own.upper, bound.high))
    )


def _equal_loops(state: State) -> bool:
    """Whether the records hold minor loops that could show it."""
    plane = state.problem.plane
    return bool(loops_of(state.problem.records, plane.low, plane.high))


def rivals(state: State, term: Term) -> tuple[str, ...]:
    """Causes that explain the data as well as ``term``, within the noise of the comparison.

    Lags in different places of the chain differ little. One also counts as good if it is behind by no more
    than a share of what is left above the noise from sample to sample: that may be the model's own error.
    The same goes for a creep as fast as the samples.
    """
    fitted, without, floor = state.current, state.without[term.cause.id], state.floor
    gain = without.squares - fitted.squares
    structure = fitted.squares - floor.quick.squares
    margin = max(
        LIMITS.rival_gain * gain,
        LIMITS.rival_relevant * floor.relevant,
        LIMITS.rival_noise * fitted.squares / floor.count,
    )
    found = []
    others = [score for score in ranked(without, fitted) if score.cause.id not in fitted.names]
    others = [score for score in others if score.cause.holds != term.cause.id]  # that would fit anyway
    named = [score.cause for score in others]
    most = max(k for k in range(len(others) + 1) if places(named[:k]) <= LIMITS.closest)
    close = [score for score in others[:most] if score.gain >= LIMITS.rival_screened * gain]
    # linearised from afar, a lag of another kind may score nothing
    close += [score for score in others if both_late(score, term) and score not in close]
    late = max(margin, LIMITS.rival_late * structure)
    tried = [(in_place(term, score), late if both_late(score, term) else margin) for score in close]
    late_too = [one for one in as_late(term, state.problem.frames[0]) if one.cause.id not in fitted.names]
    tried += [(one, late) for one in late_too]
    for one, near in tried:
        if one.cause.id in found:
            continue
        terms = (*without.terms, one)
        trial = refit(state.problem, terms, without, rounds=LIMITS.rival_rounds, goal=fitted.squares + near)
        # what may do more, and explains no more, is no reason to doubt what does less
        within = 0.0 if one.cause.holds else max(near, doubt(fitted, trial, state.scores.noise))
        if trial.squares - fitted.squares < within:
            found.append(one.cause.id)
    if residual.RATES in state.lacks and term.cause.widens:
        alike = [c.id for c in library().values() if c.widens and c is not term.cause]
        found += [name for name in alike if name not in (*found, *fitted.names)]
    return tuple(found)
