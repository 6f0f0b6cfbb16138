"""The real firmware on a pty."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from link_wire import Wire

import pulsetrainer.simulation  # noqa: F401 - announces bench: and qemu:
from pulsetrainer.device.opening import open_device

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def wire():
    """A wire to an as-built bench, and others on request: ``wire("bench:?...")``."""
    opened: list[Wire] = []

    def make(port: str = "bench:", executable: Path | None = None) -> Wire:
        opened.append(Wire(port, executable))
        return opened[-1]

    yield make
    for one in opened:
        one.close()


@pytest.fixture
def device():
    """An open as-built bench."""
    with open_device("bench:") as opened:
        yield opened


@pytest.fixture
def pulse() -> np.ndarray:
    """Two seconds of 75 bpm, full range, upstroke 100 ms, 1 kHz, A."""
    phase = np.arange(2000) % 800
    up = 0.75 - 0.75 * np.cos(np.pi * np.clip(phase / 100, 0, 1))
    return np.where(phase < 100, up, 0.75 + 0.75 * np.cos(np.pi * (phase - 100) / 700))
