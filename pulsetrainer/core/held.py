"""Readings that a logger repeats: a column that is read more seldom than the rows of its table are written.

Such a column changes every so many rows only, while the other one moves on. Steps of a converter, and an
input that was driven in steps, look alike at first. But a converter's step is the smallest there is, and a
device that was driven in steps answers to each of them: its output does not move evenly from one to the next.
"""

from __future__ import annotations

import numpy as np

from pulsetrainer.core.plane import BoolArray, FloatArray, IntArray

_MOST_NEW = 0.6  # of the rows: a column that changes more often is not repeated
_LEAST = 50  # readings: fewer may be anything
_REGULAR = 0.98  # of the readings stand for as many rows as the others, or for several times as many
_ONE = 1.5  # times the usual number of rows: what stands for longer is more than one reading
_COARSE = 2.0  # steps of the converter: smaller changes are its own steps
_EVEN = 0.4  # of what an even motion does in each row of a reading: a device that saw steps is farther off


def input_readings(u: FloatArray, y: FloatArray) -> BoolArray | None:
    """Return the rows (n,) in which an input is new, if it is repeated between them; else None.

    The output moves evenly meanwhile: it saw no steps.
    """
    new = _readings(u)
    if new is None:
        return None
    moves = _moves(y, new)
    even = moves.size > 1 and np.all(np.abs(moves - moves.mean()) <= _EVEN * moves.mean())
    return new if even else None


def output_readings(u: FloatArray, y: FloatArray) -> BoolArray | None:
    """Return the rows (n,) in which an output is new, if it is repeated while the input moves; else None."""
    new = _readings(y)
    if new is None:
        return None
    moves = _moves(u, new)
    late = moves[moves.size // 2 :].sum()
    return new if late > (0.5 - 0.5 * _EVEN) * moves.sum() else None


def _readings(values: FloatArray) -> BoolArray | None:
    """Return the rows (n,) with a new reading, where each stands for the same number of rows, or nearly."""
    new = np.append(True, values[1:] != values[:-1])
    if new.size < 2 * _LEAST or np.mean(new) > _MOST_NEW:
        return None
    at = np.flatnonzero(new)
    rows = np.diff(at)
    if at.size < _LEAST:
        return None
    usual = float(np.mean(rows[rows <= _ONE * np.median(rows)]))
    readings = np.rint(rows / usual)
    regular = (readings > 0) & (np.abs(rows - usual * readings) < 1.0)
    changes = np.abs(np.diff(values[at]))
    distinct = np.diff(np.unique(values[at]))
    coarse = float(np.median(changes)) <= _COARSE * float(distinct.min())
    if usual < 2.0 or np.mean(regular) < _REGULAR or coarse:
        return None
    new[_also_read(np.append(at, values.size), usual)] = True
    return new


def _also_read(at: IntArray, usual: float) -> IntArray:
    """Return the rows that were read, of changes and the end at (k + 1,): one reading may equal the next."""
    rows = np.diff(at)
    readings = np.maximum(np.rint(rows / usual), 1.0).astype(np.int64)
    readings[-1] = max(int(rows[-1] // usual), 1)  # the last one may not have stood for long
    of_run = np.repeat(np.arange(rows.size), readings)
    number = np.arange(of_run.size) - np.repeat(np.cumsum(readings) - readings, readings)
    return at[of_run] + np.rint(number * (rows / readings)[of_run]).astype(np.int64)


def _moves(other: FloatArray, new: BoolArray) -> FloatArray:
    """How far another column goes in each row of a reading (rows,), where it goes on in one direction."""
    at: IntArray = np.flatnonzero(new)
    rows = int(np.median(np.diff(at)))  # of a reading
    at = at[(at >= rows) & (at + rows < other.size)]
    way = np.sign(other[at + rows] - other[at - rows])
    return np.asarray([np.sum(way * (other[at + k + 1] - other[at + k])) for k in range(rows)])
