"""The form of the static model: direct, dual or signed, and which of them a record asks for.

- direct: y = P[u] with mu >= 0: the output lags, the loop runs counterclockwise.
- dual: u = P[y] with mu >= 0: the output leads, the loop runs clockwise (``core.dual``).
- signed: y = P[u] with weights of either sign: the loop may cross itself, as a butterfly does
  (Jayawardhana, Vasquez-Beltran, van de Beek, de Jonge, Acuautla, Damerio, Peletier, Noheda, Proc. IEEE CDC
  2018: butterfly loops are those of a Preisach operator whose density changes sign).

The direct form is fitted first. Only where it leaves more than noise are the others tried, all three on a
coarse plane and judged by blocks of the records that were not fitted. A form wins over a simpler one only
where it leaves far less, and where it is not a lag in time that it imitates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from typing import Literal

import numpy as np

from pulsetrainer.core import nnls
from pulsetrainer.core.dual import Dual, exchanged
from pulsetrainer.core.edges import plane_for, thinned
from pulsetrainer.core.equations import NormalEquations, parted_sums
from pulsetrainer.core.identification import correlation_of, polarity_of
from pulsetrainer.core.initial_state import record_of
from pulsetrainer.core.input_noise import white
from pulsetrainer.core.loop import loop_of
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import BoolArray, FloatArray, IntArray, Plane, ends_of
from pulsetrainer.core.record import Record, counted_output, levelled
from pulsetrainer.core.smoothing import FOLDS, blocks, smoothed
from pulsetrainer.errors import ArgumentError

Form = Literal["direct", "dual", "signed"]
FORMS: tuple[Form, ...] = ("direct", "dual", "signed")
Signals = Sequence[tuple[FloatArray, FloatArray]]
Static = Preisach | Dual
Kept = Sequence[BoolArray] | None

# Above this multiple of what looks like white noise in its residual, a fit leaves more than noise.
STRUCTURED = 1.3
SMALLEST = 0.001  # of the span, rms: nobody needs another form for less
# A less simple form must leave less than this share of what the simpler one leaves on held-out blocks.
BETTER = 0.8
# A form other than the direct one must describe the record: of the span, rms on held-out blocks.
DESCRIBES = 0.05
# Where weights of either sign leave more than this share of what the direct form leaves, no more is tried.
LOOK = 0.85
_FEWEST = 4 * FOLDS  # samples: below, there are no blocks to hold out
_LEVELS = 16
_FIRST = 0.05
_SMOOTHINGS = (0.025, _FIRST, 0.1)


@dataclass(frozen=True, slots=True)
class Tried:
    """What each form left on held-out blocks, rms, output unit; the best one; and those to fit in full."""

    left: dict[Form, float]
    form: Form
    to_fit: tuple[Form, ...]


def asked_forms(
    form: Form | Literal["auto"], signals: Signals, low: float, high: float, kept: Kept = None, *, plain: bool
) -> tuple[Form, ...]:
    """Return the form to fit: the one asked for, or with "auto" the one that the records ask for.

    Two, the simpler one first, where a coarse plane does not tell: there weights of either sign follow sharp
    corners of a loop that leads better than the dual form does. Both are then fitted in full, and compared.

    Only where weights are fitted jointly in the continuous reading (``plain``) is there more than the direct
    form. Of each record only the samples that are ``kept`` count. ArgumentError for an unknown form, or for
    dual or signed where only the direct one exists.
    """
    if form not in ("auto", *FORMS):
        raise ArgumentError(f"form must be auto, {', '.join(FORMS)}, got {form!r}", hint="use auto")
    if form == "auto":
        enough = sum(u.size for u, _ in signals) >= _FEWEST and any(np.ptp(y) > 0 for _, y in signals)
        return try_all(signals, low, high, kept).to_fit if plain and enough else ("direct",)
    if form != "direct" and not plain:
        raise ArgumentError(
            f"the {form} form is fitted jointly, in the continuous reading",
            hint="leave method and reading out, or ask for the direct form",
        )
    return (form,)


def leaves_more_than_noise(residuals: Sequence[FloatArray], span: float) -> bool:
    """Tell whether residuals are larger than their own white noise, and large enough to matter."""
    left = root_mean_square(np.concatenate(list(residuals)))
    return left > max(SMALLEST * span, STRUCTURED * max(white(r) for r in residuals))


def try_all(signals: Signals, low: float, high: float, kept: Kept = None) -> Tried:
    """Fit every form to blocks of the records, pairs of input and output (n,), and judge it by the others.

    Samples that are not ``kept`` do not count, as in a fit. ConvergenceError where a fit did not settle.
    """
    records = records_of(signals, low, high, kept)
    folds = [np.where(r.counts, blocks(r.input, low, high) % FOLDS, -1) for r in records]
    plane = thinned(plane_for(records, low, high, 2 * _LEVELS), _LEVELS)
    if len({number for fold in folds for number in np.unique(fold).tolist()} - {-1}) < 2:
        return Tried({}, "direct", ("direct",))  # nothing can be held out
    direct, signed = (_HeldOut(records, folds, plane, signed=either) for either in (False, True))
    span = float(np.ptp(counted_output(records)))
    left: dict[Form, float] = {"direct": direct(_FIRST), "signed": signed(_FIRST)}
    # the dual form too is rarely much worse as a signed one than by itself
    if left["direct"] < SMALLEST * span or left["signed"] > LOOK * left["direct"]:
        return Tried(left, "direct", ("direct",))
    if _is_late(records, folds, plane):
        return Tried(left, "direct", ("direct",))
    left = {"direct": direct.best(), "signed": signed.best(), "dual": _held_out_dual(signals, folds, kept)}
    form: Form = "direct"
    for other in ("dual", "signed"):
        if left[other] < min(BETTER * left[form], DESCRIBES * span):
            form = other
    in_doubt = form == "signed" and left["dual"] < DESCRIBES * span
    return Tried(left, form, ("dual", "signed") if in_doubt else (form,))


def records_of(signals: Signals, low: float, high: float, kept: Kept = None) -> list[Record]:
    """Return signals, pairs of input and output (n,), as records of which only what is kept counts."""
    records = [record_of(u, y, low, high) for u, y in signals]
    if kept is None:
        return records
    return [replace(r, sample_weight=r.sample_weight * k) for r, k in zip(records, kept, strict=True)]


def _is_late(records: Sequence[Record], folds: Sequence[IntArray], plane: Plane) -> bool:
    """Tell whether weights of either sign only imitate a lag: the output goes on after a reversal.

    Over a loop that lags, an output that is late has a negative reversible part, the sum of the cells on the
    diagonal. No static loop has one, however its density changes sign; what is late is a matter of time.

    An output that leads, such as the friction of something that slides, is late too if it is turned round.
    So where the sign of the fit is against the trend, nothing is late: by so much no output is.
    """
    sign = polarity_of(records, plane)
    if sign * correlation_of(records) < 0.0:
        return False
    turned, _ = levelled(records, sign)
    whole = reduce(add, _parts(turned, folds, plane))
    masses = nnls.solve_signed(*smoothed(whole, _FIRST))
    operator = Preisach(plane, masses / plane.areas, whole.offset(masses), signed=True)
    i, j = plane.cell_indices
    return loop_of(operator) == "counterclockwise" and float(masses[i == j].sum()) < 0.0


class _HeldOut:
    """The rms error on held-out blocks as a function of the smoothing, for weights of one sign or either."""

    def __init__(
        self, records: Sequence[Record], folds: Sequence[IntArray], plane: Plane, *, signed: bool
    ) -> None:
        turned, _ = levelled(records, 1 if signed else polarity_of(records, plane))
        self.signed, self.outs = signed, _each_out(turned, folds, plane)
        self.errors: dict[float, float] = {}

    def __call__(self, smoothing: float) -> float:
        if smoothing not in self.errors:
            squares = 0.0
            for part, rest in self.outs.values():
                gram, rhs = smoothed(rest, smoothing)
                masses = nnls.solve_signed(gram, rhs) if self.signed else nnls.solve(gram, rhs).x
                squares += part.sum_of_squares(masses, rest.offset(masses))
            weight = sum(part.weight_sum for part, _ in self.outs.values())
            self.errors[smoothing] = float(np.sqrt(max(squares, 0.0) / weight))
        return self.errors[smoothing]

    def best(self) -> float:
        """Least error of all smoothings."""
        return min(self(s) for s in _SMOOTHINGS)


def _parts(records: Sequence[Record], folds: Sequence[IntArray], plane: Plane) -> list[NormalEquations]:
    """Sums over each fold."""
    return [part.dense() for part in parted_sums(plane, records, "continuous", folds, FOLDS)]


def _each_out(
    records: Sequence[Record], folds: Sequence[IntArray], plane: Plane
) -> dict[int, tuple[NormalEquations, NormalEquations]]:
    """Sums over each fold that holds a sample, by its number, and over all the others."""
    held = {k: part for k, part in enumerate(_parts(records, folds, plane)) if part.weight_sum > 0}
    whole = reduce(add, held.values())
    return {k: (part, whole - part) for k, part in held.items()}


def _held_out_dual(signals: Signals, folds: Sequence[IntArray], kept: Kept) -> float:
    """Rms error on held-out blocks of the form with the roles exchanged, in the output's unit."""
    swapped = exchanged(signals)
    low, high = ends_of([y for y, _ in swapped])
    records = records_of(swapped, low, high, kept)
    plane = thinned(plane_for(records, low, high, 2 * _LEVELS), _LEVELS)
    sign = polarity_of(records, plane)
    turned, zero = levelled(records, sign)
    outs = _each_out(turned, folds, plane)

    def left(smoothing: float) -> float:
        squares, count = 0.0, 0
        for k, (_, rest) in outs.items():
            gram, rhs = smoothed(rest, smoothing)
            masses = nnls.solve(gram, rhs).x
            if not masses.sum() > 0:
                return float("inf")
            offset = sign * (rest.offset(masses) + zero)
            operator = Dual(Preisach(plane, masses / plane.areas, offset, polarity=sign))
            for (u, y), fold in zip(signals, folds, strict=True):
                chosen = fold == k
                squares += float(np.sum((operator(u) - y)[chosen] ** 2))
                count += int(chosen.sum())
        return float(np.sqrt(squares / count))

    return min(left(s) for s in _SMOOTHINGS)
