"""Exchange: each cause against the others of its family, its own other kinds, and its finer formula.

When a cause was chosen, others were still missing. So each cause is taken out, and every other cause of its
family, and every other kind of its own, is fitted in its place. The best is kept. A new cause inherits the
p-value of the old one: the test was whether anything of this family is there, not which one (decision 044).

For a lag or a force by speed that is as fast as the samples a creep is tried as well, for such a creep the
lags, and one creep in the place of several fast causes (decision 128). A lag of few time steps and a cause
as fast as the samples may be that lag alone, seeing other than a straight line between two samples
(decision 148).

Some causes have a finer formula with one more parameter. It takes the place of the plain one only if the fits
differ by more than twice what noise, and what happens between two samples, can make. The finer formula may be
another cause: a drift of the gain holds one of the zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

from pulsetrainer.diagnosis.causes import library, other_kinds
from pulsetrainer.diagnosis.causes.base import Cause
from pulsetrainer.diagnosis.causes.creep import Creep
from pulsetrainer.diagnosis.causes.resonance import Resonance
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fast_causes import as_late, fast_s
from pulsetrainer.diagnosis.finding import Estimate, may_be_nothing
from pulsetrainer.diagnosis.fitting import Fitted, refit
from pulsetrainer.diagnosis.noise import doubt
from pulsetrainer.diagnosis.screening import in_place, ranked
from pulsetrainer.diagnosis.stages.acceptance import settled
from pulsetrainer.diagnosis.stages.parameters import estimates_of
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


def stage(state: State) -> State:
    """Return the state with each cause exchanged for a better one of its family, where there is one."""
    state = _one_for_two(_one_creep(state))
    for cause in [term.cause for term in state.current.terms]:
        state = _exchanged(state, cause)
    for term in state.current.terms:
        state = _refined(state, term)
    return state


def _refined(state: State, term: Term) -> State:
    """Return the state with the finer formula of a cause if the records show it, else the plain one."""
    current, problem = state.current, state.problem
    old, coarser = term.cause, term.cause.coarser()
    others = [one for one in current.terms if one is not term]
    plain, trials = current, []
    if coarser is not None:
        term = Term(coarser, term.values[:-1])
        plain, trials = refit(problem, (*others, term), current), [current]
    if coarser is None or coarser.id != old.id:
        trials += [refit(problem, (*others, one), current) for one in _finer(state, term)]
    shown = [fine for fine in trials if _shows(state, fine, plain, _in_place_of(old, fine, current))]
    best = min(shown, key=lambda fitted: fitted.squares, default=plain)
    return state if best is current else _with(state, best, old)


def _finer(state: State, term: Term) -> list[Term]:
    """Return the finer formulas of a cause, as they begin."""
    found = term.cause.finer(state.problem.frames[0], term.values)
    return [Term(one, (*term.values, value)) for one, value in found]


def _in_place_of(old: Cause, fitted: Fitted, current: Fitted) -> Cause:
    """Return the cause of a fit that has the place of an old one."""
    return next(t.cause for t in fitted.terms if t.cause.id == old.id or t.cause.id not in current.names)


def _shows(state: State, fine: Fitted, plain: Fitted, cause: Cause) -> bool:
    """Whether the records show a finer formula, and the intervals of its strengths exclude zero."""
    noise = state.scores.noise
    if noise is None or plain.squares - fine.squares <= LIMITS.finer * doubt(fine, plain, noise):
        return False
    known = estimates_of(fine, state.scores, state.held_out, state.floor)[cause.id]
    return not may_be_nothing(cause.strengths_of(known)) and _is_told(state, known, cause)


def _is_told(state: State, known: Sequence[Estimate], cause: Cause) -> bool:
    """Whether the interval of what lies between two samples excludes that of the plain formula, zero."""
    last = cause.quantities(state.problem.frames[0])[-1]
    return not (last.whole and known[-1].lower <= 0.0 <= known[-1].upper)


def _with(state: State, best: Fitted, old: Cause) -> State:
    """Return the state with a fit that has another cause in the place of an old one, with its p-value."""
    new = _in_place_of(old, best, state.current).id
    p_values = {new if name == old.id else name: p for name, p in state.p_values.items()}
    return replace(state, current=settled(state.problem, best), p_values=p_values)


def _one_creep(state: State) -> State:
    """Return the state with one creep for several causes as fast as the samples, where that is as good."""
    current, frame = state.current, state.problem.frames[0]
    creeps = {term: as_late(term, frame) for term in current.terms if not isinstance(term.cause, Creep)}
    several = [term for term, one in creeps.items() if one]
    if len(several) < 2 or Creep.id in current.names:
        return state
    others = tuple(term for term in current.terms if term not in several)
    trials = [refit(state.problem, (*others, *creeps[term]), current) for term in several]
    best = min(trials, key=lambda fitted: fitted.squares)
    if best.squares - current.squares > doubt(current, best, state.scores.noise):
        return state
    p_values = {name: p for name, p in state.p_values.items() if name in best.names}
    p_values[Creep.id] = min(state.p_values[term.cause.id] for term in several)
    return replace(state, current=settled(state.problem, best), p_values=p_values)


def _one_for_two(state: State) -> State:
    """Return the state with one cause for two, where what it sees between two samples explains the other.

    The other is as fast as the samples, such as a force by speed, or rings. The one must do as well alone.
    """
    current, frame, noise = state.current, state.problem.frames[0], state.scores.noise
    fast = [t for t in current.terms if fast_s(t, frame) is not None or isinstance(t.cause, Resonance)]
    as_good = []
    for term, other in product(current.terms, fast):
        kept = tuple(one for one in current.terms if one not in (term, other))
        between = [one for one in _finer(state, term) if one.cause.quantities(frame)[-1].whole]
        for fine in between if other is not term else []:
            trial = refit(state.problem, (*kept, fine), current)
            if trial.squares - current.squares > doubt(current, trial, noise):
                continue
            cause = _in_place_of(term.cause, trial, current)
            known = estimates_of(trial, state.scores, state.held_out, state.floor)[cause.id]
            as_good += [trial] if _is_told(state, known, cause) else []
    if not as_good:
        return state
    best = min(as_good, key=lambda fitted: fitted.squares)
    p_values = {name: p for name, p in state.p_values.items() if name in best.names}
    return replace(state, current=settled(state.problem, best), p_values=p_values)


def _exchanged(state: State, cause: Cause) -> State:
    current, problem = state.current, state.problem
    kin = {c.id for c in library().values() if c.family == cause.family and c.id not in current.names}
    kinds = other_kinds(cause, problem.frames)
    # by its cause: an exchange before this one has moved all terms
    term = next(term for term in current.terms if term.cause is cause)
    late = [one for one in as_late(term, problem.frames[0]) if one.cause.id not in current.names]
    if not kin and not kinds and not late:
        return state
    without = current.without(term)
    others = [Term(kind, term.values) for kind in kinds]
    if kin:
        others += [in_place(term, s) for s in ranked(without, current) if s.cause.id in kin]
    trials = [refit(problem, (*without.terms, one), without, goal=current.squares) for one in others]
    for one in late:
        trial = refit(problem, (*without.terms, one), without)
        if current.squares - trial.squares > doubt(current, trial, state.scores.noise):
            trials.append(trial)
    best = min((current, *trials), key=lambda fitted: fitted.squares)
    return state if best is current else _with(state, best, cause)
