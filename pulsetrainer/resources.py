"""Where the files that ship with the package are: firmware sources and the waveform library.

A wheel carries them inside the package (``_firmware``, ``_waveforms``); a checkout has
them beside it.
"""

from __future__ import annotations

from pathlib import Path

from pulsetrainer.errors import DataError

_PACKAGE = Path(__file__).resolve().parent


def _shipped(name: str) -> Path:
    for candidate in (_PACKAGE / f"_{name}", _PACKAGE.parent / name):
        if candidate.is_dir():
            return candidate
    raise DataError(
        f"the folder {name}/ that ships with pulsetrainer is missing beside {_PACKAGE}",
        hint="install it again, in the folder that it came in: make install",
    )


def firmware_dir() -> Path:
    """Return the folder of the firmware sources."""
    return _shipped("firmware")


def waveforms_dir() -> Path:
    """Return the folder of the pulse library."""
    return _shipped("waveforms")
