"""Gains of the current loop: in A, s and duty, and as the device counts them."""

from __future__ import annotations

from pulsetrainer.core.coil import LoopGains
from pulsetrainer.device.codes import CURRENT_UNIT_A, DUTY_FULL, PARAMETER
from pulsetrainer.device.gains import Gains

# Counts of a parameter for one unit of a gain in A, s and duty: see ``firmware/core/pid.h``.
_COUNTS = DUTY_FULL * CURRENT_UNIT_A
_TABLE = (  # gain, parameter, counts for one unit, times which power of a tick
    ("proportional", "pid_kp", 4096 * _COUNTS, 0),
    ("integral", "pid_ki", 65536 * _COUNTS, 1),
    ("feed_resistance", "feed_resistance", 65536 * _COUNTS, 0),
    ("feed_inductance", "feed_inductance", 256 * _COUNTS, -1),
    ("feed_offset", "feed_offset", float(DUTY_FULL), 0),
)
# The duty is the reference: its counts, in units of the current.
OPEN_LOOP = Gains(pid_kp=0, pid_ki=0, feed_resistance=65535, feed_inductance=0, feed_offset=0)
MOST_PROPORTIONAL = PARAMETER["pid_kp"].maximum / (4096 * _COUNTS)  # duty for an A


def to_wire(gains: LoopGains, dt_s: float) -> Gains:
    """Return gains in the device's units, at ticks of ``dt_s``; beyond a parameter's range its end."""
    counts = {name: getattr(gains, own) * dt_s**power * per for own, name, per, power in _TABLE}
    return Gains.of({name: min(round(value), PARAMETER[name].maximum) for name, value in counts.items()})


def from_wire(gains: Gains, dt_s: float) -> LoopGains:
    """Return gains of the device in A, s and duty."""
    counts = gains.values()
    return LoopGains(**{own: counts[name] / per / dt_s**power for own, name, per, power in _TABLE})
