"""``pulsetrainer session``: the trainer at work, for minutes, with keys, a rhythm, and a quiz."""

from __future__ import annotations

import secrets
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Context, Option

import pulsetrainer as pt
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, DryRun, LimitCurrent, LimitForce, Out, Overwrite, Port, TrackHeat

if TYPE_CHECKING:
    from pulsetrainer.files.provenance import Header
    from pulsetrainer.steps.performance import Now

_MOST_SEED = 2**31


def session(
    context: Context,
    model: Annotated[Path, Option(help="Model of the device, ideally an extended one.")],
    out: Out,
    pulses: Annotated[
        str, Option(help="Names of the library or CSV files, separated by commas; each gets an equal share.")
    ] = "normal",
    rate: Annotated[
        float | None, Option(help="Beats a minute, 20 to 240; default: each pulse's own.")
    ] = None,
    amplitude: Annotated[float, Option(help="Height of the pulses, % of what the model reaches.")] = 100.0,
    minutes: Annotated[float | None, Option(help="Length, min; default: 5, or the quiz's.")] = None,
    beats: Annotated[int | None, Option(help="Length in beats, instead of minutes.")] = None,
    variability: Annotated[
        float, Option(min=0, max=25, help="Standard deviation of the intervals between beats, %.")
    ] = 0.0,
    respiration: Annotated[
        float, Option(min=0, max=30, help="Swing of the intervals with each breath, %.")
    ] = 0.0,
    ectopic: Annotated[float, Option(min=0, max=50, help="Share of premature beats, %.")] = 0.0,
    seed: Annotated[
        int | None,
        Option(
            min=0,
            help="Seed of the rhythm and of a quiz's order; default: 0, for a quiz a new one each time.",
        ),
    ] = None,
    changes: Annotated[
        Path | None, Option(help="Table of changes over time: t_s and any of rate, amplitude, pulse.")
    ] = None,
    quiz: Annotated[int, Option(min=0, help="Number of questions; 0: no quiz.")] = 0,
    answers: Annotated[
        Path | None,
        Option(help="File of answers to the quiz, one pulse name a line; default: answered on the keyboard."),
    ] = None,
    html: Annotated[Path | None, Option(help="Score sheet to write.")] = None,
    track_heat: TrackHeat = None,
    port: Port = None,
    limit_current_A: LimitCurrent = None,
    limit_force_N: LimitForce = None,
    dry_run: DryRun = False,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Press pulses for as long as you like.

    On a terminal, keys change rate, amplitude and pulse, pause and stop; the simulated device then keeps
    pace with the clock. With --quiz learners name pulses that are not shown.

    Example: pulsetrainer session --model extended.h5 -o session.h5 --pulses normal,bifid --minutes 2
    """
    from pulsetrainer.files.pulses import library, pulse_file, read_pulse
    from pulsetrainer.steps.arguments import check_asked_for

    names = [name for name in (part.strip() for part in pulses.split(",")) if name]
    check_asked_for(answers, quiz, names)
    tables = [pulse_file(name) for name in names]
    job = Job(context, inputs=(model,), tables=(changes, answers), outputs=(out, html))
    job.uses(*(path for path, name in zip(tables, names, strict=True) if name not in library()))
    from pulsetrainer.cli.keys import Keys
    from pulsetrainer.core.rhythm import Rhythm
    from pulsetrainer.files.changes import read_answers, read_changes
    from pulsetrainer.steps.one_beat import notes_of_tables
    from pulsetrainer.steps.programme import Change, Programme, hardly_felt, too_late
    from pulsetrainer.steps.quiz import Blind
    from pulsetrainer.steps.session import LEAD_S, LIVE_LEAD_S, check_model, plan, with_quiz

    loaded = job.load(model, pt.Model)
    check_model(loaded)
    if seed is None:  # in a quiz one that nobody can look up; the file tells it when all is answered
        seed = secrets.randbelow(_MOST_SEED) if quiz else 0
    keys = Keys([Path(name).stem if name.lower().endswith(".csv") else name for name in names])
    rows = read_changes(changes, keys.names) if changes else []
    chosen, rates = with_quiz(
        Programme(
            keys.names,
            rate=rate,
            amplitude=amplitude,
            beats=beats,
            minutes=minutes,
            changes=[Change(*row) for row in rows],
        ),
        quiz,
        read_answers(answers, keys.names, quiz)
        if answers
        else (lambda _: (keys.names[0], 0.0))  # at once, since nobody knows when
        if dry_run
        else keys.answer,
        seed,
    )
    shares = {
        "an amplitude": min([amplitude, *(row[2] or amplitude for row in rows)]),
        "`variability`": variability,
        "`respiration`": respiration,
        "`ectopic`": ectopic,
    }
    shapes = [read_pulse(name) for name in names]
    job.notes(
        hardly_felt(shares)
        + too_late([row[0] for row in rows if not (quiz or beats)], minutes)
        + notes_of_tables(one for one, name in zip(shapes, names, strict=True) if name not in library())
    )
    beside = {"--minutes": minutes, "--beats": beats, "--changes": changes}
    if quiz and (unused := [name for name, value in beside.items() if value is not None]):
        job.notes(
            [f"a quiz ends with its last question, at one rate and height: {', '.join(unused)} not used"]
        )
    asked: dict[str, Any] = {
        "rhythm": Rhythm(variability / 100, respiration / 100, ectopic / 100, seed),
        "rates": rates,
        "track_heat": track_heat,
    }
    steered = keys.steer(job.screen, chosen, shapes, by_key=answers is None)
    if dry_run:
        job.check_device()
        with job.working("rehearsing") as progress:
            share = steered.share
            planned = plan(
                loaded, shapes, chosen, limits=job.limits, watch=lambda s: progress(share(s)), **asked
            )
        from pulsetrainer.report.planned import to_be_pressed

        job.would("press a session", planned, to_be_pressed(planned, job.limits.force_N))
        return
    from pulsetrainer.cli.score import say_pressed
    from pulsetrainer.recorded import session_into

    said = "a session that was cut off; its sheet: `pulsetrainer evaluate {left} --html sheet.html`"
    job.left_over(out, pt.Session, said)
    with (
        job.open_device(loaded, by_key=steered.by_key) as device,
        job.working("session", steered.live) as progress,
    ):

        def watch(now: Now) -> None:
            if steered.live is not None:
                steered.live(now)
            progress(steered.share(now.time_s))

        def header() -> Header:
            job.know("seed", seed)
            return job.header(f"Session on {device.info.serial}", device.info)

        done, questions = session_into(
            out, job.header("Session under way"), header, loaded, device, shapes, steered.decide,
            blind=chosen if isinstance(chosen, Blind) else None, overwrite=overwrite,
            lead_s=LIVE_LEAD_S if steered.by_key and not quiz else LEAD_S, watch=watch, **asked,
        )  # fmt: skip
    say_pressed(job, out, html, done, questions, device.info)
