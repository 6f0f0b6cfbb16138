"""Account: what speaks for the verdict, as data.

It lists

- what the static model leaves, and what it would leave if nothing were wrong;
- for each cause found, what its gate saw, or its p-value and its share of the error;
- what is left with all causes found;
- where the rest is largest, if nothing explains it and it is more than noise;
- whether that rest is the same in two records of one input;
- whether what is taken for noise is slow, and whether the loop is pinched;
- which cause screening took for significant, if none was found in the end;
- what the records lack.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from pulsetrainer.diagnosis import equal_inputs, residual
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.unlisted import Unlisted
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.finding import Finding
from pulsetrainer.diagnosis.residual import LENGTH
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT


def stage(state: State) -> State:
    """Return the state with its evidence."""
    percent = PERCENT / float(np.ptp(state.problem.measured))
    levels = {"left": percent * state.baseline.rms, "floor": percent * state.floor_rms}
    said = [Evidence("static", figures=levels)]
    beyond = state.baseline.squares > state.floor.squares
    said += [_of(state, finding, beyond=beyond) for finding in state.findings if finding.found]
    said += [
        Evidence("background", finding.cause.id, {one.name: one.value for one in finding.parameters})
        for finding in state.findings
        if finding.cause.id in state.background
    ]
    if state.current is not state.baseline and state.believed is state:
        said.append(Evidence("extended", figures={"left": percent * state.current.rms}))
        if not state.is_whole(state.current):
            rest = float(
                np.sqrt(state.current.squares - state.floor_left.squares) / np.sqrt(state.floor.count)
            )
            said.append(Evidence("not whole", figures={"rest": percent * rest}, names=state.current.names))
    shown = {k: PERCENT * v for k, v in state.detectable.items() if v < LIMITS.told_effect}
    if state.verdict in ("none", "inconclusive") and shown:
        usual = [one.id for one in library().values() if one.common or one.drifts]
        hidden = tuple(one for one in usual if one not in shown)
        said.append(
            Evidence("would have shown, some" if hidden else "would have shown", "", shown, names=hidden)
        )
    if state.verdict in ("none", "inconclusive", "unknown") and not state.is_whole(state.current):
        said += _largest(state)
    if state.verdict in ("none", "inconclusive", "unknown") and state.floor.slow > LIMITS.slow_noise:
        figures = {"white": percent * state.floor.white, "times": state.floor.slow}
        said.append(Evidence("bursts" if state.in_bursts else "slow noise", figures=figures))
    said += equal_inputs.told(state)
    if state.verdict == "unknown" and state.pinched_at is not None:
        at = state.scale.low + state.pinched_at * state.scale.reach
        said.append(Evidence("crossed" if state.butterfly else "pinched", figures={"at": at}))
    if state.verdict in ("none", "inconclusive") and not state.question.quick:
        said += _not_accepted(state)
    if state.question.quick:
        said.append(Evidence("quick"))
    if state.lacks and (state.question.timed or state.question.given is None):  # else `given_model` says it
        said.append(Evidence("lacks", names=state.lacks))
    return replace(state, evidence=(*state.evidence, *said))


def _of(state: State, finding: Finding, *, beyond: bool) -> Evidence:
    """What speaks for one cause; its share only where there is an error ``beyond`` noise.

    The signature of a cause of the device is not cited if the records lack the rates or rests to show it.
    """
    if finding.seen is not None:
        return finding.seen
    assert finding.p_value is not None
    figures = {"p": finding.p_value, "explains": finding.explains_percent}
    listed = finding.cause.lasting and finding.cause.id != Unlisted.id  # a curve was seen in any case
    lacks = tuple(one for one in state.lacks if one != LENGTH) if listed else ()
    return Evidence("tested" if beyond else "tested, small", finding.cause.id, figures, lacks)


def _not_accepted(state: State) -> Iterator[Evidence]:
    """What screening took for significant, but the refit did not confirm: the table shows its p-value."""
    for score in state.scores.scores[:1]:
        if score.p_value <= LIMITS.p_max:
            figures = {"p": score.p_value, "explains": state.explains(score.gain)}
            yield Evidence("not accepted", figures=figures, names=(score.cause.id,))


def _largest(state: State) -> Iterator[Evidence]:
    """Where the remaining residual is largest; while the input rests is said once."""
    at_rest = False
    for group in residual.groups(state.problem):
        rms = residual.rms_by(group, state.current.residual)
        most, least = float(np.nanmax(rms)), float(np.nanmin(rms))
        if most > LIMITS.largest_at * least:
            k = int(np.nanargmax(rms))
            at, name = float(state.scale.places(group.at, group.unit)[k]), group.name
            if name == "rate":
                at, name = at * state.scale.reach, "rest" if k == 0 else name
            if name == "direction" and at == 0.0 and at_rest:
                continue
            at_rest = at_rest or name == "rest"
            yield Evidence(
                "largest", figures={"at": at, "times": min(most / least, LIMITS.largest_told)}, names=(name,)
            )
