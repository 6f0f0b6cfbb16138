"""What messages say, in one table: what is wrong, where, what was expected, what was got, what to do next.

A test provokes an error, asserts its exit code and kind, and names the message by its row; only this table
knows words. A row's parts are pieces of the message (``next``: of what comes after ``try:``), with the test's
own names in braces. A part that does not apply is left out, but every row says what, and what to do next.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields

import pytest

from program import Ran
from pulsetrainer.errors import PulsetrainerError

KINDS = {
    1: {"quality"},
    2: {"usage"},
    3: {"data", "argument"},
    4: {"device"},
    5: {"not-converged"},
    70: {"bug"},
    130: {"interrupted"},
}


@dataclass(frozen=True)
class Message:
    """One row: pieces of a message."""

    what: str
    next: str | None  # None: there is nothing to do
    where: str = ""
    expected: str = ""
    got: str = ""


KEPT = "kept in run.h5 (complete=false)"
MESSAGES = {
    # --- files -------------------------------------------------------------------------------------------
    "wrong kind": Message("", "pulsetrainer {verb}", "{file}", "expected {expected}", "got {got}"),
    "absent": Message("does not exist", "files here: {near}", "{file}"),
    "not an output": Message("{said}", ""),
    "no room for an output": Message("No space left", "free some space", "{file}"),
    "two outputs": Message("named for two outputs", "another file", "{file}"),
    "a folder": Message("is a folder", "", "{file}", "expected a file"),
    "exists": Message("already exists", "another file, such as", "{file}"),
    "table exists": Message("--data writes its table", "another figure, such as", "{file}"),
    "truncated": Message("truncated", "restore it", "{file}", got="{bytes} bytes"),
    "not HDF5": Message("not an HDF5 file", "pulsetrainer import", "{file}"),
    "another program's": Message("another program", "pulsetrainer import", "{file}", "kind"),
    "name too long": Message("too long", "", "x" * 20),
    "nothing recorded": Message("nothing was recorded", ""),
    "kept elsewhere": Message("kept in", "", "{file}"),
    "recording is finished": Message("finished", "a new run"),
    "disk is full": Message("is full", "kept", "{folder}", got="bytes are left"),
    "no folder": Message("does not exist", "mkdir -p", "the folder {folder}"),
    "folder deleted": Message("does not exist any more", "go to another one", "the folder you are in"),
    "no sound provenance": Message("the provenance is not", "", "{file}"),
    "no provenance": Message("'provenance' is missing", "", "{file}"),
    "not writable": Message("not writable", "", "{folder}"),
    "write-protected": Message("is write-protected", "chmod u+rw {file}", "{file}"),
    "no such figure": Message("png, svg or pdf", "model.png", "{file}", got="h5"),
    # --- tables ------------------------------------------------------------------------------------------
    "no such column": Message("no column", "name one of these", "{file}", "force_N", "t_s, current_A"),
    "column not named": Message("are missing", "--input 'Drive (V)'", "piezo.csv", "{has}"),
    "not finite": Message(" a number: ", "remove", "{file}", got="{value} in column {column}, line {line}"),
    "separator of thousands": Message(
        "not a number", "thousands separators", got="{cell!r} in column {column}, line {line}"
    ),
    "not a number": Message("not a number", "line", "{file}", got="'abc' in column current_A, line 3"),
    "bad rows": Message("not a number", "--skip-bad-rows", "{file}", got="{place}: not a number ({where})"),
    "too short a pulse": Message(
        "samples of it", "stretch the pulse", "{pulse}", "at least 20", "{period}, and a drive of {rate}"
    ),
    "no output in reach": Message("that every beat reaches", "{other} pulse", "force", got="output-lag"),
    "too many bad rows": Message("too many to leave", "export", "{count} of {file}", got="{where}"),
    "time goes back": Message("does not increase", "sort", "{file}, column t_s", got="line 4: 1 s after 2 s"),
    "time repeats": Message(
        "does not increase", "more digits", "{file}, column t_s", got="line 4: 0.1 s after 0.1 s"
    ),
    "no numbers": Message("no numbers", "another column", "{file}", "column t_s"),
    "several columns": Message("columns with the heading {asked!r}", "{near!r}", expected="{has}"),
    "nearest column": Message("no column '{asked}'", "{near}", expected="{has}"),
    "two lengths": Message("one length", ""),
    "out of all bounds": Message("goes from", "", "{place}", "the limit of 1e+100", "first is in {first}"),
    "column of text": Message("has text, not numbers", "", "{place}"),
    "time stands": Message("does not increase", "", "{place}", got="line {line}: {stamp}"),
    "no unit of time": Message("in {unit}", "", "{place}"),
    "too few rows": Message("has 1 row", ""),
    "empty": Message("is empty", "export", "{file}"),
    "beyond all numbers": Message(
        "goes from", "those rows", "{file}, column {column}", "1e+100", "-1e+308 to 1e+308"
    ),
    # --- numbers -----------------------------------------------------------------------------------------
    "force out of reach": Message("is asked for", "--force-max", expected="reaches 0.5", got="40 N"),
    "no such rate": Message(
        "the rate", "10000 Hz or a whole fraction of it", expected="10000 Hz", got="{got} Hz"
    ),
    "too slow": Message("the signal would last", "(0.75 is usual)", got="{got} samples"),
    "too fast": Message("between two samples", "(0.75 is usual)", expected="1.5", got="1e+297"),
    "longer than the device plays": Message("the device stays on", "{next}", expected="900 s", got="{got} s"),
    "too many samples": Message(
        "samples", "at most", expected="at most {most}", got="{times} times {samples}"
    ),
    "not a smoothing": Message(
        "--smoothing", "--smoothing auto", expected="a number from 0 to 1", got="'{got}'"
    ),
    "no such beat": Message("beat", "--beat", "fingerbp_AAC3_3", "6 ", "9"),
    "not one name for each": Message(
        "`{argument}` must hold", "one name for each", expected="{count}", got="got {got}"
    ),
    "recorded with other options": Message("other options", "the same options", "a.h5"),
    "not such an argument": Message("{argument} must", "", got="{got}"),
    "too few samples": Message("between two samples", "a higher `rate_Hz`", got="{got}"),
    "method too large": Message("dense", "", got="{method}"),
    "too many levels of either sign": Message(
        "either sign", "`levels` {most} or less", expected="at most {most}", got="got {levels}"
    ),
    "plane too large": Message("dense", ""),
    "did not settle": Message("did not settle", "", expected="within {steps}"),
    "no beat of that number": Message("no beat", "from 1 to {count}", got="{count} whole beats"),
    "no whole beat": Message("no whole beat", ""),
    "a unit like it": Message("{wrong}", "mean '{unit}'", "{argument}"),
    "no such unit": Message("is not a known unit", "{argument}", "{place}"),
    "no such share": Message("is not a known unit", "pure number, % and ‰", "{place}"),
    "provenance itself": Message("provenance", ""),
    "no time zone": Message("time zone", "datetime.now"),
    "cannot be read": Message("cannot be read", "", "{file}"),
    "has no time": Message("no time", ""),
    "does not repeat": Message("does not repeat", "diagnose"),
    "another model": Message("is not the model", "pulsetrainer diagnose"),
    "nothing to take out": Message("neither a diagnosis nor a delay", "`diagnosis`"),
    "delay too long": Message("is only", "seconds", expected="{length}", got="a delay of {given}"),
    "no units": Message(
        "has no units", "table of {file} again with --input-unit A --output-unit N, and", "{file}", "A and N"
    ),
    "another kind of device": Message("takes", "captured on the device", "the model {file}", "(A and N)"),
    "another run": Message("is not a diagnosis", "pulsetrainer diagnose"),
    "nothing to draw": Message("nothing to draw", ""),
    "no figure of it": Message("no figure", "", got="{got}"),
    "an empty range": Message("low < high", ""),
    "no such cause": Message("does not know", "update", got="'{named}'"),
    "does not vary": Message("the {constant} does not vary", "capture diagnostic"),
    "constant output": Message(
        "the force of {file} does not vary", "check the sensor", got="it is 1 N throughout"
    ),
    "names it": Message("", "", "{named}"),
    "no beat of a session": Message("has no whole beat", "pulsetrainer session", "{file}"),
    "not such a row": Message("", "", "{file}, {row}", "expected {expected}", "{got}"),
    "too few answers": Message("answer", "one pulse name on each line", "{file}", "{expected}", "{got}"),
    "of another device": Message("the run to verify with {run}", "the same device", got="{model}"),
    "a run that was diagnosed": Message("to verify with is one that", "not diagnosed", "{file}"),
    "nothing to extend by": Message("nothing to extend", "{next}", "{file}", got="{verdict}"),
    # --- words -------------------------------------------------------------------------------------------
    "option missing": Message("is missing", "pulsetrainer identify run.h5", expected="--out"),
    "no such command": Message("there is no command", "--help", got="frobnicate"),
    "no such signal": Message("signal", "pulsetrainer capture", expected="diagnostic", got="noise"),
    "no such bench parameter": Message("parameter", "creep", "{asked}: the bench", got="'crep'"),
    "one evaluation": Message("at least two", "pulsetrainer compare"),
    "nothing in common": Message("in common", "evaluat", "fit.h5 is of a run"),
    # --- settings ----------------------------------------------------------------------------------------
    "no such setting": Message("setting", "{next}", "pulsetrainer.toml", got="'{got}'"),
    "not such a setting": Message(
        "must be", "write, for instance", "pulsetrainer.toml", "{expected}", "{got}"
    ),
    "not TOML": Message("cannot be read", "write it as TOML", "pulsetrainer.toml", got="line 1"),
    "no file of settings": Message("settings", "--settings", "{file}"),
    # --- device ------------------------------------------------------------------------------------------
    "no such port": Message("no port", "pulsetrainer ports", "{port}"),
    "no such emulator": Message("{said}", "{hint}"),
    "no emulator": Message(
        "not found", "{packages}`; or simulate without them: `port` bench:", "qemu:", "needs {missing}"
    ),
    "does not compile": Message("does not compile", "", got="error"),
    "no cache": Message("cannot write the firmware cache", "", "{folder}"),
    "refused by number": Message("", "", got="{code}", expected="{fault}"),
    "too hot now": Message("too hot", "wait", got="% of its limit"),
    "too hot ever": Message("even from cold", "lower current", got=" % of its limit"),
    "another shape": Message("shape", ""),
    "stray current": Message("current flows although the reference is zero", ""),
    "current flows on": Message("still flow", "plug", got="{amperes}"),
    "no compiler": Message("C compiler", "pip install ziglang"),
    "several devices": Message("2 devices", "`port`", got="/dev/ttyUSB1, /dev/ttyUSB2"),
    "no device": Message("no device", "bench:", expected="0403:6015", got="/dev/ttyUSB0"),
    "no permission": Message("no permission", "dialout", "{port}"),
    "not a serial port": Message("not a serial port", "pulsetrainer ports", "{port}"),
    "not a port": Message("not a port", "", "{port}"),
    "out of reach": Message("cannot reach", "port number", "{port}"),
    "not in so long": Message("s long", "", expected="at most 2 s", got="2.999 s"),
    "port is busy": Message("busy", "close the other program", "{port}"),
    "not our device": Message("not a pulsetrainer device", "pulsetrainer ports", "{port}"),
    "nobody answers": Message("nobody answers", "has power", "{port}"),
    "older device": Message("the device is older", "flash the firmware", "", "{ours}", "{theirs}"),
    "older program": Message("the program is older", "git pull", "", "{ours}", "{theirs}"),
    "beyond the limit": Message(
        "the current", "--current-max", expected="the limit is {limit} A", got="goes up to {got} A"
    ),
    "limit raised": Message("limit", "lowered", expected="1.5 A", got="9 A"),
    "tripped while conditioning": Message(
        "force above its limit", "raise --limit-force", "conditioning", got=" N"
    ),
    "force-high": Message("force above its limit of 15 N", "--current-max", "during the capture", got=KEPT),
    "current-rail": Message("current above its hard limit", "plug", "during the capture", got=KEPT),
    "force-frozen": Message("force reading", "cause", "during the capture", got=KEPT),
    "force reading": Message("force", "sensor"),
    "tick-overrun": Message("missed its tick", "firmware is too slow", "during the capture", got=KEPT),
    "reset": Message("restarted in mid-play (cause: external)", "power supply", got=KEPT),
    "no whole repeat": Message("restarted in mid-play", "power supply", got="{file} was not written"),
    "hang": Message("restarted in mid-play (cause: watchdog)", "power supply", got=KEPT),
    "port is gone": Message("is gone", "cable", "/dev/", got=KEPT),
    "host was silent": Message("heard nothing from the host", "keep it from sleeping", got=KEPT),
    "stopped with nothing": Message("stopped by you", "run the command again", got="nothing was written"),
    "stopped with repeats": Message("stopped by you", "--overwrite", got="1 of 5 repeats was kept in run.h5"),
    "stopped before a repeat": Message(
        "stopped by you", "run the command again", got="run.h5 was not written"
    ),
    "two sessions at once": Message("got 2 sessions", "pulsetrainer compare"),
    "stopped with beats": Message("stopped by you", "evaluate", got="beats were kept in run.h5"),
    "stopped before a beat": Message("stopped by you", "run the command again", got="run.h5 was not written"),
    "interrupted": Message("stopped by you", "--resume", got=KEPT),
    "no beat was pressed": Message("no beat was pressed", "pulsetrainer tune", "{file}"),
    "too small a range to tune": Message(
        "a coil cannot be measured",
        "--limit-current",
        expected="below {least} A",
        got="the limit is {limit} A",
    ),
    "a quiz without a terminal": Message("answered on the keyboard", "in a file", got="no live view"),
    "another supply": Message("does not fit the voltage", "the supply", "during {during}"),
    "limit below the model's range": Message(
        "the current goes up", "--limit-current", expected="the limit is {limit} A", got="{got} A"
    ),
    "lost on the wire": Message("samples of the", "check the cable", got="were lost on the wire"),
    "tuning is no play": Message("force", "off the device while it is tuned", "during"),
    "a supply that sags": Message("cannot follow the pulses (voltage)", "a supply", got="sags"),
    # --- gates and bugs ----------------------------------------------------------------------------------
    "no such metric": Message("does not have", "Names here begin with", "{metric}"),
    "out of bounds": Message("1 of 1 bound in", "the bound", "{metric}", "[99, 100]", " = "),
    "bug": Message("a bug: KeyError: 'force'", "--debug"),
}


# what a command notes besides its result, and what speaks for a diagnosis: pieces of the sentence
NOTES = {
    "false reversals": ("false reversals",),
    "a share in the place of %": (
        "--ectopic of 0.1 % is hardly felt: 10 % is written as 10",
        "4 % is written as 4",
    ),
    "changes after the end": ("1 of 1 change (400 s) will not happen: the session ends at 6 s (--minutes)",),
    "cells never switched": ("never switched", "% of the plane"),
    "reversed": ("falls where the model rises", "the wrong way round", "Identify it again"),
    "follows the velocity": ("velocity of u", "wrong model"),
    "leaves much": ("% of the span", "the noise from sample to sample", "pulsetrainer diagnose"),
    "not congruent": (
        "not congruent",
        "No model of this program follows that",
        "% of the span",
        "other reversals",
        "inputs like the recorded one",
    ),
    "known from": ("cut the force off", "only from -7.", "a guess"),
    "known up to": ("cut the force off", "only up to 7.", "a guess"),
    "no minor loops": ("minor loops", "a guess", "within the major one"),
    "seen before": ("was identified from", "a run that neither has seen"),
    "zeros differ": ("shifted against each other",),
    "no time": ("no time",),
    "no time that can be read": ("has no time column (its column date", "as time: '1 Nov 2026')"),
    "nothing gained": ("in 1 pass:", "it only measured the drive"),
    "follows half the range": ("% of 0.75 A",),
    "stronger": ("the force moved by +5", "(limit 1.5 %)"),
    "changed": ("(limit 0.", "next", "identify again", "temperature"),
    "taken as seconds": ("has no known unit", "seconds", "[min]"),
    "several beats": ("scope holds 4 whole beats", "played as one period", "a table of its own"),
    "second column": ("of the 3 columns of scope.csv the second is played, p",),
    "signal without a unit": ("column time, has no unit: taken as s", "lasts 1000 s", "'t_ms'"),
    "beats found": ("6 whole beats", "0.644 to 0.653 s"),
    "stretched": ("are stretched to", "N: give --force-min and --force-max"),
}


def tells(text: str, name: str) -> None:
    """Hold that a note, or a piece of evidence, says what its row has."""
    for part in NOTES[name]:
        assert part in text, (name, part, text)


def refusal(done: Ran, code: int, name: str, **names: object) -> None:
    """Hold what every refusal is, and what this one says.

    Its code, and its kind where it was asked for as JSON; no traceback; one message, one next step; each part
    of its row.
    """
    assert done.code == code, done
    assert "Traceback" not in done.err, done.err
    row = MESSAGES[name]
    said, _, tried = done.err.partition("\n  try: ")
    assert said.startswith(("error: ", "note: ")), done.err
    assert bool(tried) == (row.next is not None), f"what to do next: {done.err!r}"
    if done.out.startswith("{"):
        error = done.json["error"]
        assert error["kind"] in KINDS[code]
        assert f"error: {error['message']}" in said
        assert error["hint"].strip() == tried.strip()
    for field in fields(Message):
        part = (getattr(row, field.name) or "").format(**names)
        assert part in (tried if field.name == "next" else said), (name, field.name, part, done.err)


@contextmanager
def raises(kind: type[PulsetrainerError], name: str, **names: object) -> Iterator[pytest.ExceptionInfo]:
    """Hold that an error of this kind is raised, and that it says each part of its row."""
    with pytest.raises(kind) as caught:
        yield caught
    told(caught.value, name, **names)


def told(error: PulsetrainerError, name: str, **names: object) -> None:
    """Hold that an error says each part of its row, and what to do next."""
    row = MESSAGES[name]
    assert bool(error.hint) == (row.next is not None), f"what to do next: {error.hint!r}"
    for field in fields(Message):
        part = (getattr(row, field.name) or "").format(**names)
        assert part in (error.hint if field.name == "next" else error.message), (
            name,
            field.name,
            part,
            error,
        )
