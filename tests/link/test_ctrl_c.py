"""Ctrl-C in the middle of a command: STOP goes out first, the device is off, and it is said what there is."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import threading
import time
from pathlib import Path

import pytest

import pulsetrainer as pt
from program import PROGRAM, Ran
from pulsetrainer.cli import guard
from pulsetrainer.cli.app import app
from pulsetrainer.device import messages as m
from pulsetrainer.device.codes import STATUS_OUTPUT_NOT_OFF, Fault, State
from pulsetrainer.device.exchange import Exchange
from pulsetrainer.device.frames import FrameReader
from pulsetrainer.device.heat import HeatMemory
from pulsetrainer.device.transport import SerialTransport
from pulsetrainer.errors import Interrupted
from pulsetrainer.simulation.bench import Bench
from pulsetrainer.steps.conductor import Play
from wording import refusal

KEPT = Path(__file__).parents[1] / "data/files-0.1"
FIRST_S = 0.3  # from the signal to STOP: a busy computer has to run the program first
pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(os.name != "posix", reason="the bench needs a pty"),
]


class Overheard:
    """A bench at the pace of the wall clock behind a socket: what the program sends is noted."""

    def __init__(self) -> None:
        self.bench = Bench("bench:?speed=real")
        self.transport = SerialTransport(self.bench.path)
        self.heard: list[tuple[float, int]] = []  # when, and which command
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = f"socket://127.0.0.1:{self._server.getsockname()[1]}"
        self._thread = threading.Thread(target=self._relay, daemon=True)
        self._thread.start()

    def _relay(self) -> None:
        reader = FrameReader()
        with contextlib.suppress(OSError):
            program, _ = self._server.accept()
            with program:
                program.setblocking(False)
                while True:
                    with contextlib.suppress(BlockingIOError):
                        data = program.recv(4096)
                        if not data:
                            return
                        now = time.monotonic()
                        self.heard += [(now, frame.type) for frame in reader.feed(data)]
                        self.transport.write(data)
                    program.sendall(self.transport.read())

    def count(self, kind: type[m.Message]) -> int:
        """How often this command was heard."""
        return sum(one == kind.TYPE for _, one in self.heard)

    def status(self) -> m.StatusReply:
        """The device's own word, once the program is gone; a silent one would have tripped meanwhile."""
        self._thread.join(10)
        assert not self._thread.is_alive()
        time.sleep(0.5)
        status = Exchange(self.transport, "bench:", monotonic=time.monotonic).request(m.Status())
        assert isinstance(status, m.StatusReply)
        return status

    def close(self) -> None:
        """End it."""
        self._server.close()
        self.transport.close()
        self.bench.close()


@pytest.fixture
def overheard():
    """A bench that is listened to."""
    one = Overheard()
    yield one
    one.close()


# words, plays that begin before the signal, seconds of the last one, what is said, and what is in the file
CASES = {
    "capture": (("capture", "identification"), 2, 1.5, "interrupted", pt.Run),
    "capture, while conditioning": (("capture", "identification"), 1, 0.3, "stopped with nothing", None),
    "play": (("play", "drive.h5"), 3, 0.5, "stopped with repeats", pt.Playback),
    "play, the first": (("play", "drive.h5"), 1, 0.5, "stopped before a repeat", None),
    "session": (
        ("session", "--model", KEPT / "model-extended.h5", "--minutes", 5),
        1, 4.0, "stopped with beats", pt.Session,
    ),
    "session, before a beat": (
        ("session", "--model", KEPT / "model-extended.h5", "--minutes", 5),
        1, 0.3, "stopped before a beat", None,
    ),
    "tune": (("tune",), 3, 0.1, "stopped with nothing", None),
    "refine": (("refine", "drive.h5"), 2, 0.5, "stopped with nothing", None),
}  # fmt: skip


QUICK = ("session",)


@pytest.mark.parametrize(
    ("words", "plays", "seconds", "said", "kept"),
    [pytest.param(*case, marks=[pytest.mark.slow] * (name not in QUICK)) for name, case in CASES.items()],
    ids=CASES,
)
def test_the_output_is_off_first_and_it_is_said_what_there_is(
    overheard, tmp_path, words, plays, seconds, said, kept
):
    """Exit 130, one whole file or none, and the device is idle because it was told, not because it waited."""
    model = pt.load(KEPT / "model.h5")
    pt.save(pt.invert("normal", model, periods=1), tmp_path / "drive.h5")
    HeatMemory(tmp_path / "state/pulsetrainer/coil-heat").remember("BENCH-0", 0.0, time.time())
    output = "run.toml" if words[0] == "tune" else "run.h5"
    process = subprocess.Popen(
        [*PROGRAM, *map(str, words), "--port", overheard.port, "-o", output, "--json"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "XDG_STATE_HOME": str(tmp_path / "state")},
    )
    try:
        deadline = time.monotonic() + 60
        while overheard.count(m.Start) < plays:
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < deadline
            time.sleep(0.01)
        time.sleep(seconds)
        sent_s = time.monotonic()
        process.send_signal(signal.SIGINT)
        time.sleep(0.03)
        process.send_signal(signal.SIGINT)  # a hand that trembles: what is being saved stays whole
        out, err = process.communicate(timeout=30)
    finally:
        process.kill()
    refusal(Ran(process.returncode, out, err), 130, said)
    assert "Traceback" not in err
    assert err.count("written") <= 1
    status = overheard.status()
    assert (State(status.state), Fault(status.fault)) == (State.IDLE, Fault.NONE)
    assert not status.flags & STATUS_OUTPUT_NOT_OFF
    after = [(at - sent_s, kind) for at, kind in overheard.heard if at >= sent_s]
    assert min(at for at, kind in after if kind == m.Stop.TYPE) < FIRST_S
    assert m.Start.TYPE not in {kind for _, kind in after}
    there = {path.name for path in tmp_path.iterdir()} - {"drive.h5", "state"}
    assert there == ({"run.h5"} if kept else set())
    if kept:
        noun = pt.load(tmp_path / "run.h5")
        assert isinstance(noun, kept)
        assert not noun.complete


def _stopped(*_: object, **__: object) -> None:
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("place", "written"),
    [("job.Job.load", "nothing"), ("job.Job.open_device", "nothing"), ("job.Job.show", "played.h5")],
    ids=["while it loads", "before it saves", "after it saved"],
)
def test_ctrl_c_while_nothing_is_played(tmp_path, monkeypatch, capsys, place, written):
    """The exit code of a stop, and what was written by then."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(f"pulsetrainer.cli.{place}", _stopped)
    assert guard.funnel(app, ["play", str(KEPT / "drive.h5"), "-o", "played.h5", "--repeats", "1"]) == 130
    assert f"error: stopped by you; {written} was written\n" in capsys.readouterr().err
    assert Path("played.h5").exists() is (written != "nothing")


def test_repeats_that_are_whole_are_kept_when_it_comes_between_two_plays():
    """What was played is in the error, as when it comes in the middle of one."""
    model = pt.load(KEPT / "model.h5")
    drive = pt.invert("normal", model, periods=1)

    def progress(share: float) -> None:
        if share > 0.6:
            raise KeyboardInterrupt

    with pt.open_device("bench:") as device, pytest.raises(Interrupted) as caught:
        pt.play(drive, device, repeats=3, progress=progress)
    assert isinstance(caught.value.kept, pt.Playback)
    assert caught.value.kept.compensated.output.shape[0] == 2
    assert not caught.value.kept.complete


def test_a_session_that_is_stopped_while_a_part_is_made_keeps_its_beats():
    """Its first part is over and the next one has not begun."""
    asked: list[int] = []

    def decide(number: int, _time_s: float) -> Play:
        asked.append(number)
        if asked.count(number) == 3:  # as what comes, for its turn, and again for the next part
            raise KeyboardInterrupt
        return Play(0)

    with pt.open_device("bench:") as device:
        device.set_parameter("on_time", 6)
        with pytest.raises(Interrupted) as caught:
            pt.session(pt.load(KEPT / "model.h5"), device, pulses="normal", decide=decide)
    assert isinstance(caught.value.kept, pt.Session)
    assert caught.value.kept.beats.start_s.size == asked[-1]
