"""Gains of the current loop: in A, s and duty, and as the device counts them."""

from __future__ import annotations

from pulsetrainer.core.coil import LoopGains
from pulsetrainer.device.codes import CURRENT_UNIT_A, DUTY_FULL, PARAMETER
from pulsetrainer.device.gains import Gains

# Counts of a parameter for one unit of a gain in A, s and duty: see ``firmware/core/pid.h``.
_COUNTS = DUTY_FULL * CURRENT_UNIT_A
_PER = {
    "pid_kp": 4096 * _COUNTS,
    "pid_ki": 65536 * _COUNTS,  # times a tick
    "feed_resistance": 65536 * _COUNTS,
    "feed_inductance": 256 * _COUNTS,  # over a tick
    "feed_offset": float(DUTY_FULL),
}
# The duty is the reference: its counts, in units of the current.
OPEN_LOOP = Gains(pid_kp=0, pid_ki=0, feed_resistance=65535, feed_inductance=0, feed_offset=0)
MOST_PROPORTIONAL = PARAMETER["pid_kp"].maximum / _PER["pid_kp"]  # duty for an A


def to_wire(gains: LoopGains, dt_s: float) -> Gains:
    """Return gains in the device's units, at ticks of ``dt_s``; beyond a parameter's range its end."""
    wanted = {
        "pid_kp": gains.proportional,
        "pid_ki": gains.integral * dt_s,
        "feed_resistance": gains.feed_resistance,
        "feed_inductance": gains.feed_inductance / dt_s,
        "feed_offset": gains.feed_offset,
    }
    return Gains.of(
        {name: min(round(value * _PER[name]), PARAMETER[name].maximum) for name, value in wanted.items()}
    )


def from_wire(gains: Gains, dt_s: float) -> LoopGains:
    """Return gains of the device in A, s and duty."""
    value = {name: counts / _PER[name] for name, counts in gains.values().items()}
    return LoopGains(
        proportional=value["pid_kp"],
        integral=value["pid_ki"] / dt_s,
        feed_resistance=value["feed_resistance"],
        feed_inductance=value["feed_inductance"] * dt_s,
        feed_offset=value["feed_offset"],
    )
