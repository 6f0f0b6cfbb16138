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
    assert tried


@pytest.mark.parametrize("name", sorted(set(pt.__all__) - {"__version__"}))
def test_every_public_name_has_an_example(name):
    """In its own docstring."""
    assert ">>> " in (getattr(pt, name).__doc__ or "")
