"""One command at work: files checked first, inputs loaded, the result saved with where it came from."""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from os.path import realpath
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import typer

from pulsetrainer.cli.console import Screen, plain, say, shows_unicode
from pulsetrainer.cli.next_step import as_options, with_files
from pulsetrainer.cli.outputs import check_ending, check_keeps_inputs
from pulsetrainer.errors import UsageError
from pulsetrainer.files.atomic_write import check_output
from pulsetrainer.files.input_file import check_artefact, check_file

if TYPE_CHECKING:
    from pulsetrainer.artefacts import FloatArray, Model
    from pulsetrainer.cli.live import Live
    from pulsetrainer.cli.loop_view import LoopView
    from pulsetrainer.device.device import Device
    from pulsetrainer.device.identity import DeviceInfo
    from pulsetrainer.device.limits import Limits
    from pulsetrainer.files.provenance import Header

K = TypeVar("K")
# what is no parameter of the work: files have digests, a port may hold what no file may know
_NOT_PARAMETERS = {"json", "overwrite", "port", "dry_run", "resume", "out", "html"}


class Job:
    """What every command does besides its one verb.

    Making it checks port, outputs and, by their first bytes, inputs: before anything heavy is loaded.

    UsageError where the port makes no sense, or an output exists and ``overwrite`` is not set, or it cannot
    be written; DataError where an input is not there or cannot be what it should be.
    """

    def __init__(
        self,
        context: typer.Context,
        *,
        inputs: Sequence[Path | None] = (),
        tables: Sequence[Path | None] = (),
        outputs: Sequence[Path | None] = (),
    ) -> None:
        given = self._parameters = context.params
        self.screen = Screen(str(context.info_name), as_json=given["json"])
        self.overwrite = bool(given.get("overwrite"))
        self.port: str | None = given.get("port")
        self._settings: Path | None = context.find_root().obj
        self._artefacts: list[Path] = []  # loaded, in their order
        self._tables: list[Path] = []
        if self.port:
            from pulsetrainer.simulation.options import check_port

            check_port(self.port)
        written = [path for path in outputs if path is not None]
        for path in written:
            check_ending(path, context)
        if len(set(map(realpath, written))) < len(written):
            raise UsageError(
                f"{written[0]} was named for two outputs", hint="name another file for one of them"
            )
        check_keeps_inputs(written, list(filter(None, (*inputs, *tables))), context)
        for path in written:
            check_output(path, self.overwrite)
        for path in filter(None, inputs):
            check_artefact(path)
        for table in filter(None, tables):
            check_file(table)
        self.seconds = 0.0

    @property
    def limits(self) -> Limits:
        """The limits that were asked for."""
        from pulsetrainer.device.limits import Limits

        return Limits(self._parameters["limit_current_A"], self._parameters["limit_force_N"])

    @contextmanager
    def working(self, label: str, view: LoopView | Live | None = None) -> Iterator[Any]:
        """Give a callable that takes the share of the work done, and measure how long it takes.

        It moves a bar, or ``view`` where there is one.
        """
        begun = time.perf_counter()
        with self.screen.bar(label) if view is None else view.on_screen(label) as progress:
            yield progress
        self.seconds = time.perf_counter() - begun

    def open_device(self, model: Model | None = None, *, by_key: bool = False) -> Device:
        """Open a device, as ``api.open_device``, with the gains that the file of settings has for it.

        It is said where what is to be played was made for another one: with a ``model`` of that. For
        a person at the keys, ``by_key``, a bench keeps pace with the clock.
        """
        from pulsetrainer.api import open_device
        from pulsetrainer.device.gains import DELIVERED
        from pulsetrainer.device.opening import DEFAULT_PORT
        from pulsetrainer.simulation.options import in_real_time

        port = in_real_time(self.port or DEFAULT_PORT) if by_key else self.port
        device = open_device(port, limits=self.limits, tuned=self._settings)
        if self._settings is not None and device.gains != DELIVERED:
            self.notes([f"{device.info.serial} plays with the gains in {self._settings}"])
        elif self._settings is not None:
            from pulsetrainer.files.tuning import read_tuned

            known = read_tuned(self._settings)
            if known and device.info.serial not in known:
                said = f"{self._settings} has gains for {', '.join(known)} and none for {device.info.serial}"
                self.notes([f"{said}, which plays with those delivered; `pulsetrainer tune` measures it"])
        this = device.info.serial
        if model is not None and model.serial not in ("", this):
            self.notes([f"the model is of {model.serial}, but this is {this}, whose force is different"])
        return device

    def one_device(self, models: Mapping[Path, Any], runs: Mapping[Path, Any]) -> None:
        """Say which runs were recorded on another device than a model is of."""
        for model, run in itertools.product(models.items(), runs.items()):
            of, on = (getattr(one[1], "serial", "") for one in (model, run))
            if of and on and of != on:
                self.notes([f"{model[0]} is of {of}, but {run[0]} was recorded on {on}: two devices differ"])

    def alike(self, files: Sequence[Path]) -> None:
        """Say which files are the same, byte for byte: between them nothing can differ."""
        from pulsetrainer.files.provenance import same_files

        twice = map(" and ".join, same_files(files))
        self.notes([f"{names} are the same file, so nothing differs between them" for names in twice])

    def check_device(self) -> None:
        """Refuse what ``open_device`` would by port, limits and file of settings alone: nothing is opened."""
        from pulsetrainer.api import check_device

        check_device(self.port, limits=self.limits, tuned=self._settings)

    def view(self, *ends: float, live: bool) -> LoopView | None:
        """Return a live view with these ends of its axes, if asked for and the terminal can show it."""
        if not live or self.screen.as_json or not sys.stderr.isatty():
            return None
        from pulsetrainer.cli.loop_view import SMALLEST, LoopView

        view = LoopView(*ends)
        if view.fits and shows_unicode():
            return view
        least = " x ".join(map(str, SMALLEST))
        say("note: ", f"no live view: it needs a terminal of {least} characters that shows Unicode")
        return None

    def load(self, path: Path, kind: type[K]) -> K:
        """Return the artefact of this kind in an input file; raises as ``store.read``."""
        return self.load_any(path, kind)

    def load_any(self, path: Path, *kinds: type) -> Any:
        """Return the artefact in an input file, of any of these kinds; no kind named: of whatever kind."""
        from pulsetrainer.files import store

        self._artefacts.append(path)
        return store.read_one_of(path, *kinds) if kinds else store.read_any(path)

    def uses(self, *paths: Path) -> None:
        """Name files that are no artefacts, but that the result is made from."""
        self._tables += paths

    def know(self, name: str, value: Any) -> None:
        """Name a parameter of the work that the command line left open."""
        self._parameters = {**self._parameters, name: value}

    def header(
        self, title: str, device: DeviceInfo | None = None, *, ancestors: Sequence[Header] = ()
    ) -> Header:
        """Return what the result says of itself: command, parameters, inputs with their history, device."""
        from pulsetrainer.device.schemes import redact
        from pulsetrainer.files import provenance, store

        parameters = {
            name: plain(value)
            for name, value in self._parameters.items()
            if name not in _NOT_PARAMETERS
            and not isinstance(value[0] if isinstance(value, list | tuple) and value else value, Path)
        }
        made_from = [store.read_header(path) for path in self._artefacts]
        measurer = None
        if device is not None:
            measurer = provenance.Device(device.serial, device.firmware, redact(self.port or ""))
        return provenance.make_header(
            title,
            argv=sys.argv[1:],
            now=datetime.now(UTC),
            parameters=parameters,
            seed=parameters.get("seed"),
            inputs=provenance.digests([*self._artefacts, *self._tables]),
            ancestors=[*made_from, *ancestors],
            device=measurer,
            libraries=provenance.library_versions(),
        )

    def save(self, path: Path | None, noun: Any, title: str, device: DeviceInfo | None = None) -> Header:
        """Write an artefact, if there is a file to write it to, and return its header."""
        from pulsetrainer.files import store

        header = self.header(title, device)
        if path is not None:
            store.write(path, noun, header, overwrite=self.overwrite)
        return header

    def write(self, path: Path, content: bytes | str) -> None:
        """Write a figure, a page or a table: whole, or not at all."""
        from pulsetrainer.files.atomic_write import replacing

        with replacing(path, overwrite=self.overwrite) as temporary:
            temporary.write_bytes(content.encode() if isinstance(content, str) else content)

    def table(self, path: Path, noun: Any, source: Path) -> Mapping[str, FloatArray]:
        """Write the series of an artefact as CSV, and return its columns."""
        from pulsetrainer.files import store
        from pulsetrainer.files.series import series_of
        from pulsetrainer.files.table import write_table
        from pulsetrainer.report.names import headed

        columns = series_of(noun)
        title = headed(noun.kind, store.read_header(source).title)
        write_table(path, columns, comments=(title,), overwrite=self.overwrite)
        return columns

    def page(self, path: Path, render: Callable[..., str], noun: Any, header: Header) -> None:
        """Write the page about an artefact."""
        said = {name: getattr(header, name) for name in ("title", "created", "history")}
        self.write(path, render(noun, provenance_json=header.provenance.to_json(), **said))

    def would(self, what: str, plan: Any, rows: Mapping[str, Any], **besides: Any) -> None:
        """Say what a dry run would have played, and where; ``besides`` is for JSON."""
        from pulsetrainer.device.opening import DEFAULT_PORT
        from pulsetrainer.device.schemes import redact

        port, out = self.port or DEFAULT_PORT, self._parameters["out"]
        current = f"{plan.peak_current_A:.3f} A at most, {plan.rms_current_A:.3f} A rms"
        self.show(
            besides | plain(plan) | {"port": redact(port), "output": out, "dry_run": True},
            f"would {what} on {port}{f' and write {out}' if out else ''}; nothing was done",
            {**rows, "current": current},
        )

    def show(self, payload: Mapping[str, Any], title: str, rows: Mapping[str, Any]) -> None:
        """Say the result: ``payload`` to a script, ``title`` and ``rows`` to a person."""
        self.screen.result(payload)
        self.screen.facts(title, rows)

    def wrote(self, *paths: Path | None) -> None:
        """Say which files there are now."""
        for path in paths:
            if path is not None:
                self.screen.whole(f"wrote {path}")

    def left_over(self, out: Path, kind: type, said: str) -> None:
        """Say what programs that were killed left beside an output, of this kind: ``said`` names it."""
        from pulsetrainer.artefacts.units import counted
        from pulsetrainer.files.recorder import interrupted

        for left, samples in interrupted(out, kind):
            self.notes([f"{left} holds {counted(samples, 'sample')} of {said.format(left=left)}"])

    def notes(self, lines: Sequence[str], lead: str = "note: ") -> None:
        """Say what a verb has to tell, a line each, on stderr."""
        for line in lines:
            say(lead, as_options(with_files(line, self._parameters)))
