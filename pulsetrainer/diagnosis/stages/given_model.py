"""The model as given: another condition, or the wrong kind of model.

So far the weights were refitted; now the model is judged as it was given, by what it predicts for these
records.

- If the output, of all records or of one, falls where the model rises, the polarity is reversed:
  `condition-change`, and all else is withdrawn.
- If a mere function of the velocity describes the output much better, the model is of the wrong kind, and
  causes sought on top of it are withdrawn, unless they leave less than a tenth of what that function
  leaves: a long lag at a high rate follows the velocity as well. If the speed matters and not only the
  direction, the force is `viscous`; otherwise the cause is `unknown`.
- If the model as given leaves less than the best model of the search, the search found only faults of its own
  coarser levels: they are withdrawn. What the given model leaves may still be more than noise, and is then
  `unknown`; otherwise the verdict is `none`, or `inconclusive` if the records lack what would show a common
  cause (rates, rests or length). What only the coarser levels hide does not count.
- The model as given may be *far off* (1 % of the span) where refitted weights are not (they leave a fifth of
  that). If a drift of the zero, or a step, then brings it near, that is the finding: refitted weights hide a
  drift that is over soon. The same holds where nothing was found, and it leaves much more than they do.
- If the model is far off on records in which the input never turned, they cannot show a change, since a first
  stroke differs from all later ones: `none` becomes `inconclusive`.
- If it is far off although it was identified from these very records, nothing can have changed since. Without
  a cause found, the verdict is then `unknown`.
- If it says itself that no model of its kind describes the device, and leaves a relevant error here too, the
  verdict is `unknown` without a cause found.
- If it is far off for none of these reasons, the device is in another condition, and `condition-change` comes
  first. If that change is all but a thousandth of the squared error, other causes would only repair the rest
  of it, and are withdrawn.

In these cases being far off is no change of condition:

- The causes found, added to the prediction of the model as given, bring it near.
- Refitted weights are far off too, on blocks that were left out: then no Preisach model describes the device.
  Without a cause found, the verdict is then `unknown`.
- The model is of the wrong kind, as these records or its own show.
- The zero alone seems to have moved, and the input left the model's range: what was switched there stays so,
  and looks like another zero.

What the raw data show stays found in every case. So does what equal loops show, unless the model is of the
wrong kind.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np

from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis import given_drift, velocity
from pulsetrainer.diagnosis.causes import condition_change, library
from pulsetrainer.diagnosis.causes.condition_change import Change, against_model, follows, left_by
from pulsetrainer.diagnosis.causes.frame import settled
from pulsetrainer.diagnosis.causes.out_of_range import OutOfRange
from pulsetrainer.diagnosis.causes.unlisted import Unlisted
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.finding import Estimate, Finding
from pulsetrainer.diagnosis.judged import Judged, added, judge, whole_and_each
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT

_CHANGED, _SPEED = "condition-change", "viscous"
_NOTHING = ("none", "inconclusive", "unknown")
_OF_THE_REST = ("slow noise", "bursts", "not accepted")  # evidence of what is left


def stage(state: State) -> State:
    """Return the state with what the records say of the model as given."""
    if state.question.given is None:
        return state
    judged = judge(state, state.question.given)
    said: list[Evidence] = []
    if not state.question.timed:
        told = tuple(c.id for c in library().values() if c.stage != "record" and not c.needs_time)
        said.append(Evidence("untimed", names=told))
    for record, one in whole_and_each(judged):
        turned = condition_change.turned_over(one.measured, one.predicted, one.noise)
        if turned is not None and turned.left < one.speed.velocity:
            state, more = _in_another_condition(withdrawn(state), turned, judged.polarity, record)
            return replace(state, evidence=(*said, *more, *state.evidence))
    if _wrong_kind(state, judged):
        said.append(velocity.evidence(judged.speed))
        state = _of_another_kind(state, judged)
    elif _is_as_good(state, judged):
        said.append(Evidence("given better"))
        state = _without_errors_of_its_own(withdrawn(state, state.by_contrast), judged)
        blind = state.blind and state.lacks and not state.question.quick
        if state.verdict == "none" and (_unexplained(state, judged) or blind):
            state = replace(state, verdict="unknown" if _unexplained(state, judged) else "inconclusive")
    changed = _changed(state, judged)
    if changed is not None:
        state, more = _of_a_change(state, judged, changed)
    else:
        state, more = _carried(state, judged)
    said += more
    if any(one.found and one.seen is None for one in state.findings if one.cause.id == _CHANGED):
        said += _each_against(judged)
    return replace(state, evidence=(*said, *state.evidence))


def _wrong_kind(state: State, judged: Judged) -> bool:
    """Whether a function of the velocity describes the output much better, and the causes found do not."""
    with_causes = state.scale.span * state.current.rms
    return judged.speed.wrong and with_causes > LIMITS.kind_share * judged.speed.velocity


def _misfits(state: State, judged: Judged) -> bool:
    """Whether the model as given says that it is of the wrong kind, and leaves a relevant error here too."""
    assert state.question.given is not None
    left = _left_by_given(state, judged)
    return state.question.given.is_of_wrong_kind and left > LIMITS.matters * float(np.ptp(judged.measured))


def _changed(state: State, judged: Judged) -> Change | None:
    """Return how the device changed since its model was made; None if it did not, or if nothing shows it."""
    assert state.question.given is not None
    if _wrong_kind(state, judged) or state.question.given.is_of_wrong_kind:
        return None
    refitted = state.scale.span * state.baseline.rms
    changed = against_model(judged.measured, judged.predicted, refitted, judged.noise)
    # what lay outside the range, and stays switched, looks like another zero
    outside = any(one.cause == OutOfRange.id for _, one in state.firings)
    return None if changed is not None and changed.kind == "shifted" and outside else changed


def _of_a_change(state: State, judged: Judged, changed: Change) -> tuple[State, list[Evidence]]:
    """Decide what a difference between the device and the model as given may be."""
    if all(_is_one_stroke(one.input) for one in judged.records):
        given = judged.left_by(judged.predicted) / changed.span
        nothing = state.verdict == "none"
        said = Evidence("one stroke", figures={"given": PERCENT * given})
        return (replace(state, verdict="inconclusive") if nothing else state), [said]
    if is_its_own(state):  # nothing can have changed since
        nothing = state.verdict in ("none", "inconclusive")
        state = replace(state, verdict="unknown") if nothing else state
        return state, _not_carried(state, judged)
    if _brought_near(state, judged):
        return state, []
    return _drifted(state, judged, changed.left) or _far_off(state, judged, changed)


def _is_one_stroke(u: FloatArray) -> bool:
    """Whether an input (n,) never turns."""
    way = np.sign(np.diff(settled(u, LIMITS.no_turn * float(np.ptp(u)))))
    return bool(np.ptp(way[way != 0.0]) == 0.0) if way.any() else True


def _carried(state: State, judged: Judged) -> tuple[State, list[Evidence]]:
    """Say what is known of the model as given where no other condition shows."""
    said = _not_carried(state, judged)
    if said and not is_its_own(state):
        gain, offset = condition_change.carried(judged.measured, judged.predicted)
        left = root_mean_square(judged.measured - gain * judged.predicted - offset)
        if drifted := _drifted(state, judged, left):
            return drifted
    if state.verdict in _NOTHING and _misfits(state, judged):
        return replace(state, verdict="unknown"), []
    return state, said


def _not_carried(state: State, judged: Judged) -> list[Evidence]:
    """Where nothing was found, say if the model as given leaves much more than refitted weights do."""
    refitted = state.scale.span * state.baseline.rms
    small = max(LIMITS.given_worse * refitted, LIMITS.matters * float(np.ptp(judged.measured)))
    if state.verdict not in _NOTHING or _left_by_given(state, judged) <= small:
        return []
    left = {"given": root_mean_square(judged.measured - judged.predicted), "refitted": refitted}
    percent = PERCENT / float(np.ptp(judged.measured))
    kind = "given worse, own" if is_its_own(state) else "given worse"
    return [Evidence(kind, figures={name: percent * size for name, size in left.items()})]


def is_its_own(state: State) -> bool:
    """Whether the model as given was identified from these very records."""
    assert state.question.given is not None
    model = state.question.given.model
    if model.fit is None or not model.fit.output.size:
        return False
    # records have polarity 1; those of the fit are thinned, and what came before their first end is left out
    own = iter(np.concatenate([model.polarity * one.output for one in state.question.records]).tolist())
    return all(value in own for value in model.fit.output.tolist())


def _each_against(judged: Judged) -> Iterator[Evidence]:
    """Yield, for each record, how far it is from the model as given, and in what way."""
    for k, (record, left) in enumerate(zip(judged.records, judged.residuals, strict=True)):
        kept = record.counts
        measured, error = record.output[kept], left[kept]
        figures = {
            "given": PERCENT * root_mean_square(error) / float(np.ptp(measured)),
            "shift": judged.polarity * float(np.mean(error)),
            "times": condition_change.carried(measured, measured - error)[0],
        }
        yield Evidence("each", _CHANGED, figures, record=k)


def _brought_near(state: State, judged: Judged) -> bool:
    """Whether the causes found, added to the prediction of the model as given, describe the records."""
    found = {one.cause.id for one in state.findings if one.found and not one.in_doubt}
    terms = [term for term in state.current.terms if term.cause.id in found]
    if not terms or not state.extends:
        return False
    said = judged.predicted + judged.kept(added(state, terms))
    if Unlisted.id in found:  # a learned curve is known but for a constant
        said = said + np.mean(judged.measured - said)
    return judged.is_near(said)


def _drifted(state: State, judged: Judged, otherwise: float) -> tuple[State, list[Evidence]] | None:
    """Return the state with the drift or step that the model as given shows; None if it shows none."""
    told = given_drift.told(state, judged, otherwise)
    if told is None:
        return None
    finding, fitted = told
    if len(fitted.terms) == 1:  # what was found beside another drift does not bring the given model nearer
        state = replace(withdrawn(state), extends=state.extends)
    assert finding.seen is not None
    return _first(replace(state, current=fitted, repeated=fitted), finding), [finding.seen]


def _far_off(state: State, judged: Judged, changed: Change) -> tuple[State, list[Evidence]]:
    """Distinguish another condition from a device that refitted weights do not describe either."""
    span, percent = state.scale.span, PERCENT / changed.span
    given = judged.left_by(judged.predicted)
    left_out = span * _left_out(state)
    if np.isnan(left_out) or follows(left_out, given):
        return _in_another_condition(state, changed, judged.polarity)
    if state.correctable and state.is_whole(state.current):
        return state, []  # what the measurement did is all that the parts differ by
    figures = {"given": given, "refitted": span * state.baseline.rms, "left_out": left_out}
    said = Evidence("not carried over", figures={name: percent * size for name, size in figures.items()})
    nothing = state.verdict in ("none", "inconclusive")
    return (replace(state, verdict="unknown") if nothing else state), [said]


def _left_out(state: State) -> float:
    """Rms error of refitted weights on blocks that were left out, less noise; NaN for too few blocks."""
    floor = state.floor.quick
    return float(np.sqrt(max(state.held_out.error(state.baseline) / floor.count - floor.white**2, 0.0)))


def _is_as_good(state: State, judged: Judged) -> bool:
    """Whether the model as given leaves no more than the search's best.

    To withdraw a cause, both sides must contain the same noise. Where no cause was found, nothing can be
    withdrawn, and only the given model's own error counts, without noise.
    """
    fitted = [one for one in state.findings if one.found and one.cause.stage != "record"]
    if any(one.cause.id not in state.by_contrast for one in fitted):
        left = root_mean_square(state.problem.bins.average(judged.residuals))
    else:
        left = _left_by_given(state, judged)
    return left <= state.scale.span * state.left_rms


def _without_errors_of_its_own(state: State, judged: Judged) -> State:
    """Return the state without what it says of what is left, if that is mostly an error of coarser levels."""
    if _left_by_given(state, judged) > 0.5 * state.scale.span * state.baseline.rms:
        return state
    return replace(state, evidence=tuple(one for one in state.evidence if one.kind not in _OF_THE_REST))


def _left_by_given(state: State, judged: Judged) -> float:
    """Rms error of the model as given, without the noise of single samples; averages hold slow noise too."""
    return left_by(judged.measured, judged.predicted, state.scale.span * state.floor.quick.noise)


def _unexplained(state: State, judged: Judged) -> bool:
    """Whether more than noise is left both by the model as given and by refitted weights."""
    span = state.scale.span
    left = _left_by_given(state, judged)
    if state.question.quick or left <= LIMITS.unexplained_span * span * state.floor.span:
        return False
    return replace(state, current=state.baseline).unexplained


def withdrawn(state: State, told: Collection[str] = ()) -> State:
    """Return a state in which only what the raw data show, and the causes in ``told``, stay found."""
    findings = tuple(
        one if one.cause.stage == "record" or one.cause.id in told else replace(one, found=False)
        for one in state.findings
    )
    gone = {one.cause.id for one in findings if not one.found}
    of_all = ("extended", "not whole")
    evidence = tuple(one for one in state.evidence if one.cause not in gone and one.kind not in of_all)
    state = replace(state, findings=findings, evidence=evidence, extends=False)
    found = [one.cause.id for one in findings if one.found]
    return replace(state, verdict=next((name for name in found if name not in state.background), "none"))


def _of_another_kind(state: State, judged: Judged) -> State:
    """Withdraw what was sought on top of the wrong kind of model."""
    state, speed = withdrawn(state), judged.speed
    direction = velocity.compare(judged.records, [None] * len(judged.records), judged.residuals)
    if speed.velocity > LIMITS.speed_matters * direction.velocity:
        return replace(state, verdict="unknown")
    explains = PERCENT * (1.0 - (speed.velocity / speed.preisach) ** 2)
    return _first(
        state,
        Finding(
            library()[_SPEED],
            found=True,
            explains_percent=explains,
            held_out_gain_percent=float("nan"),
            seen=velocity.evidence(speed),
        ),
    )


def _in_another_condition(
    state: State, changed: Change, polarity: int, record: int | None = None
) -> tuple[State, list[Evidence]]:
    """Put the change of condition first; withdraw causes that only repair the rest of it."""
    said = []
    if changed.is_everything:
        cleared = withdrawn(state, state.by_contrast)
        pairs = zip(state.findings, cleared.findings, strict=True)
        gone = tuple(before.cause.id for before, after in pairs if before.found and not after.found)
        if gone:
            left = PERCENT * state.scale.span * state.baseline.rms / changed.span
            figures = {"share": PERCENT * changed.explains, "left": left}
            said.append(Evidence("overshadowed", figures=figures, names=gone))
            state = cleared
    if state.verdict != _CHANGED:
        figures = {
            "shift": polarity * changed.shift,
            "gain": PERCENT * changed.gain,
            "times": 1.0 + changed.gain,
            "left": changed.left,
        }
        said.append(Evidence(changed.kind, _CHANGED, figures, record=record))
        state = _first(state, _finding(changed, polarity, said[-1]))
    return state, said


def _finding(changed: Change, polarity: int, seen: Evidence) -> Finding:
    """Return the finding that the device is not in the condition of the model."""
    offset, gain = polarity * changed.offset, changed.gain
    sure, wide = LIMITS.normal * changed.offset_error, LIMITS.normal * changed.gain_error
    return Finding(
        library()[_CHANGED],
        found=True,
        explains_percent=PERCENT * changed.explains,
        parameters=(
            Estimate("offset", offset, "{y}", offset - sure, offset + sure),
            Estimate("gain", gain, "1", gain - wide, gain + wide),
        ),
        held_out_gain_percent=float("nan"),
        seen=seen,
    )


def _first(state: State, finding: Finding) -> State:
    """Put a finding before all others, and make it the verdict."""
    others = tuple(one for one in state.findings if one.cause is not finding.cause)
    return replace(state, findings=(finding, *others), verdict=finding.cause.id)
