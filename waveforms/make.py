"""Draw the pulse library: ``python waveforms/make.py`` writes the CSVs beside this file.

Each record is drawn from formulas; none is a recording. A beat is a sum of four waves:

- *percussion*, *tidal* and *dicrotic* are lobes ``h exp(-(ln(t / t_peak) / w)^2 / 2)`` for t > 0: they start
  with every derivative zero, rise faster than they fall, and peak with height ``h`` at ``t_peak``;
- the *run-off* ``h (1 - exp(-(t / r)^3)) exp(-t / tau)`` is the pressure that the elastic arteries let out
  through the periphery (the Windkessel): the exponential decay in diastole.

Times count from the opening of the aortic valve, in seconds. Beats add up and their tails run into the
beats that follow, round and round the record, so that its end meets its start smoothly. The record is
then turned so that it begins at its lowest diastolic foot, and scaled to 0..1.

The normal beat was held against recorded finger pressure beats of healthy volunteers (PhysioNet,
"Autonomic Aging" 1.0.0): foot to peak in 0.10 s, notch near 0.34 s, dicrotic peak near 0.40 s.
"""  # noqa: INP001 - a folder of data with its script, not a package

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Sequence

FloatArray = NDArray[np.float64]

DT_S = 0.001
BEAT_S = 0.8  # 75 beats per minute
FOOT_S = (-0.1, 0.1)  # of a beat, about the opening of the valve
DECAYED_S = 8.0  # tails older than this are below the sixth decimal that is written


@dataclass(frozen=True, slots=True)
class Lobe:
    """One smooth, asymmetric wave: its height, when it peaks, and its width (of the logarithm of time)."""

    height: float
    peak_s: float
    width: float

    def at(self, t_s: FloatArray) -> FloatArray:
        """Return the wave at ``t_s`` after the valve opened."""
        y = np.zeros_like(t_s)
        later = t_s > 0
        y[later] = self.height * np.exp(-0.5 * (np.log(t_s[later] / self.peak_s) / self.width) ** 2)
        return y


@dataclass(frozen=True, slots=True)
class RunOff:
    """The elastic arteries emptying: filled within about ``rise_s``, emptied with the constant ``tau_s``."""

    height: float
    rise_s: float
    tau_s: float

    def at(self, t_s: FloatArray) -> FloatArray:
        """Return the pressure at ``t_s`` after the valve opened."""
        t = np.maximum(t_s, 0.0)
        return self.height * (1.0 - np.exp(-((t / self.rise_s) ** 3))) * np.exp(-t / self.tau_s)


@dataclass(frozen=True, slots=True)
class Beat:
    """One heart beat: when the valve opens in the record, how strong it is, and its waves."""

    onset_s: float
    strength: float
    waves: tuple[Lobe | RunOff, ...]


@dataclass(frozen=True, slots=True)
class Pulse:
    """A record of the library with what a reader must know of it."""

    name: str
    meaning: str
    source: str
    mmHg: tuple[int, int]  # what 0 and 1 would be in such a patient; an example, not a measurement
    beats: tuple[Beat, ...]
    period_s: float  # of the record


NORMAL = (
    Lobe(1.00, 0.116, 0.34),  # percussion: the ejected volume arrives
    Lobe(0.34, 0.252, 0.18),  # tidal: the wave reflected from the periphery, a shoulder
    Lobe(0.27, 0.436, 0.140),  # dicrotic: the valve has closed (the notch), the aorta recoils
    RunOff(0.85, 0.12, 0.70),
)
# Percussion and tidal wave of equal height with a dip in systole; the leaking valve lets the
# pressure run off fast and leaves hardly any dicrotic wave.
BISFERIENS = (
    Lobe(1.00, 0.114, 0.34),
    Lobe(0.84, 0.262, 0.225),
    Lobe(0.07, 0.450, 0.14),
    RunOff(0.52, 0.14, 0.36),
)
# A narrow valve: the rise is slow with a shoulder (anacrotic), the peak late and round, the notch lost.
TARDUS = (
    Lobe(0.30, 0.125, 0.38),
    Lobe(0.85, 0.315, 0.36),
    RunOff(0.45, 0.25, 0.60),
)
# A weak heart: hardly a tidal wave, and the recoil after the notch is a second pulse.
DICROTIC = (
    Lobe(1.00, 0.112, 0.32),
    Lobe(0.10, 0.230, 0.18),
    Lobe(0.62, 0.440, 0.150),
    RunOff(0.45, 0.12, 0.60),
)
# A large volume against an open runoff: up at once, down at once, no notch.
COLLAPSING = (
    Lobe(1.00, 0.098, 0.30),
    Lobe(0.30, 0.215, 0.24),
    RunOff(0.34, 0.10, 0.30),
)
# A narrow valve again, but the shoulder of the upstroke is a notch of its own.
ANACROTIC = (
    Lobe(0.62, 0.098, 0.42),
    Lobe(1.00, 0.280, 0.28),
    RunOff(0.50, 0.25, 0.60),
)
# Stiff arteries: the reflected wave is back before systole ends and tops the percussion wave; a steep runoff.
STIFF = (
    Lobe(0.86, 0.108, 0.32),
    Lobe(0.78, 0.235, 0.25),
    Lobe(0.10, 0.420, 0.14),
    RunOff(0.80, 0.14, 0.50),
)
# A fast heart ejects a little faster, a slow one a little slower: by the root of the interval (Bazett 1920).
FAST = (
    Lobe(1.00, 0.090, 0.33),
    Lobe(0.28, 0.188, 0.18),
    Lobe(0.24, 0.322, 0.135),
    RunOff(0.80, 0.09, 0.55),
)
SLOW = (
    Lobe(1.00, 0.142, 0.35),
    Lobe(0.38, 0.318, 0.19),
    Lobe(0.27, 0.548, 0.145),
    RunOff(0.85, 0.15, 0.85),
)
# A premature beat fills less and ejects for a shorter time: its waves come earlier.
PREMATURE = (
    Lobe(1.00, 0.105, 0.33),
    Lobe(0.30, 0.205, 0.19),
    Lobe(0.20, 0.360, 0.14),
    RunOff(0.85, 0.12, 0.70),
)


def _respiration(beats: int, fall: float) -> tuple[Beat, ...]:
    """Return ``beats`` normal beats over one breath; the weakest, mid-inspiration, is weaker by ``fall``."""
    phase = 2.0 * np.pi * np.arange(beats) / beats
    strengths = 1.0 - fall * (0.5 - 0.5 * np.cos(phase))
    return tuple(Beat(BEAT_S * k, float(s), NORMAL) for k, s in enumerate(strengths))


def _irregular(beats: int, mean_s: float, spread: float, seed: int) -> tuple[tuple[Beat, ...], float]:
    """Return beats at irregular intervals, and how long they last together.

    Intervals are independent, gamma distributed with a coefficient of variation ``spread`` and not under
    0.4 s. A beat is as strong as the interval before it let the heart fill: 1 - exp(-interval / 0.35 s).
    """
    rng = np.random.default_rng(seed)
    shape = spread**-2
    drawn = np.maximum(rng.gamma(shape, mean_s / shape, beats), 0.4)
    intervals = np.round(drawn * (mean_s * beats / drawn.sum()), 3)
    onsets = np.cumsum(intervals) - intervals
    strengths = 1.0 - np.exp(-np.roll(intervals, 1) / 0.35)
    strengths /= strengths.max()
    found = tuple(Beat(float(at), float(s), NORMAL) for at, s in zip(onsets.round(3), strengths, strict=True))
    return found, float(intervals.sum().round(3))


FIBRILLATING, FIBRILLATING_S = _irregular(20, 0.66, 0.24, 7)

BAZETT = "Bazett HC, An analysis of the time-relations of electrocardiograms, Heart 1920, 7, 353-370"
MCGEE = "McGee S, Evidence-Based Physical Diagnosis, 4th ed., Elsevier 2018, chapter 'Pulse Rate and Contour'"
TRAUBE = (
    "Traube L, Ein Fall von Pulsus bigeminus nebst Bemerkungen ueber die Leberschwellungen bei "
    "Klappenfehlern und ueber acute Leberatrophie, Berliner klinische Wochenschrift 1872, 9, 185-188"
)

LIBRARY = (
    Pulse(
        name="normal",
        meaning="a healthy pulse: quick rise, one systolic peak, dicrotic notch and wave, slow decay",
        source="Nichols WW, O'Rourke MF, Vlachopoulos C, McDonald's Blood Flow in Arteries, 6th ed., 2011",
        mmHg=(80, 120),
        beats=(Beat(0.0, 1.0, NORMAL),),
        period_s=BEAT_S,
    ),
    Pulse(
        name="bifid",
        meaning="pulsus bisferiens, two systolic peaks: aortic regurgitation (with or without stenosis), "
        "hypertrophic obstructive cardiomyopathy",
        source="Carneiro F, Abreu P, Restivo MT, Hysteresis Compensation in a Tactile Device for Arterial "
        "Pulse Reproduction, Sensors 2018, 18(5), 1631",
        mmHg=(60, 140),
        beats=(Beat(0.0, 1.0, BISFERIENS),),
        period_s=BEAT_S,
    ),
    Pulse(
        name="alternans",
        meaning="pulsus alternans, strong and weak beats in a regular rhythm: left ventricular failure",
        source=f"{TRAUBE}; {MCGEE}",
        mmHg=(80, 120),
        beats=(Beat(0.0, 1.0, NORMAL), Beat(BEAT_S, 0.62, NORMAL)),
        period_s=2 * BEAT_S,
    ),
    Pulse(
        name="paradoxus",
        meaning="pulsus paradoxus, systolic pressure falls by more than 10 mmHg on inspiration: cardiac "
        "tamponade, severe asthma; one breath of 4 s",
        source="Kussmaul A, Ueber schwielige Mediastino-Pericarditis und den paradoxen Puls, "
        f"Berliner klinische Wochenschrift 1873, 10, 433-435; {MCGEE}",
        mmHg=(75, 120),
        beats=_respiration(5, 0.45),
        period_s=5 * BEAT_S,
    ),
    Pulse(
        name="parvus-et-tardus",
        meaning="pulsus parvus et tardus, small and late with a slow rise: severe aortic stenosis; smallness "
        "is a matter of the force range, since every record spans 0 to 1",
        source="Munt B et al., Physical examination in valvular aortic stenosis: correlation with stenosis "
        "severity and prediction of clinical outcome, American Heart Journal 1999, 137(2), 298-306",
        mmHg=(85, 107),
        beats=(Beat(0.0, 1.0, TARDUS),),
        period_s=BEAT_S,
    ),
    Pulse(
        name="bigeminus",
        meaning="pulsus bigeminus, each beat coupled to a weaker premature beat, then a pause: ventricular "
        "premature beats, digitalis intoxication",
        source=TRAUBE,
        mmHg=(75, 125),
        beats=(Beat(0.0, 1.0, NORMAL), Beat(0.50, 0.50, PREMATURE)),
        period_s=2 * BEAT_S,
    ),
    Pulse(
        name="dicrotic",
        meaning="dicrotic pulse, a second wave after the notch that a finger feels: low stroke volume with "
        "soft arteries, as in cardiomyopathy, tamponade, fever",
        source="Ewy GA, Rios JC, Marcus FI, The dicrotic arterial pulse, Circulation 1969, 39, 655-661; "
        f"{MCGEE}",
        mmHg=(70, 100),
        beats=(Beat(0.0, 1.0, DICROTIC),),
        period_s=BEAT_S,
    ),
    Pulse(
        name="water-hammer",
        meaning="hyperkinetic, collapsing or water-hammer pulse, up at once and down at once: aortic "
        "regurgitation, fever, anaemia, thyrotoxicosis",
        source="Corrigan DJ, On permanent patency of the mouth of the aorta, Edinburgh Medical and Surgical "
        f"Journal 1832, 37, 225-245; {MCGEE}",
        mmHg=(45, 165),
        beats=(Beat(0.0, 1.0, COLLAPSING),),
        period_s=BEAT_S,
    ),
    Pulse(
        name="anacrotic",
        meaning="anacrotic pulse, a notch on the slow upstroke: aortic stenosis",
        source=MCGEE,
        mmHg=(85, 115),
        beats=(Beat(0.0, 1.0, ANACROTIC),),
        period_s=BEAT_S,
    ),
    Pulse(
        name="stiff",
        meaning="the pulse of stiff arteries in old age as at the neck, a late systolic peak above the early "
        "one and a steep fall: the reflected wave returns within systole",
        source="Murgo JP et al., Aortic input impedance in normal man: relationship to pressure wave forms, "
        "Circulation 1980, 62, 105-116 (type A); Kelly R et al., Noninvasive determination of age-related "
        "changes in the human arterial pulse, Circulation 1989, 80, 1652-1659",
        mmHg=(75, 155),
        beats=(Beat(0.0, 1.0, STIFF),),
        period_s=BEAT_S,
    ),
    Pulse(
        name="tachycardia",
        meaning="a fast regular pulse, 130 a minute: exercise, fever, blood loss",
        source=f"{BAZETT}; {MCGEE}",
        mmHg=(75, 105),
        beats=(Beat(0.0, 1.0, FAST),),
        period_s=0.462,
    ),
    Pulse(
        name="bradycardia",
        meaning="a slow regular pulse, 45 a minute, large because the heart fills long: athletes, "
        "heart block",
        source=f"{BAZETT}; {MCGEE}",
        mmHg=(70, 140),
        beats=(Beat(0.0, 1.0, SLOW),),
        period_s=1.333,
    ),
    Pulse(
        name="atrial-fibrillation",
        meaning="irregularly irregular, no two intervals alike, weak beats after short ones: "
        "atrial fibrillation; 20 beats drawn once, 91 a minute",
        source="Rawles JM, Rowland E, Is the pulse in atrial fibrillation irregularly irregular?, British "
        f"Heart Journal 1986, 56, 4-11; {MCGEE}",
        mmHg=(75, 120),
        beats=FIBRILLATING,
        period_s=FIBRILLATING_S,
    ),
    Pulse(
        name="premature-atrial",
        meaning="a regular pulse with one premature atrial beat in six, without a full compensatory pause: "
        "the sinus node is reset and begins anew",
        source=MCGEE,
        mmHg=(80, 120),
        beats=(
            *(Beat(BEAT_S * k, 1.0, NORMAL) for k in range(5)),
            Beat(4.0 * BEAT_S + 0.52, 0.62, PREMATURE),
        ),
        period_s=4.0 * BEAT_S + 0.52 + 0.90,
    ),
    Pulse(
        name="alternans-mild",
        meaning="pulsus alternans of little depth, 18 % between strong and weak beats: early failure of the "
        "left ventricle, felt by a practised finger",
        source=f"{TRAUBE}; {MCGEE}",
        mmHg=(80, 120),
        beats=(Beat(0.0, 1.0, NORMAL), Beat(BEAT_S, 0.82, NORMAL)),
        period_s=2 * BEAT_S,
    ),
    Pulse(
        name="alternans-severe",
        meaning="pulsus alternans of great depth, the weak beat hardly felt: severe failure of the "
        "left ventricle",
        source=f"{TRAUBE}; {MCGEE}",
        mmHg=(80, 120),
        beats=(Beat(0.0, 1.0, NORMAL), Beat(BEAT_S, 0.32, NORMAL)),
        period_s=2 * BEAT_S,
    ),
)


def _pressure(pulse: Pulse) -> FloatArray:
    """Return one period of ``pulse``, shape (period / DT_S,), from the opening of its first valve."""
    t_s: FloatArray = DT_S * np.arange(round(pulse.period_s / DT_S), dtype=np.float64)
    p = np.zeros_like(t_s)
    for turn in range(int(np.ceil(DECAYED_S / pulse.period_s)) + 1):
        for beat in pulse.beats:
            age_s = t_s + (turn * pulse.period_s - beat.onset_s)
            for wave in beat.waves:
                p += beat.strength * wave.at(age_s)
    return p


def draw(pulse: Pulse) -> FloatArray:
    """Return one period of ``pulse``, shape (period / DT_S,), 0..1, from its lowest diastolic foot."""
    p = _pressure(pulse)
    p = np.roll(p, -int(np.argmin(p)))
    scaled: FloatArray = (p - p.min()) / np.ptp(p)
    return scaled


def feet(pulse: Pulse) -> tuple[float, ...]:
    """Return when the beats of the record begin, s: the lowest sample about each opening of the valve."""
    p = _pressure(pulse)
    start = int(np.argmin(p))
    around = np.arange(round(FOOT_S[0] / DT_S), round(FOOT_S[1] / DT_S))
    found = []
    for beat in pulse.beats:
        near = (around + round(beat.onset_s / DT_S)) % p.size
        found.append(int(near[np.argmin(p[near])] - start) % p.size)
    return tuple(round(at * DT_S, 3) for at in sorted(found))


def table(pulse: Pulse) -> str:
    """Return the CSV text of ``pulse``: comment lines, the header ``t_s,p``, the samples."""
    low, high = pulse.mmHg
    lines = [
        f"# name: {pulse.name}",
        f"# meaning: {pulse.meaning}",
        f"# source: {pulse.source}",
        f"# scale: p = 0 stands for {low} mmHg and p = 1 for {high} mmHg in an exemplary patient",
        f"# beats: {' '.join(f'{at:g}' for at in feet(pulse))}",
        "# licence: MIT; drawn for this project by waveforms/make.py, not recorded from a patient",
        "t_s,p",
    ]
    lines += [f"{k * DT_S:.3f},{p:.6f}" for k, p in enumerate(draw(pulse))]
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str]) -> None:
    """Write every record into the folder given, or beside this file."""
    folder = Path(arguments[0]) if arguments else Path(__file__).resolve().parent
    for pulse in LIBRARY:
        (folder / f"{pulse.name}.csv").write_text(table(pulse), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
