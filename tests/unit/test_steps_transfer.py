"""What refining learnt on one pulse, asked for in another: on devices that are no Preisach operator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from foreign_plants import PLANTS, ForeignDevice
from test_steps_refine import SLEW, drive_of, refined_of

from pulsetrainer.core.missed import Path, elsewhere, told_by_the_rest
from pulsetrainer.errors import DataError
from pulsetrainer.steps.refine import refine
from pulsetrainer.steps.transfer import transfer


def error_percent(plant: str, drive) -> float:
    """Mean error of a drive on the plant itself, without noise, % of full force."""
    pressed = PLANTS[plant](drive.compensated)
    return 100.0 * float(np.abs(pressed - drive.target)[drive.scored].mean()) / drive.full_force


def test_a_new_pulse_keeps_half_of_the_gain():
    """Of what refining the new pulse itself would gain, at least half comes from the other one."""
    plant, drive = "Coleman-Hodgdon", drive_of("Coleman-Hodgdon", "normal")
    refined, own = refined_of(plant, "bifid"), refined_of(plant)
    other = transfer(drive, refined, slew=SLEW)
    before, after, best = (error_percent(plant, one) for one in (drive, other, own))
    assert before - after >= 0.5 * (before - best)
    assert np.abs(np.diff(other.compensated)).max() <= SLEW / 1000.0 * (1 + 1e-9)
    assert other.inversion == "transferred"
    told = np.abs(PLANTS[plant](other.compensated) - other.predicted)[other.scored].mean()
    assert 100.0 * told / other.full_force == pytest.approx(after, rel=0.1)  # it expects what was learnt


@pytest.mark.slow
@pytest.mark.parametrize("learnt", ["normal", "water-hammer"])
@pytest.mark.parametrize("plant", ["Coleman-Hodgdon", "Bouc-Wen", "Prandtl-Ishlinskii"])
def test_no_new_pulse_becomes_worse(plant, learnt):
    """What is let through is better than without, also where it was learnt on the narrowest pulse."""
    refined = refined_of(plant, learnt)
    for new in ("bifid", "anacrotic"):
        drive = drive_of(plant, new)
        try:
            other = transfer(drive, refined, slew=SLEW)
        except DataError:
            continue
        assert error_percent(plant, other) < error_percent(plant, drive)


def test_what_refining_could_not_take_out_is_not_carried_over():
    """A pulse whose own error is still far above the noise says nothing of another."""
    plant = "Coleman-Hodgdon"
    refined = refined_of(plant, "bifid")
    last = replace(refined.passes[refined.kept - 1], noise_percent=0.01)
    passes = (*refined.passes[: refined.kept - 1], last, *refined.passes[refined.kept :])
    with pytest.raises(DataError) as caught:
        transfer(drive_of(plant), replace(refined, passes=passes), slew=SLEW)
    assert ("more `passes`" in caught.value.hint) == (len(passes) < 5)


def test_what_one_path_says_of_another():
    """A zero, a lag and a density are told where the first path went; elsewhere it is uncertain."""
    t = np.arange(4000) * 1e-3
    at = np.arange(0, t.size, 16)

    def path(low, high):
        u = low + (high - low) * 0.5 * (1.0 - np.cos(2 * np.pi * t))
        return Path.of((0.0, 1.0), u, np.gradient(u, 1e-3), at)

    wide, same, narrow = path(0.1, 0.9), path(0.12, 0.88), path(0.1, 0.3)
    missed = 0.01 - 0.004 * wide.rate + 0.02 * wide.relays.mean(axis=1)
    truth = 0.01 - 0.004 * same.rate + 0.02 * same.relays.mean(axis=1)
    expected, variance = elsewhere(wide, missed, same)
    assert np.abs(expected - truth).max() < 0.001
    part = np.arange(at.size) * 5 // at.size
    assert told_by_the_rest(wide, missed, part) > 0.99
    rests = part == 4  # a part that moves nothing tells nothing, and takes nothing from what the others tell
    held = Path(np.where(rests, 0.0, wide.rate), np.where(rests[:, None], wide.relays[0], wide.relays))
    assert told_by_the_rest(held, 0.01 - 0.004 * held.rate + 0.02 * held.relays.mean(axis=1), part) > 0.95
    assert told_by_the_rest(wide, 0.0 * missed, part) == 1.0  # nothing is missed: all of it is told
    _, less = elsewhere(narrow, missed, wide)
    assert less.mean() > 3 * variance.mean()
    assert np.all(variance <= same.variance)
    np.testing.assert_allclose(same.variance, np.diagonal(same.covariance_with(same)))


def test_a_drive_of_another_model_is_refused_by_the_names_of_both():
    """What was learnt is what that model lacks."""
    refined = refine(
        drive_of("Coleman-Hodgdon"), ForeignDevice("Coleman-Hodgdon", seed=3), passes=1, slew=SLEW
    )
    model = replace(refined.model, offset=refined.model.offset + 0.1)
    other = replace(drive_of("Coleman-Hodgdon", "bifid"), model=model)
    with pytest.raises(DataError, match=r"r\.h5 was made with another model than m\.h5"):
        transfer(other, refined, slew=SLEW, names=("r.h5", "m.h5"))


def test_a_device_that_is_its_model_has_nothing_to_carry_over():
    """What is learnt from noise alone changes next to nothing."""
    drive, device = drive_of("Coleman-Hodgdon"), ForeignDevice("Coleman-Hodgdon", seed=5)
    device.press = lambda current: np.asarray(drive.model.predict(current, 1e-3))
    other = drive_of("Coleman-Hodgdon", "bifid")
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
    refined = refined_of("Jiles-Atherton")
    with pytest.raises(DataError) as caught:
        transfer(drive_of("Jiles-Atherton", "bifid"), refined, slew=SLEW)
    assert caught.value.hint


def test_what_cannot_be_carried_over_is_refused():
    """A drive that was not refined, another model or rate, another method."""
    drive, other = drive_of("Coleman-Hodgdon"), drive_of("Coleman-Hodgdon", "bifid")
    refined = refine(drive, ForeignDevice("Coleman-Hodgdon"), passes=1, slew=SLEW)
    wrong = [
        (other, drive),
        (replace(other, model=replace(other.model, offset=other.model.offset + 1e-3)), refined),
        (replace(other, inversion="extended"), refined),
        (replace(other, model=None), refined),
    ]
    for new, learnt in wrong:
        with pytest.raises(DataError) as caught:
            transfer(new, learnt)
        assert caught.value.hint
