"""How small an error can be, and how large an effect must be to be relevant: see ``stages.baseline``.

The discretisation error is that of the plane's levels, and of an input that is read in coarse steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis import residual
from pulsetrainer.diagnosis.coarse_input import hidden_square
from pulsetrainer.diagnosis.fitting import Fitted, weights_for
from pulsetrainer.diagnosis.noise import quiet_square
from pulsetrainer.diagnosis.problem import Problem
from pulsetrainer.diagnosis.raw import Firing, coarse_step, noise_beside_hum
from pulsetrainer.diagnosis.thresholds import LIMITS, TINY, UNIFORM


@dataclass(frozen=True)
class Floor:
    """The errors that stay when nothing is wrong, rms of an average."""

    count: int  # averages
    span: float
    noise: float  # rms of single samples
    white: float
    discretisation: float = 0.0
    held: float = 0.0  # mean square of what does not average out: steps and jumps of the output
    single: float = 0.0  # rms of single samples, by their differences
    doubtful: float = 0.0  # mean square of what may be slow noise, or slow errors of the model
    sampled: float = 0.0  # mean square of what that leaves in an average
    hidden: float = 0.0  # mean square of what coarse steps of the input hide, part of the discretisation

    @property
    def squares(self) -> float:
        """Sum of squares that no cause can lower."""
        return float(self.count * (self.white**2 + self.discretisation**2))

    @property
    def rms(self) -> float:
        """Rms of what is left in an average when nothing is wrong."""
        return float(np.hypot(self.white, self.discretisation))

    @property
    def quick(self) -> Floor:
        """The floor with no other noise than that from sample to sample and of steps."""
        white = float(np.sqrt(self.sampled + self.held))
        return replace(self, white=white, noise=self.single, doubtful=0.0)

    @property
    def fine(self) -> Floor:
        """The quick floor of levels as fine as can be."""
        return replace(self.quick, discretisation=float(np.sqrt(self.hidden)))

    @property
    def slow(self) -> float:
        """Noise of an average, as a multiple of that from sample to sample and of steps; NaN for none."""
        quick = self.quick.white
        return self.white / quick if quick > 0 else float("nan")

    @property
    def relevant(self) -> float:
        """Fall of the sum of squares below which an effect is irrelevant."""
        sure = float(np.sqrt(max(self.white**2 - self.doubtful, 0.0)))
        size = max(LIMITS.relevant_noise * sure, self.discretisation, LIMITS.relevant_span * self.span)
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
        square = fall / ((LIMITS.levels / LIMITS.coarse_levels) ** 2 - 1.0)
        return replace(self, discretisation=float(np.sqrt(square + self.hidden)))

    def heard(self, fitted: Fitted) -> Floor:
        """Return the floor with the noise that is heard in what a fit leaves, coloured as it is."""
        problem = fitted.problem
        quiet = quiet_square(fitted.residual, problem.bins, problem.measured, np.abs(residual.rates(problem)))
        whole = float(np.mean(fitted.residual**2))  # elsewhere it may be less than where it is heard
        sampled = min(self.sampled, whole)  # a bend between few samples looks like noise, until it is fitted
        square = max(min(quiet.square, whole), sampled)
        single = self.single * float(np.sqrt(sampled / self.sampled)) if self.sampled > 0.0 else self.single
        return replace(
            self,
            white=float(np.sqrt(square + self.held)),
            noise=max(single, float(np.sqrt(square))),
            doubtful=min(quiet.doubtful, square - sampled),
            single=single,
            sampled=sampled,
        )


def floor_of(
    measured: Sequence[Record], firings: Sequence[Firing], problem: Problem, span: float = 1.0
) -> Floor:
    """Return the floor of a problem from its raw noise and steps, discretisation left out.

    The records are as they were ``measured``: time steps made even would hide the steps of the output.
    ``span`` is what one is in the problem, output unit.
    """
    records = problem.records
    noise = float(np.sqrt(np.mean([noise_beside_hum(r.output, r.sample_weight) ** 2 for r in records])))
    step = max(coarse_step(r.output) for r in measured) / span
    jump = max((f.value for f in firings if f.cause == "stick-slip"), default=0.0) / span
    held = (step**2 + jump**2) / UNIFORM  # does not average out
    sampled = noise**2 * float(np.mean(1.0 / problem.bins.sizes))
    white = float(np.sqrt(sampled + held))
    hidden = float(np.mean([hidden_square(r) for r in measured])) / span**2
    span = float(np.ptp(problem.measured))
    return Floor(
        problem.bins.count, span, noise, white, held=held, single=noise, sampled=sampled, hidden=hidden
    )
