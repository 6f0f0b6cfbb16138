"""The examples in the docstrings of the API run, and show what they say."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

import pulsetrainer as pt

ROOT = Path(__file__).resolve().parents[2]
MODULES = sorted({getattr(pt, name).__module__ for name in pt.__all__ if name != "__version__"})


@pytest.mark.parametrize("name", MODULES)
def test_examples(name, monkeypatch):
    """All of a module, in the folder of the project."""
    monkeypatch.chdir(ROOT)
    failed, tried = doctest.testmod(importlib.import_module(name))
    assert not failed
    assert tried or name.startswith("pulsetrainer.artefacts")
