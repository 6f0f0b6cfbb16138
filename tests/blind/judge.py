"""The judge: diagnoses a measurement and only then compares with what was hidden."""

from __future__ import annotations

import os
import time
from dataclasses import asdict, dataclass

os.environ.setdefault("OMP_NUM_THREADS", "1")

import hidden
import numpy as np

from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import weights_for
from pulsetrainer.diagnosis.held_out import HeldOut
from pulsetrainer.diagnosis.procedure import diagnose
from pulsetrainer.diagnosis.state import Question, State
from pulsetrainer.diagnosis.thresholds import LIMITS


@dataclass(frozen=True)
class Verdict:
    """One row of the table."""

    kind: str
    seed: int
    causes: tuple[str, ...]
    size_percent: float  # rms of the effect in % of the span; NaN where not measured
    noise: float  # of single samples, share of the sensor's range
    found: tuple[str, ...]
    verdict: str
    tied: tuple[str, ...]  # what the verdict could not be told from
    unique: bool  # a single name, without confounded ones
    right: bool
    in_class: bool
    errors: dict  # parameter: relative error
    covered: dict  # parameter: truth within the interval
    held_out: float  # largest gain of a cause found, % of the reducible part
    oracle_share: float  # fall of the held-out error over that with the true cause and parameters
    floor_ratio: float  # final rms over the rms of the known floor
    seconds: float  # of processor time

    def row(self):
        """As plain data."""
        return asdict(self)


def family(name):
    """All causes that look much the same."""
    return next((f for f in hidden.FAMILIES if name in f), {name})


def judge(kind: str, seed: int, *, sized: bool = False) -> Verdict:
    """Hide, measure, diagnose, compare; ``sized`` measures the size of a single effect as well."""
    case = hidden.draw(kind, seed)
    data = hidden.measure(case)
    begun = time.process_time()
    answer = diagnose(Question(data.records, 0.0, data.high, np.random.default_rng(seed)))
    seconds = time.process_time() - begun
    # the verdict is in: from here on the truth may be looked at
    found = {f.cause.id: f for f in answer.findings if f.found}
    named = answer.verdict
    tied = found[named].confounded_with if named in found else ()
    right, in_class = _compare(case, named, set(found), tied)
    errors, covered = {}, {}
    for name, truth in case.truth.items():
        for e in found[name].parameters if name in found else ():
            if e.name in truth:
                errors[f"{name}.{e.name}"] = abs(e.value - truth[e.name]) / abs(truth[e.name])
                covered[f"{name}.{e.name}"] = bool(e.lower <= truth[e.name] <= e.upper)
    held = [f.held_out_gain_percent for f in found.values() if np.isfinite(f.held_out_gain_percent)]
    return Verdict(
        kind,
        seed,
        case.causes or ((case.outside,) if case.outside else ()),
        hidden.size_percent(case, data) if sized and len(case.causes) == 1 else float("nan"),
        case.settings.get("noise", 0.0),
        tuple(found),
        named,
        tuple(tied),
        named not in ("none", "unknown") and not tied,
        right,
        in_class,
        errors,
        covered,
        max(held, default=float("nan")),
        _oracle_share(case, answer),
        answer.current.rms / max(answer.floor.rms, 1e-12),
        seconds,
    )


def _compare(case, named, found, tied):
    """Whether the name is right, and whether its class is."""
    if case.outside:
        return (named == "unknown",) * 2
    if not case.causes:
        return (named == "none" and not found,) * 2
    if len(case.causes) == 1:
        return named == case.causes[0], named in family(case.causes[0]) or case.causes[0] in tied
    return found == set(case.causes), all(family(name) & found for name in case.causes)


def _oracle_share(case, answer: State) -> float:
    """Gain on held-out blocks over that of the true causes with the true parameters.

    NaN where the truth is no complete set of parameters (a phase, the moment of a step), or gains nothing.
    """
    terms = []
    for name, truth in case.truth.items():
        cause = library()[name]
        asked = cause.quantities(answer.problem.frames[0])  # of the plain formula
        if cause.stage == "record" or any(q.name not in truth for q in asked):
            return float("nan")
        values = (truth[q.name] / answer.scale.of_unit(q.unit) for q in asked)
        terms.append(Term(cause, tuple(values)))
    if not terms or answer.current is answer.baseline:
        return float("nan") if not terms else 0.0
    held_out = HeldOut(answer.problem)
    before = held_out.error(answer.baseline)
    best = before - held_out.error(weights_for(answer.problem, terms, None))
    if best < LIMITS.held_out_least * before:  # the weights hold it: there is no gain to share
        return float("nan")
    return (before - held_out.error(answer.current)) / best
