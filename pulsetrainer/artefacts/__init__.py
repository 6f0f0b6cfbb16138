"""The nouns: one frozen dataclass for each kind of artefact. They know no file."""

from __future__ import annotations

from pulsetrainer.artefacts.data import LARGEST, Attribute, BoolArray, Data, FloatArray, beyond_all_quantities
from pulsetrainer.artefacts.diagnosis import Cause, Dependence, Diagnosis, Profile, Recorded
from pulsetrainer.artefacts.evaluation import DriveError, Evaluation, ModelEvaluation, WaveformEvaluation
from pulsetrainer.artefacts.model import Extension, Fit, Model, Parameter, Seen
from pulsetrainer.artefacts.playback import DrivePlayback, Playback
from pulsetrainer.artefacts.run import Run
from pulsetrainer.artefacts.session import Beats, Quiz, Score, Session
from pulsetrainer.artefacts.waveform import RefinePass, Waveform

__all__ = [
    "KINDS", "LARGEST", "Attribute", "Beats", "BoolArray", "Cause", "Data", "Dependence", "Diagnosis",
    "DriveError", "DrivePlayback", "Evaluation", "Extension", "Fit", "FloatArray", "Model",
    "ModelEvaluation", "Parameter", "Playback", "Profile", "Quiz", "Recorded", "RefinePass", "Run", "Score",
    "Seen", "Session", "Waveform", "WaveformEvaluation", "beyond_all_quantities",
]  # fmt: skip

KINDS: dict[str, type] = {k.kind: k for k in (Run, Model, Waveform, Playback, Evaluation, Diagnosis, Session)}
