"""The samples of a wave on their way to the device: put in at one end, taken at the other, in two threads."""

from __future__ import annotations

import threading
import zlib

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.device import codes

_BYTES = 2  # of a sample on the wire


class Feed:
    """The samples [100 uA, int16] of one wave: all at once, or while it is played.

    What the device has acknowledged is let go of, so that an endless wave takes no memory.
    """

    def __init__(self, samples: NDArray[np.int16] | None = None) -> None:
        self._lock = threading.Lock()
        self._held = bytearray()
        self._first = 0  # number of the first sample that is held
        self._size = 0
        self._ended = False
        self.total = codes.WAVE_OPEN  # as the device is told
        self.crc32 = 0  # of all of them, where all are known beforehand
        if samples is not None:
            self.append(samples)
            self._ended = True
            self.total, self.crc32 = self._size, zlib.crc32(self._held)

    @property
    def is_open(self) -> bool:
        """Whether the device is not told beforehand how many samples come."""
        return self.total == codes.WAVE_OPEN

    @property
    def size(self) -> int:
        """Samples put in so far."""
        return self._size

    @property
    def ended(self) -> bool:
        """Whether no more will come."""
        return self._ended

    def append(self, samples: NDArray[np.int16]) -> None:
        """Put samples in behind the others."""
        with self._lock:
            self._held += samples.astype("<i2").tobytes()
            self._size += samples.size

    def end(self) -> None:
        """Say that no more will come."""
        self._ended = True

    def piece(self, at: int, most: int) -> bytes:
        """Return up to ``most`` samples from number ``at`` on; those before it are not asked for again."""
        with self._lock:
            del self._held[: _BYTES * (at - self._first)]
            self._first = at
            return bytes(self._held[: _BYTES * most])
