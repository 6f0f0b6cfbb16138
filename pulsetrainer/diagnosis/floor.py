"""How small an error can be, and how large an effect must be to matter.

What no cause can lower is the noise of the averages and the discretisation error; an effect smaller than the
latter, than 0.3 of the former or than 0.03 % of the span is irrelevant, however significant it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.fitting import Fitted, weights_for
from pulsetrainer.diagnosis.problem import Problem
from pulsetrainer.diagnosis.raw import Firing, coarse_step, noise_of
from pulsetrainer.diagnosis.thresholds import LIMITS, TINY, UNIFORM


@dataclass(frozen=True)
class Floor:
    """The errors that stay when nothing is wrong, rms of an average."""

    count: int  # averages
    span: float
    noise: float  # rms of single samples
    white: float
    discretisation: float = 0.0

    @property
    def squares(self) -> float:
        """Sum of squares that no cause can lower."""
        return float(self.count * (self.white**2 + self.discretisation**2))

    @property
    def rms(self) -> float:
        """Rms of what is left in an average when nothing is wrong."""
        return float(np.hypot(self.white, self.discretisation))

    @property
    def relevant(self) -> float:
        """Fall of the sum of squares below which an effect is irrelevant."""
        size = max(LIMITS.relevant_noise * self.white, self.discretisation, LIMITS.relevant_span * self.span)
        return float(self.count * size**2)

    def reducible(self, baseline: Fitted) -> float:
        """What causes could lower the baseline's sum of squares by."""
        return max(baseline.squares - self.squares, LIMITS.least_reducible * baseline.squares, TINY)

    def at(self, coarse: Problem, fitted: Fitted) -> Floor:
        """Return the floor with the discretisation error of a fit, by refitting it on a coarser plane.

        The error of a piecewise constant density falls with the cell at least in proportion, so
        d^2 <= (fall of the mean square) / ((fine / coarse)^2 - 1). A cause that is still missing makes the
        estimate too large, never too small, so it is made again whenever one has been added.
        """
        refitted = weights_for(coarse, fitted.terms, None)
        fall = max(refitted.squares - fitted.squares, 0.0) / self.count
        return replace(
            self, discretisation=float(np.sqrt(fall / ((LIMITS.levels / LIMITS.coarse_levels) ** 2 - 1.0)))
        )


def floor_of(
    measured: Sequence[Record], firings: Sequence[Firing], problem: Problem, span: float = 1.0
) -> Floor:
    """Return the floor of a problem from its raw noise and steps, discretisation left out.

    Parameters
    ----------
    measured
        The records as they were measured: time steps made even would hide the steps of the output.
    span
        What one is in the problem, output unit.
    """
    records = problem.records
    noise = float(np.sqrt(np.mean([noise_of(r.output, r.sample_weight) ** 2 for r in records])))
    step = max(coarse_step(r.output) for r in measured) / span
    jump = max((f.value for f in firings if f.cause == "stick-slip"), default=0.0) / span
    held = (step**2 + jump**2) / UNIFORM  # does not average out
    white = float(np.sqrt(noise**2 * np.mean(1.0 / problem.bins.sizes) + held))
    return Floor(problem.bins.count, float(np.ptp(problem.measured)), noise, white)
