"""What is said of a session: its score sheet, and its figures on the screen."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pulsetrainer as pt
from pulsetrainer.cli.job import Job
from pulsetrainer.report.results import pressed
from pulsetrainer.report.tables import picked

if TYPE_CHECKING:
    from pulsetrainer.artefacts import Quiz
    from pulsetrainer.device.identity import DeviceInfo
    from pulsetrainer.files.provenance import Header
    from pulsetrainer.steps.performance import Performed


def sheet(job: Job, html: Path, session: pt.Session, header: Header) -> None:
    """Write the score sheet of a session."""
    from functools import partial

    from pulsetrainer.report.score_sheet import render_session
    from pulsetrainer.steps.quiz import score

    asked = header.provenance.parameters
    result = None if session.quiz is None else score(session.quiz)
    job.page(html, partial(render_session, score=result, asked=asked), session, header)


def say_stored(job: Job, path: Path, html: Path | None, session: pt.Session) -> None:
    """Say what a session in a file amounts to, whole or cut off, and write its sheet."""
    from pulsetrainer.files import store
    from pulsetrainer.report.facts import facts

    if html is not None:
        sheet(job, html, session, store.read_header(path))
    quizzed, right = _quizzed(session.quiz)
    said = {"beats": int(session.beats.start_s.size), **session.figures(), "underruns": session.underruns}
    said |= picked(session, "complete", "fault", "ended_early")
    job.screen.result(said | {"html": html, **quizzed})
    job.screen.facts(f"{path}: session", facts(session) | right)
    job.wrote(html)


def say_pressed(
    job: Job, out: Path, html: Path | None, done: Performed, quiz: Quiz | None, info: DeviceInfo
) -> None:
    """Write the sheet and say what came out, also where the session was stopped."""
    from pulsetrainer.errors import PulsetrainerError
    from pulsetrainer.files import store
    from pulsetrainer.steps.stopped import kept_in, raise_if_stopped

    job.notes([*done.notes, *filter(None, (done.stopped_by_key,))])
    if html is not None:
        sheet(job, html, store.read(out, pt.Session), store.read_header(out))
    try:
        raise_if_stopped(done.fault, done.remedy, "the session")
    except PulsetrainerError as error:
        error.message += kept_in(out, done.beats.start_s.size, "beat")
        error.message += f", the score sheet in {html}" if html is not None else ""
        sheet_made = "" if html is not None else f"`pulsetrainer evaluate {out} --html sheet.html`, or "
        error.hint = error.hint or f"{sheet_made}press another one into another file with -o"
        raise
    quizzed, right = _quizzed(quiz)
    payload, title, rows = pressed(out, done, info)
    job.show(payload | quizzed, title, rows | right)
    job.wrote(html)


def _quizzed(quiz: Quiz | None) -> tuple[dict[str, Any], dict[str, str]]:
    from pulsetrainer.steps.quiz import score

    if quiz is None:
        return {}, {}
    result = score(quiz)
    low, high = (100 * end for end in result.interval)
    said = picked(result, "asked", "right", "interval", "chance", "p_value", "response_s")
    said["confusion"] = quiz.confusion
    share = f"{100 * result.share:.0f} %, 95 % interval {low:.0f} to {high:.0f} %"
    return {"quiz": said}, {"right": f"{result.right} of {result.asked}: {share}"}
