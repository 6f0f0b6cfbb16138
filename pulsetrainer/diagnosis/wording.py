"""Evidence and advice in words.

The one place where a diagnosis is put into English, but for the texts that a cause's own file holds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.finding import Finding

# What evidence says, by its kind: figures in braces, and {input} and {output} for what was measured
TEXTS: Mapping[str, str] = {
    "static": (
        "With its weights refitted to these recordings, the static model leaves {left:.3f} % of the span "
        "(rms of short averages); noise and discretisation alone would leave {floor:.3f} %."
    ),
    "tested": (
        "p = {p:.3f} across the whole library; it accounts for {explains:.1f} % of the error that can be "
        "explained. What gives it away: {signature}."
    ),
    "extended": "With these causes in the model, {left:.3f} % of the span remains.",
    "largest": "The remaining error is largest at {names} {at:.3g}, {times:.1f} times its smallest value.",
    "quick": "Quick screen: nothing was refitted, so strengths are linearised and come out too small.",
    "lacks": "The recording is limited: {names}.",
    "untimed": (
        "The recordings have no time, so only causes that depend on the order of the samples were tried "
        "({names}, and the checks on the raw data), and none that depends on rate."
    ),
    "wrong kind": (
        "{output} follows the velocity of {input}, not {input} itself: a Preisach model in {input} is the "
        "wrong model here. It leaves {preisach:.1f} % of the span (rms), a plain function of the velocity "
        "leaves {velocity:.1f} %. Use the velocity as the input, or a damper model"
    ),
    "given better": (
        "The model as given predicts these recordings better than any extension that was tried, so none is "
        "proposed."
    ),
    "overshadowed": (
        "The change accounts for {share:.2f} % of the squared error. Adding {names} would only reduce the "
        "remainder, {left:.2g} % of the span: too little to be named."
    ),
}
ADVICE: Mapping[str, str] = {
    "tied, quick": "Run the full diagnosis: a quick screen cannot distinguish between {names}.",
    "tied": (
        "To tell {names} apart, record {experiment}. There the two most alike differ by {there:.2g} % of "
        "the span (rms, weights refitted); on this recording they differ by {here:.2g} %. The diagnostic "
        "signal includes it: pulsetrainer capture diagnostic."
    ),
    "lacks": (
        "Make a recording with several rates, holds and repeats (pulsetrainer capture diagnostic -o run.h5)"
        " and diagnose that; this one has limits: {names}."
    ),
    "unknown": (
        "No known cause fits. Repeat the recording to see whether the remaining error repeats; if it does, "
        "vary one thing at a time: temperature, load, amplitude."
    ),
    "none": "Nothing is left to explain on this recording.",
    "extend": "Extend the model, then test it on a recording that was not fitted: pulsetrainer evaluate.",
    "other model": (
        "A Preisach model does not suit this device: take the velocity as the input, or use a damper model."
    ),
    "identify anew": (
        "Identify the device again in this condition (pulsetrainer identify RUN.h5 -o model.h5), and "
        "diagnose with the new model."
    ),
}
LACKS: Mapping[str, str] = {
    "rates": "only one rate of change",
    "holds": "no holds",
    "length": "less than 20 s",
}
EXPERIMENTS: Mapping[str, str] = {
    "nested loops": "nested loops at 0.5, 1.5, 4 and 8 ranges a second",
    "steps and holds": "fast steps to five levels with holds of three seconds",
    "equal minor loops": "equal minor loops at four levels, each reached from below and from above",
    "equal cycles": "twenty equal slow cycles and twenty fast ones",
    "heating": "major loops before and after half a minute at the top, and again after half a minute at rest",
}


def sentence(one: Evidence, words: Mapping[str, str]) -> str:
    """Return evidence as a sentence; ``words`` names the quantities ``input`` and ``output``, and units."""
    said = text(one, words)
    said = said if said.endswith(".") else f"{said}."
    return f"{one.cause}: {said}" if one.cause else said


def text(one: Evidence, words: Mapping[str, str] | None = None) -> str:
    """Return evidence in words, without the name of its cause."""
    cause = library()[one.cause] if one.cause else None
    own = cause.texts.get(one.kind) if cause else None
    figures = {
        **(words or {}),
        **one.figures,
        "names": _listed(one.names),
        "signature": cause.signature if cause else "",
    }
    where = f"record {one.record + 1}: " if one.record is not None else ""
    return where + (TEXTS[one.kind] if own is None else own).format(**figures)


def cause_text(finding: Finding, words: Mapping[str, str]) -> str:
    """Return what a finding says of its cause."""
    if finding.seen is not None:
        return text(finding.seen, words)
    return finding.cause.title.format(**{"input": "input", "output": "output", **words})


def advice(one: Evidence) -> str:
    """Return what to measure next, as a sentence."""
    tied = one.kind == "tied"  # its first name is that of the experiment
    names, experiment = (one.names[1:], EXPERIMENTS[one.names[0]]) if tied else (one.names, "")
    return ADVICE[one.kind].format(names=_listed(names), experiment=experiment, **one.figures)


def _listed(names: Sequence[str]) -> str:
    """Return ``a, b and c``; what a record lacks is spelled out."""
    *rest, last = [LACKS.get(name, name) for name in names] or [""]
    return f"{', '.join(rest)} and {last}" if rest else last
