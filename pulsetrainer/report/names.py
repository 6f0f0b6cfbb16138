"""What figures are called where a person reads them: one name and one unit each, on screens, pages and axes.

The names are those of docs/vocabulary.md; files and ``--json`` keep the keys.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

FORCE: Final = "% of full force"
_ROUNDING: Final = 1e-6
_LARGE: Final = 99.995  # what two decimals would print as 100.00
_DRIVES: Final = ("scaled", "compensated")


class Named(NamedTuple):
    """A name, and the unit where it is always the same."""

    words: str
    unit: str = ""

    def __str__(self) -> str:
        unit = self.unit.replace(" ", "\N{NO-BREAK SPACE}")  # a unit is not torn
        return f"{self.words} [{unit}]" if unit else self.words


NAMES: Final = {
    # of a played pulse
    "mean_abs_error_percent": Named("mean error", FORCE),
    "max_abs_error_percent": Named("max error", FORCE),
    "rms_error_percent": Named("rms error", FORCE),
    "hysteresis_percent": Named("loop area", "% of full force²"),
    "predicted_max_error_percent": Named("max error expected", FORCE),
    "current_tracking_max_percent": Named("max current error", "% of range"),
    "mean_error_reduction_percent": Named("reduction of the mean error", "% of scaled"),
    "noise_percent": Named("spread between repeats", FORCE),
    # of a model on a run
    "rms": Named("rms error"),
    "rms_percent": Named("rms error", "% of span"),
    "max_percent": Named("max error", "% of span"),
    "gain_percent": Named("improvement", "% of rms"),
    "offset": Named("offset"),
    "shape_rms_percent": Named("rms less offset", "% of span"),
    "second_half_percent": Named("rms of the second half, zeroed on the first", "% of span"),
    "fit_rms_percent": Named("rms error of the fit", "% of span"),
    "coverage_percent": Named("cells switched", "%"),
    # of a run
    "left_out_rows": Named("rows left out by import"),
    # of a session
    "nrmse": Named("rms error", "% of the target's range"),
    "error_jnd": Named("mean error", "just noticeable differences"),
    "beat_timing_max_ms": Named("max timing error", "ms"),
    "rate_cv_percent": Named("spread of the rate", "% of that asked for"),
    "amplitude_cv_percent": Named("spread of the height", "% of that asked for"),
    "augmentation_index_error_percent": Named("max error of the augmentation index", "% of the index"),
    # of a quiz
    "right_percent": Named("share right", "%"),
    "right_from_percent": Named("share right, 95 % from", "%"),
    "right_to_percent": Named("share right, 95 % to", "%"),
    "response_s": Named("time to the answer", "s"),
}


# what is said first of a pulse, as dotted names within it
OVERVIEW: Final = (
    "scaled.mean_abs_error_percent", "compensated.mean_abs_error_percent", "mean_error_reduction_percent",
    "scaled.max_abs_error_percent", "compensated.max_abs_error_percent",
    "scaled.hysteresis_percent", "compensated.hysteresis_percent",
)  # fmt: skip


def told(name: str, value: Any) -> Any:
    """Return a figure in the unit that a person reads: ``nrmse``, a share in files, is told in percent."""
    return 100.0 * value if name.rpartition(".")[2] == "nrmse" and value is not None else value


def split(dotted: str) -> tuple[str, Named]:
    """Return whose a figure is and what it is called: ``normal.scaled.rms_percent`` is of "normal"."""
    stem, _, metric = dotted.rpartition(".")
    named = NAMES.get(metric, Named(metric))
    owner, _, drive = stem.rpartition(".")
    if drive in _DRIVES:
        return owner, named._replace(words=f"{named.words}, {drive}")
    return stem, named


def headed(kind: str, title: str) -> str:
    """Return a title that says of which kind the artefact is, once."""
    return title if title.lower().startswith(kind) else f"{kind}: {title}"


def beyond_rounding(offset: float, rms: float) -> float:
    """Return an offset; one far below the error, which is the rounding of numbers, as nothing."""
    return 0.0 if abs(offset) <= _ROUNDING * rms else offset


def digits(value: float) -> str:
    """Return a figure with two decimals, or with none of three digits or more: they would tell nothing.

    A small one has three significant digits, and never stands as nothing.
    """
    if abs(value) >= _LARGE:
        return f"{value:.0f}"
    return f"{value:#.3g}" if 0.0 < abs(value) < 0.1 else f"{value:.2f}"
