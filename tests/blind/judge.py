"""The judge: diagnoses a measurement and only then compares with what was hidden."""

from __future__ import annotations

import os
import time
from dataclasses import asdict, dataclass

os.environ.setdefault("OMP_NUM_THREADS", "1")

import hidden
import numpy as np

from pulsetrainer.diagnosis.selection import diagnose


@dataclass(frozen=True)
class Verdict:
    """One row of the table."""

    kind: str
    seed: int
    causes: tuple[str, ...]
    found: tuple[str, ...]
    verdict: str
    tied: tuple[str, ...]  # what the verdict could not be told from
    unique: bool  # a single name, without confounded ones
    right: bool
    in_class: bool
    errors: dict  # parameter: relative error
    covered: dict  # parameter: truth within the interval
    held_out: float
    floor_ratio: float  # final rms over the rms of the known floor
    seconds: float

    def row(self):
        """As plain data."""
        return asdict(self)


def family(name):
    """All causes that look much the same."""
    return next((f for f in hidden.FAMILIES if name in f), {name})


def judge(kind: str, seed: int) -> Verdict:
    """Hide, measure, diagnose, compare."""
    case = hidden.draw(kind, seed)
    record, high = hidden.measure(case)
    begun = time.perf_counter()
    answer = diagnose([record], 0.0, high, rng=np.random.default_rng(seed))
    seconds = time.perf_counter() - begun
    found = {f.cause.id: f for f in answer.findings if f.found}
    named = answer.verdict
    tied = found[named].confounded_with if named in found else ()
    if case.outside:
        right = in_class = named == "unknown"
    elif not case.causes:
        right = in_class = named == "none"
    elif len(case.causes) == 1:
        right = named == case.causes[0]
        in_class = named in family(case.causes[0]) or case.causes[0] in tied
    else:
        right = set(found) == set(case.causes)
        in_class = all(family(name) & set(found) for name in case.causes)
    errors, covered = {}, {}
    for name, truth in case.truth.items():
        for e in found[name].parameters if name in found else ():
            if e.name in truth:
                size = abs(truth[e.name])
                errors[f"{name}.{e.name}"] = abs(abs(e.value) - size) / size
                covered[f"{name}.{e.name}"] = bool(e.lower <= truth[e.name] <= e.upper)
    held = [f.held_out_gain_percent for f in found.values() if np.isfinite(f.held_out_gain_percent)]
    count = answer.problem.bins.count
    return Verdict(
        kind,
        seed,
        case.causes or ((case.outside,) if case.outside else ()),
        tuple(found),
        named,
        tuple(tied),
        named not in ("none", "unknown") and not tied,
        right,
        in_class,
        errors,
        covered,
        max(held, default=float("nan")),
        float(np.sqrt(answer.final.squares / count) / max(answer.floor, 1e-12)),
        seconds,
    )
