"""What a cause is: one file in this folder, with one class derived from ``Cause``, which the library finds.

The extended model is a chain: the measured input passes the causes of stage ``input`` in their order, then
the Preisach operator, then the causes of stage ``output``. A cause of stage ``record`` is found on the raw
data by its own ``gate`` and changes no model. The file holds all that is the cause's own: formula, start
values, gate, thresholds, flags and words. Other code names a cause only where causes are compared, or where
a step treats that cause in its own way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from pulsetrainer.core import wild
from pulsetrainer.core.initial_state import known_from
from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.raw import Firing, Raw

if TYPE_CHECKING:
    from pulsetrainer.diagnosis.finding import Estimate
    from pulsetrainer.diagnosis.fitting import Fitted
    from pulsetrainer.diagnosis.floor import Floor

_LEVELS = 48  # of a hysteresis that fills in what the readings leave open
_STEPS = 20.0  # time steps: where samples are sparse a lag may be as long

Stage = Literal["input", "output", "record"]
Values = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Quantity:
    """One parameter of a cause; units may name the output and input unit as ``{y}`` and ``{u}``.

    Its bounds are in the units of the record: the range of the input, the span of the output, the second of
    ``scale``.
    """

    name: str
    unit: str
    low: float
    high: float
    small: float  # a step that matters little: for differences
    meaning: str = ""  # what it is, in words; {input} and {output} are what was measured
    whole: bool = False  # nothing lies beyond its bounds: an end of them is an answer like any other


@dataclass(frozen=True)
class Taken:
    """A record whose faults of measurement are to be undone, in its own units, of polarity 1."""

    raw: Raw  # as it was measured
    time_s: FloatArray  # (n,) as causes count it
    step_s: float  # of the averages that they were sought in
    empty: float  # output of the empty memory
    record: int = 0  # which of those that were diagnosed
    begin_s: float = 0.0  # of it, since the first one began

    def known(self, y: FloatArray) -> tuple[Record, Plane]:
        """Return the record with another output (n,), of which what is known counts, and a plane for it."""
        one, known = self.raw.record, np.isfinite(y)
        counts = known & (np.arange(y.size) >= known_from(one.input, self.raw.low, self.raw.high))
        record = replace(one, output=wild.repaired(y, ~known), sample_weight=counts.astype(np.float64))
        return record, Plane.uniform(self.raw.low, self.raw.high, _LEVELS)


class Cause:
    """A reason why a static Preisach model is wrong, with the operator that adds its effect."""

    id: ClassVar[str]
    title: ClassVar[str]  # in words a technician understands; {input} and {output} are what was measured
    formula: ClassVar[str]
    signature: ClassVar[str]  # what it looks like, and what no other cause looks like
    excitation: ClassVar[str]  # what must be in a record for it to be told apart
    source: ClassVar[str]
    stage: ClassVar[Stage]
    order: ClassVar[int]  # place in the chain
    family: ClassVar[str]  # causes of one family are easily taken for one another
    parameters: ClassVar[tuple[Quantity, ...]] = ()
    number: ClassVar[str] = ""  # the name in a model of a number that its formula leaves open ...
    meant: ClassVar[str] = ""  # ... and what it is, in words as those of a quantity
    size: ClassVar[str] = ""  # what the size is that its gate tells, in words as those of a quantity
    strengths: ClassVar[int] = 1  # so many leading parameters enter almost linearly
    texts: ClassVar[Mapping[str, str]] = {}  # what its gate says, by the kind of firing, figures in braces
    # how it is sought
    needs_time: ClassVar[bool] = True  # cannot be told where only the order of the samples is known
    in_rows: ClassVar[bool] = False  # an output cause too strong to be subtracted: linear, filters the rows
    feeds_back: ClassVar[bool] = False  # needs the output to compute the input
    by_contrast: ClassVar[bool] = False  # sought where the weights cannot hold it: see ``congruency``
    wild: ClassVar[bool] = False  # its gate finds samples that the other gates must not see
    voids: ClassVar[bool] = False  # what else a record shows where its gate fires is not to be trusted
    blinded_by: ClassVar[tuple[str, ...]] = ()  # causes whose firing makes its gate blind
    leaves: ClassVar[tuple[str, ...]] = ()  # causes whose gates see what is left of it in a corrected record
    doubted: ClassVar[bool] = False  # others also set off its gate: it is asked again without what they add
    # what it means
    lasting: ClassVar[bool] = True  # a property of the device, not of the record: goes into the model
    scales: ClassVar[bool] = False  # a gain and an offset of the output leave it as it is
    corrects: ClassVar[bool] = False  # a fault of the measurement, which can be taken out of the record
    jagged: ClassVar[bool] = False  # leaves what no refit can take away: then what is left is its own
    common: ClassVar[bool] = False  # most devices have some of it: a record that cannot show it says little
    widens: ClassVar[bool] = False  # at one single rate it is just a wider loop, like all others of that kind
    comes_before: ClassVar[bool] = False  # the output, before the input asks for it
    imitates: ClassVar[bool] = False  # fits almost anything that happens while the device moves
    drifts: ClassVar[bool] = False  # slower than any loop: what wanders at random looks like it
    moves_zero: bool = False  # as well as the gain; then wear that looks like it may do both, too
    sudden: bool = False  # a change at a moment, its last parameter
    by_pieces: bool = False  # whole pieces of the time may tell what it predicts where halves tell nothing
    line: ClassVar[bool] = False  # of the spectrum: what is like no error of a model where it is strong

    def gate(self, raw: Raw) -> Firing | None:
        """Return what the raw data of a record show of a cause of stage ``record``."""
        return None

    def gate_left(self, fitted: Fitted) -> Firing | None:
        """Return what a fit with all other causes leaves of a cause of stage ``record``."""
        return None

    def kinds(self, frames: Sequence[Frame] = ()) -> tuple[Cause, ...]:
        """Return the causes of this id that records may tell apart: what a formula leaves open."""
        return (self,)

    def finer(self, frame: Frame, values: Values) -> list[tuple[Cause, float]]:
        """The same with one more parameter, and values of it to begin with, for records that show it."""
        return []

    def coarser(self) -> Cause | None:
        """The same without the last parameter of the finer one; None: this is no finer one."""
        return None

    @property
    def holds(self) -> str:
        """Id of another cause whose formula is a part of its own; empty where there is none."""
        coarser = self.coarser()
        return "" if coarser is None or coarser.id == self.id else coarser.id

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        """Return the parameters with the bounds that a record sets."""
        return self.parameters

    def constants(self) -> tuple[tuple[str, float, str], ...]:
        """Return what a model must keep of it besides its parameters: name, value and unit."""
        return ()

    def restored(self, values: Values) -> tuple[Cause, Values]:
        """Return the cause and its parameters, from the constants and parameters that a model kept."""
        return self, values

    def strengths_of(self, parameters: Sequence[Estimate]) -> Sequence[Estimate]:
        """Return, of all parameters in their order, those that are all zero where the cause is nothing."""
        return parameters[: self.strengths]

    def sign(self, name: str, polarity: int) -> int:
        """Return by what a parameter is multiplied when the output is, by its polarity; sizes stay.

        Those of later records have its name and a number.
        """
        own = [q for q in self.parameters if q.name == name.partition(" ")[0]]
        return polarity if any("{y}" in q.unit and q.low < 0 for q in own) else 1

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        """Blocks of parameter values to try; what they add is fitted together, a column for each of a block.

        ``residual`` holds that of each record (n,) at its own rate, zero where samples have no weight.
        """
        raise NotImplementedError

    @property
    def sharp(self) -> Cause:
        """The same, as sudden as the samples can show it."""
        return self

    def at(self, moment: float, frames: Sequence[Frame]) -> list[Values]:
        """Return a block for a change at one moment: of the offset alone, of the gain alone."""
        raise NotImplementedError

    def sharpened(self, values: Values, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> Values:
        """Return start values for a refit, nearer to what the residual shows than the grid of ``starts``."""
        return values

    def is_background(self, sizes: Sequence[float], floor: Floor) -> bool:
        """Return whether its parameters make it a part of the noise: told, but no verdict."""
        return False

    @property
    def wears_about(self) -> float | None:
        """Share of the output's range about which a gain that settles looks like it; None: it never does."""
        return None

    def can_be_told(self, values: Values, frames: Sequence[Frame]) -> bool:
        """Return whether it can be told from an error in the times of the samples."""
        return True

    def stands_out(self, values: Values, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> bool:
        """Return whether its line is far above all others near it in what a model without it leaves."""
        return False

    def shapes_strokes(self, values: Values, frames: Sequence[Frame]) -> bool:
        """Return whether at one rate it is the shape of single strokes: it forgets within one of them."""
        return False

    def in_step(self, values: Values, frames: Sequence[Frame]) -> bool:
        """Return whether a fault goes in step with the input, as only what the device itself does should."""
        return False

    def choices(self, frames: Sequence[Frame]) -> float:
        """Return from how many independent values ``starts`` chooses by the residual; 0 where it does not."""
        return 0.0

    def on_input(self, u: FloatArray, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        """Input (n,) that the hysteresis sees, for the applied ``u`` (n,) and the output ``y`` (n,)."""
        raise NotImplementedError

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        """Output (n,) after this cause, for the output ``y`` (n,) before it."""
        raise NotImplementedError

    def undo(self, y: FloatArray, values: Values, taken: Taken) -> FloatArray:
        """Output (n,) without a fault of the measurement; NaN where nothing can be restored."""
        firing = self.gate(taken.raw)
        return y if firing is None or firing.mask is None else np.where(firing.mask, np.nan, y)

    def undo_input(self, u: FloatArray, values: Values, taken: Taken) -> FloatArray:
        """Input (n,) without a fault of its measurement."""
        return u

    def alternatives(self) -> tuple[Cause, ...]:
        """Return causes of the same parameters that are as plausible: for intervals, as ``variants`` are."""
        return ()

    def variants(self, y: FloatArray, values: Values, frame: Frame) -> list[FloatArray]:
        """Outputs (n,) of an output cause under formulas that are as plausible as its own: for intervals."""
        return []


class OfTheRecord(Cause):
    """A cause that is found on the raw data, and is no property of the device."""

    source = "Isermann, Fault-Diagnosis Systems, 2006, chapter 7: limit and plausibility checks"
    stage = "record"
    lasting = False


class OfKinds(Cause):
    """A cause whose formula leaves one number open: a few values are tried, each as a kind of its own."""

    tried: ClassVar[tuple[float, ...]]  # the first is meant where a model keeps none

    def __init__(self, kind: float | None = None) -> None:
        self.kind = self.tried[0] if kind is None else kind

    @cached_property
    def _kinds(self) -> tuple[Cause, ...]:
        plain = self.kind == self.tried[0]
        return (self, *(type(self)(one) for one in self.tried[1:])) if plain else (self,)

    def kinds(self, frames: Sequence[Frame] = ()) -> tuple[Cause, ...]:
        return self._kinds

    def constants(self) -> tuple[tuple[str, float, str], ...]:
        return () if self.kind == self.tried[0] else ((self.number, self.kind, "1"),)

    def restored(self, values: Values) -> tuple[Cause, Values]:
        """Return the cause and its parameters; the first kind keeps no constant."""
        kind, own = values[: -len(self.parameters)], values[-len(self.parameters) :]
        return type(self)(*kind), own


def sampled(quantities: Sequence[Quantity], frame: Frame) -> tuple[Quantity, ...]:
    """Return times that may be as long as some time steps, where these are longer than their bounds."""
    return tuple(replace(one, high=max(one.high, _STEPS * frame.dt_s)) for one in quantities)


def spread(low: float, high: float, ratio: float) -> list[float]:
    """Return values from ``low`` to ``high``, about a factor ``ratio`` apart; ``high`` where it is lower."""
    if high <= low:
        return [high]
    count = round(np.log(high / low) / np.log(ratio)) + 1
    return [float(one) for one in np.geomspace(low, high, count)]
