"""Doctor: what stands in the way of a capture on this computer and on this device, each with its fix."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.api import open_device
from pulsetrainer.artefacts import FloatArray
from pulsetrainer.core import excitations
from pulsetrainer.core.record import Record
from pulsetrainer.device.device import Device
from pulsetrainer.device.follower import INTERRUPTED
from pulsetrainer.device.gains import DELIVERED
from pulsetrainer.device.limits import Limits
from pulsetrainer.device.opening import DEFAULT_PORT
from pulsetrainer.device.ports import list_ports
from pulsetrainer.device.schemes import redact
from pulsetrainer.device.trace import Trace
from pulsetrainer.device.wording import UNKNOWN_REMEDY
from pulsetrainer.diagnosis import wording
from pulsetrainer.diagnosis.causes import fired_on
from pulsetrainer.diagnosis.raw import Raw
from pulsetrainer.errors import Interrupted, PulsetrainerError
from pulsetrainer.simulation import build
from pulsetrainer.steps.stopped import raise_if_stopped
from pulsetrainer.version import __version__

State = Literal["ok", "warning", "problem"]

_ROOM_MB = 500.0  # an hour at 1 kHz takes about 150
_NOISE_SHARE = 0.01  # of the range; more, and small loops drown
_TRACKING_SHARE = 0.02
_LOOP_A = 0.75  # top of the short capture: half the range, 3 s of it
_LOOP_A_PER_S = 0.75
_REST_S = 0.5
_RATE_HZ = 1000.0
_GRID_S = 1.0 / _RATE_HZ


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at."""

    name: str
    state: State
    found: str
    fix: str = ""


def _finding(name: str, found: str, *, warning: str | None = None, problem: str | None = None) -> Finding:
    """Return what was found; ``warning`` or ``problem`` is the fix of one, and without it all is well."""
    state: State = "problem" if problem is not None else "warning" if warning is not None else "ok"
    return Finding(name, state, found, problem or warning or "")


def examine(
    port: str | None,
    *,
    capture: bool,
    limits: Limits,
    settings: str,
    tuned: Path | None,
    progress: Callable[[float], None],
) -> list[Finding]:
    """Look at versions, compiler, emulator, folder, ports and device; with ``capture`` its coil is driven.

    ``limits`` hold meanwhile; ``settings`` says in words which are in force, ``tuned`` is the file with the
    gains that `tune` found.
    """
    looks: list[Callable[[], Iterator[Finding]]] = [
        _versions,
        _compiler,
        _emulator,
        _folder,
        lambda: iter([_finding("settings", settings or "none: defaults")]),
        _ports,
        lambda: _device(port, limits, tuned, capture=capture),
    ]
    found: list[Finding] = []
    for number, look in enumerate(looks):
        found += look()
        progress((number + 1) / len(looks))
    return found


# --- this computer ------------------------------------------------------------------------------------


def _versions() -> Iterator[Finding]:
    own = f"pulsetrainer {__version__}, Python {platform.python_version()}"
    names, old = [], []
    for requirement in importlib.metadata.requires("pulsetrainer") or []:
        match = re.match(r"([A-Za-z0-9_.-]+).*?>=\s*([0-9.]+)", requirement)  # typer<0.29,>=0.19 as well
        if match is None or "extra ==" in requirement:
            continue
        name, least = match.groups()
        version = importlib.metadata.version(name)
        names.append(f"{name} {version}")
        if _numbers(version) < _numbers(least):
            old.append(f"{name}>={least}")
    newer = f"python -m pip install --upgrade {' '.join(old)}" if old else None
    yield _finding("versions", own if old else f"{own}; {', '.join(names)}", problem=newer)


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(n) for n in re.findall(r"\d+", version)[:3])


def _compiler() -> Iterator[Finding]:
    try:
        name, *words = build.find_compiler()
    except PulsetrainerError as error:
        yield _finding("compiler", error.message, problem=error.hint)
    else:
        said = " ".join((shutil.which(name) or name, *words))  # of ziglang the first word is Python
        yield _finding("compiler", f"{said}, for the virtual bench")


def _emulator() -> Iterator[Finding]:
    try:
        yield _finding("emulator", build.find_emulator())
    except PulsetrainerError as error:
        yield _finding("emulator", error.message, warning=error.hint)


def _folder() -> Iterator[Finding]:
    """Tell whether artefacts can be written here: permission and room."""
    where = Path.cwd()
    try:
        with tempfile.NamedTemporaryFile(dir=where, prefix=".pulsetrainer-doctor-") as probe:
            probe.write(b"\0" * 4096)
            probe.flush()
            os.fsync(probe.fileno())
    except OSError as error:
        said = f"{where} cannot be written: {error.strerror or error}"
        yield _finding("folder", said, problem="work in a folder of your own, or free some space")
        return
    free_MB = shutil.disk_usage(where).free / 1e6
    fix = None if free_MB > _ROOM_MB else "free some space: an hour of capture takes 150 MB"
    yield _finding("folder", f"{where} can be written, {free_MB:.0f} MB free", warning=fix)


def _ports() -> Iterator[Finding]:
    fixes = {
        "no permission": "sudo usermod -aG dialout $USER, then log in again",
        "busy": "close the other program (a terminal, a second pulsetrainer)",
        "absent": "check the cable",
    }
    ports = list_ports()
    if not ports:
        yield _finding("ports", "no serial port; without a device, use --port bench:")
    for port in ports:
        state: State = "ok" if port.status == "free" else "problem" if port.is_device else "warning"
        known = [text for text in (port.description, port.vid_pid) if text not in ("", "n/a")]
        kind = ["our device", port.vid_pid] if port.is_device else known or ["unknown device"]
        said = f"{port.status}, {' '.join(kind)}".strip()
        yield Finding(f"port {port.device}", state, said, fixes.get(port.status, ""))


# --- the device -----------------------------------------------------------------------------------------


def _device(port: str | None, limits: Limits, tuned: Path | None, *, capture: bool) -> Iterator[Finding]:
    try:
        with open_device(port, limits=limits, tuned=tuned) as device:
            yield from _identity(device, redact(port or DEFAULT_PORT))
            own = (
                f"those of `pulsetrainer tune`, from {tuned}" if device.gains != DELIVERED else "as delivered"
            )
            yield _finding("gains", own)
            if capture:
                yield from _short_capture(device)
    except Interrupted:
        raise
    except PulsetrainerError as error:
        yield _finding("device", error.message, problem=error.hint)


def _identity(device: Device, port: str) -> Iterator[Finding]:
    info = device.info
    yield _finding(
        "device",
        f"{port} {info.serial}, firmware {info.firmware}, protocol {info.protocol}, "
        f"limits {info.current_limit_A:g} A and {info.force_limit_N:g} N",
    )
    if info.latched_fault:
        yield _finding("last fault", info.latched_fault, warning="remove its cause; the next play clears it")


def _short_capture(device: Device) -> Iterator[Finding]:
    """Rest, go up to half the range, hold, come back, rest; look at noise, rails, tracking and losses."""
    top = min(_LOOP_A, device.info.current_limit_A)
    rest = np.zeros(round(_REST_S * _RATE_HZ))
    up = excitations.through(np.asarray([0.0, top]), _LOOP_A_PER_S, _RATE_HZ)
    reference = np.concatenate((rest, up, rest + top, up[::-1], rest))
    held = slice(rest.size + up.size + rest.size // 5, rest.size + up.size + rest.size)
    recording = device.play(reference, _RATE_HZ, decimation=round(device.info.tick_rate_Hz / _RATE_HZ))
    if recording.fault == INTERRUPTED:
        raise_if_stopped(recording.fault, recording.remedy, "the short capture")
    if recording.fault:
        yield _finding(
            "short capture", f"it ended early: {recording.fault}", problem=recording.remedy or UNKNOWN_REMEDY
        )
        return
    if lost := recording.dropped_samples:
        cable = "use a shorter or shielded cable, another USB port, no hub"
        yield _finding(
            "link",
            f"{lost} of {reference.size} samples {'was' if lost == 1 else 'were'} lost on the wire",
            warning=cable,
        )
    else:
        yield _finding("link", f"{recording.tick.size} samples, none lost")
    range_A, span_N = device.info.current_limit_A, float(np.ptp(recording.force_N))
    at = recording.tick * _RATE_HZ / device.info.tick_rate_Hz  # a lost sample moves those behind it
    still = (held.start <= at) & (at < held.stop)
    still_A, still_N = recording.current_A[still], recording.force_N[still]
    shunt, sensor = (
        "check the shunt's wiring and its ground",
        "keep the sensor's cable off the coil; check its screws",
    )
    yield _noise("current noise", still_A, range_A, f"range of {range_A:.3g} A", "A", shunt)
    yield _noise("force noise", still_N, span_N, f"span of {span_N:.3g} N", "N", sensor)
    yield from _rails(recording, top)


def _noise(name: str, still: FloatArray, full: float, of: str, unit: str, fix: str) -> Finding:
    """Noise while the current is held, against the range of the current or the span of the force."""
    sigma = float(np.std(scipy.signal.detrend(still)))  # creep is a slope on so short a hold
    if sigma == 0.0:
        said = f"none at all: {still[0]:.4g} {unit} in every sample"
        return _finding(name, said, warning="check that the sensor is connected and has power")
    share = sigma / full if full > 0 else 0.0
    said = f"{1e3 * sigma:.2g} m{unit} rms, {100 * share:.2g} % of the {of}"
    return _finding(name, said, warning=fix if share > _NOISE_SHARE else None)


def _rails(recording: Trace, top: float) -> Iterator[Finding]:
    """Saturation, tracking and what else the raw data show by themselves."""
    measured = Record(recording.current_A, recording.force_N, dt_s=_GRID_S, reference=recording.reference_A)
    fired = {one.cause: one for one in fired_on(Raw(measured, 0.0, top)) if one.cause != "out-of-range"}
    if cut := fired.pop("saturation", None):
        fix = "lower the gain of the force amplifier"
        yield _finding("saturation", wording.text(cut.evidence), problem=fix)
    else:
        yield _finding("saturation", f"none up to {top:g} A and {recording.force_N.max():.3g} N")
    worst = float(np.abs(recording.current_A - recording.reference_A).max()) / top
    tune = "measure the coil and set the gains for it: pulsetrainer tune -o pulsetrainer.toml"
    said = f"{100 * worst:.2g} % of {top:.3g} A at worst"
    yield _finding("current tracking", said, warning=tune if worst > _TRACKING_SHARE else None)
    fired.pop("current-tracking", None)
    for cause, one in fired.items():
        more = "pulsetrainer diagnose shows more"
        yield _finding(f"force: {cause}", wording.text(one.evidence), warning=more)
