"""A record: a measured input and output, with what is known of how they were measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pulsetrainer.core.memory import State
from pulsetrainer.core.plane import BoolArray, FloatArray, finite_vector
from pulsetrainer.errors import ArgumentError


@dataclass(frozen=True, slots=True)
class Record:
    """One measured record: what a fit or a diagnosis works on.

    ArgumentError where input, output, sample weights or reference differ in length, there are fewer than 2
    samples, an input or an output that counts is not finite, a sample weight is negative, or the time step is
    not positive.
    """

    input: FloatArray  # (n,) input unit
    output: FloatArray  # (n,) output unit; where the sample weight is 0 it may be anything, NaN too
    # (n,) what each sample counts in a fit: 0 takes it out of the fit, but not out of the memory. One number
    # stands for all samples
    sample_weight: FloatArray = field(default_factory=lambda: np.ones(()))
    start: State | None = None  # memory before the first sample; None: negative saturation
    dt_s: float | None = None  # even time step; None: only the order of the samples is known
    reference: FloatArray | None = None  # (n,) the input that was asked for, input unit
    averaged: int = 1  # samples as measured, of which each of these is the mean

    def __post_init__(self) -> None:
        u = finite_vector("input", self.input, at_least=2)
        v = np.asarray(self.sample_weight, dtype=np.float64)
        v = finite_vector("sample_weight", np.full(u.size, v) if v.ndim == 0 else v)
        y = np.asarray(self.output, dtype=np.float64)
        asked = u if self.reference is None else np.asarray(self.reference, dtype=np.float64)
        if not y.shape == v.shape == asked.shape == u.shape:
            raise ArgumentError(
                "input, output, sample_weight and reference must have one length, got "
                f"{u.shape}, {y.shape}, {v.shape} and {asked.shape}",
                hint="cut the record to the samples that have all of them",
            )
        if np.any(v < 0):
            raise ArgumentError(
                f"sample_weight must not be negative, got {v.min():g}",
                hint="0 leaves a sample out of the fit",
            )
        finite_vector("output", y[v > 0], at_least=0)
        if self.dt_s is not None and not (self.dt_s > 0 and np.isfinite(self.dt_s)):
            raise ArgumentError(
                f"dt_s must be positive and finite, got {self.dt_s:g}", hint="None: no time is known"
            )
        object.__setattr__(self, "input", u)
        object.__setattr__(self, "output", y)
        object.__setattr__(self, "sample_weight", v)

    @property
    def timed(self) -> bool:
        """Whether the time step is known."""
        return self.dt_s is not None

    @property
    def step(self) -> float:
        """Time step, s; 1 where only the order of the samples is known."""
        return 1.0 if self.dt_s is None else self.dt_s

    @property
    def time_s(self) -> FloatArray:
        """Time since the first sample (n,), s; the number of the sample where no time is known."""
        return np.asarray(np.arange(self.input.size) * self.step, dtype=np.float64)

    @property
    def counts(self) -> BoolArray:
        """Which samples (n,) count in a fit."""
        return self.sample_weight > 0

    @property
    def fitted_output(self) -> FloatArray:
        """The output (n,), zero where the sample weight is: what is left out may be anything, NaN too."""
        return np.where(self.counts, self.output, 0.0)


def counted(records: Sequence[Record], signals: Sequence[FloatArray]) -> FloatArray:
    """Samples that count (k,) of one signal (n,) per record, one record after another."""
    return np.concatenate([x[r.counts] for x, r in zip(signals, records, strict=True)])


def counted_output(records: Sequence[Record]) -> FloatArray:
    """Outputs (k,) of all samples that count, one record after another."""
    return counted(records, [r.output for r in records])


def levelled(records: Sequence[Record], sign: int = 1) -> tuple[list[Record], float]:
    """Records whose outputs are ``sign`` y - z, and z, the mean of sign y over all samples that count.

    Sums of squares far from zero have no digits left for what the output does: a force of 1000 N that moves
    by 1 mN is fitted as well as one around zero only after its mean is taken off.
    """
    y = counted_output(records)
    zero = sign * float(np.mean(y)) if y.size else 0.0
    return [replace(r, output=sign * r.output - zero) for r in records], zero
