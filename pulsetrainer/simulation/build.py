"""The firmware for the bench and for the emulator, compiled on first use and kept in the user's cache."""

from __future__ import annotations

import atexit
import functools
import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from platformdirs import user_cache_dir

from pulsetrainer.errors import DeviceError
from pulsetrainer.resources import firmware_dir

_NOT_IN_A_PORT = {"harness.c"}  # programs of their own
_SOURCES = ("*.c", "*.S")
# -ffp-contract=off: the plant promises the same bits everywhere.
_FLAGS = ("-std=c99", "-O2", "-ffp-contract=off")
_HOST = (*_FLAGS, "-D_XOPEN_SOURCE=700")
_MPS2 = (*_FLAGS, "-ffreestanding", "-DPLANT_REAL=float", "-nostdlib")  # doubles are too slow for its FPU
_CORTEX_M4F = ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16")
_ZIG_CORTEX_M4F = ("-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m4+vfp4d16sp")
DEBIAN_PACKAGES = "gcc-arm-none-eabi qemu-system-arm"


@dataclass(frozen=True, slots=True)
class _Image:
    """What is compiled: a port of the firmware with one compiler."""

    port: str
    command: tuple[str, ...]
    libraries: tuple[str, ...]
    remedy: str

    @property
    def folders(self) -> tuple[str, ...]:
        return ("core", "hal", "plant", f"port/{self.port}")

    def files(self, root: Path, *patterns: str) -> list[Path]:
        """Return its files, each time in the same order."""
        found = (p for folder in self.folders for pattern in patterns for p in (root / folder).glob(pattern))
        return sorted(p for p in found if p.name not in _NOT_IN_A_PORT)


def find_compiler() -> list[str]:
    """Return the command of a C compiler; DeviceError where there is none."""
    for name in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        words = name.split()
        if words and shutil.which(words[0]):
            return words
    if importlib.util.find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "cc"]
    raise DeviceError(
        "the virtual bench needs a C compiler once, and none of $CC, cc, gcc, clang and ziglang is here",
        hint="install one: `sudo apt install gcc libc6-dev`, or without root `pip install ziglang`",
    )


def _digest(root: Path, image: _Image) -> str:
    h = hashlib.sha256()
    for path in image.files(root, *_SOURCES, "*.h", "*.ld"):
        h.update(f"{path.relative_to(root)}\0{path.stat().st_size}\0".encode())
        h.update(path.read_bytes())
    h.update("\0".join(image.command + image.libraries).encode())
    which = shutil.which(image.command[0])
    if which:
        real = Path(which).resolve()
        stat = real.stat()
        h.update(f"{real}\0{stat.st_size}\0{stat.st_mtime_ns}".encode())
    return h.hexdigest()


def firmware_executable(defines: tuple[str, ...] = ()) -> Path:
    """Return the host firmware's executable, compiled now unless the cache has it.

    ``defines`` are extra ``-D`` flags, such as another protocol version in a test.
    """
    remedy = "name another compiler in the environment variable CC, or `pip install ziglang`"
    return _compiled(_Image("host", (*find_compiler(), *_HOST, *defines), (), remedy))


def firmware_image() -> Path:
    """Return the emulated Cortex-M4F's image, compiled now unless the cache has it."""
    compiler = find_arm_compiler()
    libraries: tuple[str, ...] = ("-T", str(firmware_dir() / "port" / "mps2" / "mps2.ld"))
    libraries = (*libraries, "-lcompiler_rt" if "ziglang" in compiler else "-lgcc")
    remedy = f"use the compiler that it was tried with: `sudo apt install {DEBIAN_PACKAGES}`"
    return _compiled(_Image("mps2", (*compiler, *_MPS2), libraries, remedy))


def find_arm_compiler() -> list[str]:
    """Return the command of a C compiler for the Cortex-M4F; DeviceError where there is none."""
    if shutil.which("arm-none-eabi-gcc"):
        return ["arm-none-eabi-gcc", *_CORTEX_M4F]
    if importlib.util.find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "cc", *_ZIG_CORTEX_M4F]
    raise _not_installed("arm-none-eabi-gcc")


def find_emulator() -> str:
    """Return the path of the emulator; DeviceError where it, or the compiler that it needs, is missing."""
    program = shutil.which("qemu-system-arm")
    try:
        find_arm_compiler()
    except DeviceError as error:
        raise error if program else _not_installed("qemu-system-arm and arm-none-eabi-gcc") from error
    if program is None:
        raise _not_installed("qemu-system-arm")
    return program


def _not_installed(programs: str) -> DeviceError:
    return DeviceError(
        f"the emulated device (qemu:) needs {programs}, which was not found on this computer",
        hint=f"install: `sudo apt install {DEBIAN_PACKAGES}`; or simulate without them: `port` bench:",
    )


def _place_in(folder: Path) -> str:
    """Return a new file in a folder, which is made if need be."""
    folder.mkdir(parents=True, exist_ok=True)
    handle, path = tempfile.mkstemp(prefix="build-", dir=folder)
    os.close(handle)
    return path


@functools.cache
def _folder_of_this_process(why: str) -> Path:
    """Return a temporary folder, deleted when this process ends; DeviceError ``why`` if none can be made."""
    try:
        folder = Path(tempfile.mkdtemp(prefix="pulsetrainer-"))
    except OSError as error:
        raise DeviceError(why, hint="set XDG_CACHE_HOME to a writable folder") from error
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _compiled(image: _Image) -> Path:
    """Return the image's file in the cache, compiled now unless it is there."""
    root = firmware_dir()
    digest = _digest(root, image)
    folder = Path(user_cache_dir("pulsetrainer")) / "firmware"
    name = f"{image.port}-{digest[:20]}"
    if (folder / name).exists():
        return folder / name
    try:
        # Compiled beside its place and moved there: another process sees nothing or the whole.
        temporary = _place_in(folder)
    except OSError as error:  # a home that may only be read
        folder = _folder_of_this_process(f"cannot write the firmware cache {folder}: {error}")
        if (folder / name).exists():
            return folder / name
        temporary = _place_in(folder)
    words = [*image.command, f"-DPT_BUILD_HASH=0x{digest[:8]}u", *(f"-I{root / i}" for i in image.folders)]
    words += [*(str(p) for p in image.files(root, *_SOURCES)), *image.libraries, "-o", temporary]
    try:
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise DeviceError(
                f"the firmware does not compile with {' '.join(image.command[:4])}:\n"
                f"{done.stderr.strip()[-2000:]}",
                hint=image.remedy,
            )
        Path(temporary).chmod(0o755)
        Path(temporary).replace(folder / name)
    finally:
        Path(temporary).unlink(missing_ok=True)
    return folder / name
