"""How an artefact shows itself: as text, in a notebook, as a figure.

Tables and figures are the business of ``report``, a floor above. It is looked up when an artefact is shown,
so that the artefacts import nothing of it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Shown:
    """Base of the artefacts: ``print(it)``, its table in a notebook, ``it.plot()``."""

    __slots__ = ()

    def __str__(self) -> str:
        return str(_report("text").of(self))

    def __repr__(self) -> str:
        return str(_report("text").title(self))

    def _repr_html_(self) -> str:
        return str(_notebook().html(self))

    def plot(self) -> Axes:
        """Draw the artefact and return the first axes of its figure; ``axes.figure`` is the whole."""
        return _notebook().plot(self)


def _notebook() -> Any:
    _report("any_backend")  # before matplotlib is loaded
    return _report("notebook")


def _report(name: str) -> Any:
    return import_module(f"pulsetrainer.report.{name}")
