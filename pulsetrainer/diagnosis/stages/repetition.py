"""Repetition: a cause goes into the model only if it predicts time that was left out of the fit.

What wanders slowly looks like heat, creep or a step, and blocks that alternate with the fitted ones only
interpolate it. So each cause that belongs to the device must *repeat*. Whole stretches, a fifth of the time
each, are predicted from the others: with the cause the errors must fall by at least half of what they fall by
in the fit, and they must not rise on any stretch. Nor may they rise on any quarter of the blocks, sorted by
rate and predicted from the others: a formula that fits only the rates of one record misleads at others.

A cause that fails this fits the record, but does not repeat. It is reported in these words, and is not added
to the model. Neither is a cause that is in doubt for another reason (`rivals`). Nor is one in whose place a
fault of the measurement, or a gain that wears off, would fit as well: that happened in this record, and will
not in the next. What equal loops show was tested separately. The cause that repeats least goes first; the
others, which had been fitted beside it, are then refitted and tested again.

Some causes count as not found at all:

- A cause whose strength may be zero, and that explains less than a tenth of what can be lowered, or less than
  half a per cent of the span. It only improves the formula of another cause, if anything.
- A cause that does not repeat, and explains less than both of these.
- A slow fault of the measurement that the weights and the other causes can absorb almost entirely. It would
  be taken out as large as it was fitted, from a device that never had it. It is reported, since it may be
  there all the same. It does count as found if no other cause is slow, and it predicts nearly all that can be
  lowered on time that was left out.

When such a cause is gone, the others are refitted, and a step is tested again: it may be something that only
settles.
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis import wear
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.base import Cause
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.finding import A_FAULT, MAY_BE_WEAR, NOT_ADDED, Finding
from pulsetrainer.diagnosis.fitting import Fitted, refit
from pulsetrainer.diagnosis.held_out import repeated
from pulsetrainer.diagnosis.stages.rivals import MAY_BE_NOTHING, SETTLES, squares_moved
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT

SLOW = ("slow memory", "slow gain", "drift")  # families of what a drift may mend
DOUBT = "does not repeat"


def stage(state: State) -> State:
    """Return the state with the causes that do not repeat, and the model without them."""
    state = _without_held(state)
    kept = state.current
    asked = [one for one in state.findings if _is_asked(state, one.cause)]
    told: dict[str, str] = {
        one.cause.id: A_FAULT
        for one in asked
        if any(library()[name].corrects for name in one.confounded_with)
    }
    told |= {one.cause.id: NOT_ADDED for one in asked if one.in_doubt or MAY_BE_WEAR in one.doubts}
    once = set(told) or _weakest(state, kept)
    while once:
        told = {**dict.fromkeys(once, DOUBT), **told}
        kept = refit(state.problem, [t for t in kept.terms if t.cause.id not in once], kept)
        once = _weakest(state, kept)
    findings = tuple(
        replace(one, doubts=(*one.doubts, told[one.cause.id])) if one.cause.id in told else one
        for one in state.findings
    )
    findings = tuple(replace(one, found=one.found and not _is_nothing(state, one)) for one in findings)
    return _without_what_is_gone(replace(state, findings=findings, repeated=kept))


def _is_asked(state: State, cause: Cause) -> bool:
    """Whether a cause must repeat: it belongs to the device, and equal loops did not show it."""
    return cause.lasting and cause.id not in state.by_contrast


def _without_held(state: State) -> State:
    """Return the state without slow faults of the measurement that weights and other causes absorb."""
    held = [one for one in state.findings if one.found and _is_held(state, one)]
    said = [
        Evidence("held", one.cause.id, figures={"share": min(one.explains_percent, PERCENT)})
        for one in held
        if state.rms_of(one.explains_percent / PERCENT) > LIMITS.told_though_held * state.floor.span
    ]
    findings = tuple(replace(one, found=False) if one in held else one for one in state.findings)
    return _without_what_is_gone(replace(state, findings=findings, evidence=(*state.evidence, *said)))


def _without_what_is_gone(state: State) -> State:
    """Return the state refitted with the causes still found; what the others took away is judged again."""
    found = {one.cause.id for one in state.findings if one.found}
    terms = [term for term in state.current.terms if term.cause.id in found]
    if len(terms) == len(state.current.terms):
        return state
    if not terms:
        return replace(state, current=state.baseline)
    current = refit(state.problem, terms, state.current)
    known = {one.cause.id: one for one in current.terms}
    without = {name: current.without(one) for name, one in known.items()}
    state = replace(state, current=current, without=without)
    findings = [
        _asked_again(state, one, known[one.cause.id]) if one.cause.id in known else one
        for one in state.findings
    ]
    return replace(state, findings=tuple(findings))


def _asked_again(state: State, finding: Finding, term: Term) -> Finding:
    """Return a finding with its share now that others are gone; a step may then be what only settles."""
    gain = state.without[term.cause.id].squares - state.current.squares
    settles = term.cause.sudden and SETTLES not in finding.doubts and wear.is_as_good(state, term)
    doubts = (*finding.doubts, SETTLES) if settles else finding.doubts
    return replace(finding, explains_percent=state.explains(gain), doubts=doubts)


def _is_nothing(state: State, finding: Finding) -> bool:
    """Whether a finding may be nothing, or does not repeat, and would matter little."""
    share = finding.explains_percent / PERCENT
    little = (share < LIMITS.mends, state.rms_of(share) < LIMITS.matters * state.floor.span)
    return (MAY_BE_NOTHING in finding.doubts and any(little)) or (DOUBT in finding.doubts and all(little))


def _is_held(state: State, finding: Finding) -> bool:
    """Whether the rest of the model can absorb a fault that was found."""
    term = next((one for one in state.current.terms if one.cause is finding.cause), None)
    if term is None or not may_be_held(term):
        return False
    return is_held(state, term, state.without[finding.cause.id], finding.held_out_gain_percent)


def may_be_held(term: Term) -> bool:
    """Whether a cause is a slow fault of the measurement."""
    return term.cause.drifts and term.cause.corrects


def is_held(state: State, term: Term, without: Fitted, gain_percent: float) -> bool:
    """Whether the rest of the model can absorb nearly all that such a fault adds.

    False for a fault that predicts nearly all that can be lowered, if no other slow cause is in the model.
    """
    fall = without.squares - state.current.squares
    mends = any(one.cause.family in SLOW for one in state.current.terms if one is not term)
    predicts = gain_percent / PERCENT > LIMITS.predicts_though_held and not mends
    return not predicts and fall < LIMITS.held_by_the_rest * squares_moved(state, term)


def _weakest(state: State, fitted: Fitted) -> set[str]:
    """Id of the cause of a fit that repeats least, if it does not repeat enough; else an empty set."""
    asked = [one for one in fitted.terms if _is_asked(state, one.cause)]
    shares = {one.cause.id: repeated(state.held_out, fitted.without(one), fitted) for one in asked}
    least = min(shares, key=shares.__getitem__, default="")
    return {least} if least and shares[least] < LIMITS.repeated else set()
