"""Whether the device is in another condition than the one in which the model as given was identified.

The search for causes refits the weights, so it finds nothing wrong with a record that a Preisach model of
its own describes well. Where the model as given is far off and the refitted one is not, that is the
finding: load, configuration or zero have changed. How, is told by the gain and the offset that carry the
given prediction over:

    y = (1 + g) M(u) + b
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray

FAR = 0.01  # of the output's span: a model nearer than this is not in question
REFITTED = 0.2  # the refitted weights must leave less than this share of what the given ones leave
ALL_BUT = 0.001  # of the squared error: beside such a change nothing that is left over matters


class Change(NamedTuple):
    """Gain and offset of the records against the model, with their standard errors over blocks."""

    gain: float
    gain_error: float
    offset: float  # output unit
    offset_error: float
    explains: float  # share of the given model's squared error that refitted weights take away
    left: float  # rms of what gain and offset alone leave, output unit
    shift: float  # mean of measured less predicted, output unit; the offset is that where the model is 0
    span: float  # of the records, output unit

    @property
    def is_everything(self) -> bool:
        """Whether it leaves so little that nothing else can be named before the device is identified anew."""
        return self.explains > 1.0 - ALL_BUT

    @property
    def gain_matters(self) -> bool:
        """Whether another gain alone, about the middle of the output, would put the model in question."""
        return abs(self.gain) > 2.0 * FAR

    @property
    def shape_matters(self) -> bool:
        """Whether what gain and offset leave would put the model in question."""
        return self.left > FAR * self.span


def left_by(measured: FloatArray, predicted: FloatArray, noise_rms: float) -> float:
    """Rms error of a prediction (n,) without the white noise of single samples, output unit."""
    return float(np.sqrt(max(float(np.mean((measured - predicted) ** 2)) - noise_rms**2, 0.0)))


def change(
    measured: FloatArray, predicted: FloatArray, refitted_rms: float, noise_rms: float, blocks: int = 10
) -> Change | None:
    """Return how the condition changed, or None where it did not.

    Parameters
    ----------
    measured, predicted
        Output (n,) and what the model as given says.
    refitted_rms
        What the model leaves when its weights are fitted to these very records, output unit.
    noise_rms
        White noise of single samples, output unit: nobody's fault.
    """
    given = left_by(measured, predicted, noise_rms)
    if given < FAR * np.ptp(measured) or refitted_rms > REFITTED * given:
        return None
    whole = _fit(measured, predicted)
    # jackknife over blocks: neighbouring samples are not independent
    parts = np.array_split(np.arange(measured.size), blocks)
    without = np.stack([_fit(np.delete(measured, p), np.delete(predicted, p)) for p in parts])
    spread = np.sqrt(blocks - 1) * without.std(axis=0)
    left = measured - whole[0] * predicted - whole[1]
    return Change(
        float(whole[0] - 1.0),
        float(spread[0]),
        float(whole[1]),
        float(spread[1]),
        1.0 - (refitted_rms / given) ** 2,
        root_mean_square(left),
        float(np.mean(measured - predicted)),
        float(np.ptp(measured)),
    )


def _fit(measured: FloatArray, predicted: FloatArray) -> FloatArray:
    columns = np.stack((predicted, np.ones(predicted.size)), axis=1)
    return np.asarray(np.linalg.lstsq(columns, measured, rcond=None)[0], dtype=np.float64)
