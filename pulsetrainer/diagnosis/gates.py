"""The gates of all causes on one record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.causes import library, taken_out
from pulsetrainer.diagnosis.raw import Firing, Raw


def check(
    record: Record,
    low: float,
    high: float,
    second: float = 1.0,
    stamps: FloatArray | None = None,
    polarity: int = 1,
    corrected: Sequence[str] = (),
    said: FloatArray | None = None,
) -> list[Firing]:
    """Ask every gate about a record as it was measured; ``low`` and ``high`` are the identified range.

    ``said`` (n,) is what the model as given says of the record.

    Wild samples are found first and taken out for the others; a gate is not asked where one has fired that
    blinds it, nor about what was taken out of the record already (``corrected``) or is left of that.
    """
    raw = Raw(record, low, high, second, stamps, polarity=polarity, said=said)
    out = taken_out(corrected)
    causes = [one for one in library().values() if one.stage == "record" and one.id not in out]
    fired: dict[str, Firing] = {}
    for cause in sorted(causes, key=lambda one: not one.wild):
        if not any(name in fired for name in cause.blinded_by):
            firing = cause.gate(raw)
            if firing is not None:
                fired[cause.id] = firing
                raw = replace(raw, wild=firing.mask) if cause.wild else raw
    return [fired[cause.id] for cause in causes if cause.id in fired]
