"""The diagnosis in words: what speaks for the answer, and what to measure next."""

from __future__ import annotations

import numpy as np

from pulsetrainer.diagnosis import residual
from pulsetrainer.diagnosis.answer import Answer
from pulsetrainer.diagnosis.experiment import best_experiment


def evidence(answer: Answer, lacks: list[str]) -> list[str]:
    """Sentences that speak for the verdict, the strongest first."""
    span = float(np.ptp(answer.problem.measured))
    count = answer.problem.bins.count
    before = 100.0 * np.sqrt(answer.baseline.squares / count) / span
    after = 100.0 * np.sqrt(answer.final.squares / count) / span
    floor = 100.0 * answer.floor / span
    said = []
    said.append(
        f"With its weights refitted the static model leaves {before:.3f} % of the span (rms of short "
        f"averages); noise and levels alone would leave {floor:.3f} %."
    )
    for finding in answer.findings:
        if not finding.found:
            continue
        if finding.cause.stage == "record":
            said.append(f"{finding.cause.id}: {finding.text}.")
        else:
            said.append(
                f"{finding.cause.id}: p = {finding.p_value:.3f} over the whole library; it explains "
                f"{finding.explains_percent:.1f} % of what can be explained. "
                f"Signature: {finding.cause.signature}."
            )
    if answer.final is not answer.baseline:
        said.append(f"With the causes found {after:.3f} % are left.")
    if answer.verdict in ("none", "unknown"):
        said += _where(answer)
    if answer.quick:
        said.append("Quick: screened only; strengths are linearised and too small, nothing was refitted.")
    if lacks:
        said.append(f"The record has {', '.join(lacks)}.")
    return said


def _where(answer: Answer) -> list[str]:
    """Where the remaining residual is largest."""
    said = []
    for group in residual.groups(answer.problem):
        rms = residual.rms_by(group, answer.final.residual)
        if np.nanmax(rms) > 1.5 * np.nanmin(rms):
            k = int(np.nanargmax(rms))
            said.append(
                f"What is left is largest at {group.name} {group.at[k]:.3g} "
                f"({np.nanmax(rms) / np.nanmin(rms):.1f} times its least)."
            )
    return said


def next_experiment(answer: Answer, lacks: list[str]) -> str:
    """What to measure next."""
    tied = next((f for f in answer.findings if f.found and f.confounded_with), None)
    if tied is not None:
        names = (tied.cause.id, *tied.confounded_with)
        if answer.quick:
            return f"Diagnose without --quick: a screen cannot tell {', '.join(names)} apart."
        best = best_experiment(answer, names)
        percent = 100.0 / float(np.ptp(answer.problem.measured))
        return (
            f"To tell {', '.join(names[:-1])} and {names[-1]} apart, record {best.words}: there the two most "
            f"alike differ by {percent * best.distance:.2g} % of the span (rms, weights taken off), on this "
            f"record by {percent * best.distance_here:.2g} %. pulsetrainer capture diagnostic has all of it."
        )
    if lacks:
        return (
            f"The record has {', '.join(lacks)}: record one with several rates, holds and repeats "
            "(pulsetrainer capture diagnostic -o run.h5) and diagnose that."
        )
    if answer.verdict == "unknown":
        return (
            "No cause of the library fits. Repeat the record to see whether what is left repeats; "
            "if it does, vary one thing at a time: temperature, load, amplitude."
        )
    if answer.verdict == "none":
        return "Nothing is left to explain on this record."
    return "Extend the model, then test it on a record that was not fitted: pulsetrainer evaluate."
