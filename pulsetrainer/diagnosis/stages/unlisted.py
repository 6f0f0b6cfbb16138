"""Unlisted: what no listed cause explains is sought in a bank of states.

If more than noise is left, the device may depend on something that is not in the list. Its output, or its
gain, is then fitted by a curve over one state after another. The bank of states holds averages of input and
output over many lengths of time, of their squares and of their speeds, and how far each is from its average.
It also holds the last turn of the input, the distance and the time since that turn, and how long the input
has rested.

The best state is the one that best predicts whole stretches of time that were left out. It is taken if

- noise alone hardly ever predicts as much with any state of the bank (p of at most 0.01);
- its effect is relevant, and more than the formulas of listed causes may miss (8 % of what they explain);
- refitted with all weights, it repeats (`repetition`).

The noise is then estimated again beside it, and the next state is sought in what is left, up to three. What
may be slow noise is searched too. A curve that is found there must predict three quarters of all that is left
above the noise from sample to sample (decision 105).

If the listed causes found leave more than half unexplained, or if nothing is found beside them, the bank is
searched without them: they may be mistaken. They are then tested again beside the curve, and every cause,
listed or not, must make the fit worse when it is taken out. But a curve that only replaces listed causes
which explain nearly as much is a better formula for them, and not a dependence of its own. The same holds for
one of several curves that the listed causes could replace.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

from pulsetrainer.diagnosis.causes.unlisted import KNOTS, Part, Unlisted
from pulsetrainer.diagnosis.dependence import best_dependence, of_a_wandering_zero
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import Fitted, refit
from pulsetrainer.diagnosis.floor import Floor
from pulsetrainer.diagnosis.held_out import repeated
from pulsetrainer.diagnosis.stages import elimination, search
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS

_ID = Unlisted.id


def stage(state: State) -> State:
    """Return the state with learned dependences in the model, where they repeat."""
    if not state.question.timed or state.jagged:
        return state
    if _more_is_left(state):
        return _sought(state)
    if not _levels_are_most(state):
        return state
    fine = replace(state, floor=state.floor.fine)
    found = _sought(fine)
    return state if found.current is fine.current else found


def _levels_are_most(state: State) -> bool:
    """Whether the error of the levels would be most of what is left, and what is left matters.

    A missing cause makes that estimate too large: the finer levels may imitate it.
    """
    of_levels = state.floor.count * state.floor.discretisation**2 > LIMITS.half * state.current.squares
    return of_levels and state.current.rms > LIMITS.matters * state.floor.span


def _sought(state: State) -> State:
    """Return the state with the learned dependences that repeat and predict."""
    alone = replace(state, current=state.baseline, p_values={}, without={})
    doubts = []
    for begun in [alone] if state.unexplained else [state, alone] if state.current.terms else [state]:
        found, p_value, doubtful = _learned(begun)
        if found is not None and _wanders(begun, found):
            return replace(state, evidence=(*state.evidence, Evidence("zero wanders")))
        if found is not None and _predicts(begun, found):
            return _compared(state, begun, found, p_value)
        doubts.append(doubtful or found is not None)
    said = (Evidence("not repeated", _ID),) if any(doubts) else ()
    return replace(state, evidence=(*state.evidence, *said))


def _compared(state: State, begun: State, found: Fitted, p_value: float) -> State:
    """Return the state with the dependences ``found``, or as it was if listed causes do as well."""
    if state.current.squares <= found.squares:
        return state
    after = _heard_again(replace(begun, current=found, p_values={**begun.p_values, _ID: p_value}))
    if begun is not state:
        after = search.stage(after)
    after = _heard_again(elimination.stage(after))
    replaced = [term for term in state.current.terms if term.cause.id not in after.current.names]
    if not replaced:
        return after
    base = state.baseline.squares  # listed causes that explain nearly as much keep their names
    if base - state.current.squares > LIMITS.nearly_all * (base - after.current.squares):
        return state
    return _with_names(state, after, replaced)


def _with_names(state: State, after: State, listed: list[Term]) -> State:
    """Return the model ``after`` with listed causes in the place of one curve, if they fit as well."""
    learned = next((term for term in after.current.terms if term.cause.id == _ID), None)
    if learned is None or not isinstance(learned.cause, Unlisted) or len(learned.cause.parts) == 1:
        return after
    parts, values, trials = learned.cause.parts, learned.values, []
    others = [term for term in after.current.terms if term is not learned]
    for k in range(len(parts)):
        fewer = Unlisted(parts[:k] + parts[k + 1 :])
        curves = Term(fewer, values[: k * KNOTS] + values[(k + 1) * KNOTS :])
        terms = (*others, *listed, curves)
        trials.append(refit(state.problem, terms, after.current, rounds=LIMITS.learned_rounds))
    best = min(trials, key=lambda fitted: fitted.squares)
    if best.squares > after.current.squares + after.floor.relevant:
        return after
    p_values = {**after.p_values, **{t.cause.id: state.p_values[t.cause.id] for t in listed}}
    return _heard_again(elimination.stage(replace(after, current=best, p_values=p_values)))


def _predicts(state: State, found: Fitted) -> bool:
    """Whether learned dependences predict most of what can be lowered on blocks that were left out.

    The loops of a device that is no Preisach operator look partly like a dependence on the last turn. What
    may all be slow noise must be predicted down to the noise from sample to sample. A pinched loop, which
    curves describe partly too, must be explained down to the same noise.
    """
    if state.pinched_at is not None and not state.butterfly:
        return not _is_above(replace(state, current=found), state.floor.fine)
    floor = state.floor if _is_above(state, state.floor) else state.floor.quick
    return state.held_out.gain(state.current, found, floor) >= LIMITS.learned_predicts


def _wanders(begun: State, found: Fitted) -> bool:
    """Whether a zero that depends on time alone explains nearly as much as the learned dependences.

    Reversal curves pass their turns once, in the order of time, so that a state follows the time there.
    """
    fall = begun.current.squares - found.squares
    return of_a_wandering_zero(begun.current, begun.held_out, Unlisted.order) > LIMITS.nearly_all * fall


def _is_above(state: State, floor: Floor) -> bool:
    """Whether what is left is relevantly more than a floor."""
    return state.current.squares - floor.squares > floor.relevant


def _more_is_left(state: State) -> bool:
    """Whether more than noise is left, or much that is slow and may be noise or not: the bank decides."""
    left, quick = state.current.squares, state.floor.quick
    slow = left - quick.squares > LIMITS.slow_share * left
    return _is_above(state, state.floor_left) or (slow and _is_above(state, quick))


def _learned(state: State) -> tuple[Fitted | None, float, bool]:
    """Return the model with the dependences that repeat, its p-value, and whether one did not repeat."""
    listed = LIMITS.imperfect * (state.baseline.squares - state.current.squares)
    largest = 0.0
    parts: list[Part] = []
    values: list[float] = []
    doubtful = False
    while len(parts) < LIMITS.most_states and _more_is_left(state):
        current = state.current
        best = best_dependence(current, state.held_out, Unlisted.order, state.question.rng)
        if (
            best is None
            or best.p_value > LIMITS.p_max
            or best.fall < LIMITS.linearised * state.floor.relevant
        ):
            break
        begun = [([*parts, part], [*values, *start]) for part, start in best.starts]
        trials = [(_refitted(state, current, *one), one[0]) for one in begun if not _cancel(*one)]
        if not trials:
            break
        trial, more = min(trials, key=lambda one: one[0].squares)
        refitted = list(next(term.values for term in trial.terms if term.cause.id == _ID))
        if _cancel(more, refitted):
            break
        falls = current.squares - trial.squares > max(state.floor.relevant, listed)
        if not falls or repeated(state.held_out, current, trial) < LIMITS.repeated:
            doubtful = falls and not parts
            break
        parts, values = more, refitted
        largest = max(largest, best.p_value)
        state = _heard_again(replace(state, current=trial))
    return (state.current if parts else None), largest, doubtful


def _cancel(parts: list[Part], values: list[float]) -> bool:
    """Whether two dependences are on the same state over nearly the same time: their curves cancel."""
    taus = [(part.coded, values[k * KNOTS]) for k, part in enumerate(parts)]
    return any(
        one == other and max(tau / near, near / tau) < LIMITS.other_tau
        for (one, tau), (other, near) in combinations(taus, 2)
    )


def _heard_again(state: State) -> State:
    """Return the state with its noise estimated again: the old estimate contained the dependence."""
    return replace(state, floor=state.floor.heard(state.current).at(state.coarse, state.current))


def _refitted(state: State, current: Fitted, parts: list[Part], values: list[float]) -> Fitted:
    """Refit all weights and parameters together with the dependences."""
    others = [term for term in current.terms if term.cause.id != _ID]
    return refit(
        state.problem, (*others, Term(Unlisted(parts), tuple(values))), current, rounds=LIMITS.learned_rounds
    )
