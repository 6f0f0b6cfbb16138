"""The commands that write and those that read, each with its words, outputs and inputs; loads nothing."""

from __future__ import annotations

from dataclasses import dataclass


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
        return (*self.words, *options, *(["--overwrite"] if force else []))


def _h5(name: str = "out.h5") -> tuple[tuple[str, str], ...]:
    return (("-o", name),)


EXCITATION = ("capture", "identification", "--levels", "12", "--speed", "4")
WRITERS = (
    Writer("capture", EXCITATION, _h5(), ()),
    Writer("capture (long)", (*EXCITATION, "--repeats", "13"), _h5(), ()),
    Writer(
        "import", ("import", "run.csv", "--input", "current_A", "--output", "force_N"), _h5(), ("run.csv",)
    ),
    Writer("identify", ("identify", "run.h5", "--levels", "12"), _h5(), ("run.h5",)),
    Writer("invert", ("invert", "normal", "--model", "model.h5", "--periods", "1"), _h5(), ("model.h5",)),
    Writer("play", ("play", "drive.h5", "--repeats", "1"), _h5(), ("drive.h5",)),
    Writer("refine", ("refine", "drive.h5", "--passes", "2"), _h5(), ("drive.h5",)),
    Writer(
        "session",
        ("session", "--model", "model.h5", "--beats", "3", "--pulses", "normal,bifid"),
        (*_h5(), ("--html", "out.html")),
        ("model.h5",),
    ),
    Writer("check", ("check", "model.h5", "--update"), _h5(), ("model.h5",)),
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
    Writer(
        "correct", ("correct", "run.h5", "--diagnosis", "diagnosis.h5"), _h5(), ("run.h5", "diagnosis.h5")
    ),
    Writer("export", ("export", "run.h5"), _h5("out.csv"), ("run.h5",)),
    Writer("plot", ("plot", "model.h5"), _h5("out.png"), ("model.h5",)),
    Writer(
        "compare",
        ("compare", "evaluation.h5", "evaluation.h5"),
        _h5("out.csv"),
        ("evaluation.h5",),
    ),
)
READS_ONLY = (
    Writer(
        "tune", ("tune",), (), ()
    ),  # what it writes is added to a file of its owner's, see test_tune_command
    Writer("show", ("show", "run.h5"), (), ("run.h5",)),
    Writer("show (any kind)", ("show", "played.h5"), (), ("played.h5",)),
    Writer("show (diagnosis)", ("show", "diagnosis.h5"), (), ("diagnosis.h5",)),
)
