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
    for operator in ("relay", "continuous"):
        document = chain(folder, "bench:", operator=operator, waveforms=("normal", "bifid"))
        (folder / f"{operator}.json").write_text(json.dumps(document))
    return folder
