"""Evidence and advice in words.

The one place where a diagnosis is put into English, but for the texts that a cause's own file holds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pulsetrainer.artefacts.units import shown, with_seconds, with_unit
from pulsetrainer.diagnosis import experiment
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.finding import Finding
from pulsetrainer.diagnosis.scale import Scale
from pulsetrainer.diagnosis.thresholds import LIMITS

# What evidence says, by its kind: figures in braces, and {input} and {output} for what was measured
TEXTS: Mapping[str, str] = {
    "background": "no larger than the slow noise beside it: it is told, but is no verdict",
    "static": (
        "Fitted anew to these recordings, the model without any cause leaves {left:.3f} % of the span (rms "
        "of short averages). Noise and the number of levels alone would leave {floor:.3f} %."
    ),
    "tested": (
        "noise alone would look like it with a probability of at most {p:.4f}. It accounts for "
        "{explains:.1f} % of the squared error beyond noise. {signature}."
    ),
    "tested, small": (
        "noise alone would look like it with a probability of at most {p:.4f}. What share of the error it "
        "causes cannot be told: the whole error is no more than noise and levels may leave. {signature}."
    ),
    "extended": "With these causes in the model, {left:.3f} % of the span remains (rms of short averages).",
    "would have shown": (
        "The smallest effects that these recordings would have shown, rms, % of the span: {limits}"
    ),
    "not whole": (
        "Not all of it is explained by {names}: {rest:.2g} % of the span is something else, which noise "
        "and levels do not account for"
    ),
    "slow noise": (
        "What is taken for noise here is slow: short averages have {white:.2g} % of the span of it, "
        "{times:.1f} times what the noise from sample to sample would leave. If the sensor does not do that "
        "by itself, something acts on the device that was not recorded, or the device is of a kind that the "
        "model cannot follow"
    ),
    "bursts": (
        "What is left comes and goes, or jumps, as no noise does: short averages have {white:.2g} % of the "
        "span of it, {times:.1f} times what the noise from sample to sample would leave. Something acts on "
        "the device or the sensor that was not recorded, or the model cannot follow a device of this kind"
    ),
    "zero wanders": (
        "What is left follows the time alone as well as any state of the device: the zero of the {output} "
        "wanders, or the device changes slowly. Let device and sensor warm up, look for draughts and loose "
        "plugs, and record again"
    ),
    "not accepted": (
        "Noise alone would hardly look like {names} (p = {p:.3f}). But once the model is fitted together "
        "with it, it is too small to matter, or does not predict the parts of the recordings that were left "
        "out. So it is not named."
    ),
    "held": (
        "it would account for {share:.1f} % of the squared error beyond noise, but the weights of a model "
        "fitted to these recordings can hold nearly all of such a fault. So it cannot be told how large it "
        "is, nor whether it is there, and it is not named. A model from another recording tells: identify "
        "one, and diagnose these with it"
    ),
    "not repeated": (
        "What is left can be fitted by a learned dependence, but that did not repeat when whole pieces of "
        "the time were left out: it is not taken for a property of the device"
    ),
    "largest": "The remaining error is largest {place}: {times:.1f} times the error where it is smallest.",
    "quick": (
        "Quick screen: no cause was fitted together with the model, so strengths are rough: off by a tenth "
        "or more."
    ),
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
    "wrong kind, both": (
        "{output} follows the velocity of {input} beside {input} itself: a Preisach model in {input} is the "
        "wrong model here. It leaves {preisach:.1f} % of the span (rms), a plain function of the velocity "
        "{velocity:.1f} %, and one with a part in proportion to {input} {beside:.1f} %. Use a model of a "
        "damper and a spring"
    ),
    "pinched": (
        "All branches of the loop pass through one point, where the {input} is about {at:.3g}{in_u}. A "
        "Preisach model has no such loop, so the model does not describe this record, and what is left is "
        "taken for no noise. A resistor with a memory (a memristor) has one: use a model y = G(w) u"
    ),
    "given worse": (
        "The model as given leaves {given:.2f} % of the span (rms of single samples), and weights refitted "
        "to these recordings {refitted:.2f} %. It does not carry over: the device, its zero or its sensor "
        "was not the same when it was identified, or a model of this kind does not describe the device"
    ),
    "given worse, own": (
        "The model as given leaves {given:.2f} % of the span (rms of single samples), and weights refitted "
        "to these recordings {refitted:.2f} %, though it was identified from them. Smooth weights do not "
        "follow what free ones do: that may be something else than hysteresis, as a slow drift. A model from "
        "another recording would tell"
    ),
    "one stroke": (
        "The model as given leaves {given:.2f} % of the span, but the {input} never turns in these "
        "recordings: a first stroke is unlike all later ones, so it cannot be told whether the device has "
        "changed"
    ),
    "crossed": (
        "All branches of the loop cross in one point, where the {input} is about {at:.3g}{in_u}, as those of "
        "a butterfly do. Weights of either sign leave more of it than noise, so the device is of another "
        "kind than any Preisach model"
    ),
    "given better": (
        "The model as given predicts these recordings better than any extension that was tried, so none is "
        "proposed."
    ),
    "not carried over": (
        "A Preisach model fitted anew leaves {refitted:.2g} % of the span of these recordings, but "
        "{left_out:.2g} % of parts that were left out of that fit; the model as given leaves {given:.2g} %. "
        "So it cannot be told whether the device has changed: it may be of a kind that no Preisach model "
        "describes well, or the recordings are too short to fit one"
    ),
    "no gain": (
        "Extended by {names} and used from rest, the model would predict these recordings little better than "
        "as it was given ({extended:.3g} % of the span against {given:.3g} %), so nothing is added to it."
    ),
    "no better": (
        "Extended by {names} and used from rest, the model would predict these recordings worse than as it "
        "was given ({extended:.3g} % of the span against {given:.3g} %), so nothing is added to it."
    ),
    "under way": (
        "Extended by {names} and used from rest, the model would predict these recordings worse than as it "
        "was given ({extended:.3g} % of the span against {given:.3g} %), so nothing is added to it. It "
        "describes them only where their beginning is left open: the device was still settling from what "
        "came before."
    ),
    "overshadowed": (
        "The change accounts for {share:.2f} % of the squared error. Adding {names} would only reduce what "
        "remains, {left:.2g} % of the span: too little to be named."
    ),
}
# What a cause is known by; whether the records lack what shows it
SIGNATURES: Mapping[bool, str] = {
    False: "What gives it away: {mark}",
    True: "What would show it is not all in these recordings: {mark}",
}
# Where an error is largest, by the quantity that it was sorted by
PLACES: Mapping[str, str] = {
    "rest": "while the {input} rests",
    "rate": "where the {input} moves at {at}{in_u} per {second}",
    "level": "where the {input} is about {at}{in_u}",
    "direction": "while the {input} {way}",
    "time": "about {at} {seconds} after the start",
}
WAYS = {-1.0: "falls", 0.0: "rests", 1.0: "rises"}
# where nothing better is known
PLAIN = {"input": "input", "output": "output", "in_y": "", "in_u": "", "second": "second", "seconds": "s"}
AGAIN = (
    "record {output} and {input} again, the {input} between {low} and {high}: {missing}. Then diagnose that "
    "recording.{command}"
)
# of tied causes one of which is the measurement's, another the device's: no record decides, a person may
KNOWN = (
    " If you know that it is the measurement ({faults}), put that right (a sensor that drifts must warm up), "
    "record the same again, and identify the model from that."
)
# after what can be done with the records as they are
LATER = f" This recording cannot show everything ({{lacked}}). If that matters to you, {AGAIN}"
ADVICE: Mapping[str, str] = {
    "tied, quick": "Run the full diagnosis: a quick screen cannot distinguish between {names}.",
    "tied": (
        "To tell {names} apart, record {experiment}{lasting}. There the two that are most alike differ by "
        "{there:.2g} % of the span (rms, after the best fit of the model); on this recording they differ by "
        "{here:.2g} %. Then diagnose that recording.{command}"
    ),
    "tied, no better": (
        "We know of no recording that would tell {names} apart much better than this one, on which they "
        "differ by {here:.2g} % of the span (rms, after the best fit of the model), but for a longer one of "
        "the same kind, as noise averages out."
    ),
    "lacks": f"To see what this recording cannot show, {AGAIN}",
    "unknown": (
        "No known cause fits. Record the same again and diagnose both together. If as much is left and no "
        "cause is found, the device may be of a kind that the model cannot follow; if not, something else "
        "acts on it: vary one thing at a time, such as temperature, load or amplitude."
    ),
    "none": ("Nothing was found on this recording beyond what is taken for noise: use the model as it is."),
    "none, quick": "The quick screen found nothing. The full diagnosis tells smaller effects.",
    "none, seen": (
        "Nothing was found on this recording that asks for another model: {names} can be seen, but in doubt "
        "or no larger than the noise. Use the model as it is."
    ),
    "none, small": (
        "Nothing that matters was found on this recording: noise alone would hardly look like {names}, but "
        "it is too small to matter, or does not predict what was left out of the fit. Use the model as it is."
    ),
    "none, small, quick": (
        "Nothing that matters was found on this recording: noise alone would hardly look like {names}, but "
        "it is too small to matter."
    ),
    "extend, quick": (
        "Run the full diagnosis, which fits what was found: after a quick screen there is nothing to extend "
        "the model by, or to take out of the recording."
    ),
    "too noisy": (
        "These recordings could not have shown {names} of {matters:.2g} % of the span. Record the same for "
        "{times:.2g} times as long, or with less noise, and diagnose that."
    ),
    "far too noisy": (
        "These recordings could not have shown {names} of {matters:.2g} % of the span, and longer ones would "
        "hardly do so. Record with less noise: averaged, with a finer sensor, or over a wider range."
    ),
    "inconclusive": (
        "These recordings could not have shown {names} of {matters:.2g} % of the span. "
        f"To see it, {AGAIN}"
    ),
    "extend, or late": (
        "Is the recorder late, or the device? They look exactly alike. If it is the device, extend the model "
        "with what was found; if it is the recorder, give pulsetrainer correct its delay, to take that out. "
        "Then test the model on another recording, which was not fitted: pulsetrainer evaluate."
    ),
    "extend": (
        "Extend the model with what was found, then test it on another recording, which was not fitted: "
        "pulsetrainer evaluate."
    ),
    "extend, correct": (
        "Extend the model with what was found, then test it on another recording, which was not fitted: "
        "pulsetrainer evaluate. From the measurement: {names}; pulsetrainer correct takes that out of the "
        "recording."
    ),
    "rest first": (
        "The device was still settling when these recordings began. Let it rest for {rest} where they begin, "
        "then record the same again and diagnose that: what was found can then be added to the model."
    ),
    "again": (
        "What was found is in doubt, or does not repeat within these recordings, so nothing is added to the "
        "model. Record again, and diagnose both recordings together."
    ),
    "correct": (
        "The measurement is at fault, not the model: take {names} out of the recording (pulsetrainer "
        "correct). If the model was identified from it, identify it again from the corrected one; a model "
        "from a sound recording stays as it is."
    ),
    "correct, extend": (
        "The measurement is at fault, and the device does something that the model lacks. First take {names} "
        "out of the recording (pulsetrainer correct). If the model was identified from it, identify it again "
        "from the corrected one. Then diagnose the corrected recording, and extend the model."
    ),
    "conditions": (
        "The recordings were made in different conditions, such as load, zero or gain: the evidence says "
        "which of them the model as given predicts. Put the others right, or identify a model for each "
        "condition."
    ),
    "out of range": (
        "The model knows nothing of the {input} beyond {low} and {high}: identify the device again from a "
        "run over the whole range that it is used in, and diagnose with the new model."
    ),
    "repair": "No model can hold this: put right what was found, and record again.",
    "other model": (
        "A Preisach model does not suit this device: take the velocity as the input, or use a damper model."
    ),
    "other model, both": "A Preisach model does not suit this device: use a model of a damper and a spring.",
    "strokes": (
        "Record the same condition again, over the whole range three times at least and with smaller loops, "
        "and diagnose that."
    ),
    "identify anew": (
        "Identify the model again in this condition, from these recordings or from a new run, and diagnose "
        "with the new model."
    ),
    "warm up": (
        "Let device and sensor warm up, record the same again, and identify the model from that recording. "
        "If it then leaves little, something drifted here: go on with the new model. If it leaves as much, "
        "a Preisach model may not describe this device."
    ),
}
DOUBTS: Mapping[str, str] = {
    "predicts worse": "with it, parts of the recordings that were left out are predicted worse",
    "does not repeat": "it fits, but does not repeat: it is not added to the model",
    "not added": "so it is not added to the model",
    "may be a fault": (
        "a fault of the measurement in this recording alone would look like it: it is not added to the model"
    ),
    "may be wear": "here a gain that wears off, with time or with the way of the input, would look like it",
    "settles": "what settles from the start of the recording would look like it, and that is not sudden",
    "wanders": "what is left still wanders, so it may be a part of that: it is neither added nor taken out",
    "predicts little": (
        "on parts of the recordings that were left out it explains less than half of what could be "
        "explained, as any cause may where the model cannot follow a device of this kind"
    ),
    "imitates": (
        "on parts of the recordings that were left out it predicts less than three quarters of what the "
        "model leaves without it: something else that the device does as it moves may look like it"
    ),
    "spans zero": "its strength may be nothing, as the interval spans zero",
    "no equal loops": "only a minor loop traced three times in equal time would show it; there is none",
    "at bound": "a parameter, or the interval of one, is at the end of the range that was searched",
    "strength at bound": "its strength is at the end of the range that was searched, so it is something else",
    "in step": (
        "it keeps step with the loops, and the model without it can follow most of it: it may be what the "
        "device itself does. Loops at another rate would tell"
    ),
    "leaves more": "it takes away less than it leaves, so it may be an error of the model itself",
    "own error": (
        "on a recording of one rate without rests it cannot be told from an error of the model itself, and "
        "what is left is nearly as large, or is more than noise"
    ),
}
OURS = (
    " The diagnostic signal does all of it: pulsetrainer capture diagnostic --current-max {highest} "
    "-o diagnostic-2.h5."
)
TABLE = (
    " Save it as a table with the columns {columns}, and read that with pulsetrainer import, as you did "
    "for the recordings here."
)
# What recordings may lack, with {hold_least} and {short} for the bench: see ``Bench.numbers``
LACKS: Mapping[str, str] = {
    "rates": f"nearly all of it was run at one rate, or at rates less than {LIMITS.one_rate:g} times apart",
    "holds": "the {input} never rests for {hold_least} or more",
    "length": "all of it lasts less than {short}",
    "time": "its samples have no time",
}
# What to record instead
MISSING: Mapping[str, str] = {
    "rates": "the same loops at {slow}, {middle} and {fast}",
    "holds": "stops of {hold} at each of {levels}",
    "length": "{short} or more in all",
    "time": "with the time of every sample, at several rates and with rests",
}
EXPERIMENTS: Mapping[str, str] = {
    "nested loops": (
        "loops of the {input} between {low} and {high}, ever smaller, once each at {slow}, {middle}, {quick} "
        "and {fast}"
    ),
    "steps and holds": "steps of the {input} at {fast} to {levels}, with a stop of {hold} after each",
    "equal minor loops": (
        "loops of the {input} at {pace} that are {width} wide, up from {biases}, each reached once from "
        "below and once from above"
    ),
    "equal cycles": (
        "twenty equal cycles of the {input} between {bottom} and {top} at {middle}, and twenty at {quick}"
    ),
    "heating": (
        "full loops of the {input} at {pace}, one before and one after {heating} at {high}, and one more "
        "after {heating} at {low}"
    ),
}


@dataclass(frozen=True)
class Bench:
    """What advice is put in terms of: the device that was recorded."""

    scale: Scale
    unit: str = "1"  # of the input
    timed: bool = True
    ours: bool = False  # recorded by this program, which plays experiments itself
    input: str = "input"  # what was measured, in words
    output: str = "output"
    reached: tuple[float, float] = (0.0, 1.0)  # by the input, shares of the range: none is asked for beyond
    unit_of_output: str = "1"

    def numbers(self, faster: float = 1.0) -> dict[str, str]:
        """Levels, rates and times of the experiments, so much faster, to be set on that bench."""
        rates = dict(zip(("slow", "middle", "quick", "fast"), sorted(experiment.RATES), strict=True))
        rates["pace"] = experiment.PACE
        times = {
            "hold": experiment.HOLD_S,
            "hold_least": LIMITS.hold_s,
            "heating": experiment.HEATING_S,
            "short": LIMITS.short_s,
        }
        shares = {"low": 0.0, "high": 1.0, "bottom": min(experiment.CYCLE), "top": max(experiment.CYCLE)}
        return {
            "input": self.input,
            "output": self.output,
            "second": "second" if self.timed else "sample",
            "seconds": "s" if self.timed else "samples",
            **{name: self._level(share) for name, share in shares.items()},
            "highest": self._number(1.0),
            "columns": _joined(
                [
                    f"{name} in {shown(unit)}" if shown(unit) else name
                    for name, unit in (
                        ("time", "s"),
                        (self.input, self.unit),
                        (self.output, self.unit_of_output),
                    )
                ]
            ),
            "levels": self._levels(experiment.LEVELS[1:-1]),
            "biases": self._levels(experiment.BIASES),
            "width": with_unit(figure(experiment.WIDTH * self.scale.reach), self.unit),
            **{name: self._rate(faster * one) for name, one in rates.items()},
            **{name: self.time(one / faster) for name, one in times.items()},
        }

    def lasting(self, name: str, faster: float) -> str:
        """Return how long an experiment takes, as the end of a phrase."""
        return f", about {self.time(experiment.length_s(name) / faster)} in all" if self.timed else ""

    def _level(self, share: float) -> str:
        return with_unit(self._number(share), self.unit)

    def _levels(self, shares: Sequence[float]) -> str:
        *rest, last = [self._number(share) for share in shares]
        return with_unit(f"{', '.join(rest)} and {last}", self.unit)

    def _number(self, share: float) -> str:
        step = float(f"1e{math.floor(math.log10(LIMITS.told_to * self.scale.reach))}")
        share = min(max(share, self.reached[0]), self.reached[1])
        value = round((self.scale.low + share * self.scale.reach) / step) * step
        # a small swing about a large value needs more digits than most
        more = max(0, math.ceil(math.log10(max(abs(value), self.scale.reach) / self.scale.reach)))
        return figure(value, LIMITS.told_digits + 1 + more)

    def _rate(self, ranges: float) -> str:
        if not self.timed:
            times = ranges / min(experiment.RATES)
            return "one rate" if times == 1 else f"{times:.3g} times that rate"
        per_second = f"{shown(self.unit) or '1'}/s"
        return with_unit(figure(ranges * self.scale.reach / self.scale.second), per_second)

    def time(self, seconds: float) -> str:
        """Return a time of the diagnosis in words, in the unit of the record."""
        if not self.timed:
            return "several times as long as a loop takes"
        return with_seconds(seconds * self.scale.second)


def figure(value: float, digits: int = LIMITS.told_digits) -> str:
    """Return a number with some significant digits, and without an exponent where it needs none."""
    return f"{float(f'{value:.{digits}g}') + 0.0:.{max(digits, LIMITS.plain_digits)}g}"  # no negative zero


def sentence(one: Evidence, words: Mapping[str, str]) -> str:
    """Return evidence as a sentence; ``words`` names the quantities ``input`` and ``output``, and units."""
    said = text(one, words)
    said = said if said.endswith(".") else f"{said}."
    return f"{one.cause}: {said}" if one.cause else said


def text(one: Evidence, words: Mapping[str, str] | None = None) -> str:
    """Return evidence in words, without the name of its cause."""
    cause = library()[one.cause] if one.cause else None
    own = cause.texts.get(one.kind) if cause else None
    known = {**PLAIN, **(words or {})}
    figures = {
        **known,
        **one.figures,
        "names": _listed(one.names, known),
        "limits": _joined([f"{name} {figure(size, 2)}" for name, size in sorted(one.figures.items())]),
        "signature": SIGNATURES[bool(one.names)].format(mark=cause.signature) if cause else "",
    }
    if one.kind == "largest":
        figures["way"] = WAYS.get(one.figures["at"], "")
        figures["place"] = PLACES[one.names[0]].format(**{**figures, "at": figure(one.figures["at"])})
    where = f"{recording(one.record, known)}: " if one.record is not None else ""
    return where + (TEXTS[one.kind] if own is None else own).format(**figures)


def recording(number: int, words: Mapping[str, str]) -> str:
    """Return what a record is called: as ``words`` have it under ``record 1``, else that."""
    called = f"record {number + 1}"
    return words.get(called, called)


def cause_text(finding: Finding, words: Mapping[str, str]) -> str:
    """Return what a finding says of its cause."""
    if finding.seen is not None:
        return text(finding.seen, words)
    return finding.cause.title.format(**{**PLAIN, **words})


def advice(one: Evidence, bench: Bench) -> str:
    """Return what to measure next, as a sentence, in numbers of the bench."""
    faster = one.figures.get("faster", 1.0)
    numbers = bench.numbers(faster)
    tied = one.kind == "tied"  # its first name is that of the experiment
    names = one.names[1:] if tied else one.names
    lacked, told = [name for name in names if name in LACKS], ADVICE[one.kind]
    if lacked and "{missing}" not in told:
        told += LATER
    faults = [name for name in names if name not in LACKS and library()[name].corrects]
    if one.kind in ("tied", "tied, no better") and 0 < len(faults) < len(names):
        told += KNOWN
    return told.format(
        **numbers,
        names=_listed([name for name in names if name not in LACKS] or names, numbers),
        lacked=_listed(lacked, numbers),
        faults=_listed(faults, numbers),
        experiment=EXPERIMENTS[one.names[0]].format(**numbers) if tied else "",
        lasting=bench.lasting(one.names[0], faster) if tied else "",
        missing="; ".join(MISSING[name].format(**numbers) for name in names if name in MISSING),
        command=(OURS if bench.ours else TABLE).format(**numbers),
        **{name: bench.time(value) if name == "rest" else value for name, value in one.figures.items()},
    )


def _listed(names: Sequence[str], numbers: Mapping[str, str]) -> str:
    """Return ``a, b and c``; what a record lacks is spelled out in numbers."""
    return _joined([LACKS[name].format(**numbers) if name in LACKS else name for name in names])


def _joined(words: Sequence[str]) -> str:
    *rest, last = words or [""]
    return f"{', '.join(rest)} and {last}" if rest else last
