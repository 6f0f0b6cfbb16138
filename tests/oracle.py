"""The naive twin of each fast routine: slow, short, and obvious to a reader.

Nothing here uses the package. A plane is its ``edges`` (n_h + 1,), its content the ``masses`` (n_q,) of
the cells, mu A, in the order (0, 0), (1, 0), (1, 1), (2, 0) ... A past is the list of inputs played
before the first sample, starting with every relay down. Outputs have no offset and polarity 1.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy import optimize

# --- the plane ----------------------------------------------------------------------------------------


def cells(edges):
    """Bands (i, j) of all cells: relays that switch up in band i and down in band j."""
    return [(i, j) for i in range(len(edges) - 1) for j in range(i + 1)]


def areas(edges):
    """Areas of the cells: rectangles off the diagonal, triangles on it."""
    step = [b - a for a, b in pairwise(edges)]
    return np.array([step[i] * step[j] * (0.5 if i == j else 1.0) for i, j in cells(edges)])


def everett(edges, masses):
    """Mass between each pair of edges: node (a, b) holds all cells (i, j) with i < a and j >= b."""
    return np.array(
        [
            sum(m for m, (p, q) in zip(masses, cells(edges), strict=True) if p <= i and q >= j)
            for i, j in cells(edges)
        ]
    )


# --- relays, one by one ---------------------------------------------------------------------------------


def relays(edges):
    """Thresholds (alpha, beta) of the paper's relays: one for each cell, at the middles of its bands."""
    middle = [0.5 * (a + b) for a, b in pairwise(edges)]
    alpha = np.array([middle[i] for i, _ in cells(edges)])
    beta = np.array([middle[j] for _, j in cells(edges)])
    return alpha, beta


def relay_states(alpha, beta, inputs, past=()):
    """States (n, n_q), -1 or +1, of all relays after each input: up from alpha on, down below beta."""
    state = np.full(alpha.size, -1.0)
    states = []
    for u in (*past, *inputs):
        state[u >= alpha] = 1.0
        state[u < beta] = -1.0
        states.append(state.copy())
    return np.array(states[len(past) :])


def relay_output(alpha, beta, masses, inputs, past=()):
    """Outputs (n,) of the relays: the loop that everyone writes first."""
    state = np.full(alpha.size, -1.0)
    for u in past:
        state[u >= alpha] = 1.0
        state[u < beta] = -1.0
    output = np.empty(len(inputs))
    for n, u in enumerate(inputs):
        state[u >= alpha] = 1.0
        state[u < beta] = -1.0
        output[n] = state @ masses
    return output


def subdivided(edges, masses, parts):
    """Relays (alpha, beta, mass) that come close to a constant density: every band cut into ``parts``.

    The mass of a cell off the diagonal is shared by its parts x parts relays, the mass of a cell on the
    diagonal by the parts relays whose two thresholds are equal: it is reversible. For inputs on the cuts
    this is not close to the continuous reading but equal to it.
    """
    middles = [[a + (b - a) * (k + 0.5) / parts for k in range(parts)] for a, b in pairwise(edges)]
    fine = []
    for m, (i, j) in zip(masses, cells(edges), strict=True):
        if i == j:
            fine += [(a, a, m / parts) for a in middles[i]]
        else:
            fine += [(a, b, m / parts**2) for a in middles[i] for b in middles[j]]
    return np.array(fine).T


# --- the continuous reading, by areas -----------------------------------------------------------------


def remembered(history, low):
    """Remembered extremes [low, max, min, max, ...] of a whole history, without a stack.

    After the last time at ``low``: the last time of the highest input, the last time of the lowest input
    after it, and so on until now.
    """
    rest, extremes = [low, *history], []
    while rest:
        best = max(rest) if len(extremes) % 2 else min(rest)
        extremes.append(best)
        last = len(rest) - 1 - rest[::-1].index(best)
        rest = rest[last + 1 :]
    return extremes


def overlap(a, b, c, d):
    """Length that the intervals [a, b] and [c, d] have in common."""
    return max(0.0, min(b, d) - max(a, c))


def up_share(edges, extremes):
    """Share (n_q,) of each cell that is up: the area below the staircase of remembered extremes.

    Relays whose lower threshold lies between two remembered minima are up as far as the maximum between
    them. On the diagonal, where both thresholds are equal, they are up as far as the present input.
    """
    low, present = extremes[0], extremes[-1]
    maxima, minima = extremes[1::2], extremes[2::2]
    if len(maxima) > len(minima):
        minima = [*minima, present]  # still rising: the last stair ends at the diagonal
    share = []
    for i, j in cells(edges):
        a, b, c, d = edges[i], edges[i + 1], edges[j], edges[j + 1]
        if i == j:
            share.append(overlap(low, present, a, b) / (b - a))
            continue
        area, left = 0.0, low
        for highest, right in zip(maxima, minima, strict=True):
            area += overlap(low, highest, a, b) * overlap(left, right, c, d)
            left = right
        share.append(area / ((b - a) * (d - c)))
    return np.array(share)


def continuous_states(edges, inputs, past=()):
    """Mean states (n, n_q) in [-1, 1] of all cells after each input, density constant in each cell."""
    history = [float(np.clip(u, edges[0], edges[-1])) for u in (*past, *inputs)]
    return np.array(
        [
            2.0 * up_share(edges, remembered(history[: n + 1], edges[0])) - 1.0
            for n in range(len(past), len(history))
        ]
    )


def continuous_output(edges, masses, inputs, past=()):
    """Outputs (n,) of the continuous reading."""
    return continuous_states(edges, inputs, past) @ masses


# --- inversion ----------------------------------------------------------------------------------------


def closest_match(edges, masses, targets, past=()):
    """Level numbers (n,) whose relay output comes nearest to each target in turn, and those outputs.

    From the present level: while the output is below the target step up by one level, the relays' states
    before the step backed up, until the target is reached or the edges end; then keep the nearer
    of the last two, restoring the backup if that was the one before. Mirrored when above the target.
    """
    alpha, beta = relays(edges)
    states = relay_states(alpha, beta, [edges[0], *past])
    middle = [0.5 * (a + b) for a, b in pairwise(edges)]
    state, level = states[-1], sum((past[-1] if len(past) else edges[0]) >= m for m in middle)
    output = state @ masses
    chosen, reached = [], []
    for target in targets:
        step = 1 if output < target else -1
        backup = state.copy(), level, output
        while step * (target - output) > 0 and 0 <= level + step < len(edges):
            backup = state.copy(), level, output
            level += step
            state[edges[level] >= alpha] = 1.0
            state[edges[level] < beta] = -1.0
            output = state @ masses
        if abs(backup[2] - target) < abs(output - target):
            state, level, output = backup
        chosen.append(level)
        reached.append(output)
    return np.array(chosen), np.array(reached)


def try_all_edges(edges, masses, targets, past=()):
    """Level numbers (n,) for each target in turn: every level tried from the same backup, the best kept."""
    alpha, beta = relays(edges)
    state = relay_states(alpha, beta, [edges[0], *past])[-1]
    chosen = []
    for target in targets:
        best = (np.inf, 0, state)
        for level, u in enumerate(edges):
            tried = state.copy()
            tried[u >= alpha] = 1.0
            tried[u < beta] = -1.0
            best = min(best, (abs(tried @ masses - target), level, tried), key=lambda b: b[0])
        chosen.append(best[1])
        state = best[2]
    return np.array(chosen)


def invert(edges, masses, targets, past=()):
    """Inputs (n,) that reach each target in turn, by bisection on the continuous reading.

    Between the present input and the end of the range the output is monotone: halve that interval until
    nothing is left of it.
    """
    past = [edges[0], *past]
    inputs = []
    for target in targets:
        present = min(max(past[-1], edges[0]), edges[-1])  # beyond the plane nothing answers
        output = continuous_output(edges, masses, [present], past)[0]
        near, far = present, edges[-1] if target > output else edges[0]
        for _ in range(80):
            middle = 0.5 * (near + far)
            reached = continuous_output(edges, masses, [middle], past)[0]
            short = reached < target if target > output else reached > target
            near, far = (middle, far) if short else (near, middle)
        past.append(present if target == output else far)
        inputs.append(past[-1])
    return np.array(inputs)


def slope_envelope(values, slope):
    """Highest path (n,) nowhere above ``values`` (n,) that moves at most ``slope`` a sample."""
    where = np.arange(len(values))
    return np.array([min(values + slope * abs(where - n)) for n in where])


# --- identification -----------------------------------------------------------------------------------


def dense_fit(states, output, sample_weight=None):
    """Masses (n_q,) >= 0 and offset that minimise sum v (y - y0 - states @ masses)^2: dense nnls.

    A free offset is eliminated by taking the mean from every column and from the output.
    """
    v = np.ones(len(output)) if sample_weight is None else np.asarray(sample_weight, dtype=float)
    column_mean, output_mean = v @ states / v.sum(), v @ output / v.sum()
    root = np.sqrt(v)
    masses, _ = optimize.nnls(
        (states - column_mean) * root[:, None], (output - output_mean) * root, maxiter=30 * states.shape[1]
    )
    return masses, output_mean - column_mean @ masses


def sum_of_squares(states, output, masses, offset, sample_weight=None):
    """Weighted sum of the squared residuals of a fit."""
    v = np.ones(len(output)) if sample_weight is None else np.asarray(sample_weight, dtype=float)
    return float(v @ (output - offset - states @ masses) ** 2)


def coverage(edges, inputs):
    """Tell for each relay (n_q,) whether the input switched it on and, later, off."""
    alpha, beta = relays(edges)
    done = []
    for a, b in zip(alpha, beta, strict=True):
        up, down_again = False, False
        for u in inputs:
            down_again = down_again or (up and u < b)
            up = up or u >= a
        done.append(down_again)
    return np.array(done)


# --- a pulse --------------------------------------------------------------------------------------------


def parabola(values):
    """Middle of the parabola of least squares through an odd number of even samples."""
    at = np.arange(len(values)) - len(values) // 2
    return np.polyfit(at, values, 2)[-1]
