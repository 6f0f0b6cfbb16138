"""The extended model: causes around a static Preisach operator, forwards and backwards.

    M(u) = (output causes) o P o (input causes) (u)

One inverse serves every extension: iterative learning (``core.learning``) around the exact inverse of the
static part, with M in the device's place. It keeps the best of its rounds and never fails to converge.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pulsetrainer.core import inversion, learning
from pulsetrainer.core.dual import Dual
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.diagnosis.causes import cause_named
from pulsetrainer.diagnosis.causes.base import Cause, Values
from pulsetrainer.diagnosis.causes.delay import Delay
from pulsetrainer.diagnosis.causes.frame import Frame, Past
from pulsetrainer.diagnosis.thresholds import LIMITS


@dataclass(frozen=True)
class Term:
    """A cause with its parameter values."""

    cause: Cause
    values: Values

    def at_bounds(self, frame: Frame) -> list[bool]:
        """Tell for each parameter whether it lies at an end of what was searched."""
        bounds = self.cause.quantities(frame)
        return [
            value in (one.low, one.high) and not one.whole
            for value, one in zip(self.values, bounds, strict=True)
        ]


def in_order(terms: Sequence[Term]) -> tuple[Term, ...]:
    """Terms in the order of the chain."""
    return tuple(sorted(terms, key=lambda term: term.cause.order))


def seen_input(terms: Sequence[Term], y: FloatArray, frame: Frame) -> FloatArray:
    """Input (n,) that reaches the hysteresis, for the output ``y`` (n,) where a term feeds it back."""
    u = frame.input
    for term in terms:
        if term.cause.stage == "input":
            u = term.cause.on_input(u, y, term.values, frame)
    return u


def shown_output(terms: Sequence[Term], y: FloatArray, frame: Frame) -> FloatArray:
    """Output (n,) of the chain for the output ``y`` (n,) of the hysteresis."""
    for term in terms:
        if term.cause.stage == "output":
            y = term.cause.on_output(y, term.values, frame)
    return y


def chain(terms: Sequence[Term], static: Callable[[FloatArray], FloatArray], frame: Frame) -> FloatArray:
    """Output (n,) of the whole chain."""
    return shown_output(terms, hysteresis(terms, static, frame), frame)


def hysteresis(
    terms: Sequence[Term],
    static: Callable[[FloatArray], FloatArray],
    frame: Frame,
    inner: FloatArray | None = None,
) -> FloatArray:
    """Output (n,) of the hysteresis behind the input terms; what is fed back is passed until it settles.

    ``inner`` (n,) is the output without any, where it is known.
    """
    if not any(term.cause.feeds_back for term in terms):
        return static(seen_input(terms, frame.input, frame))
    inner = static(frame.input) if inner is None else inner
    for _ in range(LIMITS.feedback_passes):
        before, inner = inner, static(seen_input(terms, inner, frame))
        if np.max(np.abs(inner - before)) <= LIMITS.feedback_settled * frame.span:
            break
    return inner


@dataclass(frozen=True)
class Tracked:
    """The input found for a target, and what the model says it gives."""

    input: FloatArray  # (n,)
    predicted: FloatArray  # (n,) polarity 1
    clipped: int
    steps: int  # of the iteration, to the best iterate
    rms: float  # of target less prediction over the scored samples, output unit
    rms_static: float  # the same of the static inverse


@dataclass(frozen=True)
class Extended:
    """An identified model with its extensions; ``static`` has polarity 1, ``polarity`` turns the output."""

    static: Preisach | Dual
    terms: tuple[Term, ...] = ()
    polarity: int = 1

    @classmethod
    def of(cls, static: Preisach | Dual, extensions: Sequence[tuple[str, Values]]) -> Extended:
        """Build from stored names and values; DataError where a cause is unknown."""
        terms = in_order([Term(*cause_named(name).restored(values)) for name, values in extensions])
        return cls(_upright(static), terms, static.polarity)

    def frame(self, u: FloatArray, dt_s: float, past: Past | None = None) -> Frame:
        """What the causes are told of an input, and of what came before it."""
        low, ends = self.static.low, self.static.saturation
        reach = self.static.high - low
        return Frame(dt_s, u, ends[1] - ends[0], reach, low=low, ends=ends, zero=ends[0], past=past)

    def __call__(self, u: FloatArray, dt_s: float) -> FloatArray:
        """Output (n,) for an input (n,) at even steps, from negative saturation and rest."""
        return self.polarity * chain(self.terms, self.static, self.frame(u, dt_s))

    def invert(
        self,
        target: FloatArray,
        dt_s: float,
        *,
        lead: FloatArray,
        inverse: Callable[[FloatArray], inversion.Inverse] | None = None,
        band_Hz: float | None = None,
    ) -> Tracked:
        """Input (n,) whose output is ``target`` (n,), after the input ``lead`` (m,) has been played.

        The best iterate is kept; where none is better than the static inverse, that one is. What a delay
        makes late is asked for, and compared, earlier by as much. ``inverse`` is that of the static part,
        after the lead, for outputs as they are measured; None: over all its range, which signed weights do
        not have.

        ArgumentError where the target is not a finite vector, or the static part cannot be inverted.
        """
        upright = Extended(self.static, self.terms)
        target = self.polarity * np.asarray(target)
        of_static = self._inverse(lead) if inverse is None else lambda wanted: inverse(self.polarity * wanted)
        late = min(self._late(dt_s), target.size - 1)
        hold = np.zeros(late, dtype=np.intp)

        def respond(u: FloatArray, later: int = late) -> FloatArray:
            whole = upright(np.concatenate((lead, u, u[-1:][hold])), dt_s)[lead.size :]
            return whole[later : later + u.size]

        best = None
        for tried in learning.passes(
            np.concatenate((target[late:], target[-1:][hold])),
            of_static,
            respond,
            smooth=learning.LowPass(band_Hz, dt_s),
        ):
            if best is None or tried.rms < best.rms:
                static = best.rms_static if best else tried.rms
                best = Tracked(
                    tried.inverse.input, tried.output, tried.inverse.clipped, tried.number, tried.rms, static
                )
            elif tried.number > best.steps + LIMITS.inverse_patience:
                break
            if tried.number == LIMITS.inverse_rounds:
                break
        assert best is not None
        return best if late == 0 else _in_time(best, of_static(target), target, respond)

    def _late(self, dt_s: float) -> int:
        """Whole steps by which delays make the output late."""
        return round(sum(t.values[0] for t in self.terms if t.cause.id == Delay.id) / dt_s)

    def _inverse(self, lead: FloatArray) -> Callable[[FloatArray], inversion.Inverse]:
        """Return the inverse of the static part after a lead (m,)."""
        static = self.static
        if isinstance(static, Dual):
            return lambda wanted: static.inverse(wanted, lead)
        state = static.run(lead)[1] if lead.size else None
        return lambda wanted: inversion.invert(static, wanted, state)


def _in_time(
    best: Tracked,
    static: inversion.Inverse,
    target: FloatArray,
    respond: Callable[[FloatArray, int], FloatArray],
) -> Tracked:
    """Return what was found by playing earlier, with its errors at their own time; or the static inverse."""
    tried = [(best.input, best.clipped, best.steps + 1), (static.input, static.clipped, 0)]
    made = [respond(u, 0) for u, _, _ in tried]
    rms = [root_mean_square(target - y) for y in made]
    k = int(rms[1] <= rms[0])
    return Tracked(tried[k][0], made[k], *tried[k][1:], rms[k], rms[1])


def _upright(static: Preisach | Dual) -> Preisach | Dual:
    """Return the operator whose output rises with the input: the same, or its mirror image."""
    if isinstance(static, Dual):
        return static if static.polarity > 0 else Dual(_mirrored(static.inner))
    offset = static.polarity * static.offset
    return Preisach(static.plane, static.weights, offset, static.reading, signed=static.signed)


def _mirrored(falling: Preisach) -> Preisach:
    """Return the rising operator that does to -x what a falling one does to x."""
    plane = falling.plane
    i, j = plane.cell_indices
    weights = np.empty((plane.n_h, plane.n_h))
    weights[i, j] = falling.weights
    last = plane.n_h - 1
    return Preisach(Plane(-plane.edges[::-1]), weights[last - j, last - i], falling.offset)
