"""What refining learnt on one pulse, asked for in another: on devices that are no Preisach operator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from foreign_plants import PLANTS, ForeignDevice
from test_steps_refine import SLEW, drive_of

from pulsetrainer.errors import DataError
from pulsetrainer.steps.refine import refine
from pulsetrainer.steps.transfer import transfer


def error_percent(plant: str, drive) -> float:
    """Mean error of a drive on the plant itself, without noise, % of full force."""
    pressed = PLANTS[plant](drive.compensated)
    return 100.0 * float(np.abs(pressed - drive.target)[drive.scored].mean()) / drive.full_force


@pytest.mark.parametrize(("learnt", "new"), [("normal", "bifid"), ("bifid", "normal")])
@pytest.mark.parametrize(
    "plant", [pytest.param(name, marks=pytest.mark.slow if k else ()) for k, name in enumerate(PLANTS)]
)
def test_a_new_pulse_keeps_half_of_the_gain(plant, learnt, new):
    """Of what refining the new pulse itself would gain, at least half comes from the other one."""
    drive = drive_of(plant, new)
    refined = refine(drive_of(plant, learnt), ForeignDevice(plant, seed=3), slew=SLEW)
    own = refine(drive, ForeignDevice(plant, seed=3), slew=SLEW)
    other = transfer(drive, refined, slew=SLEW)
    before, after, best = (error_percent(plant, one) for one in (drive, other, own))
    print(plant, learnt, new, before, after, best, (before - after) / (before - best))
    assert before - after >= 0.5 * (before - best)
    assert np.abs(np.diff(other.compensated)).max() <= SLEW / 1000.0 * (1 + 1e-9)
    assert other.inversion == "transferred"
    told = np.abs(PLANTS[plant](other.compensated) - other.predicted)[other.scored].mean()
    assert 100.0 * told / other.full_force == pytest.approx(after, rel=0.1)  # it expects what was learnt


def test_a_device_that_is_its_model_has_nothing_to_carry_over():
    """What is learnt from noise alone changes next to nothing."""
    drive, device = drive_of("Prandtl-Ishlinskii"), ForeignDevice("Prandtl-Ishlinskii", seed=5)
    device.press = lambda current: np.asarray(drive.model.predict(current, 1e-3))
    other = drive_of("Prandtl-Ishlinskii", "bifid")
    carried = transfer(other, refine(drive, device, slew=SLEW), slew=SLEW)
    assert np.abs(carried.compensated - other.compensated).max() < 0.01 * np.ptp(other.compensated)


def test_what_belongs_to_one_pulse_stays_there():
    """A correction that comes and goes at no pace of the pulse's is refused: another pulse it would harm."""
    drive = drive_of("Coleman-Hodgdon")
    refined = refine(drive, ForeignDevice("Coleman-Hodgdon", seed=3), passes=2, slew=SLEW)
    odd = 0.02 * np.sin(2 * np.pi * 11.3 * drive.time_s) * drive.scored
    wrong = replace(refined, compensated=np.clip(drive.compensated + odd, 0.0, 1.5))
    with pytest.raises(DataError) as caught:
        transfer(drive_of("Coleman-Hodgdon", "bifid"), wrong, slew=SLEW)
    assert caught.value.hint


@pytest.mark.slow
def test_what_a_wrong_model_misses_is_not_carried_over():
    """On such a device another pulse became worse by up to its whole gain."""
    refined = refine(drive_of("Jiles-Atherton"), ForeignDevice("Jiles-Atherton", seed=3), slew=SLEW)
    with pytest.raises(DataError) as caught:
        transfer(drive_of("Jiles-Atherton", "bifid"), refined, slew=SLEW)
    assert caught.value.hint


def test_what_cannot_be_carried_over_is_refused():
    """A drive that was not refined, another model or rate, another method."""
    drive, other = drive_of("Bouc-Wen"), drive_of("Bouc-Wen", "bifid")
    refined = refine(drive, ForeignDevice("Bouc-Wen"), passes=1, slew=SLEW)
    wrong = [
        (other, drive),
        (drive_of("Coleman-Hodgdon"), refined),
        (replace(other, inversion="extended"), refined),
        (replace(other, model=None), refined),
    ]
    for new, learnt in wrong:
        with pytest.raises(DataError) as caught:
            transfer(new, learnt)
        assert caught.value.hint
