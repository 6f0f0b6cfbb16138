"""How a verb says how far it is: a callable that takes the share of the work done, 0..1."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[float], None]


class _Silent:
    """Tell nobody; a class, so that help shows a word for it."""

    def __call__(self, _share: float) -> None:
        pass

    def __repr__(self) -> str:
        return "silent"


silent = _Silent()
