"""Misfit: that a model does not describe a run at all, and the likely reason."""

from __future__ import annotations

import numpy as np

from pulsetrainer.artefacts import ModelEvaluation, Run
from pulsetrainer.artefacts.units import quantity_in_words, with_unit

_AT_ALL = 50.0  # % of the span, rms: a constant in the middle of the run is at most so far from it
_MOST = 50.0  # % of the samples outside the range of the model
_ALIKE = 1.0 / 3.0  # of the standard deviation: who leaves no more with a factor and an offset has the shape
_SAME = 2.0  # a factor nearer to one is none to speak of


def misfit_words(one: ModelEvaluation, name: str, run: Run) -> str:
    """Say that a model does not describe a run at all, and why that may be; empty where it does.

    ``name`` is that of the run; ``one`` has the errors of the model.
    """
    if one.rms_percent <= _AT_ALL and one.outside_percent <= _MOST:
        return ""
    error = f"its rms error is {one.rms_percent:.3g} % of the span of the output"
    return f"{one.name} does not describe {name} at all: {error}. {_reason(one, name, run)}"


def _reason(one: ModelEvaluation, name: str, run: Run) -> str:
    if one.outside_percent > _MOST:
        ends = f"{np.nanmin(run.input):.4g} .. {np.nanmax(run.input):.4g}"
        there = f"{quantity_in_words(run.input_quantity)} ({with_unit(ends, run.input_unit)})"
        return f"Most of its {there} is outside the range of the model: check its unit, and the device"
    output = quantity_in_words(run.output_quantity)
    measured, predicted = one.output - np.mean(one.output), one.predicted - np.mean(one.predicted)
    square = float(predicted @ predicted)
    factor = float(predicted @ measured) / square if square > 0 else 0.0
    if np.std(measured - factor * predicted) > _ALIKE * np.std(measured):
        return f"Most likely it is of another device than {name}, or of the same one set up otherwise"
    if factor < 0:
        return f"The {output} goes the other way: check its sign, and whether the columns are the right ones"
    if 1.0 / _SAME < factor < _SAME:
        by = with_unit(f"{one.offset:+.3g}", run.output_unit)
        return f"It is nearly all an offset of {by}: the zero of the {output} was different"
    far = f"The {output} varies {factor:.3g} times as much as by the model"
    return f"{far}: check its unit, and the gain of its sensor"
