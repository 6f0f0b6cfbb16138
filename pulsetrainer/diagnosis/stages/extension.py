"""Extension: the model with the causes that repeat, as it will be used.

The search judges a model on averages, with a free offset and begin. What is used is a model on levels of its
own, from rest. It is made here, and must predict the very records better than the model as given, by at least
three fifths of what the causes gain in the search; else nothing is added to that. What gains less was already
under way before the record, and begins otherwise in the next. What a fault of the measurement did to the
records, and can be taken out of them, counts on neither side.
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis.answered import extended_model, faults_of, rms_of, undone
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.fitting import refit
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT


def stage(state: State) -> State:
    """Return the state with the extended model, where there is one that predicts better."""
    if state.question.given is None or not state.extensions:
        return state
    given = state.question.given.model
    extended = extended_model(state, given)
    assert state.repeated is not None
    known, faults = undone(state), faults_of(state)
    before, after = rms_of(state, given, known), rms_of(state, extended, known)
    plain = refit(state.problem, faults, state.repeated) if faults else state.baseline
    gained = (plain.squares - state.repeated.squares) / state.floor.count
    if before**2 - after**2 > LIMITS.gain_in_use * max(gained, 0.0) * state.scale.span**2:
        return replace(state, extended=extended)
    figures = {"given": PERCENT * before / state.scale.span, "extended": PERCENT * after / state.scale.span}
    names = tuple(term.cause.id for term in state.extensions)
    said = Evidence("no gain", figures=figures, names=names)
    return replace(state, repeated=None, evidence=(*state.evidence, said))
