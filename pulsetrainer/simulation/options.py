"""What a simulated device is to be, from its port's text: parameters, parts that break, a bad wire.

Told before anything that is slow to load, so that a mistake in it is, too.
"""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass, replace
from urllib.parse import parse_qsl

from pulsetrainer.errors import UsageError

# In the order of the enum in firmware/plant/breaks.h; a test compares them with what the firmware lists.
BREAKS = (
    "current-rail", "current-zero", "current-frozen", "force-high", "force-rail",
    "force-zero", "force-frozen", "tick-overrun", "reset", "hang",
    "current-low", "current-stuck", "shunt-half", "force-half", "stuck-on",
    "comparator", "tick-lost", "converter",
)  # fmt: skip
# What of the plant the emulated device takes, with its ranges: in the order of port/mps2/board.c; a test
# compares them with what the firmware lists.
_MOST_SEED = 16777215.0
QEMU_SETTINGS = {"ambient": (-60.0, 80.0), "supply-sag": (0.0, 5.0), "coil": (0.0, _MOST_SEED)}
LONGEST_S = 1e5
MAX_RATE = 0.1  # of damaged bytes: beyond that no frame comes through
_SPEEDS = ("max", "steady", "real")


@dataclass(frozen=True, slots=True)
class Wire:
    """Damage on the way between host and device: events per byte, drawn from a seed."""

    rate: float = 0.0
    seed: int = 1

    def told(self, kind: str, name: str, text: str) -> Wire:
        """Return the wire with the parameter ``name=text`` of a ``kind:`` port; UsageError if it is none."""
        like = f'`port` "{kind}:?wire=0.0001'
        if name == "wire-seed":
            if re.fullmatch(r"\d{1,9}", text):
                return replace(self, seed=int(text))
            raise UsageError(
                f"`port`: the {kind} parameter wire-seed must be a whole number of up to nine digits, "
                f"got {text}",
                hint=f'{like}&wire-seed=3"',
            )
        rate = number_in(text, 0.0, MAX_RATE)
        if math.isnan(rate):
            raise UsageError(
                f"`port`: the {kind} parameter wire must be the share of bytes to damage, from 0 to "
                f"{MAX_RATE}, got {text}",
                hint=f'to damage one byte in ten thousand: {like}"',
            )
        return replace(self, rate=rate)


GOOD_WIRE = Wire()


def number_in(text: str, low: float, high: float) -> float:
    """Return the number in a text; NaN where there is none, or it is not from ``low`` to ``high``."""
    try:
        value = float(text)
    except ValueError:
        return math.nan
    return value if low <= value <= high else math.nan


def parse_break(text: str) -> tuple[int, float]:
    """Return what breaks, as its place in ``BREAKS``, and at which second of the play (or UsageError)."""
    what, at, seconds = text.partition("@")
    if what in BREAKS and re.fullmatch(r"\d+(\.\d*)?" if at else "", seconds):
        second = float(seconds or 0)
        if second < LONGEST_S:
            return BREAKS.index(what), second
    near = difflib.get_close_matches(what, BREAKS, n=1)
    raise UsageError(
        f"`port`: a simulated device cannot break {text!r}" + (f"; did you mean {near[0]}?" if near else ""),
        hint=f"break=WHAT@SECONDS with WHAT one of {', '.join(BREAKS)}",
    )


@dataclass(frozen=True, slots=True)
class BenchOptions:
    """What a ``bench:`` port asks for."""

    ideal: bool = False
    speed: str = "max"
    settings: tuple[tuple[str, str], ...] = ()
    breaks: tuple[str, ...] = ()
    wire: Wire = GOOD_WIRE
    serial: str = ""  # its number, where that is not the seed's: a known device with another inside

    def arguments(self) -> list[str]:
        """Return the firmware process's command-line arguments."""
        words = ["--speed", self.speed, *(["--ideal"] if self.ideal else [])]
        for name, value in self.settings:
            words += ["--set", f"{name}={value}"]
        for what in self.breaks:
            words += ["--break", what]
        return words + (["--serial", self.serial] if self.serial else [])


def _switch(text: str) -> bool:
    if text not in {"", "1", "0"}:
        raise UsageError(
            f"`port`: the bench parameter ideal takes no value, got {text!r}", hint='`port` "bench:?ideal"'
        )
    return text != "0"


def _number_of_device(text: str, name: str = "serial", within: str = " of up to eight digits") -> str:
    if not re.fullmatch(r"\d{1,8}", text):
        raise UsageError(
            f"`port`: the bench parameter {name} must be a whole number{within}, got {text}",
            hint=f'`port` "bench:?{name}=3"',
        )
    return text


def _pairs(text: str) -> list[tuple[str, str]]:
    """Return names and values in a port's text; UsageError where one is set twice: but break, which adds."""
    pairs = parse_qsl(text, keep_blank_values=True)
    names = [name for name, _ in pairs]
    if twice := next((name for name in names if name != "break" and names.count(name) > 1), ""):
        said = " and ".join(value for name, value in pairs if name == twice)
        raise UsageError(f"`port`: {twice} is set more than once, to {said}", hint=f"give {twice} once")
    return pairs


def parse_bench(port: str) -> BenchOptions:
    """Return the options in ``bench:?ideal&creep=0.05&speed=real``, or raise UsageError.

    Names and ranges of the plant's parameters are known to the firmware alone.
    """
    match = re.fullmatch(r"bench:(?://)?(?:\?(.*))?", port)
    if match is None:
        raise UsageError(
            f"`port`: {port!r} is not a bench port",
            hint='write it like one of these: `port` "bench:", "bench:?ideal", "bench:?seed=3&creep=0.05"',
        )
    asked = BenchOptions()
    for name, value in _pairs(match[1] or ""):
        if name == "ideal":
            asked = replace(asked, ideal=_switch(value))
        elif name == "speed":
            if value not in _SPEEDS:
                raise UsageError(
                    f"`port`: the bench speed is max, steady or real, not {value!r}",
                    hint='`port` "bench:?speed=real"',
                )
            asked = replace(asked, speed=value)
        elif name == "break":
            asked = replace(asked, breaks=(*asked.breaks, value))
        elif name in ("wire", "wire-seed"):
            asked = replace(asked, wire=asked.wire.told("bench", name, value))
        elif name == "serial":
            asked = replace(asked, serial=_number_of_device(value))
        else:
            if name == "seed" and re.fullmatch(r"\d+\.\d*", value):
                _number_of_device(value, "seed", f" from 0 to {_MOST_SEED:.0f}")
            asked = replace(asked, settings=(*asked.settings, (name, value)))
    return asked


@dataclass(frozen=True, slots=True)
class QemuOptions:
    """What a ``qemu:`` port asks for."""

    breaks: tuple[tuple[int, float], ...] = ()  # what, at which second of the play
    wire: Wire = GOOD_WIRE
    settings: tuple[tuple[str, float], ...] = ()  # of the plant


def parse_qemu(port: str) -> QemuOptions:
    """Return the options in ``qemu:?break=force-high@1&wire=0.0001&wire-seed=3``, or raise UsageError."""
    match = re.fullmatch(r"qemu:(?://)?(?:\?(.+))?", port)
    if match is None:
        raise UsageError(
            f"`port`: {port!r} is not a port", hint='`port` "qemu:" alone, or "qemu:?break=reset@1"'
        )
    asked = QemuOptions()
    for name, value in _pairs(match[1] or ""):
        if name in QEMU_SETTINGS:
            asked = replace(asked, settings=(*asked.settings, (name, _setting(name, value))))
        elif name == "break":
            asked = replace(asked, breaks=(*asked.breaks, parse_break(value)))
        elif name in ("wire", "wire-seed"):
            asked = replace(asked, wire=asked.wire.told("qemu", name, value))
        else:
            raise UsageError(
                f"`port`: the emulated device (qemu:) has no parameter {name!r}",
                hint=f"it takes break, wire, wire-seed, {', '.join(QEMU_SETTINGS)}; the bench takes more: "
                '`port` "bench:?seed=3&creep=0.05"',
            )
    return asked


def _setting(name: str, text: str) -> float:
    low, high = QEMU_SETTINGS[name]
    value = number_in(text, low, high)
    if math.isnan(value):
        raise UsageError(
            f"`port`: the qemu parameter {name}={text} is not a number from {low:g} to {high:g}",
            hint='write it like this: `port` "qemu:?ambient=20"',
        )
    return value


def serial_of(port: str) -> str:
    """Return the serial number of a simulated device by its port; empty for one that must be asked."""
    if not port.startswith("bench:"):
        return "QEMU-0" if port.startswith("qemu:") else ""
    options = parse_bench(port)
    number = options.serial or dict(options.settings).get("seed", "0")
    return f"BENCH-{int(number)}" if number.isdecimal() else ""


def in_real_time(port: str) -> str:
    """Return a port with a bench that keeps pace with the clock, unless its text names a speed.

    A person who presses keys cannot follow one that runs as fast as it can. It waits for a busy computer,
    where a real device takes its host for gone.
    """
    if not port.startswith("bench:") or "speed" in dict(parse_qsl(port.partition("?")[2])):
        return port
    return f"{port}{'&' if '?' in port else '?'}speed=steady"


def check_port(port: str) -> None:
    """Raise UsageError where a simulated device's port makes no sense; others are tried when they open."""
    if port.startswith("bench:"):
        parse_bench(port)
    if port.startswith("qemu:"):
        parse_qemu(port)
