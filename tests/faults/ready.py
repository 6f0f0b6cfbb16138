"""One artefact of every kind, and the commands that write: what the faults are tried on."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import children
import store_examples as examples

from pulsetrainer.artefacts import store
from pulsetrainer.artefacts.kinds import Model
from pulsetrainer.errors import DataError


@dataclass(frozen=True)
class Writer:
    """A command that writes: its words without outputs, its options for them, and what it reads."""

    name: str
    words: tuple[str, ...]
    outputs: tuple[tuple[str, str], ...]  # option, file name
    reads: tuple[str, ...]

    def line(self, *, force: bool, folder: str = "") -> tuple[str, ...]:
        """Return the whole command line, its outputs in ``folder``."""
        options = [word for option, name in self.outputs for word in (option, f"{folder}{name}")]
        return (*self.words, *options, *(["--force"] if force else []))


def _h5(name: str = "out.h5") -> tuple[tuple[str, str], ...]:
    return (("-o", name),)


_EXCITATION = ("capture", "identification", "--levels", "12", "--speed", "12")
WRITERS = (
    Writer("capture", _EXCITATION, _h5(), ()),
    Writer("capture (long)", (*_EXCITATION, "--repeats", "40"), _h5(), ()),
    Writer(
        "import", ("import", "run.csv", "--input", "current_A", "--output", "force_N"), _h5(), ("run.csv",)
    ),
    Writer("identify", ("identify", "run.h5", "--levels", "12"), _h5(), ("run.h5",)),
    Writer("invert", ("invert", "normal", "--model", "model.h5", "--periods", "1"), _h5(), ("model.h5",)),
    Writer("play", ("play", "drive.h5", "--repeats", "1"), _h5(), ("drive.h5",)),
    Writer("evaluate", ("evaluate", "played.h5"), _h5(), ("played.h5",)),
    Writer("evaluate --html", ("evaluate", "played.h5"), (*_h5(), ("--html", "out.html")), ("played.h5",)),
    Writer("evaluate --model", ("evaluate", "run.h5", "--model", "model.h5"), _h5(), ("run.h5", "model.h5")),
    Writer(
        "diagnose --quick",
        ("diagnose", "run.h5", "--model", "model.h5", "--quick"),
        (*_h5(), ("--html", "out.html")),
        ("run.h5", "model.h5"),
    ),
    Writer("extend", ("extend", "diagnosis.h5", "--model", "model.h5"), _h5(), ("diagnosis.h5", "model.h5")),
    Writer("plot", ("plot", "model.h5"), _h5("out.png"), ("model.h5",)),
    Writer(
        "compare",
        ("compare", "evaluation.h5", "evaluation.h5"),
        _h5("out.csv"),
        ("evaluation.h5",),
    ),
)
READS_ONLY = (
    Writer("show", ("show", "run.h5"), (), ("run.h5",)),
    Writer("show (any kind)", ("show", "played.h5"), (), ("played.h5",)),
    Writer("show (diagnosis)", ("show", "diagnosis.h5"), (), ("diagnosis.h5",)),
)


def prepare(folder: Path) -> dict[str, float]:
    """Make one file of every kind, then every output once; return how long each writer takes."""
    folder.mkdir(parents=True, exist_ok=True)
    log = folder / "log"
    steps: tuple[tuple[str, ...], ...] = (
        (*_EXCITATION, "-o", "run.h5"),
        ("identify", "run.h5", "--levels", "12", "-o", "model.h5"),
        ("invert", "normal", "--model", "model.h5", "-o", "drive.h5", "--periods", "1"),
        ("play", "drive.h5", "-o", "played.h5", "--repeats", "1"),
        ("evaluate", "played.h5", "-o", "evaluation.h5"),
    )
    for words in steps:
        done = children.run(folder, words, log)
        assert done.code == 0, done
    run = store.read_any(folder / "run.h5")
    rows = zip(run.time_s, run.input, run.output, strict=True)
    text = "t_s,current_A,force_N\n" + "".join(f"{t},{u},{y}\n" for t, u, y in rows)
    (folder / "run.csv").write_text(text)
    _diagnosis(folder)
    seconds = {}
    for writer in WRITERS:
        done = children.run(folder, writer.line(force=True), log)
        assert done.code == 0, done
        seconds[writer.name] = done.seconds
        for _, name in writer.outputs:
            assert whole(folder / name), name
            (folder / name).unlink()
    return seconds


def _diagnosis(folder: Path) -> None:
    """Write a diagnosis that has a model to extend, of the range of the model that is there."""
    from dataclasses import replace

    model = store.read(folder / "model.h5", Model)
    diagnosis = examples.diagnosis()
    extended = replace(model, fit=None, extensions=diagnosis.extended.extensions)
    store.write(folder / "diagnosis.h5", replace(diagnosis, extended=extended), examples.header())


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
