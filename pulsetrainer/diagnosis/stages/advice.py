"""Advice: what to measure next.

The first of these that applies is the advice:

- If the recorder clips the input, its range must be wider.
- If the model as given is of the wrong kind, or of another condition, another model is needed.
- If the device was still settling when the records began, it must rest first.
- If no verdict is reached and what is left is the same in two records of one input, another kind of model is
  needed. If it differs between them, or follows time alone (also as a drift of another course), device and
  sensor must be kept steady. If the weights may hide a fault of the measurement, a record without it is
  needed.
- If nothing was found, but what is left comes and goes, the same is to be recorded again.
- If the model contains already what was found, it is used as it is.
- If causes are tied, the advice is the experiment on which they look least alike, simulated with the model
  that was found.
- If a cause in doubt is as fast as the samples, a record that is as much faster is advised.
- Otherwise it is what the verdict asks for: a fault of the measurement is taken out of the record
  (`correct`), a property of the device goes into the model (`extend`).

What the records lack comes after what can be done with them, or first if nothing can be done with them. The
records that the model was identified from may hold it: so these are to be diagnosed together first.
The words are in ``advice_wording``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pulsetrainer.diagnosis import equal_inputs
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.clipped_input import ClippedInput
from pulsetrainer.diagnosis.causes.condition_change import ConditionChange
from pulsetrainer.diagnosis.causes.delay import Delay
from pulsetrainer.diagnosis.causes.out_of_range import OutOfRange
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.experiment import as_fast_as, best_experiment, fastest_of, sampled_apart
from pulsetrainer.diagnosis.finding import Finding
from pulsetrainer.diagnosis.residual import HOLDS, LENGTH, RATES
from pulsetrainer.diagnosis.stages.begin import TWO_SIZES
from pulsetrainer.diagnosis.stages.given_model import is_its_own
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT

# What the evidence says of the model as given, and the advice
_ANOTHER_MODEL = {
    "wrong kind": "other model",
    "wrong kind, both": "other model, both",
    "shifted": "identify anew",
    "changed": "identify anew",
    "reversed": "identify anew",
    "one stroke": "strokes",
}
# ... and where nothing was found
_NOT_AS_GIVEN = {"given worse, own": "warm up", "given worse": "identify anew"}
# What the evidence says of what is left where no verdict is reached, and the advice; the surest comes first
_OF_WHAT_IS_LEFT = {
    equal_inputs.AGAIN: "another kind",
    equal_inputs.DIFFERS: "something acts",
    "zero wanders": "keep steady",
    "held": "without the fault",
}
# ... and where nothing was found
_THOUGH_NOTHING = {"bursts": "comes and goes"}
# Advice that the recordings of the model may make needless
_ASKS_FOR_MORE = ("tied", "tied, no better", "lacks", "inconclusive", "again")
_TO_REPAIR = {ConditionChange.id: "conditions", OutOfRange.id: "out of range"}


def stage(state: State) -> State:
    """Return the state with its advice."""
    advice = (
        _of_the_recorder(state) or _of_the_conditions(state) or _not_as_given(state) or _of_the_causes(state)
    )
    if advice.kind in _ASKS_FOR_MORE and state.question.given is not None and not is_its_own(state):
        advice = replace(advice, figures={**advice.figures, "together": 1.0})
    doubted = [one.cause for one in state.findings if one.found and one.in_doubt]
    # an early answer is in doubt for want of other rates, which need no samples that are closer
    fastest = fastest_of(state, [one.id for one in doubted if not one.comes_before])
    if fastest is not None and "faster" not in advice.figures and state.question.timed:
        apart = sampled_apart(state)
        figures = {"tau": fastest, "apart": apart, "faster": as_fast_as(fastest, apart)}
        advice = replace(advice, figures={**advice.figures, **figures})
    return replace(state, advice=advice)


def _of_the_recorder(state: State) -> Evidence | None:
    clipped = [one for _, one in state.firings if one.cause == ClippedInput.id]
    return Evidence("clipped input", figures={"rail": clipped[0].value}) if clipped else None


def _of_the_conditions(state: State) -> Evidence | None:
    another = [one for one in state.evidence if one.kind in _ANOTHER_MODEL]
    if another:
        alone = another[0].record is not None  # only one of the records is not the model's
        return Evidence("conditions" if alone else _ANOTHER_MODEL[another[0].kind])
    began = [one for one in state.evidence if one.kind == "under way"]
    if began and state.extended is None:
        return Evidence("rest first", figures={"rest": began[0].figures["rest"]})
    seen = [one.kind for one in state.evidence]
    nothing = _THOUGH_NOTHING if state.verdict in ("none", "inconclusive") else {}
    asked = _OF_WHAT_IS_LEFT if state.verdict == "unknown" else nothing
    told = [asked[kind] for kind in asked if kind in seen]
    if state.verdict == "unknown" and any(TWO_SIZES in one.doubts for one in state.findings):
        told.append("keep steady")
    return Evidence(told[0]) if told else None


def _not_as_given(state: State) -> Evidence | None:
    """Return what to do if nothing was found, but the given model leaves more than refitted weights do."""
    missed = next((one.kind for one in state.evidence if one.kind in _NOT_AS_GIVEN), None)
    if state.verdict not in ("none", "inconclusive", "unknown"):
        return None
    if state.verdict == "unknown" and state.question.given and state.question.given.is_of_wrong_kind:
        return Evidence("no model")
    if missed is None:
        return None
    own = missed == "given worse, own"
    return Evidence(_NOT_AS_GIVEN[missed]) if own or state.verdict != "unknown" else None


def _of_the_causes(state: State) -> Evidence:
    if state.verdict in state.in_model:
        return Evidence("in the model", names=(*state.in_model, *state.lacks))
    tied = next((one for one in state.findings if one.found and one.confounded_with), None)
    if tied is not None:
        names = (tied.cause.id, *tied.confounded_with)
        if state.question.quick:
            return Evidence("tied, quick", names=names)
        best = best_experiment(state, names)
        percent = PERCENT / float(np.ptp(state.problem.measured))
        figures = {
            "there": percent * best.distance,
            "here": percent * best.distance_here,
            "faster": best.faster,
            **_at_the_mains(tied),
            **({"one rate": 1.0} if RATES in state.lacks and tied.cause.widens else {}),
        }
        if best.distance <= LIMITS.worth_recording * best.distance_here:
            return Evidence("tied, no better", figures=figures, names=names)
        return Evidence("tied", figures=figures, names=(best.name, *names))
    if state.verdict == "inconclusive":
        return _to_see_more(state)
    return _after_verdict(state)


def _at_the_mains(tied: Finding) -> dict[str, float]:
    """Return the frequency of a disturbance, Hz, if it is that of the mains or a harmonic of it."""
    lines = [one.value for one in tied.parameters if tied.cause.line and one.unit == "Hz"]
    mains = [k * one for one in LIMITS.mains_Hz for k in range(1, LIMITS.mains_harmonics + 1)]
    near = [one for one in lines if any(abs(one / usual - 1.0) <= LIMITS.mains_within for usual in mains)]
    return {"mains": near[0]} if near else {}


def _after_verdict(state: State) -> Evidence:
    if state.verdict in ("unknown", "none"):
        doubted = state.verdict == "unknown" and any(one.found for one in state.findings)
        return Evidence("lacks" if state.lacks and doubted else state.verdict, names=state.lacks)
    if state.verdict in state.correctable:
        device = any(one.found and one.cause.lasting and not one.in_doubt for one in state.findings)
        return Evidence("correct, extend" if device else "correct", names=tuple(state.correctable))
    # no recording in the model's range would show more
    lacks = state.lacks if state.verdict != OutOfRange.id else ()
    cause = library()[state.verdict]
    if state.extended is not None or (state.question.quick and (cause.lasting or cause.corrects)):
        return _now_and_later(state, lacks)
    if lacks:
        return Evidence("lacks", names=lacks)
    return Evidence("again" if cause.lasting else _TO_REPAIR.get(state.verdict, "repair"))


def _now_and_later(state: State, lacks: tuple[str, ...]) -> Evidence:
    """Extend the model; what the records lack comes after that."""
    figures = {"one rate": 1.0} if {RATES, HOLDS} <= set(lacks) else {}
    if state.correctable:
        return Evidence("extend, correct", figures=figures, names=(*state.correctable, *lacks))
    kind = "extend, or late" if state.verdict == Delay.id else "extend"
    return Evidence(kind, figures=figures, names=lacks)


def _to_see_more(state: State) -> Evidence:
    """Ask for what the records lack to show the causes that they could not have shown."""
    worst = max(state.detectable.get(name, np.inf) for name in state.blind)
    times = (worst / LIMITS.matters) ** 2
    figures = {"matters": PERCENT * LIMITS.matters, "times": max(np.ceil(times), 2.0)}
    if set(state.lacks) - {LENGTH} or (state.lacks and not np.isfinite(times)):
        return Evidence("inconclusive", figures=figures, names=(*state.blind, *state.lacks))
    if times > LIMITS.longer:
        return Evidence("far too noisy", figures=figures, names=state.blind)
    if state.lacks:
        short = LIMITS.short_s / float(state.problem.bins.time_s.max())
        figures["times"] = max(figures["times"], float(np.ceil(short)))
    return Evidence("too noisy", figures=figures, names=state.blind)
