"""The inverse piece by piece: for a target that has no end, and whose future is not known.

Each piece begins with the memory that the piece before it left: that of the relays, of the causes and of the
correction. For a static model this is the whole inverse, cut into pieces. The inverse of an extended model
iterates as in ``extended``,

    r <- r + 0.8 F[y_ref - M(u)],   u <- P^-1(r),

over a piece and what comes after it, as far as that is known: F is not causal, and a lag must be countered
before it shows. The next iteration begins with what was found for the piece ahead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pulsetrainer.core import inversion, learning
from pulsetrainer.core.memory import State, negative_saturation
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.frame import Past
from pulsetrainer.diagnosis.extended import Extended, chain
from pulsetrainer.diagnosis.thresholds import LIMITS

_CARRIED = 4.0  # of the filter's pad: errors of the piece before that the filter sees
_ENOUGH = 2e-4  # of the output's span: a tenth of what the best sensors resolve
_GAIN = 0.98  # of the error: a step that leaves more ends the iteration, the next beat is due soon


@dataclass(frozen=True, slots=True)
class Piece:
    """The input of a piece and what the model says it gives."""

    input: FloatArray  # (n,)
    predicted: FloatArray  # (n,) output unit
    clipped: int  # samples whose target was out of reach


class Piecewise:
    """Inverts a model, with or without terms, piece by piece, from the negative saturation and rest.

    ``slew_per_s`` is the fastest that the input may move, input unit a second: a piece needs that much
    look-ahead, at least, as the whole range takes at that speed. ``band_Hz`` is the band of the correction.
    """

    def __init__(
        self, extended: Extended, dt_s: float, *, slew_per_s: float, band_Hz: float | None = None
    ) -> None:
        static = extended.static
        assert isinstance(static, Preisach)  # a session plays direct models only
        self._static = static
        self._upright = Extended(static, extended.terms)
        self._polarity = extended.polarity
        self._dt_s = dt_s
        self._slew_per_s = slew_per_s
        plane = static.plane
        self.reach = int(np.ceil((plane.high - plane.low) / (slew_per_s * dt_s))) + 1
        self._smooth = learning.LowPass(band_Hz, dt_s)
        self._kept = round(_CARRIED * learning.PAD / (band_Hz * dt_s)) if band_Hz else 0
        self._relays: State = negative_saturation(plane.low)  # of the model
        self._turns: State = self._relays  # of the inverse
        self._past = Past()
        self._wished = np.full(self.reach, plane.low)  # inputs before the slew limit
        self._last = plane.low  # input that was given last
        self._errors = np.zeros(self._kept)
        self._lift = np.zeros(0)  # correction of the target, as far ahead as it is known

    def play(self, inputs: FloatArray) -> FloatArray:
        """Take in that the input (n,) is played as it is, and return the output (n,) that the model says."""
        self._turns = self._static.run(inputs, self._turns)[1]
        self._wished = np.concatenate((self._wished, inputs))[-self.reach :]
        return self._give(inputs, np.zeros(self._kept))

    def next(self, target: FloatArray, ahead: FloatArray) -> Piece:
        """Return the input whose output is ``target`` (n,), if ``ahead`` (m,) shall follow it.

        ArgumentError where a target is not finite, or the static part cannot be inverted.
        """
        n, wanted = target.size, self._polarity * np.concatenate((target, ahead))
        lift = np.zeros(wanted.size)
        known = min(lift.size, self._lift.size)
        lift[:known] = self._lift[:known]
        best = None
        for _ in range(LIMITS.inverse_rounds + 1 if self._upright.terms else 1):
            exact = inversion.invert(self._static, wanted + lift, self._turns)
            inputs = self._limited(exact.input)
            error = wanted - self._predicted(inputs, self._past)[0]
            rms = root_mean_square(error[:n])
            if best is not None and rms > _GAIN * best[0]:
                break
            best = rms, lift, inputs, exact.input, error
            if rms < _ENOUGH * 2.0 * self._static.total:
                break
            lift = lift + learning.STEP * self._correction(error)
        assert best is not None
        _, lift, inputs, wished, error = best
        final = inversion.invert(self._static, (wanted + lift)[:n], self._turns)
        self._turns, self._lift = final.final, lift[n:]
        self._wished = np.concatenate((self._wished, wished[:n]))[-self.reach :]
        return Piece(inputs[:n], self._give(inputs[:n], error[:n]), final.clipped)

    def _give(self, inputs: FloatArray, error: FloatArray) -> FloatArray:
        """Let the model go on by an input (n,) that is given, and return its output (n,)."""
        past = Past(self._past.before)
        predicted, self._relays = self._predicted(inputs, past)
        self._past, self._last = past.next(), float(inputs[-1])
        if self._kept:
            self._errors = np.concatenate((self._errors, error))[-self._kept :]
        return self._polarity * predicted

    def _predicted(self, inputs: FloatArray, past: Past) -> tuple[FloatArray, State]:
        """Output (n,) of the model from where it is, and its relays afterwards."""
        frame = self._upright.frame(inputs, self._dt_s, past)
        relays = self._relays

        def static(seen: FloatArray) -> FloatArray:
            nonlocal relays
            output, relays = self._static.run(seen, self._relays)
            return output

        return chain(self._upright.terms, static, frame), relays

    def _correction(self, error: FloatArray) -> FloatArray:
        """The error (n,), low-passed; the filter sees the errors of the piece before."""
        return self._smooth(np.concatenate((self._errors, error)))[self._errors.size :]

    def _limited(self, wished: FloatArray) -> FloatArray:
        """The input (n,) within the slew limit, also from the piece before on."""
        whole = np.concatenate((self._wished, wished))
        limited = inversion.slew_limited(whole, 1.0 / self._dt_s, self._slew_per_s)[self._wished.size :]
        step = self._slew_per_s * self._dt_s
        # what was wished for this piece when the one before was given may have been something else
        free = step * np.arange(1, limited.size + 1)
        return np.clip(limited, self._last - free, self._last + free)
