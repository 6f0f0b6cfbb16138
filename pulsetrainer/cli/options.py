"""Arguments and options that several commands share, each with its help."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, BadParameter, CallbackParam, Option

from pulsetrainer.files.settings import SETTINGS, variable


def positive(value: float | None, param: CallbackParam) -> float | None:
    """Refuse a number that is not above 0 and finite; None is no choice."""
    if value is not None and not 0 < value < math.inf:
        unit = next((one.unit for one in SETTINGS if one.variable == param.envvar and one.unit), "")
        least, got = (f"{number:g} {unit}".rstrip() for number in (0.0, value))
        raise BadParameter(f"must be a finite number above {least}, got {got}")
    return value


def not_empty(port: str | None) -> str | None:
    """Refuse ``--port "$PORT"`` where that is not set: it would play on the simulated device instead."""
    if port is not None and not port.strip():
        raise BadParameter("must name a port, got nothing")
    return port


def word_or_number(text: str | None, word: str, option: str, must: str, *, least: float, most: float) -> Any:
    """Return the word, or the number from ``least`` to ``most`` that a text spells; None is no choice."""
    if text is None or text == word:
        return text
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not least <= value <= most:
        raise BadParameter(f"must be {must}, got {text!r}", param_hint=option)
    return value


def setting(key: str, name: str, words: str, **more: Any) -> Any:
    """Return an option whose value may stand in the file of settings or in the environment.

    Without ``min`` any number above 0 goes.
    """
    return Option(
        name, help=words, envvar=variable(key), callback=None if "min" in more else positive, **more
    )


AnyFile = Annotated[Path, Argument(help="Any file this program wrote.", metavar="FILE.h5")]
Drive = Annotated[Path, Argument(help="Waveform made by invert.", metavar="DRIVE.h5")]
Out = Annotated[Path, Option("-o", "--out", help="File to write.")]
Report = Annotated[Path | None, Option(help="Report to write.")]
Overwrite = Annotated[bool, Option("--overwrite", help="Replace an existing output.")]
AsJson = Annotated[bool, Option("--json", help="One JSON object on stdout.")]
Port = Annotated[
    str | None,
    Option(
        "--port",
        help="bench: (simulated, the default), bench:?seed=3, qemu: (emulated; needs qemu-system-arm), "
        "/dev/ttyUSB0, COM3 or socket://host:port.",
        envvar="PULSETRAINER_PORT",
        callback=not_empty,
    ),
]
DryRun = Annotated[bool, Option("--dry-run", help="Show what would be played; open no port, write nothing.")]
ShowLive = Annotated[
    bool, Option("--live", help="Draw the loop on the terminal as it is recorded; nothing in a pipe.")
]
TrackHeat = Annotated[
    bool | None,
    Option(
        "--track-heat/--no-track-heat",
        help="Measure the coil's temperature by the duty and compensate for the force it costs; "
        "default: on if the model has a thermal term and was captured with the duty.",
    ),
]
LimitCurrent = Annotated[
    float | None,
    setting(
        "limits.current_A",
        "--limit-current",
        "Highest current that the device may drive, A; it can only lower the device's own limit.",
    ),
]
LimitForce = Annotated[
    float | None,
    setting(
        "limits.force_N",
        "--limit-force",
        "Force above which the device switches off, N; it can only lower the device's own limit.",
    ),
]
