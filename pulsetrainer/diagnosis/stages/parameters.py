"""Intervals: how sure the parameters are.

The spread of each parameter is the larger of two: of joint refits, linearised, on redrawn noise, and of
leaving out each tenth of the record in turn. Added to it are the error of the levels, as if a fifth of it
were aligned with the parameter; a fifth of a sample step, since input and output are not read at the same
moment; and the estimates by other formulas that are as plausible as the library's. What equal loops show has
the interval of those loops.
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis.intervals import estimates_of
from pulsetrainer.diagnosis.state import State


def stage(state: State) -> State:
    """Return the state with 95 % intervals of all parameters."""
    known = estimates_of(state.current, state.scores, state.held_out, state.floor)
    return replace(
        state,
        estimates={
            name: tuple(state.scale.estimate(one) for one in rows)
            for name, rows in {**known, **state.by_contrast}.items()
        },
    )
