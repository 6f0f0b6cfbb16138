"""Evidence and advice in words.

The one place where a diagnosis is put into English, but for the texts that a cause's own file holds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pulsetrainer.artefacts.units import with_seconds, with_unit
from pulsetrainer.diagnosis import experiment
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.finding import Finding
from pulsetrainer.diagnosis.scale import Scale
from pulsetrainer.diagnosis.thresholds import LIMITS

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
    "would have shown": (
        "The smallest effects that these recordings would have shown, rms, % of the span: {limits}"
    ),
    "not whole": (
        "{names} explain only a part of it: {rest:.2g} % of the span is something else, which noise and "
        "levels do not account for"
    ),
    "not accepted": (
        "{names} would explain {explains:.0f} % of the error that can be explained, more than noise does "
        "(p = {p:.3f}), but refitted with all weights it is too small to matter, or does not predict blocks "
        "that were left out. It is not named."
    ),
    "not repeated": (
        "What is left can be fitted by a learned dependence, but that did not repeat when whole pieces of "
        "the time were left out: it is no property of the device"
    ),
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
        "the span (rms, weights refitted); on this recording they differ by {here:.2g} %.{command}"
    ),
    "lacks": "This recording has limits: {names}. Record {missing}, and diagnose that.{command}",
    "unknown": (
        "No known cause fits. Repeat the recording to see whether the remaining error repeats; if it does, "
        "vary one thing at a time: temperature, load, amplitude."
    ),
    "none": "Nothing is left to explain on this recording.",
    "too noisy": (
        "These recordings could not have shown {names} of {matters:.2g} % of the span. Record the same for "
        "{times:.2g} times as long, or with less noise, and diagnose that."
    ),
    "inconclusive": (
        "These recordings could not have shown {names} of {matters:.2g} % of the span. Record {missing}, and "
        "diagnose that.{command}"
    ),
    "extend": "Extend the model, then test it on a recording that was not fitted: pulsetrainer evaluate.",
    "correct": (
        "The measurement is at fault, not the model: take {names} out of the recording (pulsetrainer "
        "correct), and identify the model from what that gives, or diagnose it again."
    ),
    "repair": "No model can hold this: put right what was found, and record again.",
    "other model": (
        "A Preisach model does not suit this device: take the velocity as the input, or use a damper model."
    ),
    "identify anew": (
        "Identify the device again in this condition (pulsetrainer identify RUN.h5 -o model.h5), and "
        "diagnose with the new model."
    ),
}
DOUBTS: Mapping[str, str] = {
    "predicts worse": "with it, blocks that were left out are predicted worse than without it",
    "does not repeat": "it fits, but does not repeat: it is not added to the model",
    "spans zero": "the interval of its strength spans zero",
    "at bound": "a parameter sits at the end of the range in which it was sought",
}
OURS = " The diagnostic signal includes it: pulsetrainer capture diagnostic -o run.h5."
LACKS: Mapping[str, str] = {
    "rates": "only one rate of change",
    "holds": "no holds",
    "length": "few crossings of the range",
}
# What to record, with {numbers} for the bench: see ``Bench.numbers``
MISSING: Mapping[str, str] = {
    "rates": "the same loops at {slow}, {middle} and {fast}",
    "holds": "stops of {hold} at {levels}",
    "length": "{short} or more",
}
EXPERIMENTS: Mapping[str, str] = {
    "nested loops": "nested loops between {low} and {high} at {slow}, {middle}, {quick} and {fast}",
    "steps and holds": "steps at {fast} to {levels}, each followed by a stop of {hold}",
    "equal minor loops": "minor loops {width} wide from {biases}, each reached from below and from above",
    "equal cycles": "twenty equal cycles between {bottom} and {top} at {middle}, and twenty at {quick}",
    "heating": "major loops before and after {heating} at {high}, and again after {heating} at {low}",
}


@dataclass(frozen=True)
class Bench:
    """What advice is put in terms of: the device that was recorded."""

    scale: Scale
    unit: str = "1"  # of the input
    timed: bool = True
    ours: bool = False  # recorded by this program, which plays experiments itself

    def numbers(self, faster: float = 1.0) -> dict[str, str]:
        """Levels, rates and times of the experiments, so much faster, to be set on that bench."""
        rates = dict(zip(("slow", "middle", "quick", "fast"), sorted(experiment.RATES), strict=True))
        times = {"hold": experiment.HOLD_S, "heating": experiment.HEATING_S, "short": LIMITS.short_s}
        shares = {"low": 0.0, "high": 1.0, "bottom": min(experiment.CYCLE), "top": max(experiment.CYCLE)}
        return {
            **{name: self._level(share) for name, share in shares.items()},
            "levels": self._levels(experiment.LEVELS[1:-1]),
            "biases": self._levels(experiment.BIASES),
            "width": with_unit(f"{experiment.WIDTH * self.scale.reach:.3g}", self.unit),
            **{name: self._rate(faster * one) for name, one in rates.items()},
            **{name: self._time(one / faster) for name, one in times.items()},
        }

    def _level(self, share: float) -> str:
        return with_unit(self._number(share), self.unit)

    def _levels(self, shares: Sequence[float]) -> str:
        *rest, last = [self._number(share) for share in shares]
        return with_unit(f"{', '.join(rest)} and {last}", self.unit)

    def _number(self, share: float) -> str:
        value = self.scale.low + share * self.scale.reach
        return f"{0.0 if abs(value) < LIMITS.same_value * self.scale.reach else value:.4g}"

    def _rate(self, ranges: float) -> str:
        if not self.timed:
            times = ranges / min(experiment.RATES)
            return "one rate" if times == 1 else f"{times:.3g} times that rate"
        per_second = "1/s" if self.unit == "1" else f"{self.unit}/s"
        return with_unit(f"{ranges * self.scale.reach / self.scale.second:.3g}", per_second)

    def _time(self, seconds: float) -> str:
        if not self.timed:
            return "several times as long as a loop takes"
        return with_seconds(seconds * self.scale.second)


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
        "limits": _joined([f"{name} {size:.2g}" for name, size in sorted(one.figures.items())]),
        "signature": cause.signature if cause else "",
    }
    where = f"record {one.record + 1}: " if one.record is not None else ""
    return where + (TEXTS[one.kind] if own is None else own).format(**figures)


def cause_text(finding: Finding, words: Mapping[str, str]) -> str:
    """Return what a finding says of its cause."""
    if finding.seen is not None:
        return text(finding.seen, words)
    return finding.cause.title.format(**{"input": "input", "output": "output", **words})


def advice(one: Evidence, bench: Bench) -> str:
    """Return what to measure next, as a sentence, in numbers of the bench."""
    numbers = bench.numbers(one.figures.get("faster", 1.0))
    tied = one.kind == "tied"  # its first name is that of the experiment
    names = one.names[1:] if tied else one.names
    return ADVICE[one.kind].format(
        names=_listed([name for name in names if name not in LACKS] or names),
        experiment=EXPERIMENTS[one.names[0]].format(**numbers) if tied else "",
        missing=_joined([MISSING[name].format(**numbers) for name in names if name in MISSING]),
        command=OURS if bench.ours else "",
        **one.figures,
    )


def _listed(names: Sequence[str]) -> str:
    """Return ``a, b and c``; what a record lacks is spelled out."""
    return _joined([LACKS.get(name, name) for name in names])


def _joined(words: Sequence[str]) -> str:
    *rest, last = words or [""]
    return f"{', '.join(rest)} and {last}" if rest else last
