"""STOP goes out first; whatever there is to ask is asked afterwards."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest
from scripted import SLICE_S, ScriptedDevice, message

from pulsetrainer.device import codes
from pulsetrainer.device import messages as m
from pulsetrainer.device.codes import NakCode, State
from pulsetrainer.device.exchange import Exchange
from pulsetrainer.device.opening import open_device
from pulsetrainer.errors import DeviceError

PLAY_S = 3.0
HALF_AMP = np.full(round(PLAY_S * 1000), 0.5)


def _refuse(device, kind, after_s):
    """Refuse a command of this kind from a time after START on."""

    def answer(command, usual):
        late = device.session and device.now_s - device.started_s > after_s
        if late and isinstance(command, kind):
            return message(m.Nak, code=NakCode.RANGE, command=command.TYPE, state=device.state)
        return usual

    device.answer = answer


def test_a_refusal_in_mid_play_is_followed_by_stop():
    """Nothing is asked before STOP has gone out, and no time passes."""
    script = ScriptedDevice()
    _refuse(script, m.Heartbeat, 0.5)
    with script.open() as device:
        trace = device.play(HALF_AMP, 1000)
        refused = script.when(m.Heartbeat)[-1]
        after = [(at, type(command)) for at, command in script.heard if at >= refused]
    assert not trace.complete
    assert "refused Heartbeat" in trace.fault
    kinds = [kind for _, kind in after]
    assert kinds[kinds.index(m.Heartbeat) + 1] is m.Stop
    assert after[kinds.index(m.Stop)][0] - refused <= SLICE_S


def test_a_stop_does_not_wait_for_an_answer_that_is_late():
    """A command is without its answer when the user wants out: STOP goes out within one wait for a byte."""
    script = ScriptedDevice()
    asked = []

    def answer(command, usual):
        if script.session and isinstance(command, m.Heartbeat) and script.tick > 5000:
            if not asked:
                asked.append(script.now_s)
                device.stop()
            return None
        return usual

    script.answer = answer
    with script.open() as device:
        trace = device.play(HALF_AMP, 1000)
    assert trace.fault == "stopped"
    assert next(at for at in script.when(m.Stop) if at >= asked[0]) - asked[0] <= SLICE_S


def test_an_answer_that_never_comes_ends_in_stop():
    """A device that no longer answers is told to stop, whether it hears or not."""
    script = ScriptedDevice()
    script.answer = lambda command, usual: None if script.session and script.tick > 5000 else usual
    with script.open() as device:
        trace = device.play(HALF_AMP, 1000)
        silent = script.started_s + 0.5
        assert any(at > silent for at in script.when(m.Stop))
    assert "did not answer" in trace.fault
    assert (trace.samples, trace.dropped_samples) == (0, 0)


def test_a_refused_arm_is_no_complete_play():
    """The counts that the status gives then are those of the play before."""
    script = ScriptedDevice()
    with script.open() as device:
        assert device.play(HALF_AMP, 1000).complete
        refusal = message(m.Nak, code=NakCode.STATE, command=m.Arm.TYPE)
        script.answer = lambda command, usual: refusal if isinstance(command, m.Arm) else usual
        script.now_s += PLAY_S
        trace = device.play(HALF_AMP[:10], 1000)
    assert (trace.complete, trace.samples) == (False, 0)
    assert "refused Arm" in trace.fault


def test_a_device_that_goes_on_is_no_complete_play():
    """The reference has been played, but the device does not come to rest."""
    script = ScriptedDevice()
    with script.open() as device:
        script.status = {"state": State.RAMPING}
        trace = device.play(HALF_AMP, 1000)
    assert not trace.complete
    assert "did not come to rest" in trace.fault
    assert "ramping" in trace.fault


@pytest.mark.parametrize("kind", [m.WaveData, m.Heartbeat])
def test_the_real_firmware_leaves_its_reference_as_soon_as_it_refuses(monkeypatch, kind):
    """A command refused in mid-play: the device is on its way down within 100 ms of it, in its own time."""
    refused = []
    request = Exchange.request

    def once(self, command, *rest):
        if isinstance(command, kind) and not refused and playing():
            refused.append(ticks[-1])
            command = m.Arm(0)  # not possible while it runs
        return request(self, command, *rest)

    ticks = [0]
    monkeypatch.setattr(Exchange, "request", once)
    with open_device("bench:?speed=real") as device:

        def playing():
            return device._player is not None and device._player.last_tick > 5000

        trace = device.play(
            np.full(5000, 0.5), 1000, on_block=lambda block: ticks.append(int(block.tick[-1]))
        )
        status = device._status()
    assert refused
    assert not trace.complete
    assert "refused Arm" in trace.fault
    assert status.state == State.IDLE
    assert trace.tick[-1] - refused[0] < 1000 + 20 * 10 * codes.TICK_RATE_HZ / 1000  # 100 ms and a block


@pytest.mark.slow
def test_stop_from_other_threads_under_load():
    """Four threads call stop() at any moment, before, during and after plays: each play ends as it should."""
    with open_device("bench:") as device:
        done = threading.Event()
        errors: list[BaseException] = []

        def hammer(seed: int) -> None:
            rng = np.random.default_rng(seed)
            while not done.wait(float(rng.exponential(0.02))):
                try:
                    device.stop()
                except BaseException as error:
                    errors.append(error)

        threads = [threading.Thread(target=hammer, args=(seed,)) for seed in range(4)]
        for thread in threads:
            thread.start()
        outcomes = []
        deadline = time.monotonic() + 6
        try:
            while time.monotonic() < deadline:
                outcomes.append(device.play(np.full(2000, 0.3), 1000))
                assert device.set_parameter("force_trip", 9000) == 9000
        finally:
            done.set()
            for thread in threads:
                thread.join()
        assert not errors
        assert len(outcomes) > 20
        assert {trace.fault for trace in outcomes} <= {"", "stopped"}
        assert any(trace.fault for trace in outcomes)
        assert all(trace.complete == (trace.fault == "") for trace in outcomes)
        assert device.play([0.1], 1000).complete


def test_only_stop_may_be_called_while_the_device_plays(device):
    """Anything else from another thread is refused in words, and the play is not disturbed."""
    refused = []

    def meddle(_block) -> None:
        for act in (lambda: device.set_parameter("force_trip", 1000), lambda: device.play([0.1], 1000)):
            with pytest.raises(DeviceError) as caught:
                act()
            refused.append(caught.value)

    trace = device.play(np.full(3000, 0.3), 1000, on_block=meddle)
    assert trace.complete
    assert refused


def test_closing_from_another_thread_waits_until_the_play_is_stopped():
    """The port is not taken away from under a play that is just stopping the device."""
    device = open_device("bench:?speed=real")
    closer = threading.Thread(target=device.close)
    trace = device.play(np.full(5000, 0.3), 1000, on_block=lambda _: closer.ident or closer.start())
    closer.join(timeout=10)
    assert not closer.is_alive()
    assert trace.fault == "stopped"


def test_a_ctrl_c_between_two_steps_of_a_start_leaves_nobody_waiting(monkeypatch):
    """A play that has not begun is none: closing does not wait for its end."""
    script = ScriptedDevice()
    device = script.open()

    def interrupted(*_given, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr("pulsetrainer.device.device.Follower", interrupted)
    with pytest.raises(KeyboardInterrupt):
        device.play([0.1, 0.1], 1000)
    closing = threading.Thread(target=device.close, daemon=True)
    closing.start()
    closing.join(5)
    assert not closing.is_alive()
    assert script.when(m.Stop)
