"""The heat of the coil, as the firmware counts it (firmware/core/heat.c): what a play adds, how it cools.

The device averages the squared current, dh/dt = (i^2 / HEAT_LIMIT_A2 - h) / HEAT_TAU_S, and stops at h = 1.
After power-on it does not know how hot its coil is and assumes the limit; a host that has seen it before
tells, from what is remembered here from one day to the next.
"""

from __future__ import annotations

import contextlib
import json
import logging
import math
import os
import tempfile
from pathlib import Path
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray
from platformdirs import user_state_path

from pulsetrainer.device.codes import HEAT_LIMIT_A2, HEAT_TAU_S

_LOG = logging.getLogger(__name__)
_MOST = 2.0  # more than any current that the device permits can reach


def cooled(heat: float, seconds: float) -> float:
    """Return what is left of a heat, h exp(-t / tau); a clock that was set back has not cooled it."""
    return heat * math.exp(-max(seconds, 0.0) / HEAT_TAU_S)


def added(reference_A: NDArray[np.float64], rate_Hz: float) -> NDArray[np.float64]:
    """Return the heat (n,) that a reference (n,) in A gives a cold coil, at each of its samples."""
    share = -math.expm1(-1.0 / (rate_Hz * HEAT_TAU_S))
    fed = share * reference_A**2 / HEAT_LIMIT_A2
    heat, before = np.empty(fed.size), 0.0
    # numpy alone: a filter of scipy's would load for longer than all else that a refusal needs
    block = max(1, math.ceil(rate_Hz * HEAT_TAU_S))  # in which what is left stays a number of ordinary size
    left = _left(min(block, fed.size), rate_Hz)
    for at in range(0, fed.size, block):
        one = fed[at : at + block]
        part = left[: one.size]
        heat[at : at + block] = part * (before + np.cumsum(one / part))
        before = heat[min(at + block, fed.size) - 1]
    return heat


def course(heat: float, reference_A: NDArray[np.float64], rate_Hz: float) -> NDArray[np.float64]:
    """Return the heat (n,) that a coil of this heat has at each sample of a reference (n,) in A."""
    return heat * _left(reference_A.size, rate_Hz) + added(reference_A, rate_Hz)


def _left(samples: int, rate_Hz: float) -> NDArray[np.float64]:
    """Share (n,) of a heat that is left after each sample."""
    return np.asarray(np.exp(-np.arange(1, samples + 1) / (rate_Hz * HEAT_TAU_S)))


def wait_s(heat: float, reference_A: NDArray[np.float64], rate_Hz: float) -> float:
    """Return how long a coil has to cool before it bears a reference, s.

    That is h exp(-t / tau) + added(t) <= 1 throughout; 0 if it bears it now, infinite if even a cold one
    does not.
    """
    bears = float(np.min((1.0 - added(reference_A, rate_Hz)) / _left(reference_A.size, rate_Hz)))
    if heat <= bears:
        return 0.0
    return HEAT_TAU_S * math.log(heat / bears) if bears > 0 else math.inf


class HeatMemory:
    """The last known heat of each device, a small file for each serial number.

    What cannot be read counts as unknown and what cannot be written is not remembered: the device then
    assumes a hot coil, which costs patience and nothing else.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder or user_state_path("pulsetrainer") / "coil-heat"

    def _path(self, serial: str) -> Path:
        return self._folder / f"serial-{quote(serial, safe='')}.json"

    def remember(self, serial: str, heat: float, now_s: float) -> None:
        """Keep a heat that a device with this serial number has, or will have, at a time of the clock, s."""
        if not serial:  # it could be any device
            return
        temporary = ""
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            handle, temporary = tempfile.mkstemp(prefix=".heat-", dir=self._folder)
            with os.fdopen(handle, "w") as file:
                json.dump({"heat": heat, "time_s": now_s}, file)
            Path(temporary).replace(self._path(serial))
        except OSError as error:
            _LOG.info("the coil's heat is not remembered: %s", error)
            with contextlib.suppress(OSError):
                Path(temporary).unlink()

    def recall(self, serial: str, now_s: float) -> float | None:
        """Return the heat that a device has by now; None if nothing sound is known."""
        if not serial:
            return None
        try:
            kept = json.loads(self._path(serial).read_bytes())
            heat, time_s = float(kept["heat"]), float(kept["time_s"])
        except (OSError, ValueError, LookupError, TypeError):
            return None
        if not (0.0 <= heat <= _MOST and math.isfinite(time_s)):
            return None
        return cooled(heat, now_s - time_s)


def in_words(seconds: float) -> str:
    """Return a time to wait as a person says it, rounded up."""
    if seconds <= 90:
        return f"{max(10, 10 * math.ceil(seconds / 10))} seconds"
    return f"{math.ceil(seconds / 60)} minutes"
