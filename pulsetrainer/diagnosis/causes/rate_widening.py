"""the loop widens with the root of the rate (excess loss): P[v], u - v = k sgn(v') sqrt(abs v')."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan, tan, tanh

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Values
from pulsetrainer.diagnosis.causes.frame import Frame

_TRIED = (0.005, 0.015)  # of the root of the range: coefficients tried
_NONE = 3e-8  # of the root of range and time step: a smaller coefficient widens nothing


class RateWidening(Cause):
    """Excess loss: the field trails by the root of its rate."""

    id = "rate-widening"
    title = "the loop widens with the root of the rate (excess loss)"
    formula = "P[v], u - v = k sgn(v') sqrt(abs v')"
    signature = "the loop widens with the root of the rate, not in proportion to it"
    excitation = "reversals at four rates or more"
    source = "Bertotti, Hysteresis in Magnetism, 1998, chapter 12: excess loss"
    stage = "input"
    order = 30
    family = "lag"
    scales = True
    widens = True
    parameters = (
        Quantity("coefficient", "({u} s)^0.5", 0.0, 0.16, 4e-4, "lag of the {input}, per root of its speed"),
    )

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        return [[(one * frames[0].reach ** 0.5,)] for one in _TRIED]

    def on_input(self, u: FloatArray, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        k = values[0]
        if k <= _NONE * (frame.reach * frame.dt_s) ** 0.5:
            return u
        begun, inner = frame.remembered(self.id, np.repeat(u[:1], 2)).tolist()
        if not frame.is_first:
            u = np.append(begun, u)
        path = u.copy()
        path[0] = inner
        path[1:] -= _excess(u, u[0] - inner, k, frame.dt_s)
        frame.remember(self.id, np.asarray([u[-1], path[-1]]))
        return path[-frame.input.size :]


def _excess(u: FloatArray, e: float, k: float, dt_s: float) -> FloatArray:
    """Excess e = u - v (n - 1,) at the samples of ``u`` (n,) after the first, where it is ``e``.

    Exact for an input that is straight between samples: e' = u' - sgn(e) (e/k)^2 is a Riccati equation. With
    E = k sqrt|u'| and a = sqrt|u'| dt/k its solution is E (e + E tanh a)/(E + e tanh a) where e has the sign
    of u', and E tan(atan(e/E) + a) where it has the other one, until it is zero.
    """
    rate = np.diff(u) / dt_s
    root = np.sqrt(np.abs(rate))
    turn = root * dt_s / k
    found = []
    for end, angle, th, up in zip(
        (k * root).tolist(), turn.tolist(), np.tanh(turn).tolist(), (rate > 0).tolist(), strict=True
    ):
        own = e if up else -e  # along the input's motion
        if end == 0.0:
            own = own / (1.0 + abs(own) * dt_s / k**2)
        elif own >= 0.0:
            own = end * (own + end * th) / (end + own * th)
        else:
            rest = atan(own / end) + angle
            own = end * (tan(rest) if rest < 0.0 else tanh(rest))
        e = own if up else -own
        found.append(e)
    return np.asarray(found)
