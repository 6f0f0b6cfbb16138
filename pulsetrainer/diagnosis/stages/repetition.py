"""Repetition: no cause goes into the model that does not predict time which was left out.

What wanders slowly looks like heat, creep or a step, and blocks that alternate only interpolate it. So for
each cause that belongs to the device whole pieces, a fifth of the time each, are predicted from the others:
with the cause the errors must fall by at least half of what they fall by in the fit, and on no piece may they
rise. A cause that does not do that fits, but does not repeat: it is told with these words, and is not added
to the model; nor is one that predicts blocks worse (`rivals`). What equal loops show was tested by itself.
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis.repeats import repeats
from pulsetrainer.diagnosis.stages.rivals import WORSE
from pulsetrainer.diagnosis.state import State

DOUBT = "does not repeat"


def stage(state: State) -> State:
    """Return the state with the causes that do not repeat."""
    worse = {one.cause.id for one in state.findings if WORSE in one.doubts}
    once = frozenset(
        term.cause.id
        for term in state.current.terms
        if term.cause.lasting
        and not term.cause.by_contrast
        and (
            term.cause.id in worse or not repeats(state.held_out, state.without[term.cause.id], state.current)
        )
    )
    findings = tuple(
        replace(one, doubts=(*one.doubts, DOUBT)) if one.cause.id in once else one for one in state.findings
    )
    return replace(state, findings=findings, once=once)
