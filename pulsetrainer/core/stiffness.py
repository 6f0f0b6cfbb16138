"""How much the density may differ from one place of the diagonal to the next.

A Prandtl-Ishlinskii model is a Preisach model whose density depends on alpha - beta alone (Krejci and Kuhnen,
IEE Proc. Control Theory Appl. 148, 2001, 185-192): the same loop wherever it is traced. Adding

    t g sum (m[i + 1, j + 1] - m[i, j])^2

over neighbours along the diagonal, with g the mean of the Gram matrix's diagonal and m the cells' masses,
leads from a free density (t = 0) to that model (t large). Where the data are no Preisach operator's at
all, such as a force that follows the velocity, a free density learns one stretch by heart and predicts the
next one worse than the stiff one: ``choose_stiffness`` finds out on the second half of the records.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core import nnls
from pulsetrainer.core.edges import thinned
from pulsetrainer.core.equations import NormalEquations, parted_sums
from pulsetrainer.core.plane import FloatArray, Plane, Reading
from pulsetrainer.core.record import Record
from pulsetrainer.core.smoothing import smoothed

STRENGTHS = (0.1, 1.0, 10.0, 100.0)  # 100 is within a few per cent of t -> infinity
HELD_OUT = 0.5  # of the samples of each record, the last ones
# The stiffest density wins whose held-out error is within this share of the best one: among models that
# predict equally well the one with less freedom (the rule of one standard error, Breiman et al. 1984,
# section 3.4).
TOLERANCE = 0.05
_LEVELS = 32  # on which t is chosen


def stiffness_penalty(plane: Plane, diagonal: FloatArray, strength: float) -> scipy.sparse.csr_array:
    """Return t g D'D (n_q, n_q) on the masses; t, the ``strength``, has no unit.

    Cells where ``diagonal`` (n_q,), that of the centred Gram matrix, is zero are left alone.
    """
    i, _ = plane.cell_indices
    here = np.flatnonzero(i + 1 < plane.n_h)
    there = here + i[here] + 2  # cell (i + 1, j + 1)
    usable = diagonal > nnls.SMALLEST_DIAGONAL * diagonal.max(initial=0.0)
    both = usable[here] & usable[there]
    here, there = here[both], there[both]
    count = here.size
    value = np.repeat((1.0, -1.0), count)
    row = np.tile(np.arange(count), 2)
    difference = scipy.sparse.csr_array(
        (value, (row, np.concatenate((here, there)))), shape=(count, plane.n_q)
    )
    return (difference.T @ difference) * (strength * float(diagonal.sum()) / plane.n_q)


def penalised(
    equations: NormalEquations, smoothing: float, stiffness: float
) -> tuple[FloatArray, FloatArray]:
    """Return the centred Gram matrix (n_q, n_q) and right side (n_q,) with the penalties of a fit.

    See ``core.smoothing`` for the length; 0 is none of either.
    """
    gram, rhs = smoothed(equations, smoothing)
    if stiffness:
        centred = equations.centred()[0]
        gram += stiffness_penalty(equations.plane, np.diagonal(centred).copy(), stiffness).toarray()
    return gram, rhs


def choose_stiffness(records: Sequence[Record], plane: Plane, reading: Reading) -> float:
    """Return t by the error on the second half of each record: 0, or one of ``STRENGTHS``.

    Each t is fitted to the first halves, on at most 32 levels, and judged by its rms error on the second
    halves, both followed from the start of the record. The largest t within ``TOLERANCE`` of the best wins.

    ArgumentError where the reading is unknown; ConvergenceError where a fit did not settle.
    """
    coarse = thinned(plane, _LEVELS)
    parts = []
    for record in records:
        known = np.cumsum(record.counts)
        parts.append((known > (1.0 - HELD_OUT) * known[-1]).astype(np.int64))
    fitted, held_out = (part.dense() for part in parted_sums(coarse, records, reading, parts, 2))
    if min(fitted.weight_sum, held_out.weight_sum) <= 0:
        return 0.0
    errors = {t: _error(fitted, held_out, t) for t in (0.0, *STRENGTHS)}
    enough = (1.0 + TOLERANCE) * min(errors.values())
    return max(t for t, error in errors.items() if error <= enough)


def _error(fitted: NormalEquations, held_out: NormalEquations, strength: float) -> float:
    masses = nnls.solve(*penalised(fitted, 0.0, strength)).x
    return held_out.rms(masses, fitted.offset(masses))
