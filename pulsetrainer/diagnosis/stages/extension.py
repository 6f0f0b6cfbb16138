"""Extension: the model with the causes that repeat; never one that predicts worse than the model given.

The search judges a model on averages, with a free offset and a free beginning. The model that will be used
has levels of its own, and starts from rest. It is made here. It must predict these same records better than
the model as given, and better than a static model that was fitted to them, by at least three fifths of what
the causes gain in the search; otherwise nothing is added. A cause that gains less was already under way
before the record, and will begin differently in the next one.

If the model as given contains these causes already, the new one must leave less than half of its squared
error; otherwise that is said. A fault of the measurement that can be taken out of the records counts on
neither side of the comparison. Equal loops show a cause by differences that the weights can absorb, not by
what it predicts. If the model gains nothing with such a cause, it is tried without. If it predicts worse with
a learned dependence, that is in doubt: it was named for what it predicts.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pulsetrainer.artefacts import Model
from pulsetrainer.diagnosis.artefact import (
    extended_model,
    faults_of,
    percent_of_samples,
    rms_of,
    undone,
    with_its_offset,
)
from pulsetrainer.diagnosis.causes.condition_change import ConditionChange
from pulsetrainer.diagnosis.causes.unlisted import Unlisted
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.fitting import Fitted, refit
from pulsetrainer.diagnosis.raw import noise_of
from pulsetrainer.diagnosis.stages import begin
from pulsetrainer.diagnosis.stages.repetition import DOUBT
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


def stage(state: State) -> State:
    """Return the state with the extended model, where there is one that predicts better."""
    if state.question.given is None or not state.extensions:
        return state
    given = state.question.given.model
    found = _extended(state, given)
    if found.extended is None and {term.cause.id for term in state.extensions} & set(state.by_contrast):
        fewer = _without_contrast(state)
        other = _extended(fewer, given) if fewer.extensions else found
        return other if other.extended is not None else found
    return found


def _extended(state: State, given: Model) -> State:
    assert state.repeated is not None
    known, faults = undone(state), faults_of(state)
    extended = with_its_offset(state, extended_model(state, given), known)
    before, after = rms_of(state, given, known), rms_of(state, extended, known)
    plain = refit(state.problem, faults, state.repeated) if faults else state.baseline
    gained = (plain.squares - state.repeated.squares) / state.floor.count
    beaten = before**2
    # What was fitted in several conditions has a zero for each, which no model has. Else it counts: a model
    # that has the heat already predicts a record that begins warm worse than any other.
    if ConditionChange.id not in state.repeated.names:
        static = plain.squares / state.floor.count + _within_averages(state, state.repeated)
        beaten = min(beaten, static * state.scale.span**2)
    names = tuple(term.cause.id for term in state.extensions)
    held = set(names) <= {one.cause for one in given.extensions}  # what they gain, the model has already
    needed = LIMITS.half * before**2 if held else LIMITS.gain_in_use * max(gained, 0.0) * state.scale.span**2
    if beaten - after**2 > needed:
        return replace(state, extended=extended)
    rest = _rest(state)
    if held:
        kind, against = "in the model", before
    else:
        kind, against = _why_not(state, after**2 <= beaten, rest), float(np.sqrt(beaten))
    percent = percent_of_samples(state)
    figures = {"given": percent * against, "extended": percent * after, "rest": rest}
    said = Evidence(kind, figures=figures, names=names)
    state = replace(state, repeated=None, evidence=(*state.evidence, said))
    return _curve_in_doubt(state) if kind == "no better" and names == (Unlisted.id,) else state


def _curve_in_doubt(state: State) -> State:
    """Return the state with its learned dependence in doubt: nothing stands for one but what it predicts."""
    findings = tuple(
        replace(one, doubts=(*one.doubts, DOUBT)) if one.found and one.cause.id == Unlisted.id else one
        for one in state.findings
    )
    verdict = "unknown" if state.verdict == Unlisted.id else state.verdict
    return replace(state, findings=findings, verdict=verdict)


def _within_averages(state: State, fitted: Fitted) -> float:
    """Mean square of what a fit leaves of samples as measured, beyond what it leaves of their averages.

    The records that are fitted may be averages themselves; within these there is only noise.
    """
    records, bins = fitted.problem.records, fitted.problem.bins
    simulated = fitted.simulator.full(fitted.terms)
    left = [record.output - y for record, y in zip(records, simulated, strict=True)]
    variance = bins.average([one**2 for one in left]) - bins.average(left) ** 2
    noise = [
        (1.0 - 1.0 / even.averaged) * noise_of(own.output, own.sample_weight) ** 2
        for own, even in zip(state.question.records, records, strict=True)
    ]
    return float(np.average(variance, weights=bins.sizes) + np.mean(noise) / state.scale.span**2)


def _why_not(state: State, better: bool, rest: float) -> str:
    """Kind of the evidence that says why nothing is added; ``rest`` is how long the device settles."""
    assert state.repeated is not None
    if better:
        return "no gain"
    # what is over within the shortest hold was not under way
    free = state.repeated.problem.bins.begins_free
    return "under way" if free and rest >= LIMITS.hold_s else "no better"


def _rest(state: State) -> float:
    """How long the device must rest before a record, so that nothing still settles when it begins."""
    assert state.repeated is not None
    times = [
        value
        for term in (*state.repeated.terms, *state.current.terms)
        for quantity, value in zip(term.cause.quantities(state.problem.frames[0]), term.values, strict=True)
        if quantity.unit == "s"
    ]
    return LIMITS.settled_times * max(times, default=0.0)


def _without_contrast(state: State) -> State:
    """Return the state whose model that is passed on lacks the causes that only equal loops showed."""
    assert state.repeated is not None
    kept = [term for term in state.repeated.terms if term.cause.id not in state.by_contrast]
    findings = tuple(
        replace(one, doubts=(*one.doubts, DOUBT)) if one.cause.id in state.by_contrast else one
        for one in state.findings
    )
    fewer = refit(state.problem, kept, state.repeated, rebuild=True)
    return begin.stage(replace(state, repeated=fewer, findings=findings))
