"""Verdict: the strongest cause, or that it is unknown.

If more than half of what can be explained is left, and enough to matter, the verdict is the jagged cause that
a gate saw, since no refit takes away what it leaves; without such a cause it is `unknown`, whatever else was
found. Otherwise the verdict is the cause that explains most, then what a gate on the raw data saw; the gate
comes first if all others together are below half a per cent of the span. Where nothing was found it is
`none`, or `inconclusive` if the record could not have shown half a per cent of the span of a common cause. A
hum no larger than the noise is found and reported, but is not a verdict; nor are steps that noise averages
out, a drift or step no larger than slow noise, or what may be one, or a cause that is in doubt (`rivals`,
`repetition`). If all branches of a loop pass through one point within it, as those of a memristor do,
anything left beyond the noise from sample to sample is `unknown`: no Preisach operator has such a loop, and
any cause explains some of it.
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.finding import Estimate, Finding
from pulsetrainer.diagnosis.raw import Firing
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT


def stage(state: State) -> State:
    """Return the state with all findings in order, and the verdict."""
    ranked = sorted(state.findings, key=lambda one: -one.explains_percent)
    found, rest = [one for one in ranked if one.found], [one for one in ranked if not one.found]
    gated = _gated(state)
    fired = {one.cause.id for one in gated}
    silent = [Finding(c, False) for c in library().values() if c.stage == "record" and c.id not in fired]
    most = state.rms_of(sum(one.explains_percent for one in found) / PERCENT)
    seen = [*gated, *found] if most < LIMITS.matters * state.floor.span else [*found, *gated]
    told = replace(state, findings=tuple(seen))
    sure = [one for one in seen if not one.in_doubt and one.cause.id not in told.background]
    verdict = next((one.cause.id for one in sure), "none")
    if verdict == "none" and state.blind and not state.question.quick:
        verdict = "inconclusive"
    if told.believed.unexplained and not state.question.quick:
        verdict = next((one.cause.id for one in sure if one.cause.jagged), "unknown")
    return replace(state, findings=(*seen, *rest, *silent), verdict=verdict)


def _gated(state: State) -> list[Finding]:
    """Findings of the gates, one a cause: that of the first record where it fired."""
    found: dict[str, Finding] = {}
    several = len(state.problem.records) > 1
    for k, firing in state.firings:
        if firing.cause not in found:
            found[firing.cause] = _seen(firing, k if several else None)
    return list(found.values())


def _seen(firing: Firing, record: int | None) -> Finding:
    low, high = firing.value - firing.spread, firing.value + firing.spread
    return Finding(
        library()[firing.cause],
        found=True,
        parameters=(Estimate("size", firing.value, firing.unit, low, high),),
        held_out_gain_percent=float("nan"),
        seen=replace(firing.evidence, record=record),
    )
