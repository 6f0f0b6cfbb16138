"""Verdict: the strongest cause, or that it is unknown.

A cause is *jagged* if it leaves what no refit can take away, such as sticking or coarse steps. Much is
*unexplained* if more than half of what can be lowered is left, and if that is relevant several times over and
more than 0.2 % of the span. The verdict is the first of these that applies:

- If much is unexplained: the jagged cause that a gate saw, or without one `unknown`, whatever else was found.
- The cause that explains most; without one, what a gate on the raw data saw. The gate comes first if all
  other causes together explain less than half a per cent of the span.
- If there is neither: `inconclusive`, if the record could not have shown half a per cent of the span of a
  common cause; otherwise `none`.

An input that its recorder clips comes before all of these: see `clipped-input`. Nothing else is then sought.

Some findings are reported, but never become the verdict:

- a hum no larger than the noise;
- steps that noise averages out;
- a drift or step no larger than slow noise, or a cause that may be such a one;
- a cause that is in doubt (`rivals`, `repetition`, `begin`), unless the doubt is of its size only: a
  parameter at the end of the range that was searched.

All branches of a loop may pass through one point within it, as those of a memristor do. No Preisach operator
has such a loop, and any cause explains some of it. Anything left beyond the noise from sample to sample is
then `unknown`.
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis.causes import library, with_gates
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
    silent = [Finding(cause, False) for cause in with_gates(fired)]
    most = state.rms_of(sum(one.explains_percent for one in found) / PERCENT)
    seen = [*gated, *found] if most < LIMITS.matters * state.floor.span else [*found, *gated]
    told = replace(state, findings=tuple(seen))
    sure = [one for one in seen if not one.in_doubt and one.cause.id not in told.background]
    verdict = next((one.cause.id for one in sure), "none")
    if verdict == "none" and state.blind and not state.question.quick:
        verdict = "inconclusive"
    if told.believed.unexplained and not state.void and not state.question.quick:
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
