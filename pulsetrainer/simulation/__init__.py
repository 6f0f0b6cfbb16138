"""What only pretends to be a device: the bench, the emulator, the bad wire.

Importing this package announces the ports ``bench:`` and ``qemu:``; what they need is loaded when one is
opened. Whoever opens a device by the text of its port imports it first.
"""

from __future__ import annotations

from pulsetrainer.device.schemes import Clock, OpenPort, register


def _open_bench(port: str, monotonic: Clock) -> OpenPort:
    from pulsetrainer.simulation.bench import open_bench

    return open_bench(port, monotonic)


def _open_emulator(port: str, monotonic: Clock) -> OpenPort:
    from pulsetrainer.simulation.emulator import open_emulator

    return open_emulator(port, monotonic)


register("bench", _open_bench)
register("qemu", _open_emulator)
