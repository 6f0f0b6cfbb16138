"""The virtual bench: the real firmware with a simulated solenoid, as a process on a pty."""

from __future__ import annotations

import contextlib
import difflib
import math
import os
import re
import select
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from pulsetrainer.device.schemes import OpenPort
from pulsetrainer.device.transport import SerialTransport
from pulsetrainer.errors import DeviceError, UsageError
from pulsetrainer.resources import firmware_dir
from pulsetrainer.simulation.bad_wire import through
from pulsetrainer.simulation.build import firmware_executable
from pulsetrainer.simulation.options import BenchOptions, number_in, parse_bench

BENCH_PORT = "bench:"
_OWN = ("ideal", "speed", "break", "wire", "wire-seed", "serial")
_LIST = "plant/solenoid_params.c"  # each with its range and what it does
_START_S = 10.0
_LEAVE_S = 2.0


def _known(executable: Path) -> tuple[dict[str, tuple[str, str, str, str]], list[str]]:
    """Return the plant's parameters (name: unit, low, high, meaning) and what can be broken."""
    text = subprocess.run([str(executable), "--list"], capture_output=True, text=True, check=True).stdout
    table, _, breaks = text.partition("\n\n")
    rows = [line.split("\t") for line in table.splitlines()]
    return {name: (unit, low, high, meaning) for name, unit, low, high, meaning in rows}, breaks.split()


def _explain(executable: Path, options: BenchOptions, complaint: str) -> UsageError:
    """Return the usage error behind the firmware process's complaint."""
    parameters, breaks = _known(executable)
    for name, value in options.settings:
        if name not in parameters:
            near = difflib.get_close_matches(name, [*parameters, *_OWN], n=3, cutoff=0.6) or [
                known for known, row in parameters.items() if name and name in f"{known} {row[-1]}"
            ]
            return UsageError(
                f"`port`: the bench has no parameter {name!r}",
                hint=f"did you mean {' or '.join(near)}?"
                if near
                else f"it takes {', '.join(_OWN)}, and what {firmware_dir() / _LIST} lists, such as noise",
            )
        unit, low, high, meaning = parameters[name]
        if f"{name}={value}" in complaint:
            within = f"{low} to {high} {unit}".removesuffix(" 1")
            most = sys.float_info.max
            amiss = "is not a number from" if math.isnan(number_in(value, -most, most)) else "is outside"
            hint = f"give {name} a value in that range; it sets: {meaning}"
            if re.fullmatch(r"-?\d+,\d+", value):
                hint = f"write it with a point: {name}={value.replace(',', '.')}"
            if (share := re.fullmatch(r"(\d+(?:\.\d+)?)%", value)) and unit == "1":
                hint = f"write {float(share[1]) / 100:g} for {share[1]} %"
            if re.search(r"[,;]\w+=", value):
                several = f"bench:?{name}={re.sub('[,;]', '&', value)}"
                hint = f"put & between parameters, and quotes around them: `port` '{several}'"
            return UsageError(f"`port`: the bench parameter {name}={value} {amiss} {within}", hint=hint)
    for what in options.breaks:
        if what.partition("@")[0] not in breaks or what in complaint:
            return UsageError(
                f"`port`: the bench cannot break {what!r}",
                hint=f"break=WHAT@SECONDS with WHAT one of {', '.join(breaks)}",
            )
    return UsageError(
        f"`port`: the bench refused its parameters: {complaint}", hint='start with `port` "bench:" alone'
    )


def check_bench(port: str) -> None:
    """Raise UsageError where a bench would refuse its parameters; none is started."""
    options = parse_bench(port)
    if not (options.settings or options.breaks):
        return  # nothing that has to be compiled to be asked
    executable = firmware_executable()
    words = [str(executable), *options.arguments(), "--list"]  # read before it lists
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode == 2:
        raise _explain(executable, options, done.stderr.strip())


class Bench:
    """A running firmware process; ``path`` is its pty."""

    def __init__(self, port: str, executable: Path | None = None) -> None:
        if os.name != "posix":
            raise DeviceError(
                "the virtual bench needs a pseudo-terminal, which this system does not have",
                hint="use Linux, macOS or WSL for bench:, or a real device with `port` COM3",
            )
        self.options = options = parse_bench(port)
        executable = executable or firmware_executable()
        # A session of its own: Ctrl-C in the terminal must reach the host program only, which then stops
        # the device in order. The pipe on standard input is the leash: it closes however we end.
        self._process = subprocess.Popen(
            [str(executable), "--leash", *options.arguments()],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
        try:
            self.path = self._first_line()
        except BaseException:
            self.close()
            raise
        if not self.path:
            complaint = self._complaint()
            self.close()
            if self._process.returncode == 2:
                raise _explain(executable, options, complaint)
            raise DeviceError(
                f"the bench did not start: {complaint}",
                hint="check that /dev/ptmx exists and may be opened: ls -l /dev/ptmx",
            )

    @property
    def pid(self) -> int:
        """Process id of the firmware process."""
        return self._process.pid

    def _first_line(self) -> str:
        assert self._process.stdout is not None
        ready, _, _ = select.select([self._process.stdout], [], [], _START_S)
        return self._process.stdout.readline().decode().strip() if ready else ""

    def _complaint(self) -> str:
        with contextlib.suppress(subprocess.TimeoutExpired):
            _, err = self._process.communicate(timeout=_LEAVE_S)
            return err.decode(errors="replace").strip()
        return f"no answer within {_START_S:g} s"

    def close(self) -> None:
        """End the firmware process."""
        process = self._process
        for pipe in (process.stdin, process.stdout, process.stderr):
            if pipe is not None:
                pipe.close()
        try:
            process.wait(timeout=_LEAVE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def open_bench(port: str, monotonic: Callable[[], float], executable: Path | None = None) -> OpenPort:
    """Start a bench and open its line.

    UsageError where the port's text makes no sense; DeviceError where the firmware cannot be compiled or
    started.
    """
    bench = Bench(port, executable)
    try:
        transport = SerialTransport(bench.path, BENCH_PORT)
    except BaseException:
        bench.close()
        raise
    wired = through(bench.options.wire, transport, monotonic)
    return OpenPort(wired, BENCH_PORT, starts_cold=True, machine=bench)
