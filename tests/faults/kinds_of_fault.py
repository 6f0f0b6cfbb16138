"""The faults: each is tried many times from a seed and counts what was lost, halved, hung or told wrongly."""

from __future__ import annotations

import contextlib
import fcntl
import os
import random
import re
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import children
import ready
from children import DOCUMENTED, Child, Ended

from command_lines import EXCITATION, READS_ONLY, WRITERS, Writer
from pulsetrainer.errors import DataError
from pulsetrainer.files import journal, store
from pulsetrainer.files.checksum import CHECKSUM_LENGTH

_SETTLE_S = 0.004  # the moments around a new file's appearance


@dataclass
class Tally:
    """One row of the table."""

    fault: str
    tries: int = 0
    lost: int = 0  # older artefacts that are gone
    half_written: int = 0  # under the final name
    hangs: int = 0
    wrong_exits: int = 0  # wrong code, no message, or a traceback
    busy: int = 0  # the device stopped because this computer was too busy, and said so
    seconds: float = 0.0
    complaints: list[str] = field(default_factory=list)
    slow: list[str] = field(default_factory=list)  # what took long, though it ended
    commands: list[str] = field(default_factory=list)  # what it was tried on, where that is all of them

    def blame(self, what: str, done: Ended | None = None) -> None:
        """Keep the first reasons for a count above zero."""
        said = (
            "" if done is None else f" `{' '.join(done.words)}` ended with {done.code}: {done.err[-400:]!r}"
        )
        self.complaints.append(what + said)

    def judge(self, done: Ended, allowed: tuple[int, ...]) -> None:
        """Count a hang, a code that is not allowed, a message that is none."""
        if done.code == 4 and "too busy" in done.err and done.spoke:
            self.busy += 1  # the device's own safety: the reference did not arrive in time
        elif done.hung:
            self.hangs += 1
            self.blame("hung:", done)
        elif done.code not in allowed or not done.spoke:
            self.wrong_exits += 1
            self.blame(f"expected one of {allowed}:", done)

    def look(self, path: Path, older: bytes | None) -> None:
        """Count what is wrong under a final name."""
        if not path.exists():
            if older is not None:
                self.lost += 1
                self.blame(f"{path.name} is gone")
        elif path.read_bytes() != older and not ready.whole(path):
            self.half_written += 1
            self.blame(f"{path.name} is half-written")

    def look_into(self, recording: Path, kind: str) -> None:
        """Count a recording that cannot be read, or that reads as another kind, though it holds samples."""
        if not any(block.samples.size for block in journal.blocks(recording)):
            return
        try:
            kept = store.read_any(recording)
        except DataError as error:
            self.lost += 1
            self.blame(f"{recording.name} cannot be read: {error.message}")
            return
        if kept.kind != kind or kept.complete:
            self.half_written += 1
            self.blame(f"{recording.name} reads as a {kind if kept.complete else kept.kind}")

    @property
    def clean(self) -> bool:
        """Whether nothing went wrong."""
        return not (self.lost or self.half_written or self.hangs or self.wrong_exits)


@dataclass(frozen=True)
class World:
    """What all faults need."""

    ready: Path  # one artefact of every kind
    seconds: dict[str, float]  # how long each command takes
    scratch: Path
    rng: random.Random

    @contextlib.contextmanager
    def folder(self, writer: Writer) -> Iterator[Path]:
        """Give an empty folder with what a command reads."""
        folder = self.scratch / f"{self.rng.getrandbits(48):012x}"
        folder.mkdir()
        ready.copy_inputs(self.ready, folder, writer.reads)
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def order(self, writers: Sequence[Writer]) -> list[Writer]:
        """Shuffle the commands, so that a few tries meet other ones with every seed."""
        return self.rng.sample(writers, len(writers))

    @property
    def log(self) -> Path:
        """Where a child's output goes."""
        return self.scratch / "log"


def readers() -> list[Writer]:
    """Return the commands that read an artefact."""
    return [one for one in (*WRITERS, *READS_ONLY) if any(name.endswith(".h5") for name in one.reads)]


def outputs(writer: Writer, folder: Path) -> list[Path]:
    """Final names of a command."""
    return [folder / name for _, name in writer.outputs]


def put_older(writer: Writer, folder: Path) -> dict[Path, bytes]:
    """Lay older files under the final names and return them."""
    older = {path: f"the older {path.name}\n".encode() * 50 for path in outputs(writer, folder)}
    for path, content in older.items():
        path.write_bytes(content)
    return older


def leftovers(folder: Path) -> list[Path]:
    """Temporary files that a dead process left."""
    return [path for path in folder.iterdir() if path.name.endswith(".tmp")]


# --- kill -9 ----------------------------------------------------------------------------------------------


def kill(world: World, tries: int, writer: Writer, *, older: bool) -> Tally:
    """Kill -9 at random moments of the whole run, every other time around the moment when a file appears."""
    tally = Tally(f"kill -9 {writer.name}{', older file there' if older else ''}")
    for number in range(tries):
        with world.folder(writer) as folder:
            before = put_older(writer, folder) if older else {}
            names = {path.name for path in folder.iterdir()}
            child = Child(folder, writer.line(force=older), world.log)
            if number % 2:
                _until_new_file(child, folder, names, skip=world.rng.randrange(len(writer.outputs)))
                time.sleep(world.rng.uniform(0, _SETTLE_S))
            else:
                time.sleep(world.rng.uniform(0, 1.05) * world.seconds[writer.name])
            child.kill()
            done = child.wait()
            tally.tries += 1
            if done.code not in (0, -9):
                tally.judge(done, (0, -9))
            for path in outputs(writer, folder):
                tally.look(path, before.get(path))
            for path in _recordings(folder):
                tally.look_into(path, "session" if writer.words[0] == "session" else "run")
            _go_on(world, writer, folder, tally)
    return tally


def _until_new_file(child: Child, folder: Path, names: set[str], *, skip: int) -> None:
    """Wait until the command has made its first file, or the one after it."""
    wanted = len(names) + 1 + skip
    while not child.ended() and sum(1 for _ in folder.iterdir()) < wanted:
        time.sleep(0.0001)


def _recordings(folder: Path) -> list[Path]:
    """Recordings that a dead process left."""
    return [path for path in folder.iterdir() if ".partial" in path.name]


def _go_on(world: World, writer: Writer, folder: Path, tally: Tally) -> None:
    """After a kill the same command works; nothing of the dead one stays but a recording, which is named."""
    dead, recordings = leftovers(folder), _recordings(folder)
    if not dead and not recordings:
        return
    if writer.name == "capture (long)" and recordings:
        done = children.run(folder, (*writer.line(force=False), "--resume", "--overwrite"), world.log)
        if done.code in (2, 3) and not any(".partial" in path.name for path in folder.iterdir()):
            # killed before the first sample: nothing to go on with
            done = children.run(folder, writer.line(force=True), world.log)
    else:
        done = children.run(folder, writer.line(force=True), world.log)
    tally.judge(done, (0,))
    for path in outputs(writer, folder):
        tally.look(path, b"")
    for path in leftovers(folder):
        tally.half_written += 1
        tally.blame(f"{path.name} was not swept")
    for path in folder.iterdir():
        if ".partial" in path.name and path.name not in done.err:
            tally.half_written += 1
            tally.blame(f"{path.name} was not named", done)


# --- no room, no permission ---------------------------------------------------------------------------------


@contextlib.contextmanager
def small_disk(world: World, kilobytes: int) -> Iterator[Path]:
    """Mount a small disk in memory; only root may."""
    disk = world.scratch / "disk"
    disk.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", disk], check=True)
    try:
        yield disk
    finally:
        subprocess.run(["umount", "--lazy", disk], check=True)


def full_disk(world: World, tries: int) -> Tally:
    """Write onto a disk with less room than the output needs, or just enough."""
    tally = Tally("full disk (tmpfs)")
    writers = world.order(WRITERS)
    for number in range(tries):
        writer = writers[number % len(writers)]
        room = world.rng.choice([4, 8, 16, 32, 64, 128, 512, 1024, 1200, 1500, 2048, 4096])
        with world.folder(writer) as folder, small_disk(world, room) as disk:
            older = world.rng.random() < 0.5
            before: dict[Path, bytes] = {}
            for path in outputs(writer, disk) if older else ():
                before[path] = b"the older one"
                path.write_bytes(before[path])
            done = children.run(folder, writer.line(force=older, folder=f"{disk}/"), world.log)
            tally.tries += 1
            tally.judge(done, (0, 3))
            _look_after(tally, writer, disk, before, done)
    return tally


def _look_after(tally: Tally, writer: Writer, folder: Path, before: dict[Path, bytes], done: Ended) -> None:
    """Judge what is on a disk after a command that ended by itself."""
    for path in outputs(writer, folder):
        tally.look(path, before.get(path))
        if done.code == 0 and (not path.exists() or not ready.whole(path)):
            tally.wrong_exits += 1
            tally.blame(f"{path.name} is not there though all was well:", done)
    for path in leftovers(folder):
        tally.half_written += 1
        tally.blame(f"{path.name} was left behind", done)


def quota(world: World, tries: int) -> Tally:
    """Let every file end at a random size, as a quota does."""
    tally = Tally("full quota (RLIMIT_FSIZE)")
    writers = world.order(WRITERS)
    for number in range(tries):
        writer = writers[number % len(writers)]
        limit = world.rng.choice([5000, 10_000, 20_000, 60_000, 200_000, 600_000])
        with world.folder(writer) as folder:
            older = put_older(writer, folder) if world.rng.random() < 0.5 else {}
            line = writer.line(force=bool(older))
            done = children.run(folder, line, world.log, children.file_size_limit(limit))
            tally.tries += 1
            tally.judge(done, (0, 3))
            _look_after(tally, writer, folder, older, done)
    return tally


def read_only(world: World, tries: int) -> Tally:
    """Write into a folder that cannot be written: a disk mounted read-only, or no permission."""
    tally = Tally("read-only folder")
    writers = world.order(WRITERS)
    for number in range(tries):
        writer = writers[number % len(writers)]
        older = world.rng.random() < 0.5
        with world.folder(writer) as folder, _read_only_disk(world, writer, older) as (disk, before):
            done = children.run(folder, writer.line(force=older, folder=f"{disk}/"), world.log)
            tally.tries += 1
            tally.judge(done, (2,))
            for path, content in before.items():
                tally.look(path, content)
    return tally


@contextlib.contextmanager
def _read_only_disk(world: World, writer: Writer, older: bool) -> Iterator[tuple[Path, dict[Path, bytes]]]:
    if os.geteuid() != 0:
        disk = world.scratch / "closed"
        disk.mkdir(exist_ok=True)
        before = put_older(writer, disk) if older else {}
        disk.chmod(0o555)
        try:
            yield disk, before
        finally:
            disk.chmod(0o755)
        return
    with small_disk(world, 512) as disk:
        before = put_older(writer, disk) if older else {}
        subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
        yield disk, before


# --- bad inputs -------------------------------------------------------------------------------------------


def truncated(world: World, tries: int) -> Tally:
    """Feed every reader a file that was cut at a random byte."""
    return _damaged(world, tries, "truncated input", _cut)


def flipped(world: World, tries: int) -> Tally:
    """Feed every reader a file of which some bits were flipped."""
    return _damaged(world, tries, "bit-flipped input", _flip)


def without_checksum(world: World, tries: int) -> Tally:
    """The same without the checksum that would tell: whatever is in the file, an answer in words."""

    def damage(data: bytes, rng: random.Random) -> bytes:
        return _flip(data[:-CHECKSUM_LENGTH], rng)

    return _damaged(world, tries, "bit-flipped, no checksum", damage)


def _cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) - CHECKSUM_LENGTH)]


def _flip(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.choice([1, 1, 4, 64])):
        changed[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _damaged(world: World, tries: int, fault: str, damage: Callable[[bytes, random.Random], bytes]) -> Tally:
    able = world.order(readers())
    tally = Tally(fault)
    for number in range(tries):
        writer = able[number % len(able)]
        with world.folder(writer) as folder:
            victim = folder / world.rng.choice([name for name in writer.reads if name.endswith(".h5")])
            data = victim.read_bytes()
            victim.write_bytes(damage(data, world.rng))
            older = put_older(writer, folder)
            done = children.run(folder, writer.line(force=bool(older)), world.log)
            tally.tries += 1
            # a bit of the checksum, or of a file without one, may hit nothing that counts
            lenient = (0, 3, 5) if fault.startswith("bit") else (3,)
            tally.judge(done, lenient)
            _look_after(tally, writer, folder, older, done)
    return tally


def damaged_recording(world: World, tries: int) -> Tally:
    """Show, use and resume what a killed capture or session left, cut anywhere or with flipped bits."""
    tally = Tally("damaged recording")
    resume = Writer("resume", (*EXCITATION, "--resume"), (("-o", "out.h5"),), (ready.CUT_OFF,))
    identify = ("identify", ready.CUT_OFF, "--levels", "12")
    able = (
        Writer("show", ("show", ready.CUT_OFF), (), (ready.CUT_OFF,)),
        Writer("sheet", ("evaluate", ready.CUT_SESSION), (("--html", "out.html"),), (ready.CUT_SESSION,)),
        Writer("identify", identify, (("-o", "model.h5"),), (ready.CUT_OFF,)),
        resume,
    )
    for number in range(tries):
        writer = able[number % len(able)]
        with world.folder(writer) as folder:
            victim, is_cut = folder / writer.reads[0], number // len(able) % 2 == 0
            data = victim.read_bytes()
            victim.write_bytes(data[: world.rng.randrange(len(data))] if is_cut else _flip(data, world.rng))
            found = victim.read_bytes()
            done = children.run(folder, writer.line(force=False), world.log)
            tally.tries += 1
            # a cut one is shorter or holds nothing; damage is never passed over
            tally.judge(done, (0, 2, 3, 5) if is_cut else (2, 3))
            _look_after(tally, writer, folder, {}, done)
            if not is_cut and (not victim.exists() or victim.read_bytes() != found):
                tally.lost += 1
                tally.blame("a damaged recording was changed:", done)
    return tally


# --- others at the same time ------------------------------------------------------------------------------


def together(world: World, tries: int) -> Tally:
    """Two processes write one output at the same time: the first wins, with --overwrite the last one."""
    tally = Tally("two processes, one output")
    writers = world.order(WRITERS)
    for number in range(tries):
        writer, force = writers[number % len(writers)], number // len(writers) % 2 == 1
        with world.folder(writer) as folder:
            first = Child(folder, writer.line(force=force), Path(f"{world.log}-1"))
            time.sleep(world.rng.choice([0, 0, world.rng.uniform(0, world.seconds[writer.name])]))
            second = Child(folder, writer.line(force=force), Path(f"{world.log}-2"))
            ends = first.wait(), second.wait()
            tally.tries += 1
            for done in ends:
                tally.judge(done, (0,) if force else (0, 2))
            if all(done.code not in (0, 4) for done in ends) and len(writer.outputs) == 1:
                tally.wrong_exits += 1
                tally.blame("neither won:", ends[0])
            for path in outputs(writer, folder):
                tally.look(path, b"")
            for path in leftovers(folder):
                tally.half_written += 1
                tally.blame(f"{path.name} was left behind")
    return tally


def locked(world: World, tries: int) -> Tally:
    """An input is locked by another process, as by a network drive: said so; an output is replaced."""
    tally = Tally("locked by another process")
    able = world.order(readers())
    for number in range(tries):
        writer = able[number % len(able)]
        with world.folder(writer) as folder, contextlib.ExitStack() as held:
            older = put_older(writer, folder)
            reads = number // len(able) % 2 == 0
            victim = folder / next(n for n in writer.reads if n.endswith(".h5"))
            if not reads and older:
                victim = next(iter(older))
            stream = held.enter_context(victim.open("rb+"))
            fcntl.flock(stream, fcntl.LOCK_EX)
            done = children.run(folder, writer.line(force=bool(older)), world.log)
            tally.tries += 1
            tally.judge(done, (3,) if reads or not older else (0,))
            if done.code == 3 and not re.search("locked by another program", done.err):
                tally.wrong_exits += 1
                tally.blame("the lock is not named:", done)
            _look_after(tally, writer, folder, older, done)
    return tally


def documented(done: Ended) -> bool:
    """Whether a command ended with a code of the contract, in words."""
    return done.code in DOCUMENTED and done.spoke
