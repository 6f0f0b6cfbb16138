"""Lines of the spectrum: hums, which no error of a model looks like.

Blocks that were left out say little of a hum where a model misses much else: the error there is mostly the
model's. So a line is judged by its spectrum, if it is not in step with the input.
"""

from __future__ import annotations

from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.screening import at_full_rate
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


def is_a_line(state: State, term: Term, fitted: Fitted, without: Fitted) -> bool:
    """Whether a cause of a model is a line that no error of a model looks like.

    It is most of what the model ``without`` it leaves, or stands far above the lines near it.
    """
    frames = state.problem.frames
    if not term.cause.line or term.cause.in_step(term.values, frames):
        return False
    most = without.squares - fitted.squares > LIMITS.half * without.squares
    return most or term.cause.stands_out(term.values, frames, at_full_rate(without))
