"""Diagnose: what a model gets wrong on some runs, the cause by name, and what to measure next."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.artefacts import Cause, Diagnosis, Extension, Model, Parameter, Profile, Run
from pulsetrainer.core.identification import coverage
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis import residual, wording
from pulsetrainer.diagnosis.extended import seen_input
from pulsetrainer.diagnosis.fitting import weights_for
from pulsetrainer.diagnosis.problem import problem_for
from pulsetrainer.diagnosis.selection import diagnose
from pulsetrainer.errors import DataError, UsageError
from pulsetrainer.files import atomic_write, provenance, store
from pulsetrainer.steps import given_model
from pulsetrainer.steps.modelling import known_from, parts_of, predict, step_of

if TYPE_CHECKING:
    from pulsetrainer.diagnosis.answer import Answer, Finding
    from pulsetrainer.steps.context import Context

FASTEST_HZ = 1000.0  # more samples a second are averaged down
MOST_LEVELS = 64  # of the extended model: the joint refit holds dense rows
_TRACE_SAMPLES = 6000
_GAP = 1.5  # median steps
_MOST_FILLED = 0.5  # of a record on even steps: beyond that it is not one record


@dataclass(frozen=True, slots=True)
class Options:
    """Which runs, which model."""

    runs: tuple[Path, ...]
    model: Path
    output: Path
    html: Path | None = None
    quick: bool = False
    seed: int = 0  # of the simulated null
    force: bool = False


@dataclass(frozen=True, slots=True)
class Result:
    """The diagnosis and where it is."""

    output: Path
    html: Path | None
    diagnosis: Diagnosis
    seconds: float


def run(options: Options, context: Context) -> Result:
    """Diagnose runs against a model and store what was found.

    Raises
    ------
    UsageError
        An output exists, or no run was given.
    DataError
        Runs and model differ in their units or ranges, a run has no time, or nothing varies.
    """
    begun = time.perf_counter()
    for path in (options.output, options.html):
        if path is not None:
            atomic_write.check_output(path, options.force)
    if not options.runs:
        raise UsageError("diagnose needs at least one run", hint="pulsetrainer capture diagnostic -o run.h5")
    model = store.read(options.model, Model)
    runs = [store.read(path, Run) for path in options.runs]
    low, high = float(model.edges[0]), float(model.edges[-1])
    records = []
    for path, one in zip(options.runs, runs, strict=True):
        _check_fits(path, one, options.model, model)
        records += [measured_of(path, part, model.polarity, low, high) for part in parts_of(one)]
        if not one.complete:
            context.note(f"{path} is incomplete; diagnosing the {one.input.size} samples it has")
    answer = diagnose(
        records,
        low,
        high,
        rng=np.random.default_rng(options.seed),
        quick=options.quick,
        progress=lambda share: context.progress(0.9 * share),
    )
    diagnosis = given_model.judged(_artefact(answer, runs, records, model), answer, records, model, runs[0])
    header = provenance.make_header(
        f"Diagnosis of {', '.join(path.stem for path in options.runs)}",
        argv=context.argv,
        now=context.now(),
        parameters={"quick": options.quick, "seed": options.seed},
        inputs=provenance.digests([*options.runs, options.model]),
        ancestors=[store.read_header(path) for path in (*options.runs, options.model)],
        libraries=provenance.library_versions(),
    )
    store.write(options.output, diagnosis, header, overwrite=options.force)
    if options.html is not None:
        from pulsetrainer.report.diagnosis_html import render_diagnosis

        page = render_diagnosis(
            diagnosis,
            title=header.title,
            created=header.created,
            provenance_json=header.provenance.to_json(),
            history=header.history,
        )
        with atomic_write.replacing(options.html, overwrite=options.force) as temporary:
            temporary.write_text(page, encoding="utf-8")
    context.progress(1.0)
    return Result(options.output, options.html, diagnosis, time.perf_counter() - begun)


def _check_fits(path: Path, one: Run, model_path: Path, model: Model) -> None:
    """Raise DataError unless run and model can be of one device."""
    if (one.input_unit, one.output_unit) != (model.input_unit, model.output_unit):
        raise DataError(
            f"{path} is in {one.input_unit} and {one.output_unit}, but {model_path} was identified in "
            f"{model.input_unit} and {model.output_unit}",
            hint="use a model of the same device, in the same units",
        )
    if model.reading != "continuous":
        raise DataError(
            f"{model_path} reads its weights as relays, whose steps would be taken for causes",
            hint="identify it with the continuous reading: pulsetrainer identify RUN.h5 -o model.h5",
        )
    low, high = float(model.edges[0]), float(model.edges[-1])
    u = one.input[np.isfinite(one.input)]
    if u.size == 0 or np.mean((u >= low - 0.02 * (high - low)) & (u <= high + 0.02 * (high - low))) < 0.5:
        span = f"{u.min():.4g} .. {u.max():.4g}" if u.size else "nothing"
        raise DataError(
            f"most of the input of {path} ({span} {one.input_unit}) lies outside the range of {model_path} "
            f"({low:.4g} .. {high:.4g} {model.input_unit})",
            hint="is the model of another device? identify this one, then diagnose",
        )


def measured_of(path: Path, one: Run, polarity: int, low: float, high: float) -> Record:
    """Return a run on even time steps; filled gaps and samples that are not numbers have no weight.

    Raises
    ------
    DataError
        The run is too short, or has more gaps than samples.
    """
    step = step_of(one)
    if one.input.size < 100:
        raise DataError(
            f"{path} has only {one.input.size} samples, too few to tell causes apart", hint="record longer"
        )
    if step is None or one.time_s is None:
        return _untimed(path, one, polarity, low, high)
    per = max(1, round(1.0 / (FASTEST_HZ * step)))
    t = one.time_s - one.time_s[0]
    count = round(float(t[-1]) / step) + 1
    if count * _MOST_FILLED > t.size:
        raise DataError(
            f"{path} has {t.size} samples where even steps of {step:.4g} s would have {count}: "
            "most of it is gaps",
            hint="cut it into several runs at the gaps",
        )
    good = np.isfinite(one.input) & np.isfinite(one.output)
    if good.sum() < 100:
        raise DataError(f"{path} holds {good.sum()} samples that are numbers", hint="record it again")
    grid = np.arange(count) * step
    following = np.clip(np.searchsorted(t[good], grid), 1, int(good.sum()) - 1)
    hole = t[good][following] - t[good][following - 1] > _GAP * step
    u, y = np.interp(grid, t[good], one.input[good]), np.interp(grid, t[good], one.output[good])
    reference = None if one.reference is None else np.interp(grid, t, one.reference)
    weight = np.where(hole, 0.0, 1.0)
    weight[: known_from(u, low, high)] = 0.0
    if per > 1:
        cut = count // per * per
        u, y, weight = (x[:cut].reshape(-1, per).mean(axis=1) for x in (u, y, weight))
        reference = None if reference is None else reference[:cut].reshape(-1, per).mean(axis=1)
        weight = np.where(weight < 1.0, 0.0, 1.0)
    return Record(u, polarity * y, weight, dt_s=step * per, reference=reference)


def _untimed(path: Path, one: Run, polarity: int, low: float, high: float) -> Record:
    """Return a run of which only the order of the samples is known."""
    if not (np.isfinite(one.input).all() and np.isfinite(one.output).all()):
        raise DataError(f"{path} holds samples that are no numbers", hint="record it again")
    weight = np.ones(one.input.size)
    weight[: known_from(one.input, low, high)] = 0.0
    return Record(one.input, polarity * one.output, weight, reference=one.reference)


def _artefact(answer: Answer, runs: Sequence[Run], records: Sequence[Record], model: Model) -> Diagnosis:
    problem = answer.problem
    span = float(np.ptp(problem.measured))
    errors = [
        (predict(model, r.input, r.step) * model.polarity - r.output)[r.sample_weight > 0]
        for r in answer.problem.records
    ]
    left = root_mean_square(np.concatenate(errors))
    after_residual = answer.final.residual
    extended = None if answer.quick else _extended(answer, model)
    thin = slice(None, None, max(1, problem.bins.count // _TRACE_SAMPLES))
    ends = np.cumsum([0.0] + [r.input.size * r.step for r in records])
    time_s = problem.bins.time_s + ends[problem.bins.record]
    sign = model.polarity
    first = runs[0]
    percent = 100.0 / span
    lacks = residual.excitation_limits(problem)
    units = {"u": first.input_unit, "y": first.output_unit}
    return Diagnosis(
        verdict=answer.verdict,
        quick=answer.quick,
        rms=left,
        rms_percent=left * percent,
        noise_percent=answer.noise * percent,
        static_percent=root_mean_square(answer.baseline.residual) * percent,
        extended_percent=root_mean_square(after_residual) * percent,
        floor_percent=answer.floor * percent,
        causes=tuple(_cause(finding, units) for finding in answer.findings),
        evidence=tuple(wording.evidence(answer, lacks)),
        next_experiment=wording.next_experiment(answer, lacks),
        profiles=_profiles(answer, units),
        time_s=time_s[thin],
        input=problem.bins.average([r.input for r in problem.records])[thin],
        output=sign * problem.measured[thin],
        before=sign * (problem.measured - answer.baseline.residual)[thin],
        after=sign * (problem.measured - answer.final.residual)[thin],
        extended=extended,
        input_unit=first.input_unit,
        output_unit=first.output_unit,
    )


def _unit(text: str, units: dict[str, str]) -> str:
    return text.replace("{u}", units["u"]).replace("{y}", units["y"])


def _cause(finding: Finding, units: dict[str, str]) -> Cause:
    return Cause(
        cause=finding.cause.id,
        found=finding.found,
        p_value=finding.p_value,
        explains_percent=finding.explains_percent,
        held_out_gain_percent=finding.held_out_gain_percent,
        parameters=tuple(
            Parameter(e.name, e.value, _unit(e.unit, units), e.lower, e.upper) for e in finding.parameters
        ),
        confounded_with=finding.confounded_with,
        text=finding.text or finding.cause.title,
    )


def _profiles(answer: Answer, units: dict[str, str]) -> tuple[Profile, ...]:
    before, after = answer.baseline.residual, answer.final.residual
    found = [
        Profile(
            group.name,
            _unit(group.unit, units),
            group.at,
            residual.rms_by(group, before),
            residual.rms_by(group, after),
            units["y"],
        )
        for group in residual.groups(answer.problem)
    ]
    frequency, first = residual.spectrum(answer.problem, before)
    _, second = residual.spectrum(answer.problem, after)
    return (*found, Profile("frequency", "Hz", frequency, first, second, units["y"]))


def _extended(answer: Answer, model: Model) -> Model | None:
    """Return the model on its own levels with weights refitted together with the causes found."""
    lasting = [pair for pair in answer.terms if pair[0].cause.lasting]
    if not lasting:
        return None
    low, high = float(model.edges[0]), float(model.edges[-1])
    plane = Plane(model.edges)
    if plane.n_h > MOST_LEVELS or not np.allclose(np.diff(plane.edges), np.diff(plane.edges)[0]):
        plane = Plane.uniform(low, high, min(plane.n_h, MOST_LEVELS))
    problem = problem_for(answer.problem.records, low, high, plane.n_h)
    if not np.allclose(np.diff(plane.edges), np.diff(plane.edges)[0]):
        raise DataError("only models with even levels can be extended", hint="identify the model again")
    fitted = weights_for(problem, answer.final.terms, None)
    operator = fitted.simulator.operator
    seen = [
        seen_input(answer.final.terms, record.output, frame)
        for record, frame in zip(problem.records, problem.frames, strict=True)
    ]
    units = {"u": model.input_unit, "y": model.output_unit}
    return Model(
        edges=plane.edges,
        weights=operator.weights,
        offset=model.polarity * operator.offset,
        covered=coverage(plane, seen),
        weights_unit=model.weights_unit,
        input_unit=model.input_unit,
        output_unit=model.output_unit,
        input_quantity=model.input_quantity,
        output_quantity=model.output_quantity,
        reading="continuous",
        polarity=model.polarity,
        extensions=tuple(
            Extension(
                term.cause.id,
                tuple(Parameter(e.name, e.value, _unit(e.unit, units), e.lower, e.upper) for e in estimates),
            )
            for term, estimates in lasting
        ),
    )
