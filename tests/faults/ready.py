"""One artefact of every kind: what the faults are tried on."""

from __future__ import annotations

import shutil
from pathlib import Path

import children
import store_examples as examples

from command_lines import EXCITATION, WRITERS
from pulsetrainer.artefacts import Cause, Model, Parameter, Recorded, Run
from pulsetrainer.errors import DataError
from pulsetrainer.files import store
from pulsetrainer.files.encode import values_of
from pulsetrainer.files.recorder import RunRecorder
from pulsetrainer.files.session_recorder import SessionRecorder

CUT_OFF, CUT_SESSION = "out.h5.partial", "session.h5.partial"


def prepare(folder: Path) -> dict[str, float]:
    """Make one file of every kind, then every output once; return how long each writer takes."""
    folder.mkdir(parents=True, exist_ok=True)
    log = folder / "log"
    steps: tuple[tuple[str, ...], ...] = (
        (*EXCITATION, "-o", "run.h5"),
        # a check refuses to update a model that is as coarse and was measured as fast as that run
        ("capture", "identification", "--levels", "24", "--speed", "2", "-o", "calibration.h5"),
        ("identify", "calibration.h5", "--levels", "24", "-o", "model.h5"),
        ("invert", "normal", "--model", "model.h5", "-o", "drive.h5", "--periods", "1"),
        ("play", "drive.h5", "-o", "played.h5", "--repeats", "1"),
        ("evaluate", "played.h5", "-o", "evaluation.h5"),
    )
    for words in steps:
        _surely(folder, words, log)
    run = store.read_any(folder / "run.h5")
    rows = zip(run.time_s, run.input, run.output, strict=True)
    text = "t_s,current_A,force_N\n" + "".join(f"{t},{u},{y}\n" for t, u, y in rows)
    (folder / "run.csv").write_text(text)
    _diagnosis(folder)
    _cut_off(folder)
    _cut_session(folder)
    seconds = {}
    for writer in WRITERS:
        seconds[writer.name] = _surely(folder, writer.line(force=True), log).seconds
        for _, name in writer.outputs:
            assert whole(folder / name), name
            (folder / name).unlink()
    return seconds


def _surely(folder: Path, words: tuple[str, ...], log: Path) -> children.Ended:
    """Run a command that must work; on a computer that is too busy for the device, again."""
    done = children.run(folder, words, log)
    for _ in range(5):
        if done.code == 4 and "too busy" in done.err:
            done = children.run(
                folder, (*words, *(["--overwrite"] if "--overwrite" not in words else [])), log
            )
    assert done.code == 0, done
    return done


def _diagnosis(folder: Path) -> None:
    """Write a diagnosis of the run that has a model to extend, of the right range, and a drift to correct."""
    from dataclasses import replace

    model, run = store.read(folder / "model.h5", Model), store.read(folder / "run.h5", Run)
    drift = Cause("offset-drift", True, 0.005, 1.0, 1.0, (Parameter("rate", 0.01, "N/s", 0.0, 0.02),))
    diagnosis = examples.diagnosis()
    records = tuple(Recorded(part.fingerprint, 0.005) for part in run.parts())
    extended = replace(model, fit=None, extensions=diagnosis.extended.extensions)
    whole = replace(
        diagnosis,
        extended=extended,
        causes=(*diagnosis.causes, drift),
        records=records,
        correctable=("offset-drift",),
    )
    store.write(folder / "diagnosis.h5", whole, examples.header())


def _cut_off(folder: Path) -> None:
    """Leave what a capture leaves that was killed: the journal of the first two thirds of the run."""
    run, header = store.read(folder / "run.h5", Run), store.read_header(folder / "run.h5")
    with RunRecorder(folder / "whole.h5", header, signal=run.signal) as recorder:
        for start in range(0, 2 * run.input.size // 3, 50):
            part = slice(start, start + 50)
            recorder.append(run.time_s[part], run.reference[part], run.input[part], run.output[part])
        shutil.copy(recorder.partial, folder / CUT_OFF)
    (folder / "whole.h5").unlink()


def _cut_session(folder: Path) -> None:
    """Leave what a session leaves that was killed: the journal of its two beats and their quiz."""
    fields = values_of(examples.session())
    samples = [fields.pop(name) for name in ("time_s", "target", "reference", "input", "output")]
    with SessionRecorder(folder / "whole.h5", examples.header(), signal="session") as recorder:
        recorder.append(*samples)
        recorder.judge(fields)
        shutil.copy(recorder.partial, folder / CUT_SESSION)
    (folder / "whole.h5").unlink()


def copy_inputs(ready: Path, folder: Path, names: tuple[str, ...]) -> None:
    """Put what a command reads into a folder."""
    for name in names:
        shutil.copy(ready / name, folder / name)


def whole(path: Path) -> bool:
    """Whether a file is complete: it reads, and its last byte is there."""
    end = {".html": b"</html>", ".png": b"IEND\xaeB`\x82", ".csv": b"\n"}.get(path.suffix)
    content = path.read_bytes()
    if end is not None:
        return content.rstrip(b"\n").endswith(end.rstrip(b"\n")) and bool(content)
    try:
        store.read_header(path)
        store.read_any(path)
    except DataError:
        return False
    return b"pulsetrainer crc32" in content[-40:]
