"""What to record next, in words: experiments, with levels, rates and times that suit the device."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from pulsetrainer.artefacts.units import shown, with_seconds, with_unit
from pulsetrainer.diagnosis import experiment
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.evidence import Evidence, sentences
from pulsetrainer.diagnosis.scale import Scale
from pulsetrainer.diagnosis.thresholds import LIMITS
from pulsetrainer.diagnosis.wording import LACKS, figure, joined, listed

# What is said beside an advice or in its place: of tied causes of which one may be the measurement's (known,
# first) or all are (whichever), or which the model was extended by; of a fault that can be taken out (also);
# of records without time (rate); of what is found at the fast end of what a record shows (faster)
BESIDE = sentences("""\
again: record {output} and {input} again: first a loop of the {input} from {low} to {high} and back, then
    {missing}. {command} Then diagnose the new recording together with these, with the same model.
together: Before that: if you have the recordings that the model was identified from, diagnose them together
    with these (pulsetrainer diagnose takes several). That may be enough.
keep: Use the model as it is: nothing that was found calls for another one.
known: If you know that it is the measurement ({faults}), put that right (a sensor that drifts must warm up),
    record the same again, and identify the model from that.
also: First take {removed} out of the recording (pulsetrainer correct), and diagnose what is left.
whichever: Be it {either}, it does not belong in a model of the device: take {removed} out of the recording
    (pulsetrainer correct), and go on with the corrected one: it is right either way, but for what the causes
    differ by.
first: Take {removed} out of the recording (pulsetrainer correct), and go on with the corrected one: that much
    is certain.
mains: {mains:.4g} Hz is a frequency of the mains, so a hum is likely.
extended: Extend the model now (pulsetrainer extend): it then predicts recordings like these better, whether
    it is {either}.
one rate: At one rate each of them is only a shape of the loop, which the device may have without any of
    them, and a model that was extended by one may do worse at other rates.
no rest: All of this recording was run at one rate, without rests, where an effect that takes time looks like
    a shape of the loop. So the extended model may do worse at other rates: compare both at those too.
rate: If the samples were taken at a constant rate, no new recording is needed: read the table again with
    pulsetrainer import --rate HZ.
faster: A time of about {tau} was found, at the fast end of what this recording shows (samples {apart} apart).
    To know what it is, record {experiment}{often}{lasting}{so_fast}. {command} Then diagnose
    the new recording together with these, with the same model.
later: This recording cannot show everything ({lacked}). If that matters to you, {again}
ours: The diagnostic signal does all of it: pulsetrainer capture diagnostic --current-max {highest} -o
    diagnostic-2.h5.
table: Save it as a table with the columns {columns}, and read that with pulsetrainer import, as you did for
    the recordings here.
""")
ADVICE: Mapping[str, str] = {
    kind: said.replace("{again}", BESIDE["again"]).replace("{keep}", BESIDE["keep"])
    for kind, said in sentences("""\
tied, quick: Run the full diagnosis: a quick screen cannot distinguish between {names}.
tied: To tell {names} apart, record {experiment}{often}{lasting}{so_fast}. There the two most similar causes
    differ by {there:.2g} % of the span (rms, after the best fit of the model); on this recording they differ
    by {here:.2g} %. {command} Then diagnose the new recording together with these, with the same model.
tied, no better: We know of no kind of recording that would tell {names} apart much better than this one, on
    which they differ by {here:.2g} % of the span (rms, after the best fit of the model). A longer one of the
    same kind would help: four times as long halves the noise.
lacks: To see what this recording cannot show, {again}
unknown: No known cause fits. Record the same again and diagnose both together: that shows whether the device
    does the same again, so that a model of this kind cannot follow it, or something else acts on it.
comes and goes: What is left comes and goes, or jumps. Record the same again and diagnose both together: that
    shows whether the device does the same again, so that a model of this kind cannot follow it, or something
    else acts on it. Until then use the model as it is.
another kind: The device does the same again, so no other recording helps: a model of this kind does not
    follow it further. Use the model if what it leaves does not matter to you, or a model of another kind.
no model: No model of this program follows this device much further, as far as these recordings show. Use it
    for inputs like those recorded if what it leaves there does not matter to you, or take a model of another
    kind. Recordings at other rates, and with rests, show whether time has to do with it.
something acts: Something that is not in these recordings acts on the device or the sensor. Vary one thing at
    a time, such as temperature, load or supply, and record the same again each time. Then keep what matters
    as it is, and identify the model from a recording in which it was.
without the fault: A fault of the measurement may be hidden in these recordings. Put it right (a sensor that
    drifts must warm up), record the same again, and diagnose both together. If that does not show it,
    identify a model from the new recording, and diagnose these with that model.
none: Nothing was found in this recording beyond what is taken for noise: use the model as it is.
none, quick: The quick screen found nothing. The full diagnosis shows smaller effects.
none, seen: Nothing in this recording calls for another model: {names} can be seen, but in doubt or no larger
    than the noise. Use the model as it is.
none, correct: Nothing in this recording calls for another model: {names} can be seen, but no larger than the
    noise. Use the model as it is. To take that out too, go on with pulsetrainer correct.
in the model: The model as given contains {names} already, and fitted again to these recordings it would be
    hardly better: use it as it is.
none, small: Nothing that matters was found in this recording. What is left looks a little like {names}, but
    that is too small to matter, or does not predict what was left out of the fit. Use the model as it is.
none, small, quick: Nothing that matters was found in this recording. What is left looks a little like
    {names}, but that is too small to matter.
extend, quick: Run the full diagnosis, which fits what was found: a quick screen fits nothing that a model
    could be extended by, or that could be taken out of the recording.
too noisy: {keep} These recordings could not have shown {names} as small as {matters:.2g} % of the span. If
    that matters to you, record the same for {times:.2g} times as long, or with less noise, and diagnose that.
far too noisy: {keep} These recordings could not have shown {names} as small as {matters:.2g} % of the span,
    and longer ones would hardly do so. If that matters to you, record with less noise: averaged, with a finer
    sensor, or over a wider range.
inconclusive: {keep} These recordings could not have shown {names} of {matters:.2g} % of the span. If that
    matters to you, {again}
extend, or late: Is the recorder late, or the device? The two look exactly alike. If it is the device, extend
    the model with what was found; if it is the recorder, take the delay out of each recording (pulsetrainer
    correct RUN.h5 --delay SECONDS -o OUT.h5), and identify the model again. Then compare both models on
    another recording, one that was not fitted: pulsetrainer evaluate.
extend: Extend the model with what was found, then compare both models on another recording, one that was not
    fitted: pulsetrainer evaluate. If you have that recording already, give it to extend (--verify): only what
    holds there too is then added.
extend, correct: Extend the model with what was found, then compare both models on another recording, one that
    was not fitted: pulsetrainer evaluate. From the measurement: {names}; the extended model was fitted
    without that, so nothing has to be corrected first. For a clean recording, there is pulsetrainer correct.
rest first: The device was still settling when these recordings began, or had never been cycled. Cycle it once
    through its whole range, let it rest for {rest} where they begin, then record the same again and diagnose
    that: what was found can then be added to the model. The rest need not be recorded.
again: What was found is in doubt, or does not repeat within these recordings, so nothing is added to the
    model. Record the same again, and diagnose both recordings together.
correct: What was found is most likely a fault of the measurement, not of the model: take {names} out of the
    recording (pulsetrainer correct). If the model was identified from it, identify it again from the
    corrected one; a model from a sound recording stays as it is.
correct, extend: The measurement is most likely at fault, and the device does something that the model lacks.
    First take {names} out of the recording (pulsetrainer correct). If the model was identified from it,
    identify it again from the corrected one. Then diagnose the corrected recording, and extend the model.
conditions: The recordings were made in different conditions, such as load, zero or gain: the evidence says
    which of them the model as given predicts. Put the others right, or identify a model for each condition.
out of range: The model knows nothing of the {input} beyond {low} and {high}: identify the device again from a
    run over the whole range in which it is used, and diagnose with the new model.
clipped input: The recorder clips the {input} at {rail:.4g}{in_u}: widen its range, or keep the {input} within
    it, and record again. What it did not see cannot be put back (pulsetrainer correct does not try). Until
    then use no model that was identified from such a recording: it is wrong beyond {rail:.4g}{in_u}, and
    after the {input} was there. A model from a sound recording stays as it is.
repair: No model can represent this: put right what was found, and record again.
other model: A Preisach model does not suit this device: take the velocity as the input, or use a damper
    model.
other model, both: A Preisach model does not suit this device: use a model of a damper and a spring.
strokes: Record again in the same condition, at least three times between {low} and {high}, then with smaller
    loops that turn at {turns}, and diagnose that.
keep steady: Something that is not in these recordings changes the device or the measurement slowly. Let
    device and sensor warm up, cycle the device some twenty times through its range (it may be running in),
    keep room and supply as they are, look for draughts and loose plugs, and record the same again. Diagnose
    both together: if they differ, it was not the device.
identify anew: Identify the model again in this condition, from loops of many sizes: a new run, or these
    recordings if they hold such loops. If nothing was changed since, take them together with those that the
    model was identified from. Then diagnose with the new model.
warm up: Let device and sensor warm up, record the same again, and identify the model from that recording. If
    it then leaves little, something drifted here: go on with the new model. If it leaves as much, a Preisach
    model may not describe this device.
""").items()
}
_NOTHING_ELSE = ("lacks", "again")  # advice that a faster record takes the place of
_TIMES = ("rest", "tau", "apart")  # figures that are times
_TIED = ("tied", "tied, no better")
_SAYS_CORRECT = ("correct", "correct, extend", "extend, correct", "extend, or late", "none, correct")
# What to record instead
MISSING = sentences("""\
rates: the same loops at {slow}, {middle} and {fast}
holds: stops of {hold} at each of {levels}
length: {short} or more in all, with loops as fast as these
time: with the time of every sample, the same loops at {slow}, {middle} and {fast}, and stops of {hold} at
    each of {levels}
""")
EXPERIMENTS = sentences("""\
nested loops: loops of the {input} between {low} and {high}, ever smaller about {centre} (turning at {turns}),
    once each at {slow}, {middle}, {quick} and {fast}, each begun at {low}
steps and holds: steps of the {input} at {fast} to {levels}, with a stop of {hold} after each
equal minor loops: loops of the {input} at {pace} that are {width} wide, two each up from {biases}, reached
    once from {low} and once from {high}
equal cycles: twenty equal cycles of the {input} between {bottom} and {top} at {middle}, and twenty at {quick}
heating: full loops of the {input} at {pace}, one before and one after {heating} at {high}, and one more after
    {heating} at {low}
""")


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
        columns = (("time", "s"), (self.input, self.unit), (self.output, self.unit_of_output))
        shares = {"low": 0.0, "high": 1.0, "bottom": min(experiment.CYCLE), "top": max(experiment.CYCLE)}
        shares["centre"] = 0.5 * sum(experiment.TURNS[-2:])
        return {
            "input": self.input,
            "output": self.output,
            "second": "second" if self.timed else "sample",
            "seconds": "s" if self.timed else "samples",
            **{name: with_unit(self._number(share), self.unit) for name, share in shares.items()},
            "in_u": with_unit("", self.unit),
            "highest": self._number(1.0),
            "columns": joined(
                [f"{name} in {shown(unit)}" if shown(unit) else name for name, unit in columns]
            ),
            "levels": self._levels(experiment.LEVELS[1:-1]),
            "biases": self._levels(experiment.BIASES),
            "turns": self._levels(experiment.TURNS),
            "width": with_unit(figure(experiment.WIDTH * self.scale.reach), self.unit),
            **{name: self._rate(faster * one) for name, one in rates.items()},
            **{name: self.time(one / faster, math.ceil) for name, one in times.items()},  # or more
        }

    def lasting(self, name: str, faster: float) -> str:
        """Return how long an experiment takes, as the end of a phrase."""
        return f", about {self.time(experiment.length_s(name) / faster)} in all" if self.timed else ""

    def often(self, name: str, faster: float) -> str:
        """Return how often an experiment must be sampled, as the end of a phrase."""
        every = self.time(experiment.sampled_s(name) / faster, math.floor) if self.timed else ""
        return f", sampled at least every {every}" if every and not self.ours else ""

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
        return with_unit(figure(_set(ranges * self.scale.reach / self.scale.second)), per_second)

    def time(self, seconds: float, to_whole: Callable[[float], int] = round) -> str:
        """Return a time of the diagnosis in words, in the unit of the record, rounded as asked."""
        if not self.timed:
            return "several times as long as a loop takes"
        return with_seconds(_set(seconds * self.scale.second, to_whole))


def _set(value: float, to_whole: Callable[[float], int] = round) -> float:
    """Return a rate or a time as somebody would set it: 40 for 39.9."""
    step = float(f"1e{math.floor(math.log10(value)) + 1 - LIMITS.set_digits}")
    whole = to_whole(round(value / step, LIMITS.told_digits))  # rounding is no reason to go up
    return float(f"{whole * step:.{LIMITS.set_digits}g}")


def advice(one: Evidence, bench: Bench, command: str = "", removed: Sequence[str] = ()) -> str:
    """Return what to measure next, in numbers of the bench: one paragraph, or two with a line break between.

    ``command`` is what goes on with the recordings as they are, and ``removed`` what `correct` takes out.
    """
    faster = one.figures.get("faster", 1.0)
    numbers = bench.numbers(faster)
    tied = one.kind == "tied"  # its first name is that of the experiment
    faster_too = "tau" in one.figures and not bench.ours  # our device plays no faster signal
    played = one.names[0] if tied else "nested loops"
    names = one.names[1:] if tied else one.names
    lacked = [name for name in names if name in LACKS]
    faults = [name for name in names if name not in LACKS and library()[name].corrects]
    told = " ".join(_parts(one, command, len(faults), len(names), faster_too=faster_too))
    told = _with_what_lacks(told, lacked)
    return told.format(
        **numbers,
        names=listed([name for name in names if name not in LACKS] or names, numbers),
        lacked=listed(lacked, bench.numbers()),
        either=joined(names, "or"),
        removed=listed(removed, numbers),
        faults=listed(faults, numbers),
        experiment=EXPERIMENTS[played].format(**numbers),
        often=bench.often(played, faster),
        lasting=bench.lasting(played, faster),
        so_fast=", if device and recorder can be so fast" if faster > 1.0 and not bench.ours else "",
        missing="; ".join(MISSING[name].format(**bench.numbers()) for name in names if name in MISSING),
        command=BESIDE["ours" if bench.ours else "table"].format(**numbers),
        **{name: bench.time(value) if name in _TIMES else value for name, value in one.figures.items()},
    )


def _parts(one: Evidence, command: str, faults: int, names: int, *, faster_too: bool) -> Iterator[str]:
    """Yield the sentences of an advice, of so many names of which some are faults of the measurement."""
    if command == "correct" and one.kind not in (*_TIED, *_SAYS_CORRECT):
        yield BESIDE["also"]
    if one.kind in _TIED:
        yield from _of_ties(one, command, faults, names)
    elif not (faster_too and one.kind in _NOTHING_ELSE):
        yield ADVICE[one.kind]
        if "one rate" in one.figures:
            yield BESIDE["no rest"]
    if "together" in one.figures:
        yield BESIDE["together"]
    if faster_too:
        yield BESIDE["faster"]


def _of_ties(one: Evidence, command: str, faults: int, names: int) -> Iterator[str]:
    """Yield the sentences of an advice about causes that are tied."""
    if "mains" in one.figures:
        yield BESIDE["mains"]
    if command == "extend":
        yield BESIDE["extended"]
    if "one rate" in one.figures:
        yield BESIDE["one rate"]
    if command == "correct":
        yield BESIDE["whichever" if faults == names else "first"]
    yield ADVICE[one.kind]
    if 0 < faults < names:
        yield BESIDE["known"]


def _with_what_lacks(told: str, lacked: Sequence[str]) -> str:
    """Return advice with what to do about what the records lack, where it does not say so itself."""
    rate = [BESIDE["rate"]] if "time" in lacked else []
    if lacked and "{missing}" not in told:
        later = BESIDE["later"].replace("{again}", BESIDE["again"])
        return f"{told}\n{' '.join([later, *rate])}"  # a paragraph of its own: it may not matter
    return " ".join([*rate, told])
