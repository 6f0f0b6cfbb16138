"""The program as a user runs it: a subprocess in a folder of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

PROGRAM = [sys.executable, "-m", "pulsetrainer"]


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


def pulsetrainer(folder: Path, *words: object, env: dict[str, str] | None = None) -> Ran:
    """Run a command in ``folder`` to its end."""
    done = subprocess.run(
        [*PROGRAM, *map(str, words)],
        cwd=folder,
        env={**os.environ, "COLUMNS": "200", **(env or {})},
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    return Ran(done.returncode, done.stdout, done.stderr)


def chain(folder: Path, port: str, *, reading: str, waveforms: tuple[str, ...]) -> dict:
    """Capture once, identify, invert, play and evaluate on a bench; return the evaluation as JSON."""
    steps: list[list[object]] = []
    if not (folder / "run.h5").exists():
        steps.append(["capture", "identification", "--port", port, "-o", "run.h5"])
    steps.append(["identify", "run.h5", "--reading", reading, "-o", f"model-{reading}.h5"])
    for name in waveforms:
        drive, played = f"drive-{name}-{reading}.h5", f"played-{name}-{reading}.h5"
        steps.append(["invert", name, "--model", f"model-{reading}.h5", "-o", drive])
        steps.append(["play", drive, "--port", port, "-o", played])
    for words in steps:
        done = pulsetrainer(folder, *words)
        assert done.code == 0, (words, done)
    played = [f"played-{name}-{reading}.h5" for name in waveforms]
    done = pulsetrainer(
        folder, "evaluate", *played, "-o", f"evaluation-{reading}.h5", "--html", f"{reading}.html", "--json"
    )
    assert done.code == 0, done
    return done.json
