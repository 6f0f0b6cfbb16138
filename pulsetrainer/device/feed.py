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
        self.size = 0  # samples put in so far
        self.ended = False  # no more will come
        self.total = codes.WAVE_OPEN  # as the device is told
        self.crc32 = 0  # of all of them, where all are known beforehand
        if samples is not None:
            self.append(samples)
            self.ended = True
            self.total, self.crc32 = self.size, zlib.crc32(self._held)

    def append(self, samples: NDArray[np.int16]) -> None:
        """Put samples in behind the others."""
        with self._lock:
            self._held += samples.astype("<i2").tobytes()
            self.size += samples.size

    def piece(self, at: int, most: int) -> bytes:
        """Return up to ``most`` samples from number ``at`` on; those before it are not asked for again."""
        with self._lock:
            del self._held[: _BYTES * (at - self._first)]
            self._first = at
            return bytes(self._held[: _BYTES * most])
