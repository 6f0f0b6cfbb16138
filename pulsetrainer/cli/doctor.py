"""``pulsetrainer doctor``: what stands in the way, each with its fix."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Annotated

from typer import Context, Option

from pulsetrainer.cli.console import Screen
from pulsetrainer.cli.next_step import as_options
from pulsetrainer.cli.options import AsJson, LimitCurrent, LimitForce, Port
from pulsetrainer.files import settings
from pulsetrainer.report.tables import folded

_MARKS = {"ok": "ok", "warning": "warning", "problem": "PROBLEM"}
_WIDTH = 100


def doctor(
    context: Context,
    port: Port = None,
    capture: Annotated[
        bool, Option(help="Drive the coil for 3 s, to half its range, and check what comes back.")
    ] = True,
    limit_current_A: LimitCurrent = None,
    limit_force_N: LimitForce = None,
    json: AsJson = False,
) -> None:
    """Check this computer, its ports and the device.

    Exit code 1 if something needs fixing. Keep fingers off the device meanwhile.

    Example: pulsetrainer doctor --port /dev/ttyUSB0
    """
    from pulsetrainer.device.limits import Limits
    from pulsetrainer.doctor import examine
    from pulsetrainer.errors import QualityError

    screen = Screen("doctor", as_json=json)
    file = context.find_root().obj
    rows = settings.effective(file, os.environ)
    words = "; ".join(f"{one.key} = {value} ({source})" for one, value, source in rows)
    with screen.bar("looking") as progress:
        held = Limits(limit_current_A, limit_force_N)
        found = examine(port, capture=capture, limits=held, settings=words, tuned=file, progress=progress)
    findings = [replace(one, found=as_options(one.found), fix=as_options(one.fix)) for one in found]
    problems = sum(one.state == "problem" for one in findings)
    said = f"{problems} of {len(findings)} checks found a problem"
    failed = QualityError(said, hint="make the fixes in order, from the top") if problems else None
    screen.result({"findings": findings, "problems": problems}, failed)
    if not json:
        width = max(len(one.name) for one in findings)
        for one in findings:
            lead = f"{_MARKS[one.state]:<8} {one.name:<{width}}  "
            if one.name in ("versions", "settings"):  # lists of words that nobody copies
                screen.whole(folded(lead, one.found, min(_WIDTH, screen.width)))
            else:
                screen.line(lead, one.found)
            if one.fix and one.state != "ok":
                screen.whole(f"{'':<8} fix: {one.fix}")
    screen.end(failed)
