"""The artefact made from the final state of a diagnosis, with the model extended by what was found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pulsetrainer.artefacts import (
    Cause,
    Dependence,
    Diagnosis,
    Extension,
    Model,
    Parameter,
    Profile,
    Recorded,
    Seen,
)
from pulsetrainer.artefacts.units import unit_of, with_unit
from pulsetrainer.core.coverage import coverage, covers_range
from pulsetrainer.core.initial_state import estimated_start
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray, ends_of
from pulsetrainer.core.record import counted_output
from pulsetrainer.diagnosis import advice_wording, residual, wording
from pulsetrainer.diagnosis.causes.base import Cause as Asked
from pulsetrainer.diagnosis.causes.condition_change import ConditionChange
from pulsetrainer.diagnosis.causes.unlisted import Unlisted
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.finding import Estimate, Finding
from pulsetrainer.diagnosis.fitting import added
from pulsetrainer.diagnosis.forms import completed, levels_of, static_behind
from pulsetrainer.diagnosis.learned import learned
from pulsetrainer.diagnosis.prediction import operator_of
from pulsetrainer.diagnosis.raw import noise_of
from pulsetrainer.diagnosis.stages.raw_data import followed, masked_by
from pulsetrainer.diagnosis.state import Given, State
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT

Words = dict[str, str]  # units by "u" and "y", and what a text needs


def diagnosis_of(state: State) -> Diagnosis:
    """Return the diagnosis of a model, as the noun that it is."""
    given = state.question.given
    assert given is not None
    problem, model = state.problem, given.model
    scale = state.scale
    percent = PERCENT / float(np.ptp(problem.measured))
    of_samples = scale.span * percent_of_samples(state)
    rms, extended = rms_of(state, model, estimate=True), state.current if state.extends else state.baseline
    in_use, extended_model = float("nan"), state.extended
    if extended_model is not None:
        errors = np.concatenate(errors_of(state, extended_model, undone(state))) / scale.span
        in_use = root_mean_square(errors)
        extended_model = replace(extended_model, seen=_seen(state, model, of_samples * errors))
    thin = slice(None, None, max(1, problem.bins.count // LIMITS.trace_samples))
    bench = advice_wording.Bench(
        scale,
        model.input_unit,
        state.question.timed,
        given.ours,
        given.input_quantity,
        given.output_quantity,
        ends_of([record.input for record in problem.records]),
        model.output_unit,
    )
    sign, words = model.polarity, _words(given) | bench.numbers()
    empty = float(scale.outputs(np.asarray(extended.simulator.frames[0].zero)))
    words["empty"] = with_unit(f"{sign * empty:.4g}", model.output_unit)
    dependences = learned(state, words)
    found = Diagnosis(
        verdict=state.verdict,
        quick=state.question.quick,
        rms=rms,
        rms_percent=rms * of_samples / scale.span,
        # slow noise, or a hum, may come out larger; no more than all that is left is noise
        noise_percent=float(np.nanmin((_noise_of(state), rms / scale.span, in_use))) * of_samples,
        static_percent=state.baseline.rms * percent,
        extended_percent=extended.rms * percent,
        floor_percent=state.floor_rms * percent,
        causes=tuple(
            one for finding in state.findings for one in _causes(state, finding, words, dependences)
        ),
        evidence=_said(model, [wording.sentence(one, words) for one in state.evidence]),
        next_experiment="",
        profiles=_profiles(state, words),
        time_s=scale.second * problem.time_s[thin],
        input=scale.inputs(problem.bins.average([r.input for r in problem.records]))[thin],
        output=sign * scale.outputs(problem.measured)[thin],
        before=sign * scale.outputs(problem.measured - state.baseline.residual)[thin],
        after=sign * scale.outputs(problem.measured - state.current.residual)[thin],
        extended=extended_model,
        extended_rms_percent=in_use * of_samples,
        input_unit=model.input_unit,
        output_unit=model.output_unit,
        input_quantity=model.input_quantity,
        output_quantity=model.output_quantity,
        held_out_gain_percent=_held_out_gain(state),
        lacks=state.lacks,
        whole=state.is_whole(extended) and state.verdict != "unknown",
        dependences=dependences,
        notes=state.question.notes,
        model=model.fingerprint,
        records=tuple(
            Recorded(
                name, float("nan") if r.dt_s is None else r.dt_s * scale.second, f.begin_s * scale.second
            )
            for name, r, f in zip(given.fingerprints, problem.records, problem.frames, strict=True)
        ),
        correctable=tuple(state.correctable),
        polarity=sign,
        as_measured=True,
        empty=empty,
        in_model=state.in_model,
    )
    said = advice_wording.advice(_advice(state), bench, found.next_command, found.correctable)
    return replace(found, next_experiment=said)


def _advice(state: State) -> Evidence:
    """Return the advice, in words of its own for a quick screen and for what was seen and is not named."""
    one, tried = state.advice, state.scores.scores[:1]
    if state.question.quick and one.kind.startswith("extend"):
        return replace(one, kind="extend, quick")
    seen = tuple(dict.fromkeys(finding.cause.id for finding in state.findings if finding.found))
    if one.kind == "none" and state.correctable:
        return Evidence("none, correct", names=(*state.correctable, *one.names))
    if one.kind == "none" and seen:
        return Evidence("none, seen", names=(*seen, *one.names))
    if one.kind == "none" and tried and tried[0].p_value <= LIMITS.p_max:
        small = "none, small, quick" if state.question.quick else "none, small"
        return Evidence(small, names=(tried[0].cause.id, *one.names))
    if one.kind == "none" and state.question.quick:
        return replace(one, kind="none, quick")
    return one


def _said(model: Model, evidence: Sequence[str]) -> tuple[str, ...]:
    """Return the evidence, and first what the model says of its own record, if that is new."""
    warning = f"{model.fit.warning}." if model.fit and model.fit.warning else ""
    known = warning in ("", *evidence)
    return tuple(evidence) if known else (f"Of the model as given: {warning}", *evidence)


def _held_out_gain(state: State) -> float:
    """Per cent of the reducible error on blocks that were not fitted, which all causes together remove."""
    if state.current is state.baseline or not state.extends:
        return float("nan")
    return PERCENT * state.held_out.gain_told(state.baseline, state.current, state.floor)


def _words(given: Given) -> Words:
    unit, of_input = given.model.output_unit, given.model.input_unit
    return {
        "input": given.input_quantity,
        "output": given.output_quantity,
        "u": given.model.input_unit,
        "y": unit,
        "in_y": with_unit("", unit),
        "in_u": with_unit("", of_input),
        **{wording.recording(k, {}): name for k, name in enumerate(given.names)},
    }


def _seen(state: State, model: Model, errors: FloatArray) -> Seen:
    """Return what the records held, and how large ``errors`` (n,) of single samples are, of the span."""
    records = state.question.records
    inputs = np.concatenate([one.input[one.counts] for one in records])
    outputs = model.polarity * np.concatenate([one.output[one.counts] for one in records])
    missed = root_mean_square(errors), float(np.max(np.abs(errors)))
    return Seen.of(missed, inputs, outputs, (model.input_unit, model.output_unit))


def rms_of(state: State, model: Model, faults: Sequence[FloatArray] = (), *, estimate: bool = False) -> float:
    """Rms error of a model, as given or extended, over the single samples with weight: see ``errors_of``."""
    return root_mean_square(np.concatenate(errors_of(state, model, faults, estimate=estimate)))


def errors_of(
    state: State, model: Model, faults: Sequence[FloatArray] = (), *, estimate: bool = False
) -> list[FloatArray]:
    """Errors of a model at the samples with weight of each record (n,), of an output that rises.

    ``faults`` holds what faults of the measurement did to each record (n,), which is no error of a model.
    ``estimate``: a model without extensions begins, as in `evaluate`, where it predicts best; else at rest.
    """
    question, errors, start = state.question, [], None
    counted = [
        masked_by(own, [firing for record, firing in state.firings if record == k])
        for k, own in enumerate(question.records)
    ]
    if estimate and not model.extensions:
        turned = [replace(one, output=model.polarity * one.output) for one in counted]
        start, _ = estimated_start(operator_of(model), turned)
    for k, (own, masked) in enumerate(zip(question.records, counted, strict=True)):
        said = followed(model, masked, question.stamps[k] if question.stamps else None, start)
        fault = faults[k] if faults else 0.0
        errors.append((said + fault - own.output)[masked.counts])
    return errors


def with_its_offset(state: State, model: Model, faults: Sequence[FloatArray]) -> Model:
    """Return a model whose mean error on the first record, of which it goes on, is not relevant.

    A cause that acts on the gain does so about the output of empty memory, which lies elsewhere on the levels
    of the model than on those of the search. The dual form has no offset of its output.
    """
    mean = float(np.mean(errors_of(state, model, faults)[0]))
    relevant = state.floor.relevant / state.floor.count * state.scale.span**2
    if model.form == "dual" or mean**2 <= relevant:
        return model
    return replace(model, offset=model.offset - model.polarity * mean)


def faults_of(state: State) -> tuple[Term, ...]:
    """Return the faults of the measurement in the model that goes on, which can be taken out of a record."""
    terms = () if state.repeated is None else state.repeated.terms
    return tuple(term for term in terms if term.cause.id in state.correctable)


def undone(state: State) -> list[FloatArray]:
    """Return what these faults did to each record, at its samples (n,), polarity 1; empty without faults."""
    faults, fitted, question = faults_of(state), state.repeated, state.question
    if fitted is None or not faults:
        return []
    others = [term for term in fitted.terms if term not in faults]
    effects = added(fitted.simulator, fitted.terms, others)
    found = []
    for k, (own, record) in enumerate(zip(question.records, state.problem.records, strict=True)):
        effect = state.scale.span * effects[k]
        seconds = state.scale.second * record.step * np.arange(effect.size)
        stamps = question.stamps[k] if question.stamps else None
        at = own.time_s if stamps is None else stamps - stamps[0]
        found.append(np.interp(at, seconds, effect))
    return found


def percent_of_samples(state: State) -> float:
    """Return what makes an error of single samples, in the unit of the output, per cent of their span."""
    return PERCENT / (state.scale.span * float(np.ptp(counted_output(state.problem.records))))


def _noise_of(state: State) -> float:
    """Noise of single samples as measured, of the span of the problem; what may be a slow error is none."""
    own = [noise_of(r.output, r.sample_weight) ** 2 for r in state.question.records]
    heard = 0.0 if state.in_bursts else max(state.floor.noise**2 - state.floor.doubtful, 0.0)
    return float(np.sqrt(max(heard, float(np.mean(own)) / state.scale.span**2)))


def _parameters(
    state: State, cause: Asked, estimates: Sequence[Estimate], words: Words, *, measured: bool = False
) -> tuple[Parameter, ...]:
    """Return estimates as parameters of the output as measured; ``measured``: they are that already."""
    assert state.question.given is not None
    polarity = 1 if measured else state.question.given.model.polarity
    meanings = {q.name: q.meaning for q in cause.quantities(state.problem.frames[0])}
    meanings |= {"size": cause.size, cause.number: cause.meant}

    def told(e: Estimate) -> Parameter:
        own = words.get("seconds", "s") if e.unit == "s" else e.unit
        unit, meaning = unit_of(own, words["u"], words["y"]), meanings.get(e.name, "").format(**words)
        meaning += _within(state, e.value, own, words) if cause.sudden and e is estimates[-1] else ""
        sign = cause.sign(e.name, polarity)
        low, high = (e.lower, e.upper) if sign > 0 else (-e.upper, -e.lower)
        return Parameter(e.name, sign * e.value, unit, low, high, meaning)

    return tuple(told(e) for e in estimates)


def _within(state: State, moment: float, unit: str, words: Words) -> str:
    """Say in which of several records a moment is, and when in that one."""
    begins = [state.scale.second * frame.begin_s for frame in state.problem.frames]
    if len(begins) == 1:
        return ""
    k = max((k for k, begin in enumerate(begins) if begin <= moment), default=0)
    return f", {wording.figure(moment - begins[k])} {unit} into {wording.recording(k, words)}"


def _causes(state: State, finding: Finding, words: Words, dependences: Sequence[Dependence]) -> list[Cause]:
    """Return a finding as causes: one for each learned dependence."""
    one = _cause(state, finding, words)
    if not finding.found or finding.cause.id != Unlisted.id or not dependences:
        return [one]
    # as the curves are: of the model that goes on
    rows = _parameters(state, finding.cause, state.repeated_estimates[Unlisted.id], words)
    size = len(rows) // len(dependences)
    return [
        replace(one, text=told.text, parameters=rows[k * size : (k + 1) * size])
        for k, told in enumerate(dependences)
    ]


def _cause(state: State, finding: Finding, words: Words) -> Cause:
    # what tells the record from the model as given is told of the output as it was measured
    measured = finding.cause.id == ConditionChange.id and finding.seen is not None
    return Cause(
        cause=finding.cause.id,
        found=finding.found,
        p_value=finding.p_value,
        explains_percent=finding.explains_percent,
        held_out_gain_percent=finding.held_out_gain_percent,
        parameters=_parameters(state, finding.cause, finding.parameters, words, measured=measured),
        confounded_with=finding.confounded_with,
        text=wording.cause_text(finding, words),
        doubts=tuple(wording.DOUBTS[one] for one in finding.doubts),
        detectable_from_percent=PERCENT * state.detectable.get(finding.cause.id, float("nan")),
    )


def _profiles(state: State, words: Words) -> tuple[Profile, ...]:
    scale, unit = state.scale, words["y"]
    before, after = scale.span * state.baseline.residual, scale.span * state.current.residual
    found = [
        Profile(
            group.name,
            unit_of(group.unit, words["u"], words["y"]),
            scale.places(group.at, group.unit),
            residual.rms_by(group, before),
            residual.rms_by(group, after),
            unit,
        )
        for group in residual.groups(state.problem)
    ]
    frequency, first = residual.spectrum(state.problem, before)
    second = residual.spectrum(state.problem, after)[1]
    return (*found, Profile("frequency", "Hz", scale.places(frequency, "Hz"), first, second, unit))


def extended_model(state: State, model: Model) -> Model:
    """Return the model with the causes that repeat, its static part identified again from what they leave.

    Where what counts of the records leaves out a part of the model's range, its cells there stay as they
    were given: what a sensor clips does not count.
    """
    lasting = state.extensions
    assert state.question.given is not None
    assert state.repeated is not None
    scale, words = state.scale, _words(state.question.given)
    # the later records are brought to the condition of the first, of which the model goes on
    known = [
        t
        for t in state.repeated.terms
        if t in lasting or t in faults_of(state) or isinstance(t.cause, ConditionChange)
    ]
    partial = not covers_range([one.input[one.counts] for one in state.problem.records], 0.0, 1.0)
    behind = static_behind(state.repeated, known, model, scale, levels=levels_of(model) if partial else None)
    found = behind.identified.operator
    remembered = [one.output if model.form == "dual" else one.input for one in behind.records]
    counts = [one.counts for one in behind.records]
    covered = coverage(found.plane, [x[one] for x, one in zip(remembered, counts, strict=True)])
    if partial:
        found, covered = completed(found, covered, model, remembered, counts)
    return replace(
        model,
        edges=found.plane.edges,
        weights=found.weights,
        offset=found.offset,
        covered=covered,
        polarity=found.polarity,
        weights_lower=None,
        weights_upper=None,
        fit=None,
        coil=None,
        as_measured=True,
        extensions=tuple(_extension(state, term, words) for term in lasting),
    )


def _extension(state: State, term: Term, words: Words) -> Extension:
    kept = [Estimate(name, value, unit, value, value) for name, value, unit in term.cause.constants()]
    rows = (*map(state.scale.estimate, kept), *state.repeated_estimates[term.cause.id])
    return Extension(term.cause.id, _parameters(state, term.cause, rows, words))
