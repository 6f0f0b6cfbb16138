"""What a device does beside its hysteresis, and what a calibration took for hysteresis.

A lag and a creep are no hysteresis, but the Preisach model of a calibration explains them as well as it can.
On another record of the same device it misses, of each such effect s,

    n = s - P s,   P s the Preisach operator nearest to s over the calibration

with a density of either sign. Multiples of n tell what is no hysteresis from what moved.
"""

from __future__ import annotations

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core import operator
from pulsetrainer.core.plane import FloatArray, Plane

LEVELS = 24  # effects are smooth: more would cost time alone
_RIDGE = 1e-6  # of the mean diagonal: for nodes that the calibration did not visit


def missed(
    plane: Plane, input_then: FloatArray, then: FloatArray, input_now: FloatArray, now: FloatArray
) -> FloatArray:
    """Return what a model misses of effects in a record of now, shape (n, k), output unit.

    ``plane`` is where P works; few levels do. ``input_then`` (m,) is the input of the calibration, ``then``
    (m, k) the effects there; ``input_now`` (n,) and ``now`` (n, k) are those of the other record.
    """
    design, here = _rows(plane, input_then), _rows(plane, input_now)
    gram = (design.T @ design).toarray()
    gram[np.diag_indices_from(gram)] += _RIDGE * np.trace(gram) / len(gram)
    taken = scipy.linalg.solve(gram, design.T @ then, assume_a="pos")
    return np.asarray(now - here @ taken)


def _rows(plane: Plane, values: FloatArray) -> scipy.sparse.csr_array:
    """Design rows (n, n_q + 1) of an input, the last column for the offset."""
    path = operator.follow(plane, np.clip(values, plane.low, plane.high), None, "continuous")
    return scipy.sparse.hstack((operator.rows(plane, path), np.ones((values.size, 1))), format="csr")
