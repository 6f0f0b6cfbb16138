"""The bench's firmware, compiled on first use and kept in the user's cache."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from platformdirs import user_cache_dir

from pulsetrainer.errors import DeviceError
from pulsetrainer.resources import firmware_dir

_FOLDERS = ("core", "plant", "port/host")
_INCLUDES = ("core", "hal", "plant", "port/host")
_NOT_IN_A_PORT = {"harness.c"}  # programs of their own
# -ffp-contract=off: the plant promises the same bits everywhere.
_FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-D_XOPEN_SOURCE=700")


def find_compiler() -> list[str]:
    """Return the command of a C compiler: $CC, ``cc``, or ziglang from the package index.

    Raises
    ------
    DeviceError
        if there is none.
    """
    for name in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        words = name.split()
        if words and shutil.which(words[0]):
            return words
    if importlib.util.find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "cc"]
    raise DeviceError(
        "the virtual bench needs a C compiler once, and there is neither cc nor ziglang",
        hint="install one: `sudo apt install gcc libc6-dev`, or without root `pip install ziglang`",
    )


def _sources(root: Path) -> list[Path]:
    return sorted(
        p for folder in _FOLDERS for p in (root / folder).glob("*.c") if p.name not in _NOT_IN_A_PORT
    )


def _digest(root: Path, command: list[str]) -> str:
    """Return a hash of sources, headers, compiler and flags."""
    h = hashlib.sha256()
    headers = (p for folder in _INCLUDES for p in (root / folder).glob("*.h"))
    for path in sorted([*_sources(root), *headers]):
        h.update(f"{path.relative_to(root)}\0{path.stat().st_size}\0".encode())
        h.update(path.read_bytes())
    h.update("\0".join(command).encode())
    which = shutil.which(command[0])
    if which:
        real = Path(which).resolve()
        stat = real.stat()
        h.update(f"{real}\0{stat.st_size}\0{stat.st_mtime_ns}".encode())
    return h.hexdigest()


def firmware_executable(defines: tuple[str, ...] = ()) -> Path:
    """Return the host firmware's executable, compiled now unless the cache has it.

    ``defines`` are extra ``-D`` flags, such as another protocol version in a test.
    """
    root = firmware_dir()
    command = [*find_compiler(), *_FLAGS, *defines]
    digest = _digest(root, command)
    folder = Path(user_cache_dir("pulsetrainer")) / "firmware"
    target = folder / f"host-{digest[:20]}"
    if target.exists():
        return target
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # Compiled beside its place and moved there: another process sees nothing or the whole.
        handle, temporary = tempfile.mkstemp(prefix="build-", dir=folder)
    except OSError as error:
        raise DeviceError(
            f"cannot write the firmware cache {folder}: {error}",
            hint="set XDG_CACHE_HOME to a writable folder",
        ) from error
    os.close(handle)
    words = [*command, f"-DPT_BUILD_HASH=0x{digest[:8]}u", *(f"-I{root / i}" for i in _INCLUDES)]
    words += [str(p) for p in _sources(root)]
    try:
        done = subprocess.run([*words, "-o", temporary], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise DeviceError(
                f"the firmware does not compile with {' '.join(command[:4])}:\n{done.stderr.strip()[-2000:]}",
                hint="name another compiler in the environment variable CC, or `pip install ziglang`",
            )
        Path(temporary).chmod(0o755)
        Path(temporary).replace(target)
    finally:
        Path(temporary).unlink(missing_ok=True)
    return target
