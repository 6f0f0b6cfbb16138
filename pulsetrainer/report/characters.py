"""Curves of characters, for a terminal: bars of block elements, and dots of Unicode braille."""

from __future__ import annotations

import numpy as np

BARS = " ▁▂▃▄▅▆▇█"
PLAIN_BARS = " .:-=+*%#"  # for a terminal that has no others
_BRAILLE = 0x2800
_DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]], dtype=np.uint16)  # row, column


class Dots:
    """A grid of characters of 2 x 4 dots; a dot is set once a point fell on it.

    So a point costs the same however many there were before.
    """

    def __init__(self, columns: int, rows: int) -> None:
        self._cells = np.zeros((rows, columns), dtype=np.uint16)

    def add(self, across: np.ndarray, up: np.ndarray) -> None:
        """Set the dots of points (n,), of 0..1 from the left and from below; beyond it is the edge."""
        height, width = self._cells.shape
        column = np.clip(across * (2 * width - 1), 0, 2 * width - 1).astype(int)
        row = np.clip((1.0 - up) * (4 * height - 1), 0, 4 * height - 1).astype(int)
        np.bitwise_or.at(self._cells, (row // 4, column // 2), _DOTS[row % 4, column % 2])

    def lines(self) -> list[str]:
        """Return the rows, the top one first."""
        return [row.tobytes().decode("utf-32-le") for row in (self._cells + _BRAILLE).astype("<u4")]


def plotted(values: np.ndarray, width: int, rows: int, bars: str = BARS) -> list[str]:
    """Return a curve as ``rows`` lines of ``width`` characters of ``bars``, lowest to highest value."""
    known = np.nan_to_num(values, nan=float(np.nanmin(values)) if np.isfinite(values).any() else 0.0)
    means = np.asarray([part.mean() if part.size else known[-1] for part in np.array_split(known, width)])
    span = float(np.ptp(means)) or 1.0
    height = (means - means.min()) / span * rows * (len(bars) - 1)
    lines = []
    for row in range(rows - 1, -1, -1):
        filled = np.clip(height - row * (len(bars) - 1), 0, len(bars) - 1).round().astype(int)
        lines.append("".join(bars[k] for k in filled))
    return lines
