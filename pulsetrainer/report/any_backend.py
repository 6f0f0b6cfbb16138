"""Matplotlib, loaded whatever backend the environment asks for: the figures of a notebook need none."""

from __future__ import annotations

import os
import sys
from contextlib import suppress

if "matplotlib" not in sys.modules:
    _asked = os.environ.pop("MPLBACKEND", "")  # of one that does not exist matplotlib says so, and ends
    try:
        import matplotlib  # noqa: ICN001 - as the whole package
    finally:
        if _asked:
            os.environ["MPLBACKEND"] = _asked
    with suppress(ValueError):
        if _asked:
            matplotlib.rcParams["backend"] = _asked
