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

    @property
    def period_s(self) -> float:
        """Length of the record."""
        return BEAT_S * len(self.beats)


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
    ),
    Pulse(
        name="bifid",
        meaning="pulsus bisferiens, two systolic peaks: aortic regurgitation (with or without stenosis), "
        "hypertrophic obstructive cardiomyopathy",
        source="Carneiro F, Abreu P, Restivo MT, Hysteresis Compensation in a Tactile Device for Arterial "
        "Pulse Reproduction, Sensors 2018, 18(5), 1631",
        mmHg=(60, 140),
        beats=(Beat(0.0, 1.0, BISFERIENS),),
    ),
    Pulse(
        name="alternans",
        meaning="pulsus alternans, strong and weak beats in a regular rhythm: left ventricular failure",
        source=f"{TRAUBE}; {MCGEE}",
        mmHg=(80, 120),
        beats=(Beat(0.0, 1.0, NORMAL), Beat(BEAT_S, 0.62, NORMAL)),
    ),
    Pulse(
        name="paradoxus",
        meaning="pulsus paradoxus, systolic pressure falls by more than 10 mmHg on inspiration: cardiac "
        "tamponade, severe asthma; one breath of 4 s",
        source="Kussmaul A, Ueber schwielige Mediastino-Pericarditis und den paradoxen Puls, "
        f"Berliner klinische Wochenschrift 1873, 10, 433-435; {MCGEE}",
        mmHg=(75, 120),
        beats=_respiration(5, 0.45),
    ),
    Pulse(
        name="parvus-et-tardus",
        meaning="pulsus parvus et tardus, small and late with a slow rise: severe aortic stenosis; smallness "
        "is a matter of the force range, since every record spans 0 to 1",
        source="Munt B et al., Physical examination in valvular aortic stenosis: correlation with stenosis "
        "severity and prediction of clinical outcome, American Heart Journal 1999, 137(2), 298-306",
        mmHg=(85, 107),
        beats=(Beat(0.0, 1.0, TARDUS),),
    ),
    Pulse(
        name="bigeminus",
        meaning="pulsus bigeminus, each beat coupled to a weaker premature beat, then a pause: ventricular "
        "premature beats, digitalis intoxication",
        source=TRAUBE,
        mmHg=(75, 125),
        beats=(Beat(0.0, 1.0, NORMAL), Beat(0.50, 0.50, PREMATURE)),
    ),
)


def draw(pulse: Pulse) -> FloatArray:
    """Return one period of ``pulse``, shape (period / DT_S,), 0..1, from its lowest diastolic foot."""
    t_s: FloatArray = DT_S * np.arange(round(pulse.period_s / DT_S), dtype=np.float64)
    p = np.zeros_like(t_s)
    for turn in range(int(np.ceil(DECAYED_S / pulse.period_s)) + 1):
        for beat in pulse.beats:
            age_s = t_s + (turn * pulse.period_s - beat.onset_s)
            for wave in beat.waves:
                p += beat.strength * wave.at(age_s)
    p = np.roll(p, -int(np.argmin(p)))
    scaled: FloatArray = (p - p.min()) / np.ptp(p)
    return scaled


def table(pulse: Pulse) -> str:
    """Return the CSV text of ``pulse``: comment lines, the header ``t_s,p``, the samples."""
    low, high = pulse.mmHg
    lines = [
        f"# name: {pulse.name}",
        f"# meaning: {pulse.meaning}",
        f"# source: {pulse.source}",
        f"# scale: p = 0 stands for {low} mmHg and p = 1 for {high} mmHg in an exemplary patient",
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
