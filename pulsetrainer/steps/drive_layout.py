"""What a drive is made of: a major loop, a ramp to the first target, the beats, a ramp back, and rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.pulses import Shape, train
from pulsetrainer.steps.invertible import Invertible

RAMP_S = 0.4  # from rest to the first target, and back after the last


@dataclass(frozen=True, slots=True)
class Layout:
    """What is to be played: the major loop as an input, then ramp, beats, ramp back and rest as an output."""

    lead: FloatArray
    ramp: FloatArray  # 0..1
    beats: FloatArray
    wanted: FloatArray
    rate_Hz: float

    @property
    def body(self) -> slice:
        """The beats within ``wanted``."""
        return slice(self.ramp.size, self.ramp.size + self.beats.size)

    def scored(self, size: int, shape: Shape, periods: int) -> np.ndarray:
        """True (size,) in the beats after the first one, where there is more than one."""
        period = round(shape.period_s * self.rate_Hz)
        at = self.lead.size + self.ramp.size
        scored = np.zeros(size, dtype=bool)
        scored[at + (period if periods > 1 else 0) : at + self.beats.size] = True
        return scored

    def target(self, part: Invertible) -> FloatArray:
        """Target (n,): what the lead and the tail give by themselves, and what is wanted between them."""
        after = np.full(part.tail.size, self.wanted[-1])
        return np.concatenate((part.whole(part.lead), self.wanted, after))

    def scaled(self, current: FloatArray, part: Invertible, forces: tuple[float, float]) -> FloatArray:
        """Drive (n,) that is the target itself, scaled to the extremes of the compensated ``current``."""
        body, low = self.body, part.low
        ends = sorted((float(current[body].min()), float(current[body].max())), reverse=part.polarity < 0)
        beats = ends[0] + (ends[1] - ends[0]) * (self.beats - forces[0]) / (forces[1] - forces[0])
        up = low + (beats[0] - low) * self.ramp
        down = beats[-1] + (low - beats[-1]) * self.ramp
        return np.concatenate((self.lead, up, beats, down, [low], part.tail))


def laid_out(
    shape: Shape, part: Invertible, forces: tuple[float, float], periods: int, rate_Hz: float, own_Hz: float
) -> Layout:
    """Lay out what is to be played: the beats between ``forces``, reached from rest and left to rest."""
    beats = train(shape, periods=periods, rate_Hz=rate_Hz, low=forces[0], high=forces[1])
    rest = float(part.whole(part.lead)[-1])
    ramp = np.linspace(0.0, 1.0, round(RAMP_S * own_Hz), endpoint=False)
    wanted = np.concatenate(
        (rest + (beats[0] - rest) * ramp, beats, beats[0] + (rest - beats[0]) * ramp, [rest])
    )
    return Layout(part.lead, ramp, beats, wanted, rate_Hz)
