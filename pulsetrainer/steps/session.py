"""Session: pulses for as long as wanted, beat by beat, recorded and judged while they are pressed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pulsetrainer.artefacts import Model
from pulsetrainer.artefacts.session import Quiz, Session
from pulsetrainer.core.heartbeat import FASTEST_BPM, SLOWEST_BPM, Pulse
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.pulses import Shape
from pulsetrainer.core.rhythm import Rhythm
from pulsetrainer.device.device import Device
from pulsetrainer.device.limits import ON_TIME_S, RAMP_S, Limits, Rehearsal, check_force, check_peak
from pulsetrainer.diagnosis.prediction import extended_of
from pulsetrainer.errors import DataError, DeviceError
from pulsetrainer.steps.arguments import check_asked_for
from pulsetrainer.steps.conductor import RATE_HZ, Conductor, Decide, Given, Pause, Reach
from pulsetrainer.steps.heat import coil_of, rest_force, thermometer_of
from pulsetrainer.steps.invertible import major_loop
from pulsetrainer.steps.one_thread import one_thread
from pulsetrainer.steps.own_device import check_units
from pulsetrainer.steps.performance import TOO_SHORT, Now, Performance, Performed, Sink
from pulsetrainer.steps.programme import Change, Programme
from pulsetrainer.steps.progress import Progress, silent
from pulsetrainer.steps.quiz import Answer, Blind, from_list, order
from pulsetrainer.steps.recording import PAUSE_S
from pulsetrainer.steps.stopped import raise_if_stopped

LEAD_S = 3.0  # of current that is ready before its time: how long this computer may be busy with other things
LIVE_LEAD_S = 0.5  # the same where a person changes what comes next
_SETTLED = 4.0  # of the slowest time constant of a model
_LONGEST_SETTLING_S = 300.0


class InMemory:
    """A sink that keeps everything."""

    def __init__(self) -> None:
        self.blocks: list[FloatArray] = []

    def append(self, *columns: FloatArray) -> None:
        """Take samples in."""
        self.blocks.append(np.stack(columns))

    def judge(self, _fields: object) -> None:
        """Keep nothing: what it amounts to is known at the end."""


def check_model(model: Model) -> None:
    """Raise DataError for a model of another device or another form, or whose weights are read as relays."""
    check_units(model)
    if model.form != "direct":
        raise DataError(
            f"the model has the form {model.form}; a session carries the memory of direct models only",
            hint="identify with `form` direct",
        )
    if model.reading != "continuous":
        raise DataError(
            f"the weights of the model are read as {model.reading}, which has no continuous inverse",
            hint="identify with `reading` continuous",
        )


def reach_of(model: Model, pulses: Sequence[Pulse], rates: Sequence[float | None]) -> Reach:
    """Return the forces that every beat reaches with the range of the input, cold as well as in the long run.

    The model is given each pulse as its input, over the whole range and at the slowest and the fastest rate,
    until its slowest cause has settled: heat, lag and creep keep a pulse from the ends of the static loop.
    """
    extended = extended_of(model)
    low, high = float(model.edges[0]), float(model.edges[-1])
    slow = [p.value for e in model.extensions for p in e.parameters if p.unit == "s"]
    seconds = min(_SETTLED * max(slow, default=0.0) + 4.0, _LONGEST_SETTLING_S)
    lead = major_loop(low, high, RATE_HZ)
    lows, highs = [], []
    for pulse in pulses:
        asked = {rate or pulse.own_bpm for rate in rates}
        for bpm in {max(min(asked), SLOWEST_BPM), min(max(asked), FASTEST_BPM)}:
            record = pulse.record(pulse.own_bpm / bpm, RATE_HZ)
            turns = max(2, int(np.ceil(seconds * RATE_HZ / record.size)))
            level = np.tile(record, turns)
            if model.polarity < 0:
                level = 1.0 - level
            made = extended(np.concatenate((lead, low + (high - low) * level)), 1.0 / RATE_HZ)
            last = made[-record.size :]
            cold = made[lead.size + record.size : lead.size + 2 * record.size]
            lows.append(max(float(last.min()), float(cold.min())))
            highs.append(min(float(last.max()), float(cold.max())))
    return Reach(max(lows), min(highs))


def _check_stroke(model: Model, current_A: float, force_N: float) -> None:
    """Refuse a model whose whole range, over which each part of a session begins, is beyond a limit."""
    check_peak(model.edges, current_A)
    stroke = major_loop(float(model.edges[0]), float(model.edges[-1]), RATE_HZ)
    check_force(stroke, RATE_HZ, force_N, extended_of(model)(stroke, 1.0 / RATE_HZ))


@one_thread
def perform(
    model: Model,
    device: Device,
    pulses: Sequence[Shape],
    decide: Decide,
    sink: Sink,
    *,
    rhythm: Rhythm,
    rates: Sequence[float | None] = (None,),
    lead_s: float = LEAD_S,
    track_heat: bool | None = None,
    watch: Callable[[Now], None] = lambda _now: None,
) -> Performed:
    """Press what ``decide`` decides until it decides the end, and judge every beat.

    Between the slowest and the fastest of the ``rates`` (beats a minute; None: its own) every pulse reaches
    its full amplitude. A beat is decided and made ``lead_s`` before its time. ``track_heat`` tells the
    coil's temperature from the duty, before and throughout, and makes up for the force that it costs;
    None: where the model has a thermal term and knows the coil. ``watch`` gets each piece of telemetry.

    DataError where the model cannot be used; DeviceError where the model foretells a force
    beyond the limit in force, the device cannot be talked to, or its firmware knows no open-ended waves.
    """
    check_model(model)
    _check_stroke(model, device.info.current_limit_A, device.info.force_limit_N)
    beating = [Pulse(shape) for shape in pulses]
    reach = reach_of(model, beating, rates)
    meter = thermometer_of(model, device, asked=track_heat)
    if meter is not None:
        meter.restart()
        rest, left = rest_force(model), 1.0 - max(meter.extra, 0.0)  # a warm coil does not reach as high
        reach = Reach(reach.low, rest + (reach.high - rest) * left)
    performance = Performance(model, device, beating, rhythm, decide, sink, reach, watch, meter)
    return performance.run(lead_s)


@dataclass(frozen=True, slots=True)
class Plan:
    """What would be pressed."""

    beats: int
    seconds: float  # all pauses included
    pulses: dict[str, int]  # beats of each
    parts: int  # in which the device is on: no longer than it stays on in one go
    longest_part_s: float  # that it may take
    pauses: tuple[Pause, ...]  # to let the coil cool
    heat_percent: float  # the most, of that at which the device stops
    peak_force_N: float  # foretold by the model
    pulse_force_N: float  # the most that a beat presses; below the peak where pulses are lower
    peak_current_A: float
    rms_current_A: float


@one_thread
def plan(
    model: Model,
    pulses: Sequence[Shape],
    decide: Decide,
    *,
    rhythm: Rhythm,
    rates: Sequence[float | None] = (None,),
    track_heat: bool | None = None,
    limits: Limits | None = None,
    watch: Callable[[float], None] = lambda _time_s: None,
) -> Plan:
    """Return what ``perform`` would press on a device as it is delivered, with a cold coil; fails as it.

    ``watch`` is called with each time, s, up to which it is known.
    """
    check_model(model)
    rehearsal = Rehearsal(limits or Limits())
    _check_stroke(model, rehearsal.current_A, rehearsal.force_N)
    beating = [Pulse(shape) for shape in pulses]
    reach = reach_of(model, beating, rates)
    coil_of(model, asked=track_heat)
    count = dict.fromkeys((pulse.name for pulse in beating), 0)
    square = peak_A = peak_N = pulse_N = 0.0

    def give(piece: Given) -> None:
        nonlocal square, peak_A, peak_N, pulse_N
        rehearsal.stream(piece.input, RATE_HZ, piece.predicted)
        square += float(np.sum(piece.input**2))
        peak_A, peak_N = max(peak_A, float(piece.input.max())), max(peak_N, float(piece.predicted.max()))
        if piece.beat is not None:
            pulse_N = max(pulse_N, float(piece.predicted.max()))
            count[beating[piece.beat.play.pulse].name] += 1

    conductor = Conductor(extended_of(model), beating, reach, rhythm, decide, give)
    parts, longest_s = 0, ON_TIME_S - RAMP_S
    while not conductor.ended:
        parts += 1
        for _ in conductor.part(longest_s):
            watch(conductor.time_s)
        if not conductor.ended and conductor.idle:
            raise_if_stopped(*TOO_SHORT, "the session")
    return Plan(
        beats=sum(count.values()),
        seconds=conductor.time_s + PAUSE_S * (parts - 1),
        pulses=count,
        parts=parts,
        longest_part_s=longest_s,
        pauses=tuple(conductor.pauses),
        heat_percent=100.0 * rehearsal.most_heat,
        peak_force_N=peak_N,
        pulse_force_N=pulse_N,
        peak_current_A=peak_A,
        rms_current_A=float(np.sqrt(square / (conductor.time_s * RATE_HZ))),
    )


def session(
    model: Model,
    device: Device,
    *,
    pulses: Sequence[Shape],
    rate: float | None = None,
    amplitude: float = 100.0,
    minutes: float | None = None,
    beats: int | None = None,
    variability: float = 0.0,
    respiration: float = 0.0,
    ectopic: float = 0.0,
    seed: int = 0,
    changes: Sequence[Change] = (),
    quiz: int = 0,
    answers: Sequence[str] | Answer = (),
    decide: Decide | None = None,
    track_heat: bool | None = None,
    progress: Progress = silent,
) -> Session:
    """Press pulses for as long as wanted, beat by beat, and return everything, every beat judged.

    Parameters
    ----------
    pulses
        Each is pressed for an equal share of the time. ``pt.session`` takes names in the library, tables,
        drives, or times (s) and values.
    rate
        Beats a minute, 20 to 240; None: each pulse's own.
    amplitude
        Height of the pulses, % of what every beat reaches.
    minutes, beats
        When it ends; neither: after five minutes, or with the quiz.
    variability, respiration, ectopic
        Irregularity of the rhythm, %: see ``core.rhythm.Rhythm``.
    seed
        Seed of the rhythm, and of the order of a quiz.
    changes
        What changes when.
    quiz, answers
        Number of questions, and the answers to them: a list, or a callable that is asked for each.
    decide
        Instead of all that: asked for each beat what is to be played; see ``steps.conductor``.
    track_heat
        As in ``perform``.
    progress
        Called with the share of the work done, 0 to 1.

    Raises
    ------
    UsageError
        There is no pulse of that name, or a rate, an amplitude or a pulse cannot be played.
    DataError
        The model is of another device, or an answer names a pulse that is not asked.
    DeviceError, Interrupted
        The device or the user stopped it; what was recorded is in the error's ``kept``.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> with pt.open_device("bench:") as device:
    ...     run = pt.capture("identification", device, levels=16)
    ...     pressed = pt.session(pt.identify(run, levels=16), device, pulses=["normal", "bifid"], beats=4)
    >>> pressed.beats.start_s.size, pressed.underruns
    (4, 0)
    """
    names = [shape.name for shape in pulses]
    programme = Programme(
        names, rate=rate, amplitude=amplitude, beats=beats, minutes=minutes, changes=changes
    )
    chosen, rates = with_quiz(programme, quiz, answers, seed)
    sink, rhythm = InMemory(), Rhythm(variability / 100.0, respiration / 100.0, ectopic / 100.0, seed)

    def watch(now: Now) -> None:
        if isinstance(chosen, Programme):
            progress(chosen.share_at(now.time_s))

    done = perform(
        model,
        device,
        pulses,
        decide or chosen,
        sink,
        rhythm=rhythm,
        rates=rates,
        track_heat=track_heat,
        watch=watch,
    )
    asked = chosen.quiz() if isinstance(chosen, Blind) else None
    kept = _session(sink, done, asked)
    raise_if_stopped(done.fault, done.remedy, "the session", kept)
    if kept is None:
        raise DeviceError("the session brought back no sample", hint="check the line to the device")
    return kept


def with_quiz(
    programme: Programme, quiz: int, answers: Sequence[str] | Answer, seed: int
) -> tuple[Programme | Blind, tuple[float | None, ...]]:
    """Return who decides, and between which rates every pulse shall reach its full amplitude.

    A quiz asks for the pulses as the programme begins them. Raises as ``session``.
    """
    names = programme.names
    check_asked_for(None if callable(answers) else answers, quiz, names)
    if not quiz:
        return programme, programme.rates
    asked = order(len(names), quiz, seed)
    answer = answers if callable(answers) else from_list(answers, names, quiz)
    return Blind(names, asked, answer, programme.start), programme.rates[:1]


def _session(sink: InMemory, done: Performed, asked: Quiz | None) -> Session | None:
    if not sink.blocks:
        return None
    time_s, target, reference, current, force = np.concatenate(sink.blocks, axis=1)
    samples = {"time_s": time_s, "target": target, "reference": reference, "input": current, "output": force}
    return Session(**samples, **done.fields, quiz=asked)
