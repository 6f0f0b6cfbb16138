"""``pulsetrainer session``: the trainer at work, for minutes, with keys, a rhythm, and a quiz."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, LimitCurrent, LimitForce, Out, Overwrite, Port, TrackHeat
from pulsetrainer.cli.settings import variable

if TYPE_CHECKING:
    from pulsetrainer.artefacts import Model
    from pulsetrainer.artefacts.session import Quiz
    from pulsetrainer.core.pulses import Shape
    from pulsetrainer.device.identity import DeviceInfo
    from pulsetrainer.steps.conductor import Decide
    from pulsetrainer.steps.programme import Programme
    from pulsetrainer.steps.quiz import Blind
    from pulsetrainer.steps.session import Now, Performed

_MOST_SEED = 2**31


def session(
    context: typer.Context,
    model: Annotated[Path, typer.Option(help="Model of the device, best an extended one.")],
    out: Out,
    pulses: Annotated[
        str, typer.Option(help="Names of the library or CSV files, separated by commas.")
    ] = "normal",
    rate: Annotated[
        float | None,
        typer.Option(help="Beats a minute, 20 to 240; default: each pulse's own.", show_default=False),
    ] = None,
    amplitude: Annotated[
        float, typer.Option(help="Height of the pulses, % of what the model reaches.")
    ] = 100.0,
    minutes: Annotated[
        float | None, typer.Option(help="Length; default: 5, or the quiz's.", show_default=False)
    ] = None,
    beats: Annotated[
        int | None, typer.Option(help="Length in beats, instead of minutes.", show_default=False)
    ] = None,
    variability: Annotated[
        float, typer.Option(help="Standard deviation of the intervals between beats, %.")
    ] = 0.0,
    respiration: Annotated[float, typer.Option(help="Swing of the intervals with the breath, %.")] = 0.0,
    ectopic: Annotated[float, typer.Option(help="Share of premature beats, %.")] = 0.0,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0,
            help="Of the rhythm and of the quiz's order; default: 0, for a quiz drawn.",
            show_default=False,
        ),
    ] = None,
    changes: Annotated[
        Path | None,
        typer.Option(
            help="Table of what changes when: t_s and any of rate, amplitude, pulse.", show_default=False
        ),
    ] = None,
    quiz: Annotated[int, typer.Option(min=0, help="Number of questions; 0: no quiz.")] = 0,
    answers: Annotated[
        Path | None,
        typer.Option(help="Answers to the quiz, a pulse name a line; default: by key.", show_default=False),
    ] = None,
    html: Annotated[
        Path | None, typer.Option(help="Score sheet to write.", show_default=False, envvar=variable("html"))
    ] = None,
    track_heat: TrackHeat = None,
    port: Port = None,
    limit_current_A: LimitCurrent = None,
    limit_force_N: LimitForce = None,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Press pulses for as long as wanted.

    On a terminal keys change rate, amplitude and pulse, pause and stop. With --quiz the pulses come blind.

    Example: pulsetrainer session --model extended.h5 -o session.h5 --pulses normal,bifid --minutes 2
    """
    from pulsetrainer.files.pulses import pulse_file
    from pulsetrainer.simulation.options import check_port

    names = [name for name in (part.strip() for part in pulses.split(",")) if name]
    tables = [pulse_file(name) for name in names]
    check_port(port)
    job = Job(
        context,
        inputs=(model,),
        tables=(changes, answers),
        outputs=(out, html),
        overwrite=overwrite,
        as_json=json,
    )
    for path, name in zip(tables, names, strict=True):
        if str(path) == name:
            job.uses(path)
    asked = _Asked(
        names,
        rate,
        amplitude,
        minutes,
        beats,
        variability,
        respiration,
        ectopic,
        seed,
        changes,
        quiz,
        answers,
    )
    from pulsetrainer.artefacts import Model
    from pulsetrainer.device.limits import Limits
    from pulsetrainer.steps.session import check_model

    loaded = job.load(model, Model)
    check_model(loaded)
    limits = Limits(limit_current_A, limit_force_N)
    _press(job, out, html, asked, loaded, port, limits, track_heat=track_heat)


@dataclass
class _Asked:
    """What the command line asks for."""

    names: list[str]
    rate: float | None
    amplitude: float
    minutes: float | None
    beats: int | None
    variability: float
    respiration: float
    ectopic: float
    seed: int | None
    changes: Path | None
    quiz: int
    answers: Path | None
    pressed: list[tuple[str, float]] = field(default_factory=list)  # answers by key, not yet taken

    def __post_init__(self) -> None:
        if self.seed is None:
            import secrets

            # an order that nobody can look up; the file tells it when all is answered
            self.seed = secrets.randbelow(_MOST_SEED) if self.quiz else 0

    def decider(self) -> tuple[Programme | Blind, tuple[float | None, ...]]:
        """Return who decides what is played, and between which rates."""
        from pulsetrainer.files.changes import read_answers, read_changes
        from pulsetrainer.steps.programme import Change
        from pulsetrainer.steps.session import programme

        return programme(
            [Path(name).stem if name.lower().endswith(".csv") else name for name in self.names],
            rate=self.rate,
            amplitude=self.amplitude,
            minutes=self.minutes,
            beats=self.beats,
            changes=[Change(*row) for row in read_changes(self.changes)] if self.changes else (),
            quiz=self.quiz,
            answers=read_answers(self.answers) if self.answers else self._by_key,
            seed=self.seed or 0,
        )

    def _by_key(self, _question: int) -> tuple[str, float] | None:
        return self.pressed.pop(0) if self.pressed else None


def _press(
    job: Job,
    out: Path,
    html: Path | None,
    asked: _Asked,
    model: Model,
    port: str | None,
    limits: Any,
    *,
    track_heat: bool | None,
) -> None:
    """Press, record, save and say."""
    from pulsetrainer.cli import live
    from pulsetrainer.core.rhythm import Rhythm
    from pulsetrainer.errors import UsageError
    from pulsetrainer.files.pulses import read_pulse
    from pulsetrainer.files.recorder import interrupted
    from pulsetrainer.files.session_recorder import SessionRecorder
    from pulsetrainer.steps.quiz import Blind
    from pulsetrainer.steps.session import LEAD_S, LIVE_LEAD_S, perform

    chosen, rates = asked.decider()
    assert asked.seed is not None
    job.notes(
        [
            f"{left} holds {samples} samples of an interrupted session: it can be read as a run; delete it"
            for left, samples in interrupted(out)
        ]
    )
    rhythm = Rhythm(asked.variability / 100, asked.respiration / 100, asked.ectopic / 100, asked.seed)
    shapes = [read_pulse(name) for name in asked.names]
    dark = "a result in JSON has no live view" if job.screen.as_json else live.why_not()
    blind = isinstance(chosen, Blind)
    if blind and asked.answers is None and dark:
        raise UsageError(f"a quiz is answered by key, and {dark}", hint="give the answers in a file")
    if dark and "small" in dark:
        job.notes([f"{dark}; there are no keys"])
    view, decide, screen = _steered(asked, chosen, shapes, dark)
    with job.open_device(port, limits) as device:
        info = device.info
        recorder = SessionRecorder(
            out, job.header("a session under way"), overwrite=job.overwrite, signal="session"
        )
        with recorder, job.working("session") as progress, screen:

            def watch(now: Now) -> None:
                view(now)
                if not blind:
                    progress(chosen.share(0, now.time_s) if asked.beats is None else 0.0)  # type: ignore[union-attr]

            done = perform(
                model,
                device,
                shapes,
                decide,
                _Sink(recorder.press),
                rhythm=rhythm,
                rates=rates,
                lead_s=LEAD_S if dark or blind else LIVE_LEAD_S,
                track_heat=track_heat,
                watch=watch,
            )
            quiz = chosen.quiz(out.stem) if isinstance(chosen, Blind) else None
            job.know("seed", asked.seed)
            header = job.header(f"session on {info.serial}", device=job.device(info))
            fields = done.fields | {"pulses": tuple(shape.name for shape in shapes), "quiz": quiz}
            if done.beats.start_s.size:
                recorder.keep(fields, header)
            recorder.finish(complete=not done.fault, dropped_samples=done.dropped)
    _tell(job, out, html, done, quiz, info)


@dataclass(frozen=True, slots=True)
class _Sink:
    append: Callable[..., None]


def _steered(
    asked: _Asked, chosen: Programme | Blind, shapes: list[Shape], dark: str
) -> tuple[Callable[[Now], None], Decide, contextlib.AbstractContextManager[None]]:
    """Return what looks at every piece, who decides, and the screen, with keys where there is a terminal."""
    from pulsetrainer.cli.live import Live, letters
    from pulsetrainer.core.heartbeat import Pulse
    from pulsetrainer.steps.quiz import Blind
    from pulsetrainer.steps.steering import Steering

    if dark:
        return lambda _now: None, chosen, contextlib.nullcontext()
    names = [shape.name for shape in shapes]
    steering = Steering(chosen, [Pulse(shape).own_bpm for shape in shapes])

    def press(key: str, at_s: float) -> None:
        if not isinstance(chosen, Blind):
            steering.press(key)
        elif key in letters()[: len(names)]:
            asked.pressed[:] = [(names[letters().index(key)], at_s)]
        elif key == "Q":
            steering.press("q")

    screen = Live(press, names, blind=isinstance(chosen, Blind))
    if isinstance(chosen, Blind):
        blind = chosen
        screen.status = lambda: (
            f"question {min(blind.question + 1, asked.quiz)} of {asked.quiz}"
            + (", answered" if asked.pressed else "")
        )
    else:
        screen.status = lambda: "paused" if steering.paused else ""
    return screen, steering, screen.on_screen()


def _tell(
    job: Job, out: Path, html: Path | None, done: Performed, quiz: Quiz | None, info: DeviceInfo
) -> None:
    """Write the sheet and say what came out, also where the session was stopped."""
    from pulsetrainer.artefacts import Session
    from pulsetrainer.errors import PulsetrainerError
    from pulsetrainer.files import store
    from pulsetrainer.steps.quiz import score
    from pulsetrainer.steps.stopped import raise_if_stopped

    job.notes(done.notes)
    if done.beats.start_s.size and html is not None:
        from pulsetrainer.report.score_sheet import render_session

        header = store.read_header(out)
        page = render_session(
            store.read(out, Session),
            None if quiz is None else score(quiz),
            title=header.title,
            created=header.created,
            provenance_json=header.provenance.to_json(),
            history=header.history,
        )
        job.write(html, page)
    try:
        raise_if_stopped(done.fault, done.remedy, "the session")
    except PulsetrainerError as error:
        error.message += f"; {done.beats.start_s.size} beats were kept in {out} (complete=false)"
        raise
    payload: dict[str, Any] = {
        "output": out,
        "beats": int(done.beats.start_s.size),
        **done.figures,
        "underruns": done.underruns,
        "parts": done.parts,
        "force_range_N": (done.reach.low, done.reach.high),
        "clipped_samples": done.clipped,
        "dropped_samples": done.dropped,
        "temperature_K": [kelvin for _, kelvin in done.temperature] or None,
        "serial": info.serial,
        "firmware": info.firmware,
    }
    rows: dict[str, Any] = {
        "beats": f"{payload['beats']} in {done.parts} part{'s' if done.parts > 1 else ''}",
        "force": f"{done.reach.low:.2f} .. {done.reach.high:.2f} N at full amplitude",
        "error": f"{done.figures['mean_abs_error_percent']:.2f} % mean, "
        f"{done.figures['max_abs_error_percent']:.2f} % at most, of full force",
        "timing": f"{done.figures['beat_timing_max_ms']:.2f} ms at most",
        "variation": f"{done.figures['rate_cv_percent']:.3f} % of rate, "
        f"{done.figures['amplitude_cv_percent']:.2f} % of height",
        "underruns": done.underruns,
    }
    if done.temperature:
        kelvins = [kelvin for _, kelvin in done.temperature]
        rows["coil"] = f"{kelvins[0]:+.1f} to {kelvins[-1]:+.1f} K against calibration, made up for"
    if quiz is not None:
        result = score(quiz)
        payload["quiz"] = {
            "asked": result.asked,
            "right": result.right,
            "interval": result.interval,
            "chance": result.chance,
            "p_value": result.p_value,
            "response_s": result.response_s,
            "confusion": quiz.confusion,
        }
        low, high = (100 * end for end in result.interval)
        rows["right"] = (
            f"{result.right} of {result.asked}: {100 * result.share:.0f} %, 95 % interval {low:.0f} to "
            f"{high:.0f} %"
        )
    job.screen.result(payload)
    job.screen.facts(f"{out}: a session on {info.serial}", rows)
