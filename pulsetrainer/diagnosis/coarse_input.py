"""An input that is read in coarse steps though it moved evenly, as by a coarse ammeter.

Where the reading steps, the input passed the middle of the step. From one middle to the next the input is
taken to be straight; where a reading stays longer than its neighbours, the input rested there. An output
that moves as much between the steps as at them shows such an even input. One that moves only with the steps
shows that the device saw the steps.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pulsetrainer.core.plane import FloatArray, IntArray
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.raw import spacing_of
from pulsetrainer.diagnosis.thresholds import LIMITS, UNIFORM


def as_it_moved(record: Record) -> Record:
    """Return a record with its input between the steps of its reading, where the output tells that it was."""
    at = _steps_of(record)
    return record if at is None else replace(record, input=_between(record.input, at))


def hidden_square(record: Record) -> float:
    """Mean square of what is not known of the output, as its input was read in coarse steps; else 0.

        sum of (s q dy/du)^2 / 12 over the samples between two steps the same way

    with q the step, and s the share of it that is not known where turns and rests are.
    """
    at = _steps_of(record)
    if at is None:
        return 0.0
    u, y, begin, end = record.input, record.output, at[:-1], at[1:]
    same = (u[end] > u[begin]) == (u[begin] > u[begin - 1])
    rise = (y[end] - y[begin]) / (u[end] - u[begin]) * spacing_of(u) * LIMITS.not_between
    return float(np.sum((rise**2 * (end - begin))[same])) / UNIFORM / u.size


def _steps_of(record: Record) -> IntArray | None:
    """Return where an input that is read in coarse steps has them; None where it moved as it is read."""
    if spacing_of(record.input) < LIMITS.coarse_reading * float(np.ptp(record.input)):
        return None
    at = np.flatnonzero(np.diff(record.input)) + 1
    return at if _moves_between(record.input, record.output, at) else None


def _moves_between(u: FloatArray, y: FloatArray, at: IntArray) -> bool:
    """Whether an output (n,) moves evenly between two steps ``at`` of an input (n,) that go the same way."""
    begin, end = at[:-1], at[1:]
    way = np.sign(u[end] - u[begin])
    held = (end - begin > 1) & (way == np.sign(u[begin] - u[begin - 1]))
    if np.count_nonzero(held) < LIMITS.least_held:
        return False
    begin, end, way = begin[held], end[held], way[held]
    moved = float(np.sum(way * (y[end - 1] - y[begin])))
    whole = float(np.sum(way * (y[end - 1] - y[begin - 1])))
    even = float(np.sum(end - begin - 1)) / float(np.sum(end - begin))
    return moved > LIMITS.read_evenly * even * whole > 0.0


def _between(u: FloatArray, at: IntArray) -> FloatArray:
    """Input (n,) through the middles of its steps ``at``, and at rest at what is read for longer."""
    length = np.diff(at).astype(np.float64)
    length = np.concatenate((length[:1], length, length[-1:]))  # of the readings before and after each step
    stay = length[1:-1]
    since, until = (np.minimum(0.5 * one, stay) for one in (length[:-2], length[2:]))
    both = np.minimum(stay / np.maximum(since + until, 1.0), 1.0)
    begin, end = at[:-1] - 0.5, at[1:] - 0.5
    time = np.concatenate(([0.0], at - 0.5, begin + both * since, end - both * until, [u.size - 1.0]))
    value = np.concatenate((u[:1], 0.5 * (u[at] + u[at - 1]), u[at[:-1]], u[at[:-1]], u[-1:]))
    order = np.argsort(time, kind="stable")
    return np.interp(np.arange(u.size), time[order], value[order])
