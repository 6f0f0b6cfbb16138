"""Intervals: how sure the parameters are.

The spread of each parameter is the larger of two: that of joint refits, linearised, on redrawn noise, and
that of leaving out each tenth of the record in turn. Three errors are added to it:

- the error of the levels, as if a fifth of it were aligned with the parameter;
- the effect of a fifth of a sample step, since input and output are not read at the same moment;
- how far other formulas, as plausible as those of the library, move the estimate.

A cause that equal loops show has the interval of those loops.
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis.intervals import estimates_of
from pulsetrainer.diagnosis.state import State


def stage(state: State) -> State:
    """Return the state with 95 % intervals of all parameters."""
    known = estimates_of(state.current, state.scores, state.held_out, state.floor)
    return replace(state, estimates=state.in_its_units(known))
