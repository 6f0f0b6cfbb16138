"""Jumps: the raw data are searched again, now that causes are known.

Some gates can be set off by other causes: a hum, too, looks like jumps between flat runs. Such a gate is
applied once more to the output less what the causes found add to it, and its finding is dropped if it no
longer fires.

The other way round, some sticking shows only in what the model leaves: sticking that is smaller than the
noise, or that was recorded at one rate only. If more is left there than noise from sample to sample, by a
relevant amount, the residual is searched for it (decision 044). Jumps that are not far larger than the coarse
steps of the output are those steps. Nor is it searched if the model as given says that no model of its kind
describes the device: the errors of such a model come again on every stroke, as jumps do. What was already
taken out of a record (`correct`) is not tested again, and neither is what remains of it: coarse steps that
were smoothed still have flat runs.
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis.causes import library, taken_out, with_gates
from pulsetrainer.diagnosis.raw import Firing, Raw
from pulsetrainer.diagnosis.scale import Scale
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


def stage(state: State) -> State:
    """Return the state without the gates that no longer fire, and with those that fire on the residual."""
    kept = tuple((k, firing) for k, firing in state.firings if not _explained(state, k, firing))
    state = replace(state, firings=kept)
    floor = state.floor.quick  # jumps are heard as slow noise
    given = state.question.given
    if state.current.squares - floor.squares <= floor.relevant or (given and given.is_of_wrong_kind):
        return state
    out = taken_out(name for one in state.question.corrected for name in one)
    out |= {firing.cause for _, firing in kept}
    left = [cause.gate_left(state.current) for cause in with_gates(out)]
    seen = [(0, _in_its_unit(firing, state.scale)) for firing in left if firing is not None]
    steps = LIMITS.steps_apart * max((f.value for _, f in kept if f.cause == "quantisation"), default=0.0)
    larger = [one for one in seen if one[1].value > steps]
    return replace(state, firings=tuple(sorted((*kept, *larger), key=_order)))


def _order(firing: tuple[int, Firing]) -> int:
    """Place of a firing among others: coarse steps come last, the rest in the order found."""
    return int(firing[1].cause == "quantisation")


def _in_its_unit(firing: Firing, scale: Scale) -> Firing:
    """Return a firing on the residual, all of whose figures are sizes, in the unit of the record."""
    factor = scale.of_unit(firing.unit)
    figures = {name: factor * size for name, size in firing.figures.items()}
    return replace(firing, value=factor * firing.value, figures=figures)


def _explained(state: State, k: int, firing: Firing) -> bool:
    """Whether what a gate saw on record ``k`` is only what the causes found add to the output."""
    cause, terms = library()[firing.cause], state.current.terms
    if not cause.doubted or not terms:
        return False
    record, simulator = state.problem.records[k], state.current.simulator
    added = simulator.full(terms)[k] - simulator.inner(terms)[k]
    plane = state.problem.plane
    return cause.gate(Raw(replace(record, output=record.output - added), plane.low, plane.high)) is None
