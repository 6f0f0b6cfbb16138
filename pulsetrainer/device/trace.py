"""What comes back from a device: telemetry samples, and the whole of a play."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.device.codes import CURRENT_UNIT_A, DUTY_FULL, FORCE_UNIT_N
from pulsetrainer.device.messages import Telemetry, TelemetryDuty

FloatArray = NDArray[np.float64]
Int64Array = NDArray[np.int64]

# divided, 477 mN are 0.477 N; times 0.001 they would be 0.47700000000000004 N
_PER_UNIT = np.round(1.0 / np.asarray((CURRENT_UNIT_A, CURRENT_UNIT_A, FORCE_UNIT_N)))


@dataclass(frozen=True, slots=True)
class Block:
    """Telemetry samples in order, of one or many wire blocks: tick of the play, A, A, N, 1; shapes (n,).

    ``duty`` is the share of the tick before the sample in which the coil was switched on; NaN from a device
    that does not tell it.
    """

    tick: Int64Array
    reference_A: FloatArray
    current_A: FloatArray
    force_N: FloatArray
    duty: FloatArray

    @classmethod
    def from_wire(cls, messages: Sequence[Telemetry], decimation: int) -> Block:
        """Return the samples of ``messages``, ``decimation`` ticks apart within each."""
        told = any(isinstance(m, TelemetryDuty) for m in messages)
        items = np.frombuffer(b"".join(m.items for m in messages), dtype="<i2").reshape(-1, 4 if told else 3)
        starts = np.array([m.first_tick for m in messages], dtype=np.int64)
        counts = np.array([m.count for m in messages], dtype=np.int64)
        within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        scaled = items[:, :3] / _PER_UNIT
        return cls(
            tick=np.repeat(starts, counts) + decimation * within,
            reference_A=scaled[:, 0].copy(),
            current_A=scaled[:, 1].copy(),
            force_N=scaled[:, 2].copy(),
            duty=items[:, 3] / DUTY_FULL if told else np.full(len(items), np.nan),
        )


@dataclass(frozen=True, slots=True)
class Trace(Block):
    """All that a play brought back; lost samples are counted, never filled.

    The arrays are empty where the play was asked not to keep what it handed over.
    """

    tick_rate_Hz: float
    dropped_samples: int
    complete: bool  # the reference was played to its end
    fault: str  # why not: the device's first cause, or "interrupted"; empty when complete
    samples: int  # received, also where they were not kept
    remedy: str = ""  # what to do about it, where that is known
    underrun: bool = False  # the device had to stop because a sample came too late
    fault_code: int = 0  # the device's first cause, a codes.Fault; 0 where it had none

    @property
    def time_s(self) -> FloatArray:
        """Time since the first sample of the reference, s."""
        return self.tick / self.tick_rate_Hz
