"""The virtual bench: the real firmware with a simulated solenoid, as a process on a pty."""

from __future__ import annotations

import contextlib
import difflib
import os
import re
import select
import subprocess
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl

from pulsetrainer.errors import DeviceError, UsageError
from pulsetrainer.link.build import firmware_executable
from pulsetrainer.link.simulated import GOOD_WIRE, Wire, wire_rate, wire_seed

if TYPE_CHECKING:
    from pathlib import Path

_SPEEDS = ("max", "real")
_OWN = ("ideal", "speed", "break", "wire", "wire-seed")
_START_S = 10.0
_LEAVE_S = 2.0


@dataclass(frozen=True, slots=True)
class BenchOptions:
    """What a ``bench:`` port asks for."""

    ideal: bool = False
    speed: str = "max"
    settings: tuple[tuple[str, str], ...] = ()
    breaks: tuple[str, ...] = ()
    wire: Wire = GOOD_WIRE

    def arguments(self) -> list[str]:
        """Return the firmware process's command-line arguments."""
        words = ["--speed", self.speed, *(["--ideal"] if self.ideal else [])]
        for name, value in self.settings:
            words += ["--set", f"{name}={value}"]
        for what in self.breaks:
            words += ["--break", what]
        return words


def parse_bench(port: str) -> BenchOptions:
    """Return the options in ``bench:?ideal&creep=0.05&speed=real``; names and ranges are checked later.

    Raises
    ------
    UsageError
        if it is not of that form.
    """
    match = re.fullmatch(r"bench:(?://)?(?:\?(.*))?", port)
    if match is None:
        raise UsageError(
            f"{port!r} is not a bench port",
            hint='like this: "bench:", "bench:?ideal", "bench:?seed=3&creep=0.05"',
        )
    ideal, speed = False, "max"
    rate, seed = GOOD_WIRE.rate, GOOD_WIRE.seed
    settings: list[tuple[str, str]] = []
    breaks: list[str] = []
    for name, value in parse_qsl(match[1] or "", keep_blank_values=True):
        if name == "ideal":
            if value not in {"", "1", "0"}:
                raise UsageError(
                    f"bench parameter ideal takes no value, got {value!r}", hint='"bench:?ideal"'
                )
            ideal = value != "0"
        elif name == "speed":
            if value not in _SPEEDS:
                raise UsageError(f"bench speed is max or real, not {value!r}", hint='"bench:?speed=real"')
            speed = value
        elif name == "break":
            breaks.append(value)
        elif name == "wire":
            rate = wire_rate("bench", value)
        elif name == "wire-seed":
            seed = wire_seed("bench", value)
        else:
            settings.append((name, value))
    return BenchOptions(ideal, speed, tuple(settings), tuple(breaks), Wire(rate, seed))


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
            near = difflib.get_close_matches(name, [*parameters, *_OWN], n=3, cutoff=0.5)
            return UsageError(
                f"the bench has no parameter {name!r}",
                hint=f"did you mean {' or '.join(near)}?"
                if near
                else f"there are: {', '.join([*_OWN, *parameters])}",
            )
        unit, low, high, meaning = parameters[name]
        if f"{name}={value}" in complaint:
            return UsageError(
                f"bench parameter {name}={value} is outside its range: {low}..{high} {unit}",
                hint=f"{name}: {meaning}",
            )
    for what in options.breaks:
        if what.partition("@")[0] not in breaks or what in complaint:
            return UsageError(
                f"the bench cannot break {what!r}",
                hint=f"break=WHAT@SECONDS with WHAT one of {', '.join(breaks)}",
            )
    return UsageError(f"the bench refused its parameters: {complaint}", hint='start with "bench:" alone')


class Bench:
    """A running firmware process; ``path`` is its pty."""

    def __init__(self, port: str, executable: Path | None = None) -> None:
        if os.name != "posix":
            raise DeviceError(
                "the virtual bench needs a pseudo-terminal, which this system does not have",
                hint="use Linux, macOS or WSL for bench:, or a real device with --port COM3",
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
                f"the bench did not start: {complaint}", hint="is /dev/ptmx there and permitted?"
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
