"""The file formats of figures; loads nothing, so that a wrong ending is answered at once."""

from __future__ import annotations

from typing import Final

FORMATS: Final = ("png", "svg", "pdf")
