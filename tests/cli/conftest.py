"""Fixtures: the program in a folder of its own, and one whole chain to share."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from mistakes import PREPARATION
from program import Ran, chain, pulsetrainer


@pytest.fixture
def run(tmp_path):
    """Run commands in the test's own folder."""

    def call(*words: object, env: dict[str, str] | None = None) -> Ran:
        return pulsetrainer(tmp_path, *words, env=env)

    return call


@pytest.fixture(scope="session")
def small_chain(made_once) -> Path:
    """A folder with a small run, a model, a drive and a playback; copied before anything is written there."""

    def fill(folder: Path) -> None:
        (folder / "plain").mkdir()
        for words in PREPARATION:
            done = pulsetrainer(folder, *words)
            assert done.code == 0, done

    return made_once("small-chain", fill)


@pytest.fixture(scope="session")
def as_built(made_once) -> Path:
    """A folder in which the whole chain has been run on the as-built bench, by both methods."""

    def fill(folder: Path) -> None:
        for reading in ("relay", "continuous"):
            document = chain(folder, "bench:", reading=reading, waveforms=("normal", "bifid"))
            (folder / f"{reading}.json").write_text(json.dumps(document))

    return made_once("as-built", fill)


@pytest.fixture(scope="session")
def built_small(made_once) -> Path:
    """The same files of a short record and few levels, with a page of the continuous reading."""

    def fill(folder: Path) -> None:
        small = {"signal": ("--levels", "12", "--speed", "4"), "levels": ("--levels", "12")}
        for reading in ("relay", "continuous"):
            page = reading == "continuous"
            document = chain(
                folder, "bench:", reading=reading, waveforms=("normal", "bifid"), page=page, **small
            )
            (folder / f"{reading}.json").write_text(json.dumps(document))

    return made_once("built-small", fill)


@pytest.fixture(scope="session")
def extended(as_built, made_once) -> Path:
    """A folder with the second act: diagnosed, extended, the pulses played again; the first act beside it."""

    def fill(folder: Path) -> None:
        shutil.copytree(as_built, folder, dirs_exist_ok=True)
        steps = [
            ["capture", "diagnostic", "-o", "diagnostic.h5"],
            ["diagnose", "diagnostic.h5", "--model", "model-continuous.h5", "-o", "diagnosis.h5", "--json"],
            ["extend", "diagnosis.h5", "--model", "model-continuous.h5", "-o", "model-extended.h5"],
        ]
        for name in ("normal", "bifid"):
            steps.append(["invert", name, "--model", "model-extended.h5", "-o", f"drive-{name}-extended.h5"])
            steps.append(["play", f"drive-{name}-extended.h5", "-o", f"played-{name}-extended.h5"])
        for words in steps:
            done = pulsetrainer(folder, *words)
            assert done.code == 0, (words, done)
            if words[0] == "diagnose":
                (folder / "diagnosis.json").write_text(done.out)

    return made_once("extended", fill)
