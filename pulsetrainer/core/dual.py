"""The dual operator: input and output with their roles exchanged, u = P[y].

A Preisach operator with mu >= 0 lags behind its input. An output that leads, such as the force of a rubber
over its stretch, is one whose *input* lags behind it: its inverse is a Preisach operator, and its prediction
is the exact inverse that ``inversion`` has, its inversion the plain operator (Krejci, Hysteresis, Convexity
and Dissipation in Hyperbolic Equations, 1996, section II.3; Visintin, Differential Models of Hysteresis,
1994, chapter IV).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pulsetrainer.core.input_noise import estimate, monotone_between
from pulsetrainer.core.inversion import Inverse, invert
from pulsetrainer.core.memory import State, positive_saturation, turning_points
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray, finite_vector


@dataclass(frozen=True)
class Dual:
    """An operator y = P^-1[u]; ``inner`` is P, from the output to the input."""

    inner: Preisach

    @property
    def polarity(self) -> int:
        """1 where the output rises with the input, -1 where it falls."""
        return self.inner.polarity

    @property
    def low(self) -> float:
        """Lower end of the input range."""
        return min(self.inner.saturation)

    @property
    def high(self) -> float:
        """Upper end of the input range."""
        return max(self.inner.saturation)

    @property
    def saturation(self) -> tuple[float, float]:
        """Outputs at the lower and at the upper end of the input."""
        ends = self.inner.plane.low, self.inner.plane.high
        return ends if self.polarity > 0 else (ends[1], ends[0])

    @property
    def rest(self) -> State | None:
        """Memory of ``inner`` when the input is at its lower end."""
        plane = self.inner.plane
        return None if self.polarity > 0 else positive_saturation(plane.low, plane.high)

    def __call__(self, values: ArrayLike, start: State | None = None) -> FloatArray:
        """Output (n,) for an input (n,) from its lower end, or from ``start``, remembered inputs.

        ArgumentError where the input is empty, not one-dimensional or not finite.
        """
        u = finite_vector("input", values)
        past = np.zeros(0) if start is None else np.asarray(start.extremes)
        return invert(self.inner, np.concatenate((past, u)), self.rest).input[past.size :]

    def inverse(self, target: ArrayLike, lead: FloatArray | None = None) -> Inverse:
        """Input (n,) whose output is ``target`` (n,), after the input ``lead`` has been played.

        Targets beyond the output's range are clipped to it and counted.

        ArgumentError where the target is empty, not one-dimensional or not finite.
        """
        wanted = finite_vector("target", target)
        plane = self.inner.plane
        state = self.rest
        if lead is not None and lead.size:
            state = invert(self.inner, lead, state).final
        beyond = np.maximum(plane.low - wanted, wanted - plane.high)
        u, final = self.inner.run(wanted, state)
        slack = 1e-9 * (plane.high - plane.low)
        return Inverse(u, int(np.sum(beyond > slack)), final)


def exchanged(signals: Sequence[tuple[FloatArray, FloatArray]]) -> list[tuple[FloatArray, FloatArray]]:
    """Return records, pairs of input and output (n,), with the roles exchanged.

    What was an output is noisy, and an operator remembers every wiggle of its input. It turns where the input
    turns: between two turns its path is made monotone.
    """
    return [(monotone_between(y, turning_points(u)[:-1], estimate(y)), u) for u, y in signals]
