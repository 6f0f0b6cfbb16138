"""``pulsetrainer ports``: what could be a device."""

from __future__ import annotations

from pulsetrainer.cli.console import Screen, say
from pulsetrainer.cli.options import AsJson

_HEADS = {"device": "port", "vid_pid": "vendor:product", "is_device": "our device"}


def ports(json: AsJson = False) -> None:
    """List the serial ports.

    It shows which of them is our device, and whether each can be opened.

    Example: pulsetrainer ports
    """
    from pulsetrainer.device.ports import list_ports

    screen = Screen("ports", as_json=json)
    found = list_ports()
    screen.result({"ports": found})
    if found:
        names = list(found[0].__dataclass_fields__)
        unknown = ("", "n/a")
        cells = [[getattr(port, name) for name in names] for port in found]
        rows = [[None if cell in unknown else cell for cell in row] for row in cells]
        for row, port in zip(rows, found, strict=True):
            if not port.vid_pid:  # a plain serial port tells nothing of what is behind it
                row[-1] = "not known"
        screen.table("serial ports", [_HEADS.get(name, name) for name in names], rows)
    else:
        say("note: ", "no serial port; plug the device in, or use the simulated one: --port bench:")
