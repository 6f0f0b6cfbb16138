"""A hysteretic solenoid that presses a true arterial pulse, without a force sensor in the loop.

    import pulsetrainer as pt

    run = pt.load("run.h5")
    model = pt.identify(run)
    drive = pt.invert("normal", model)

Names are loaded when they are first used, so that the import itself costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from pulsetrainer.version import __version__

if TYPE_CHECKING:
    from pulsetrainer.api import invert, load, open_device, read_table, save, session, tune
    from pulsetrainer.artefacts import Diagnosis, Evaluation, Model, Playback, Run, Session, Waveform
    from pulsetrainer.steps.capture import capture
    from pulsetrainer.steps.check import check
    from pulsetrainer.steps.compare import compare
    from pulsetrainer.steps.correct import correct
    from pulsetrainer.steps.diagnose import diagnose
    from pulsetrainer.steps.evaluate import evaluate
    from pulsetrainer.steps.extend import extend
    from pulsetrainer.steps.identify import identify
    from pulsetrainer.steps.play import play
    from pulsetrainer.steps.refine import refine
    from pulsetrainer.steps.transfer import transfer

__all__ = [
    "Diagnosis", "Evaluation", "Model", "Playback", "Run", "Session", "Waveform", "__version__", "capture",
    "check", "compare", "correct", "diagnose", "evaluate", "extend", "identify", "invert", "load",
    "open_device", "play", "read_table", "refine", "save", "session", "transfer", "tune",
]  # fmt: skip

_OF_THE_API = ("invert", "load", "open_device", "read_table", "save", "session", "tune")


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'pulsetrainer' has no attribute {name!r}")
    home = "artefacts" if name[0].isupper() else "api" if name in _OF_THE_API else f"steps.{name}"
    found = getattr(import_module(f"pulsetrainer.{home}"), name)
    if home != "artefacts":
        from pulsetrainer.steps.arguments import kinds_checked  # noqa: PLC0415 - the import costs nothing

        found = kinds_checked(found)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted(__all__)
