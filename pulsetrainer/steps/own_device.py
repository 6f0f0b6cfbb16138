"""Whether a model is of our own device, and of the one that is connected."""

from __future__ import annotations

from pulsetrainer.artefacts import Model, Waveform
from pulsetrainer.artefacts.units import as_parameters, in_units
from pulsetrainer.device.device import Device
from pulsetrainer.errors import DataError

EXPORT = "for an amplifier of your own, pulsetrainer export writes the drive as a table"
_ANEW = {
    "model": "identify a run that was captured on the device",
    "drive": f"identify and invert a run that was captured on the device; {EXPORT}",
}


def check_units(noun: Model | Waveform) -> None:
    """Raise DataError for a model or a drive that is not from A to N."""
    what, again = ("model", "identify it") if isinstance(noun, Model) else ("drive", "identify and invert it")
    units = (noun.input_unit, noun.output_unit)
    hint = _ANEW[what]
    if "1" in units:
        raise DataError(
            f"the {what} {in_units(noun)}, expected A and N",
            hint=f"if the table it was made from is in A and N: import it again with "
            f"{as_parameters('A', 'N')}, and {again}; otherwise {hint}",
        )
    if units != ("A", "N"):
        raise DataError(
            f"the {what} takes {units[0]} and gives {units[1]}, so it is not a {what} of this device "
            "(A and N)",
            hint=hint,
        )


def check_same_device(model: Model, device: Device) -> None:
    """Raise DataError for a model that was captured on another device, where it knows its serial number."""
    if model.serial not in ("", device.info.serial):
        raise DataError(
            f"the model is of the device {model.serial}, this is {device.info.serial}",
            hint="give the model of this device, or connect that one",
        )
