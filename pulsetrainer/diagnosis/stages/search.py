"""Search: one cause after another.

Screening, joint fit and acceptance are repeated. Each round begins with the model that holds all causes
accepted so far, and draws its noise anew from what that model leaves. The search ends when no candidate is
accepted, or when there are five causes.
"""

from __future__ import annotations

from pulsetrainer.diagnosis.stages import acceptance, joint_fit, screened
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS

ROUND = (screened, joint_fit, acceptance)


def stage(state: State) -> State:
    """Return the state with all causes that were accepted, and the scores of those that were not."""
    while True:
        state = screened.stage(state)
        number = len(state.current.terms)
        if number >= LIMITS.most_causes:
            return state
        found = acceptance.stage(joint_fit.stage(state))
        if found.current is state.current:
            return state
        state = found
        # most records need one to three rounds
        state.question.progress(
            LIMITS.search_begins + LIMITS.search_share * (1.0 - LIMITS.search_round ** (number + 1))
        )
