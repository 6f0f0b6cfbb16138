"""What a stored model predicts: its static Preisach operator, and the causes it was extended by."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pulsetrainer.artefacts import Model
from pulsetrainer.core.dual import Dual
from pulsetrainer.core.memory import State
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.errors import DataError

if TYPE_CHECKING:
    from pulsetrainer.diagnosis.extended import Extended


def operator_of(model: Model) -> Preisach | Dual:
    """Return the static operator of a model, without its extensions.

    ArgumentError where edges or weights are not those of a Preisach plane; DataError where the model's
    reading is unknown.
    """
    if model.reading not in ("continuous", "relay"):
        raise DataError(
            f"the weights of this model are read as {model.reading!r}; known are 'continuous' and 'relay'",
            hint="identify the model again",
        )
    operator = Preisach(
        Plane(model.edges),
        model.weights,
        model.offset,
        "relay" if model.reading == "relay" else "continuous",
        model.polarity,
        signed=model.form == "signed",
    )
    return Dual(operator) if model.form == "dual" else operator


def extended_of(model: Model) -> Extended:
    """Return a model with its extensions, ready to predict and to be inverted.

    ArgumentError where edges or weights are not those of a Preisach plane; DataError where the model was
    extended by causes that this version does not know.
    """
    # scipy.signal and scipy.stats come with it: a static model need not wait for them
    from pulsetrainer.diagnosis.causes import upright_values  # noqa: PLC0415
    from pulsetrainer.diagnosis.extended import Extended  # noqa: PLC0415

    polarity = model.polarity if model.as_measured else 1
    named = [(one.cause, upright_values(one, polarity)) for one in model.extensions]
    return Extended.of(operator_of(model), named)


def predict(model: Model, inputs: FloatArray, dt_s: float | None, start: State | None = None) -> FloatArray:
    """Output (n,) that a model predicts for an input (n,) at even steps of ``dt_s``.

    It goes on from ``start``, None: negative saturation. A model with extensions begins there, at rest.

        y_t = y0 + sum_k mu_k A_k r_k(u_0 .. u_t)    (Carneiro 2018, eq. 2), then the extensions in order

    DataError where the model has extensions, but the time step is unknown; or as ``extended_of``.
    """
    if not model.extensions:
        return operator_of(model)(inputs, start)
    if dt_s is None:
        raise DataError(
            f"this model is extended by {', '.join(e.cause for e in model.extensions)}, which depend on "
            "time, but the time step is unknown",
            hint="give the run a time: import it again with `time` COLUMN or `rate_Hz` HZ",
        )
    return extended_of(model)(inputs, dt_s)
