"""Random command lines, tables and artefacts: an answer in words and a code of the contract, in time."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import children
import h5py
import numpy as np
import ready
import typer
from kinds_of_fault import Tally, World, documented, readers

from command_lines import READS_ONLY, WRITERS, Writer
from pulsetrainer.cli import app

_NUMBERS = (
    "0", "1", "-1", "2", "3", "1e308", "-1e308", "1e-308", "nan", "inf", "-inf", "0.5", "1000000", "1e9",
    "12", "999999999999", "-999999999999", "48", "1_0", "0x10", "1,5", "", " ", "٣", "1e", "--", "9" * 400,
)  # fmt: skip
_TEXTS = (
    "run.h5", "model.h5", "drive.h5", "played.h5", "evaluation.h5", "diagnosis.h5", "run.csv", "absent.h5",
    "", " ", ".", "..", "/", "/dev/null", "/dev/full", "/proc/self/mem", "x" * 5000, "ä\u0301€𝄞", "\udc80bad",
    "[bold]", "%s%n", "--json", "-o", "a\nb", "\x1b[2J", "identification", "diagnostic", "normal", "bench:",
    "bench:?", "bench:?seed=x", "bench:?speed=real", "qemu:?nonsense", "socket://", "socket://nowhere.invalid:1",
    "/dev/ttyNONE", "COM99", "auto:", "joint", "relay", "auto", "1", "nan", "out.png", "out.pdf", "out.svg",
    "no/such/folder/out.h5", "run.h5/out.h5",
)  # fmt: skip
_SLOW_S = 10.0
_MAIN_OPTIONS = (
    "--debug",
    "--verbose",
    "--version",
    "--help",
    "--json",
    "--overwrite",
    "--force",
    "--nonsense",
    "-x",
    "--settings",
)


def arguments(world: World, tries: int) -> Tally:
    """Run random command lines: real commands and options, values of all kinds, words missing or twice."""
    tally = Tally("fuzzed arguments")
    commands = typer.main.get_command(app.app).commands  # every one there is: none can be forgotten
    names = world.rng.sample(list(commands), len(commands))
    tally.commands = sorted(names)
    for number in range(max(tries, len(names))):
        name = names[number % len(names)]
        good = next((w for w in (*WRITERS, *READS_ONLY) if w.words[0] == name), None)
        _try(world, tally, _line(world.rng, name, commands[name].params, good))
    return tally


def values(world: World, tries: int) -> Tally:
    """Give good command lines one more option: all that take a value, with every number, in any order."""
    tally = Tally("fuzzed values")
    commands = typer.main.get_command(app.app).commands
    lines = [
        (*one.line(force=False), parameter.opts[0], number)
        for one in {line.words[0]: line for line in reversed(WRITERS)}.values()
        for parameter in _valued(commands[one.words[0]].params)
        for number in _NUMBERS
    ]
    tally.commands = sorted({line[0] for line in lines})
    for words in world.rng.sample(lines, min(tries, len(lines))):
        _try(world, tally, words)
    return tally


def _try(world: World, tally: Tally, words: tuple[str, ...]) -> None:
    """Run a command line in a folder with an artefact of each kind, and count what is wrong with its end."""
    names = tuple(path.name for path in world.ready.iterdir() if path.suffix in {".h5", ".csv"})
    with world.folder(Writer("all", (), (), names)) as folder:
        done = children.run(folder, words, world.log)
        tally.tries += 1
        if done.seconds > _SLOW_S:
            tally.slow.append(f"{done.seconds:.0f} s, code {done.code}: {' '.join(words)[:300]}")
        if "--debug" in words:
            done = children.Ended(words, done.code, done.out, _untraced(done.err), done.seconds, done.hung)
        if done.hung or not documented(done):
            tally.judge(done, children.DOCUMENTED)
        for path in folder.iterdir():
            if path.name.endswith(".tmp") or (path.suffix == ".h5" and not ready.whole(path)):
                tally.half_written += 1
                tally.blame(f"{path.name!r} is half-written", done)


def _valued(parameters: list[Any]) -> list[Any]:
    """Return the options that take a value."""
    return [p for p in parameters if p.opts[0].startswith("-") and not getattr(p, "is_flag", False)]


def _untraced(err: str) -> str:
    """Return what was said beside the traceback that --debug asked for."""
    return err[err.rfind("error: ") :] if "Traceback" in err else err


def _line(rng: random.Random, name: str, parameters: list[Any], good: Writer | None) -> tuple[str, ...]:
    """Return a command line: a good one with something wrong, or a random one."""
    words = [name]
    if good is not None and rng.random() < 0.8:
        words = list(good.line(force=rng.random() < 0.5))
        valued = _valued(parameters)
        if valued and rng.random() < 0.7:  # all is well but for one value
            return (*words, rng.choice(rng.choice(valued).opts), rng.choice(_NUMBERS))
    for parameter in parameters:
        options = [o for o in (*parameter.opts, *parameter.secondary_opts) if o.startswith("-")]
        if rng.random() > (0.25 if options else 0.6):
            continue
        value = rng.choice(_NUMBERS if rng.random() < 0.5 else _TEXTS)
        if not options:
            words.append(value)
        elif getattr(parameter, "is_flag", False):
            words.append(rng.choice(options))
        else:
            words += [rng.choice(options), value]
    if rng.random() < 0.3:
        words.insert(rng.randrange(len(words) + 1), rng.choice(_MAIN_OPTIONS))
    if rng.random() < 0.2 and len(words) > 1:
        words.pop(rng.randrange(1, len(words)))
    return tuple(word.replace("\0", "") for word in words)


def tables(world: World, tries: int) -> Tally:
    """Import, capture and invert random tables."""
    tally = Tally("fuzzed tables")
    lines: tuple[tuple[str, ...], ...] = (
        ("import", "x.csv", "--input", "current_A", "--output", "force_N", "-o", "out.h5"),
        ("capture", "x.csv", "-o", "out.h5"),
        ("invert", "x.csv", "--model", "model.h5", "-o", "out.h5"),
    )
    for number in range(tries):
        with world.folder(Writer("x", (), (), ("model.h5",))) as folder:
            (folder / "x.csv").write_bytes(_table(world.rng))
            done = children.run(folder, lines[number % len(lines)], world.log)
            tally.tries += 1
            if done.hung or not documented(done):
                tally.judge(done, children.DOCUMENTED)
            if (folder / "out.h5").exists() and not ready.whole(folder / "out.h5"):
                tally.half_written += 1
                tally.blame("out.h5 is half-written", done)
    return tally


def _table(rng: random.Random) -> bytes:
    """Return a table in which anything may be wrong."""
    if rng.random() < 0.1:
        return rng.randbytes(rng.randrange(2000))
    comma = rng.choice([",", ";", "\t", " "])
    names = ["t_s", "current_A", "force_N"]
    if rng.random() < 0.3:
        rng.shuffle(names)
    step = rng.choice([1e-3, 1e-3, 1e-9, 1.0, 1e9, 0.0, -1.0])
    rows = [comma.join(names)] if rng.random() < 0.9 else []
    for k in range(rng.choice([0, 1, 2, 50, 300])):
        cells = [repr(k * step), f"{rng.uniform(0, 1.5):.4f}", f"{rng.uniform(0, 14):.3f}"]
        if rng.random() < 0.01:
            cells[rng.randrange(3)] = rng.choice([*_NUMBERS, '"', "#", "\x00"])
        if rng.random() < 0.003:
            cells.pop()
        rows.append(comma.join(cells))
    return "\n".join(rows).encode("utf-8", "surrogateescape")


def artefacts(world: World, tries: int) -> Tally:
    """Change values, shapes, types and names inside artefacts, and feed every reader with them."""
    tally = Tally("fuzzed artefacts")
    able = world.order(readers())
    for number in range(tries):
        writer = able[number % len(able)]
        with world.folder(writer) as folder:
            victim = folder / world.rng.choice([name for name in writer.reads if name.endswith(".h5")])
            what = _change(victim, world.rng)
            done = children.run(folder, writer.line(force=False), world.log)
            tally.tries += 1
            if done.hung or not documented(done):
                tally.judge(done, children.DOCUMENTED)
                tally.blame(f"  after {what} in {victim.name}")
            for _, name in writer.outputs:
                if (folder / name).exists() and not ready.whole(folder / name):
                    tally.half_written += 1
                    tally.blame(f"{name} is half-written after {what}", done)
    return tally


def _change(path: Path, rng: random.Random) -> str:
    """Change something in an HDF5 file and say what."""
    generator = np.random.default_rng(rng.getrandbits(32))
    with h5py.File(path, "r+") as file:
        names: list[str] = []
        file.visit(names.append)
        name = rng.choice(names)
        item = file[name]
        if rng.random() < 0.25:  # an attribute
            owner = rng.choice([file, item])
            key = rng.choice(list(owner.attrs)) if len(owner.attrs) else "kind"
            value = rng.choice([0, -1, 2**62, np.nan, np.inf, "", "x" * 300, np.arange(3), h5py.Empty("f8")])
            owner.attrs[key] = value
            return f"attribute {key} of {owner.name} = {value!r:.60}"
        if isinstance(item, h5py.Group) or rng.random() < 0.1:
            del file[name]
            return f"removal of {name}"
        kind = rng.choice(["values", "values", "shape", "type", "constant"])
        if kind == "values" and item.size:
            data = np.asarray(item[()], dtype=float)
            flat = np.atleast_1d(data).ravel()
            share = rng.choice([0.0, 0.01, 1.0])
            hit = generator.random(flat.size) < share
            hit[generator.integers(flat.size)] = True
            flat[hit] = rng.choice([np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-320, 0.0, -1.0, 1e6])
            changed = flat.reshape(data.shape)
        elif kind == "shape":
            changed = np.zeros(rng.choice([(0,), (1,), (7,), (2, 3), (0, 4), (100_000,)]))
        elif kind == "type":
            changed = rng.choice(
                [np.array(["a"], dtype=object), np.array([1 + 2j]), np.array([True]), np.array([3])]
            )
        else:
            changed = np.full(item.shape, rng.choice([0.0, 1.0, -5.0, 1e30]))
        attributes = {k: v for k, v in item.attrs.items() if k in ("units", "quantity", "dtype")}
        del file[name]
        fresh = file.create_dataset(name, data=changed)
        for key, value in attributes.items():
            fresh.attrs[key] = value
        return f"{kind} of {name}"
