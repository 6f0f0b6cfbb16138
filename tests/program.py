"""The program as a user runs it: a process of its own in a folder of its own."""

from __future__ import annotations

import atexit
import functools
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import warm

PROGRAM = [sys.executable, "-m", "pulsetrainer"]
_WARM = Path(warm.__file__)


@dataclass(frozen=True)
class Ran:
    """What a command printed and how it ended."""

    code: int
    out: str
    err: str

    @property
    def json(self):
        """The one object on stdout."""
        lines = self.out.splitlines()
        assert len(lines) == 1, f"one JSON object on stdout, got: {self.out!r}"
        return json.loads(lines[0])


@functools.cache
def warm_socket() -> str:
    """Return where commands are taken by a process that has loaded the program; it ends with this one."""
    folder = tempfile.mkdtemp(prefix="warm-")
    path = str(Path(folder) / "socket")
    server = subprocess.Popen(
        [sys.executable, "-P", str(_WARM), "--serve", path],
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
    )

    def end() -> None:
        os.killpg(server.pid, signal.SIGKILL)
        server.wait()
        shutil.rmtree(folder, ignore_errors=True)

    assert server.stdout is not None
    assert server.stdout.readline() == b"ready\n"
    atexit.register(end)
    return path


def program_on_path() -> Path:
    """Return a folder that holds ``pulsetrainer``, as a program that a shell or make finds."""
    folder = Path(warm_socket()).parent
    script = folder / "pulsetrainer"
    if not script.exists():
        script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -IS "{_WARM}" "{warm_socket()}" "$@"\n')
        script.chmod(0o755)
    return folder


def pulsetrainer(folder: Path, *words: object, env: dict[str, str] | None = None) -> Ran:
    """Run a command in ``folder`` to its end, without the time of the program's start."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err, Path(os.devnull).open() as nothing:
        code = warm.run(
            warm_socket(),
            [str(word) for word in words],
            str(folder),
            _environment(env),
            (nothing.fileno(), out.fileno(), err.fileno()),
        )
        return Ran(code, _text(out), _text(err))


def cold(folder: Path, *words: object, env: dict[str, str] | None = None) -> Ran:
    """Run a command in ``folder`` to its end, from the start of a new interpreter."""
    done = subprocess.run(
        [*PROGRAM, *map(str, words)],
        cwd=folder,
        env=_environment(env),
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    return Ran(done.returncode, done.stdout, done.stderr)


def _environment(more: dict[str, str] | None) -> dict[str, str]:
    return {**os.environ, "COLUMNS": "200", **(more or {})}


def _text(file) -> str:
    file.seek(0)
    return file.read().decode().replace("\r\n", "\n")


def chain(
    folder: Path,
    port: str,
    *,
    reading: str,
    waveforms: tuple[str, ...],
    signal: tuple[str, ...] = (),
    levels: tuple[str, ...] = (),
    page: bool = False,
) -> dict:
    """Capture once, identify, invert, play and evaluate on a bench; return the evaluation as JSON."""
    steps: list[list[object]] = []
    if not (folder / "run.h5").exists():
        steps.append(["capture", "identification", *signal, "--port", port, "-o", "run.h5"])
    steps.append(["identify", "run.h5", *levels, "--reading", reading, "-o", f"model-{reading}.h5"])
    for name in waveforms:
        drive, played = f"drive-{name}-{reading}.h5", f"played-{name}-{reading}.h5"
        steps.append(["invert", name, "--model", f"model-{reading}.h5", "-o", drive])
        steps.append(["play", drive, "--port", port, "-o", played])
    for words in steps:
        done = pulsetrainer(folder, *words)
        assert done.code == 0, (words, done)
    played = [f"played-{name}-{reading}.h5" for name in waveforms]
    html = ["--html", f"{reading}.html"] if page else []
    done = pulsetrainer(folder, "evaluate", *played, "-o", f"evaluation-{reading}.h5", *html, "--json")
    assert done.code == 0, done
    return done.json


def until_recorded(folder: Path, least: int, process: subprocess.Popen[str]) -> None:
    """Wait until a file of the folder that is no table has so many bytes: a recording has begun."""
    deadline = time.monotonic() + 60
    while not any(_bytes(path) > least for path in folder.iterdir() if path.suffix != ".csv"):
        assert time.monotonic() < deadline
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)


def _bytes(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:  # a temporary file that has its own name by now
        return 0
