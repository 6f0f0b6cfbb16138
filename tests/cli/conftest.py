"""Fixtures: the program in a folder of its own, and one whole chain to share."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from program import Ran, chain, pulsetrainer


@pytest.fixture
def run(tmp_path):
    """Run commands in the test's own folder."""

    def call(*words: object, env: dict[str, str] | None = None) -> Ran:
        return pulsetrainer(tmp_path, *words, env=env)

    return call


@pytest.fixture(scope="session")
def as_built(tmp_path_factory) -> Path:
    """A folder in which the whole chain has been run on the as-built bench, by both methods."""
    folder = tmp_path_factory.mktemp("as-built")
    for reading in ("relay", "continuous"):
        document = chain(folder, "bench:", reading=reading, waveforms=("normal", "bifid"))
        (folder / f"{reading}.json").write_text(json.dumps(document))
    return folder


@pytest.fixture(scope="session")
def extended(as_built) -> Path:
    """Return the same folder after the second act: diagnosed, extended, the pulses played again."""
    steps = [
        ["capture", "diagnostic", "-o", "diagnostic.h5"],
        ["diagnose", "diagnostic.h5", "--model", "model-continuous.h5", "-o", "diagnosis.h5", "--json"],
        ["extend", "diagnosis.h5", "--model", "model-continuous.h5", "-o", "model-extended.h5"],
    ]
    for name in ("normal", "bifid"):
        steps.append(["invert", name, "--model", "model-extended.h5", "-o", f"drive-{name}-extended.h5"])
        steps.append(["play", f"drive-{name}-extended.h5", "-o", f"played-{name}-extended.h5"])
    for words in steps:
        done = pulsetrainer(as_built, *words)
        assert done.code == 0, (words, done)
        if words[0] == "diagnose":
            (as_built / "diagnosis.json").write_text(done.out)
    return as_built
