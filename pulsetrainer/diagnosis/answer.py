"""What a diagnosis says: findings with their intervals, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass

from pulsetrainer.diagnosis.causes.base import Cause
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.problem import Problem


@dataclass(frozen=True)
class Estimate:
    """One parameter with its interval."""

    name: str
    value: float
    unit: str
    lower: float
    upper: float


@dataclass(frozen=True)
class Finding:
    """What the data say about one cause."""

    cause: Cause
    found: bool
    p_value: float
    explains_percent: float  # of the reducible part of the baseline's error
    parameters: tuple[Estimate, ...] = ()
    confounded_with: tuple[str, ...] = ()
    held_out_gain_percent: float = 0.0  # of the reducible part
    text: str = ""
    by_contrast: bool = False  # told by differences between equal loops, whatever a model leaves


@dataclass(frozen=True)
class Answer:
    """The whole diagnosis of one set of records."""

    verdict: str
    findings: tuple[Finding, ...]
    problem: Problem
    baseline: Fitted
    final: Fitted
    noise: float  # rms of the white noise of single samples
    floor: float  # rms of what is left in an average when nothing is wrong
    discretisation: float  # rms
    quick: bool
    terms: tuple[tuple[Term, tuple[Estimate, ...]], ...] = ()
