"""Gains of the device's current loop, in the units of its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Self

from pulsetrainer.device import codes
from pulsetrainer.errors import ArgumentError


@dataclass(frozen=True, slots=True)
class Gains:
    """PI and feed-forward as ``firmware/core/pid.h`` counts them; the defaults are those delivered."""

    pid_kp: int
    pid_ki: int
    feed_resistance: int
    feed_inductance: int
    feed_offset: int

    def __post_init__(self) -> None:
        for name, value in self.values().items():
            row = codes.PARAMETER[name]
            if isinstance(value, bool) or not isinstance(value, int):
                raise ArgumentError(
                    f"the gain {name} must be a whole number, got {value!r}", hint="tune again"
                )
            if not row.minimum <= value <= row.maximum:
                raise ArgumentError(
                    f"the gain {name}={value} is outside {row.minimum}..{row.maximum} {row.unit}",
                    hint="tune the device again",
                )

    @classmethod
    def of(cls, values: Mapping[str, int]) -> Self:
        """Return the gains among some values by name; ArgumentError where one is missing or out of range."""
        names = [field.name for field in fields(cls)]
        missing = [name for name in names if name not in values]
        if missing:
            raise ArgumentError(f"the gain {missing[0]} is missing", hint="tune the device again")
        return cls(**{name: values[name] for name in names})

    def values(self) -> dict[str, int]:
        """Return the gains by the names of their parameters."""
        return asdict(self)


DELIVERED = Gains.of({p.name: p.default for p in codes.PARAMETERS})
