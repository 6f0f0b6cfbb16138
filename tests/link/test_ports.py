"""Ports: listed, found, and each failure with its own remedy."""

from __future__ import annotations

import contextlib
import errno
import socket
import subprocess
import sys
import threading
from types import SimpleNamespace

import numpy as np
import pytest

from pulsetrainer.device import ports
from pulsetrainer.device.codes import Fault, State
from pulsetrainer.device.opening import open_device
from pulsetrainer.device.ports import list_ports
from pulsetrainer.device.schemes import OpenPort, find_opener
from pulsetrainer.device.trace import Block
from pulsetrainer.device.transport import SerialTransport
from pulsetrainer.errors import DeviceError
from wording import raises, told


def _computer(monkeypatch, *found):
    rows = [
        SimpleNamespace(device=name, description="", serial_number=None, vid=vid, pid=pid)
        for name, vid, pid in found
    ]
    monkeypatch.setattr(ports.serial_ports, "comports", lambda: rows)


OURS = (0x0403, 0x6015)


def test_the_device_is_listed_first(monkeypatch):
    """Ports with the device's USB id come before the others."""
    _computer(monkeypatch, ("/dev/ttyS0", None, None), ("/dev/ttyUSB7", *OURS))
    listed = list_ports()
    assert [(p.device, p.is_device, p.vid_pid) for p in listed] == [
        ("/dev/ttyUSB7", True, "0403:6015"),
        ("/dev/ttyS0", False, ""),
    ]
    assert listed[0].status == "absent"


def test_a_port_says_what_it_is(monkeypatch):
    """Description and serial number, where the system knows them."""
    _computer(monkeypatch, ("/dev/ttyS0", None, None), ("/dev/ttyS1", None, None))
    known = ports.serial_ports.comports()[1]
    known.description, known.serial_number = "a bridge", "DK0F3"
    assert [(p.description, p.serial) for p in list_ports()] == [("", ""), ("a bridge", "DK0F3")]


def test_one_device_is_found_by_itself(monkeypatch):
    """Auto-detection takes the one port with our USB id."""
    _computer(monkeypatch, ("/dev/ttyUSB0", 0x1A86, 0x7523), ("/dev/ttyUSB7", *OURS))
    assert ports.find_device_port() == "/dev/ttyUSB7"


def test_two_devices_are_listed_not_guessed(monkeypatch):
    """Several found: all are named, none is opened."""
    _computer(monkeypatch, ("/dev/ttyUSB1", *OURS), ("/dev/ttyUSB2", *OURS))
    with raises(DeviceError, "several devices"):
        open_device("auto")


def test_no_device_points_to_the_bench(monkeypatch):
    """None found: what is there, and the virtual bench as a way on."""
    _computer(monkeypatch, ("/dev/ttyUSB0", 0x1A86, 0x7523))
    with raises(DeviceError, "no device"):
        open_device("auto")


def test_an_absent_port(monkeypatch):
    """The ports that are there are named."""
    _computer(monkeypatch, ("/dev/ttyS9", None, None))
    with raises(DeviceError, "no such port", port="/dev/ttyUSB42 (ports here: /dev/ttyS9)"):
        open_device("/dev/ttyUSB42")


def test_a_busy_port(wire):
    """A second program on the port is told so."""
    path = wire("bench:").bench.path
    with raises(DeviceError, "port is busy", port=path):
        SerialTransport(path)


@pytest.mark.parametrize(
    "error",
    [
        OSError(errno.EBUSY, "Device or resource busy"),
        OSError(errno.EAGAIN, "Resource temporarily unavailable"),
        OSError("Could not exclusively lock port"),
    ],
)
def test_a_busy_port_is_told_by_a_number_or_by_words(error):
    """Systems and libraries differ in which of them they give."""
    told(ports.cannot_open("/dev/ttyUSB0", error), "port is busy", port="/dev/ttyUSB0")


def test_a_port_without_its_folder_is_offered_only_where_there_is_one(monkeypatch):
    """Of one that is not there either, both names are told."""
    monkeypatch.setattr(ports, "list_ports", list)
    monkeypatch.setattr(ports.Path, "exists", lambda path: path == ports.Path("/dev/ttyUSB0"))
    there, absent = (
        ports.cannot_open(name, FileNotFoundError(errno.ENOENT, "No such file"))
        for name in ("ttyUSB0", "ttyUSB1")
    )
    assert there.message == "there is no port ttyUSB0 (ports here: none)"
    assert there.hint.startswith("write its path: `port` /dev/ttyUSB0; ")
    assert absent.message == "there is no port ttyUSB1, nor /dev/ttyUSB1 (ports here: none)"
    assert "write its path" not in absent.hint


def test_a_busy_port_is_listed_as_busy(monkeypatch, wire):
    """The list says so without opening the port."""
    path = wire("bench:").bench.path
    _computer(monkeypatch, (path, *OURS))
    assert list_ports()[0].status == "busy"


def test_a_port_without_permission():
    """The group's name is in the remedy."""
    error = ports.cannot_open("/dev/ttyUSB0", PermissionError(errno.EACCES, "Permission denied"))
    told(error, "no permission", port="/dev/ttyUSB0")


def test_something_that_is_no_port(tmp_path):
    """A plain file is not a serial port; neither is nonsense."""
    plain = tmp_path / "notes.txt"
    plain.touch()
    with raises(DeviceError, "not a serial port", port=plain):
        SerialTransport(str(plain))
    with raises(DeviceError, "not a port", port="gopher://somewhere"):
        SerialTransport("gopher://somewhere")


def test_a_socket_nobody_listens_on():
    """Host and port are what to check."""
    with raises(DeviceError, "out of reach", port="socket://127.0.0.1:9"):
        SerialTransport("socket://127.0.0.1:9")


@pytest.fixture
def carrier(wire):
    """A real-time bench behind socket://: its hand-held wire, its port, and an event that pulls the cable."""
    one = wire("bench:?speed=real")
    server = socket.create_server(("127.0.0.1", 0))
    pulled = threading.Event()

    def carry() -> None:
        peer, _ = server.accept()
        with peer:
            peer.settimeout(0.002)
            while not pulled.is_set():
                with contextlib.suppress(TimeoutError):
                    data = peer.recv(4096)
                    if not data:
                        return
                    one.transport.write(data)
                came = one.transport.read()
                if came:
                    peer.sendall(came)

    thread = threading.Thread(target=carry, daemon=True)
    thread.start()
    yield one, f"socket://127.0.0.1:{server.getsockname()[1]}", pulled
    pulled.set()
    thread.join(timeout=5)
    server.close()


def test_a_device_behind_a_socket(carrier):
    """socket:// is a port like any other: greeting, a play, nothing lost."""
    _, port, _ = carrier
    with open_device(port) as device:
        recording = device.play(np.linspace(0, 1, 500), 1000)
    assert recording.complete
    assert (len(recording.tick), recording.dropped_samples) == (500, 0)


def test_a_cable_pulled_in_mid_play(carrier):
    """The device lives on without its host: it switches off by itself, latched; the host keeps what came."""
    one, port, pulled = carrier

    def pull(block: Block) -> None:
        if block.tick[-1] > 3000:
            pulled.set()

    with open_device(port) as device:
        recording = device.play(np.full(20_000, 0.5), 1000, on_block=pull)
    assert not recording.complete
    assert "gone" in recording.fault or "did not answer" in recording.fault
    assert "by itself" in recording.remedy
    assert 300 <= len(recording.tick) < 4000
    status = one.wait_for(State.FAULT)
    assert Fault(status.fault) == Fault.HEARTBEAT
    assert status.fault_tick - recording.tick[-1] < 2000 + 1500  # 200 ms after the last command, not later
    assert one.beat().state == State.FAULT


def test_a_kind_of_port_announces_itself():
    """The device opens no simulation of its own: a scheme that nobody announced is a usage error."""
    script = (
        "from pulsetrainer.device.opening import open_device\n"
        "from pulsetrainer.errors import UsageError\n"
        "try:\n    open_device('bench:')\nexcept UsageError:\n    print('unknown')\n"
        "import pulsetrainer.simulation\n"
        "with open_device('bench:') as device:\n    print(device.info.serial)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["unknown", "BENCH-0"]


def test_announcing_simulations_loads_nothing():
    """Whoever imports the simulations pays for them only when one is opened."""
    script = (
        "import sys, pulsetrainer.simulation\n"
        "print(*{'numpy', 'serial', 'subprocess', 'cobs'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


@pytest.mark.parametrize("port", ["/dev/ttyUSB0", "COM3", "socket://127.0.0.1:9", "/dev/by-path/usb-0:1"])
def test_what_names_no_scheme_is_a_serial_port(port):
    """Colons in paths and in the addresses of sockets are no schemes."""
    assert find_opener(port) is None


@pytest.mark.parametrize("port", ["bench", "bench?seed=3", "BENCH:", "Bench"])
def test_a_bench_without_its_colon_or_in_capitals_is_no_serial_port(port):
    """A dry run opens nothing, and has to refuse it too."""
    with pytest.raises(DeviceError) as caught:
        find_opener(port)
    assert "`port` bench:" in caught.value.hint or "`port` 'bench:?seed=3'" in caught.value.hint


def test_an_opened_port_closes_what_runs_behind_it():
    """Also when giving the line back fails."""
    ended = []

    class Line:
        def close(self) -> None:
            raise OSError(errno.EIO, "")

    class Machine:
        def close(self) -> None:
            ended.append(1)

    with pytest.raises(OSError) as caught:  # noqa: PT011 - its number is held
        OpenPort(Line(), "x:", machine=Machine()).close()
    assert (caught.value.errno, ended) == (errno.EIO, [1])
