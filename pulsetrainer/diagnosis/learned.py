"""A learned dependence in words, as a figure of its curve, and as causes of the diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pulsetrainer.artefacts import Dependence
from pulsetrainer.artefacts.units import unit_of, with_seconds, with_unit
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.unlisted import KNOTS, Part, Unlisted
from pulsetrainer.diagnosis.dependence import Bank
from pulsetrainer.diagnosis.finding import Estimate
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT
from pulsetrainer.diagnosis.wording import figure

_OFFSETS = {"input": "u", "turn": "u", "output": "y"}  # states told from the zero of the quantity
_TEXT = (
    "the {output} also depends on something that is not in the list of causes: {it} is {way} by {size} when "
    "{state} {where}"
)


@dataclass(frozen=True)
class _Curve:
    """One learned dependence of the output as measured, its mean over the record taken off."""

    part: Part
    tau: float
    at: FloatArray  # (k,)
    value: FloatArray  # (k,) of a gain per cent
    half: FloatArray  # (k,) half width of the band


def learned(state: State, words: Mapping[str, str]) -> tuple[Dependence, ...]:
    """Return the dependences in the model of a diagnosis, each with its text, curve and parameters."""
    term = next((one for one in state.extensions if isinstance(one.cause, Unlisted)), None)
    if term is None:
        return ()
    assert isinstance(term.cause, Unlisted)
    assert state.repeated is not None
    bank = Bank(state.repeated, state.held_out, Unlisted.order)
    rows, found = state.repeated_estimates[term.cause.id], []
    for k, part in enumerate(term.cause.parts):
        own = slice(k * KNOTS, (k + 1) * KNOTS)
        curve = _curve(state, bank, part, term.values[own], rows[own])
        found.append(
            Dependence(
                text=_text(curve, words),
                state=_said(curve, words),
                unit="s" if part.kind.saturates else unit_of(part.kind.unit, words["u"], words["y"]),
                tau_s=curve.tau,
                at=curve.at,
                value=curve.value,
                half=curve.half,
                output_unit=_unit(curve, words),
            )
        )
    return tuple(found)


def _curve(
    state: State, bank: Bank, part: Part, values: tuple[float, ...], rows: tuple[Estimate, ...]
) -> _Curve:
    scale, (tau, *knots) = state.scale, values
    z = bank.state(part.state, tau)
    low, high = (float(one) for one in np.quantile(z, LIMITS.curve_bulk))
    places = np.linspace(max(low, part.low), min(high, part.high), LIMITS.curve_places)
    apart = part.columns(places) - part.columns(z).mean(axis=0)
    value = apart @ np.asarray(knots)
    half = np.abs(apart) @ np.asarray([0.5 * (one.upper - one.lower) for one in rows[1:]])
    at = places * scale.of_unit(part.kind.unit)
    if part.kind.saturates:
        at = -tau * scale.second * np.log1p(-np.minimum(places, 1.0 - LIMITS.same_value))
    shift = {"u": scale.low, "y": scale.zero + scale.span * bank.fitted.simulator.frames[0].zero}
    at = at + (shift[_OFFSETS[part.kind.name]] if part.kind.name in _OFFSETS else 0.0)
    if part.gain:
        value, half = PERCENT * value, PERCENT * half
    sign = state.question.given.model.polarity if state.question.given else 1
    if sign < 0 and part.kind.unit == "{y}":
        at, value, half = -at[::-1], value[::-1], half[::-1]
    return _Curve(part, tau * scale.second, at, (1.0 if part.gain else sign * scale.span) * value, half)


def _text(curve: _Curve, words: Mapping[str, str]) -> str:
    """Return the dependence in words: from end to end, or where it is farthest from the line between them."""
    value, unit = curve.value, unit_of(curve.part.kind.unit, words["u"], words["y"])
    # against the line between its ends: a bump or dip where that is more than what the ends differ by
    bent = value - np.linspace(value[0], value[-1], value.size)
    k = int(np.argmax(np.abs(bent)))
    change = float(value[-1] - value[0])
    if abs(bent[k]) > abs(change):
        change, where = float(bent[k]), f"is near {_place(curve, k, unit)}"
    else:
        where = f"goes from {_place(curve, 0, unit)} to {_place(curve, -1, unit)}"
    size = with_unit(figure(abs(change), 2), _unit(curve, words))
    it, way = "its gain" if curve.part.gain else "it", "lower" if change < 0 else "higher"
    state = _said(curve, words)
    return _TEXT.format(output=words["output"], it=it, way=way, size=size, state=state, where=where)


def _unit(curve: _Curve, words: Mapping[str, str]) -> str:
    return "%" if curve.part.gain else words["y"]


def _said(curve: _Curve, words: Mapping[str, str]) -> str:
    return curve.part.kind.words.format(
        input=words["input"], output=words["output"], tau=with_seconds(float(f"{curve.tau:.2g}"))
    )


def _place(curve: _Curve, k: int, unit: str) -> str:
    value = float(curve.at[k])
    return with_seconds(value) if curve.part.kind.saturates else with_unit(figure(value, 2), unit)
