"""Baseline: a static model refitted to these records, and the floor under every model.

The weights of a static Preisach model are fitted to the records, whatever the model as given predicts. The
error that this refit leaves is the *baseline*. Causes can lower it, but no further than a *floor*: the noise
of the averages, the steps of the output, and the error of the levels. (An *average* is the mean of the
samples of a few milliseconds; the fits see averages only.) The error of the levels is that of cells with a
finite width, and is estimated from how much more a coarser plane leaves. What lies between baseline and floor
is *what can be lowered*.

An effect that is smaller than the error of the levels, than 0.3 of the noise or than 0.03 % of the span is
*irrelevant*, however significant it is. What the records lack (several rates, holds, length) is noted here,
since it limits which causes can be told apart later.
"""

from __future__ import annotations

import numpy as np

from pulsetrainer.diagnosis.fitting import weights_for
from pulsetrainer.diagnosis.floor import floor_of
from pulsetrainer.diagnosis.forms import base_of
from pulsetrainer.diagnosis.held_out import HeldOut
from pulsetrainer.diagnosis.pinched import crosses, pinched_at
from pulsetrainer.diagnosis.problem import problem_for
from pulsetrainer.diagnosis.residual import TIME, excitation_limits
from pulsetrainer.diagnosis.stages.raw_data import Masked
from pulsetrainer.diagnosis.state import State


def stage(masked: Masked) -> State:
    """Return the state in which the search begins: no cause in the model.

    DataError where the data do not suffice for any statement.
    """
    records, firings = masked.records, masked.firings
    given = masked.question.given
    signed = given is not None and given.model.form != "direct"
    base = None if given is None else base_of(given.model, masked.scale)
    problem = problem_for(records, 0.0, 1.0, signed=signed, base=base)
    coarse = problem.coarser()
    fitted = weights_for(problem, (), None)
    fired = [firing for _, firing in firings]
    floor = floor_of(masked.question.records, fired, problem, masked.scale.span)
    floor = floor.heard(fitted).at(coarse, fitted)
    lacks = tuple(excitation_limits(problem)) if masked.question.timed else (TIME,)
    held_out = HeldOut(problem)
    # as they were measured: what has no weight, such as all before the memory is known, is filled in by now
    whole = masked.question.records
    u, y = (np.concatenate(one) for one in ([r.input for r in whole], [r.output for r in whole]))
    level = (u - masked.scale.low) / masked.scale.reach
    known = (masked.question, firings, masked.scale, problem, coarse, fitted, floor, held_out, lacks, fitted)
    at = pinched_at(level, y, floor.single * masked.scale.span)
    return State(*known, pinched_at=at, butterfly=crosses(level, y, at))
