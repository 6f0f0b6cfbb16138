"""Options that several commands share, each with its help."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Out = Annotated[Path, typer.Option("-o", "--out", help="File to write.", show_default=False)]
Force = Annotated[bool, typer.Option("--force", help="Replace an existing output.")]
AsJson = Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")]
Port = Annotated[
    str | None,
    typer.Option(
        "--port",
        help="bench: (default), bench:?seed=3, qemu:, /dev/ttyUSB0, COM3 or socket://host:port.",
        envvar="PULSETRAINER_PORT",
        show_default=False,
    ),
]
