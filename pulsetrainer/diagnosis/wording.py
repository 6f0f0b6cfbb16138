"""Evidence in words.

Here and in ``advice_wording`` a diagnosis is put into English; causes have texts of their own in their files.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.evidence import Evidence, sentences
from pulsetrainer.diagnosis.finding import Finding
from pulsetrainer.diagnosis.thresholds import LIMITS

# What evidence says, by its kind: figures in braces, and {input} and {output} for what was measured
TEXTS = sentences("""\
background: it, or what it could equally be, is no larger than what wanders slowly in these recordings, and
    may be part of that: reported, but not a verdict
static: Refitted to these recordings without any cause, the model leaves {left:.3f} % of the span (rms of
    short averages). Noise and the number of levels alone would leave {floor:.3f} %.
tested: the probability that noise alone looks like it is at most {p:.4f}. It accounts for {explains:.1f} % of
    the squared error beyond noise. {signature}.
tested, small: the probability that noise alone looks like it is at most {p:.4f}. Its share of the error
    cannot be determined: the whole error is no more than noise and levels may leave. {signature}.
extended: With these causes in the model, {left:.3f} % of the span remains (rms of short averages).
would have shown: The smallest effects that these recordings would have shown, rms, % of the span: {limits}
would have shown, some: The smallest effects that these recordings would have shown, rms, % of the span:
    {limits}. Of {names} they would have shown no effect below a tenth of the span
not whole: Not all of it is explained by {names}: {rest:.2g} % of the span comes from something else, which
    noise and levels do not account for
slow noise: What is taken for noise here is slow: it leaves {white:.2g} % of the span in short averages,
    {times:.1f} times what the noise from sample to sample would leave. If it is not the sensor itself,
    something that was not recorded acts on the device, or the model cannot follow a device of this kind
bursts: What is left comes and goes, or jumps, which noise does not do: it leaves {white:.2g} % of the span in
    short averages, {times:.1f} times what the noise from sample to sample would leave. Something that was not
    recorded acts on the device or the sensor, or the model cannot follow a device of this kind
zero wanders: What is left follows time alone as well as it follows any state of the device: the zero of the
    {output} wanders, or the device changes slowly
comes again: In two of these recordings the {input} is the same, and {share:.0f} % of what is left is the same
    too (squared, beyond noise). So it comes from the device, or from what is done to it each time, and no
    model of this kind follows it
differs: In two of these recordings the {input} is the same, but {share:.0f} % of what is left differs
    (squared, beyond noise). So it does not come from the {input}: something that was not recorded acts on the
    device or the sensor
not accepted: What is left looks more like {names} than noise alone does (p = {p:.3f}), as small errors of the
    model do, too. When it is fitted together with the model, it is too small to matter, or it does not
    predict the parts of the recordings that were left out. So it is not named.
held: it would account for {share:.1f} % of the squared error beyond noise, but the weights of a model fitted
    to these recordings can absorb nearly all of such a fault. So these recordings show neither how large it
    is nor whether it is there, and it is not named. To find out, diagnose another recording together with
    these
not repeated: A learned dependence fits what is left, but it did not repeat when whole stretches of time were
    left out, so it is not taken for a property of the device
largest: The remaining error is largest {place}: {times:.1f} times the error where it is smallest.
quick: Quick screen: no cause was fitted together with the model, so strengths are rough: off by a tenth or
    more.
lacks: The recording is limited: {names}.
untimed: The recordings have no time, so only causes that depend on the order of the samples were tried
    ({names}, and the checks on the raw data), and none that depend on rate.
wrong kind: {output} follows the velocity of {input}, not {input} itself: a Preisach model in {input} is the
    wrong model here. It leaves {preisach:.1f} % of the span (rms), a plain function of the velocity leaves
    {velocity:.1f} %. Use the velocity as the input, or a damper model
wrong kind, both: {output} follows the velocity of {input} as well as {input} itself: a Preisach model in
    {input} is the wrong model here. It leaves {preisach:.1f} % of the span (rms), a plain function of the
    velocity {velocity:.1f} %, and one with an added part in proportion to {input} {beside:.1f} %. Use a model
    of a damper and a spring
pinched: All branches of the loop pass through one point, where the {input} is about {at:.3g}{in_u}. No
    Preisach model has such a loop, so the model does not describe this record, and what is left is not taken
    for noise. A resistor with a memory (a memristor) has one: use a model y = G(w) u
given worse: The model as given leaves {given:.2f} % of the span (rms of single samples); weights refitted to
    these recordings leave {refitted:.2f} %. It does not carry over: the device, its zero or its sensor was
    not the same when it was identified, or a model of this kind does not describe the device
given worse, own: The model as given leaves {given:.2f} % of the span (rms of single samples); weights
    refitted to these recordings leave {refitted:.2f} %, although it comes from them. Free weights
    follow something that smooth ones do not, which need not be hysteresis: it may be a slow drift. A model
    from another recording would show which
one stroke: The model as given leaves {given:.2f} % of the span, but the {input} never turns in these
    recordings: a first stroke differs from all later ones, so they do not show whether the device has changed
crossed: All branches of the loop cross at one point, where the {input} is about {at:.3g}{in_u}, like those of
    a butterfly. Even weights of either sign leave more than noise, so no Preisach model describes this device
given better: The model as given predicts these recordings better than any extension that was tried, so none
    is proposed.
not carried over: A Preisach model fitted anew leaves {refitted:.2g} % of the span of these recordings, but
    {left_out:.2g} % of parts that were left out of that fit; the model as given leaves {given:.2g} %. So
    these recordings do not show whether the device has changed: no Preisach model may describe it well, or
    they are too short to fit one
no gain: Extended by {names} and started from rest, the model would predict these recordings hardly better
    than without ({extended:.3g} % of the span against {given:.3g} %), so nothing is added to it.
in the model: The model as given contains {names} already. Fitted again to these recordings and started from
    rest, it would leave {extended:.3g} % of the span (rms of single samples, less faults of the measurement);
    as given it leaves {given:.3g} %. So nothing is added to it.
no better: Extended by {names} and started from rest, the model would predict these recordings worse than
    without ({extended:.3g} % of the span against {given:.3g} %), so nothing is added to it.
under way: Extended by {names} and started from rest, the model would predict these recordings worse than
    without ({extended:.3g} % of the span against {given:.3g} %), so nothing is added to it. It describes them
    only if their starting state is left free: the device was still settling from what came before.
overshadowed: The change accounts for {share:.2f} % of the squared error. Adding {names} would only reduce
    what remains, {left:.2g} % of the span: too little to be named.
""")
# What a cause is known by; whether the records lack what shows it
SIGNATURES: Mapping[bool, str] = {
    False: "Its signature: {mark}",
    True: "Its signature, part of which is missing in these recordings: {mark}",
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
DOUBTS = sentences("""\
predicts worse: it makes the prediction of parts of the recordings that were left out worse
does not repeat: it fits, but does not repeat: it is not added to the model
not added: so it is not added to the model
may be a fault: a fault of the measurement in this recording alone would look like it: it is not added to the
    model
may be wear: here a gain that wears off, with time or with the distance that the input has travelled, would
    look like it
settles: something that settles from the start of the recording would look like it, and that is not sudden
one stretch: nearly all that it explains lies in one short stretch of the recording, and a step changes all
    that comes after: it is neither added nor taken out
rate changes: the {input} changes its speed at that moment, and what another cause lacks of a dependence on
    speed would look like it: it is neither added nor taken out
wanders: what is left still wanders, so it may be part of that: it is neither added nor taken out
predicts little: on parts of the recordings that were left out it explains less than half of what could be
    explained, as any cause may if the model cannot follow a device of this kind
imitates: on parts of the recordings that were left out it predicts less than three quarters of what the model
    leaves without it: something else that the device does as it moves may look like it
two sizes: how large it is these recordings do not tell, since it has another course than its formula: it is
    neither added nor taken out
spans zero: its strength may be zero: the interval includes zero
no equal loops: only a minor loop traced three times in equal time would show it; there is none
at bound: a parameter, or the interval of one, is at the end of the range that was searched
strength at bound: its strength is at the end of the range that was searched, so it is something else
in step: it keeps step with the loops, and the model without it can follow most of it: it may be what the
    device itself does. Loops at another rate would show which
leaves more: it takes away less than it leaves, so it may be an error of the model itself
own error: on a recording of one rate it cannot be distinguished from an error of the model itself: there
    whatever takes time is a shape of the loop
""")
# What recordings may lack, with {hold_least} and {short} for the bench: see ``advised.Bench.numbers``
LACKS: Mapping[str, str] = {
    "rates": f"nearly all of it was run at one rate, or at rates less than {LIMITS.one_rate:g} times apart",
    "holds": "the {input} never rests for {hold_least} or more",
    "length": "all of it lasts less than {short}",
    "time": "its samples have no time",
}


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
        "names": listed(one.names, known),
        "limits": joined([f"{name} {figure(size, 2)}" for name, size in sorted(one.figures.items())]),
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


def listed(names: Sequence[str], numbers: Mapping[str, str]) -> str:
    """Return ``a, b and c``; what a record lacks is spelled out in numbers."""
    return joined([LACKS[name].format(**numbers) if name in LACKS else name for name in names])


def joined(words: Sequence[str], word: str = "and") -> str:
    """Return ``a, b and c``."""
    *rest, last = words or [""]
    return f"{', '.join(rest)} {word} {last}" if rest else last
