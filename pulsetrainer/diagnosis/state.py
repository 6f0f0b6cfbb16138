"""The question of a diagnosis, and what is known after each stage."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pulsetrainer.artefacts import Model
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.finding import Estimate, Finding
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.floor import Floor
from pulsetrainer.diagnosis.held_out import HeldOut
from pulsetrainer.diagnosis.noise import burstiness
from pulsetrainer.diagnosis.problem import Problem
from pulsetrainer.diagnosis.raw import Firing
from pulsetrainer.diagnosis.residual import RATES
from pulsetrainer.diagnosis.scale import Scale
from pulsetrainer.diagnosis.screening import Score, Screen, Sight
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT


@dataclass(frozen=True)
class Given:
    """The model as it was given, and what its input and output are called."""

    model: Model
    input_quantity: str = "input"
    output_quantity: str = "output"
    ours: bool = False  # recorded by this program, which can play the experiments that it proposes
    fingerprints: tuple[str, ...] = ()  # of the records
    names: tuple[str, ...] = ()  # of the records, as a person knows them; empty: they are numbered

    @property
    def is_of_wrong_kind(self) -> bool:
        """Whether the model itself says that no model of its kind describes the device."""
        return self.model.fit is not None and bool(self.model.fit.warning)


@dataclass(frozen=True)
class Question:
    """Records of one device as they were measured, of polarity 1.

    ``low`` and ``high`` are the range of the input that was identified; without ``given`` only the search for
    causes is made, which needs no model.
    """

    records: Sequence[Record]  # ``dt_s`` is the usual step
    low: float
    high: float
    rng: np.random.Generator
    quick: bool = False  # only screen
    progress: Callable[[float], None] = lambda _share: None
    given: Given | None = None
    notes: tuple[str, ...] = ()  # what a person should know about the records
    stamps: Sequence[FloatArray | None] = ()  # s, (n,) times of the samples of each record; None: even steps
    corrected: Sequence[tuple[str, ...]] = ()  # ids of the causes that were taken out of each record

    @property
    def timed(self) -> bool:
        """Whether the records have a clock."""
        return all(record.timed for record in self.records)


@dataclass(frozen=True)
class State:
    """What is known so far; every stage returns a new one."""

    question: Question
    firings: tuple[tuple[int, Firing], ...]  # gates that fired, with the number of their record
    scale: Scale  # the units of the problem: those of the records themselves
    problem: Problem
    coarse: Problem  # the same on fewer levels
    baseline: Fitted  # no cause, weights refitted
    floor: Floor
    held_out: HeldOut
    lacks: tuple[str, ...]  # what the records do not have: see ``residual``
    current: Fitted  # the model with the causes accepted so far
    scores: Screen = field(default_factory=Screen)  # of the causes that are not in it
    trials: tuple[tuple[Fitted, Score], ...] = ()  # joint refits of the best of them
    p_values: Mapping[str, float] = field(default_factory=dict)  # of every cause that was accepted
    without: Mapping[str, Fitted] = field(default_factory=dict)  # the model without each of its causes
    by_contrast: Mapping[str, tuple[Estimate, ...]] = field(default_factory=dict)  # what equal loops show
    estimates: Mapping[str, tuple[Estimate, ...]] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()  # of every cause, strongest first
    sights: Mapping[str, Sight] = field(default_factory=dict)  # of every cause that was screened
    detectable: Mapping[str, float] = field(default_factory=dict)  # shares of the span that would show ...
    expected: Mapping[str, float] = field(default_factory=dict)  # ... in half of the records at least
    extended: Model | None = None  # with those causes
    verdict: str = "none"
    evidence: tuple[Evidence, ...] = ()
    advice: Evidence = field(default_factory=lambda: Evidence("none"))
    repeated: Fitted | None = None  # the model with the causes that repeat, once that was asked
    repeated_estimates: Mapping[str, tuple[Estimate, ...]] = field(default_factory=dict)  # as ``estimates``
    pinched_at: float | None = None  # input, of its range, at which all branches of the loop meet
    butterfly: bool = False  # there one branch rises, and the other falls
    extends: bool = True  # False: what was found is no fault of the model as given

    @property
    def void(self) -> bool:
        """Whether a gate fired after which nothing else that the records show is to be trusted."""
        return any(library()[one.cause].voids for _, one in self.firings)

    @property
    def families(self) -> set[str]:
        """Families of the causes in the model; at one single rate all that widen the loop are one."""
        known = {term.cause.family for term in self.current.terms}
        if RATES in self.lacks and any(term.cause.widens for term in self.current.terms):
            known |= {cause.family for cause in library().values() if cause.widens}
        return known

    @property
    def jagged(self) -> bool:
        """Whether a gate fired of a cause that leaves what no refit can take away."""
        return any(
            library()[one.cause].jagged
            and not library()[one.cause].is_background([one.value / self.scale.of_unit(one.unit)], self.floor)
            for _, one in self.firings
        )

    @property
    def in_bursts(self) -> bool:
        """Whether what is taken for slow noise matters, and comes and goes or jumps as no noise does."""
        if not self.floor.slow > LIMITS.slow_noise:
            return False
        # beside a cause that was found less of it is what its formula, or another kind of plant, leaves
        least = LIMITS.matters if self.current.terms else LIMITS.bursts_span
        if self.floor.white < least * self.floor.span:
            return False
        problem = self.problem
        return burstiness(self.current.residual, problem.bins, problem.measured) > LIMITS.burstiness

    @property
    def beyond_any(self) -> bool:
        """Whether the loop is one that no Preisach operator has, and no curve was learned beside it."""
        return self.pinched_at is not None and all(term.cause.id != "unlisted" for term in self.current.terms)

    @property
    def floor_left(self) -> Floor:
        """The floor under what is left: what comes in bursts is no noise.

        Nor is what is left of a pinched loop, of which the levels of the plane explain little.
        """
        if not self.beyond_any:
            return self.floor.quick if self.in_bursts else self.floor
        most = LIMITS.unexplained_span * self.floor.span
        return replace(self.floor.quick, discretisation=min(self.floor.discretisation, most))

    @property
    def floor_rms(self) -> float:
        """What noise and levels leave, rms: no more than is left with the causes found."""
        return min(self.floor_left.rms, self.current.rms)

    @property
    def unexplained(self) -> bool:
        """Whether more than half of what can be explained is left, and enough to matter.

        Any cause explains some of a pinched loop, which no Preisach operator has: there all of it counts.
        """
        floor = self.floor_left
        left = self.current.squares - floor.squares
        half = LIMITS.unexplained * floor.reducible(self.baseline) if not self.beyond_any else 0.0
        small = floor.count * (LIMITS.unexplained_span * floor.span) ** 2
        return left > max(half, small, LIMITS.unexplained_relevant * floor.relevant)

    @property
    def believed(self) -> State:
        """The same, or with no cause in the model where it has none that was found and is in no doubt."""
        own = [one for one in self.findings if one.cause.id in self.current.names]
        in_doubt = own and not any(one.found and not one.in_doubt for one in own)
        return replace(self, current=self.baseline) if in_doubt else self

    @property
    def blind(self) -> tuple[str, ...]:
        """Ids of the common causes of which half of such records would not have shown what matters."""
        if not self.question.timed or not self.expected:
            return ()
        common = [one.id for one in library().values() if one.common and one.id not in self.current.names]
        return tuple(one for one in common if not self.expected.get(one, np.inf) <= LIMITS.matters)

    @property
    def left_rms(self) -> float:
        """Rms error with the causes found; a cause that was only screened counts with its linearised gain."""
        found = {one.cause.id for one in self.findings if one.found} if self.question.quick else set()
        gains = [one.gain for one in self.scores.scores if one.cause.id in found]
        if not gains:
            return self.current.rms
        return float(np.sqrt(max(self.current.squares - gains[0], self.floor.squares) / self.floor.count))

    def is_whole(self, fitted: Fitted) -> bool:
        """Whether what a fit leaves is noise, as far as it is relevant."""
        floor = self.floor_left
        return fitted.squares - floor.squares <= LIMITS.unexplained_relevant * floor.relevant

    @property
    def background(self) -> set[str]:
        """Ids of the causes found that are no larger than the noise, which they are taken for part of."""
        return {
            one.cause.id
            for one in self.findings
            if one.found and (one.cause.is_background(self._sizes(one), self.floor) or self._is_slow(one))
        }

    def _is_slow(self, finding: Finding) -> bool:
        """Whether it, or what it cannot be told from, is a slow fault, and no larger than noise as slow."""
        slow = self.floor.white**2 - self.floor.quick.white**2
        may_be = (library()[name] for name in (finding.cause.id, *finding.confounded_with))
        accounted = self.rms_of(finding.explains_percent / PERCENT)
        return accounted**2 <= slow and any(one.drifts and one.corrects for one in may_be)

    def _sizes(self, finding: Finding) -> list[float]:
        """Parameters of a finding in the units of the problem."""
        return [one.value / self.scale.of_unit(one.unit) for one in finding.parameters]

    @property
    def extensions(self) -> list[Term]:
        """Causes that go into the model: properties of the device, not of the record."""
        if not self.extends or self.unexplained or self.repeated is None:
            return []
        return [term for term in self.repeated.terms if term.cause.lasting]

    @property
    def in_model(self) -> tuple[str, ...]:
        """Ids of the causes found that the model as given contains already, as well as they can be told."""
        said = next((one.names for one in self.evidence if one.kind == "in the model"), ())
        return tuple(
            name for name in said if any(one.found and one.cause.id == name for one in self.findings)
        )

    @property
    def correctable(self) -> list[str]:
        """Ids of the faults of the measurement that can be taken out of a record: found, and not in doubt.

        A fault that was fitted is in doubt too where most of the error is unexplained, and where it could
        equally be something that the device does.
        """
        if self.question.quick or self.void:
            return []
        found = [one for one in self.findings if one.found and one.cause.corrects and not one.in_doubt]
        found = [one for one in found if not (one.cause.jagged and one.cause.id in self.background)]
        return [one.cause.id for one in found if one.cause.stage == "record" or not self._of_device(one)]

    def _of_device(self, fault: Finding) -> bool:
        """Whether a fault of the measurement may be something that the device does."""
        return self.unexplained or any(library()[name].lasting for name in fault.confounded_with)

    def in_its_units(self, known: Mapping[str, tuple[Estimate, ...]]) -> dict[str, tuple[Estimate, ...]]:
        """Return estimates in the units of the records; of what equal loops show, those of the loops."""
        both = {**known, **self.by_contrast}
        return {name: tuple(self.scale.estimate(one) for one in rows) for name, rows in both.items()}

    def rms_of(self, share: float) -> float:
        """Rms of a share of what can be explained."""
        return float(np.sqrt(share * self.floor.reducible(self.baseline) / self.floor.count))

    def explains(self, gain: float) -> float:
        """Per cent of what can be explained."""
        return PERCENT * min(max(gain / self.floor.reducible(self.baseline), 0.0), 1.0)

    def significant(self, score: Score) -> bool:
        """Whether noise alone hardly scores so much, and it is relevant."""
        return score.p_value <= LIMITS.p_max and score.gain > self.floor.relevant
