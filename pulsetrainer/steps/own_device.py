"""Whether a model is of our own device, and of the one that is connected."""

from __future__ import annotations

from pulsetrainer.artefacts import Model
from pulsetrainer.device.device import Device
from pulsetrainer.errors import DataError


def check_units(model: Model) -> None:
    """Raise DataError for a model that is not from A to N."""
    if (model.input_unit, model.output_unit) != ("A", "N"):
        raise DataError(
            f"the model takes {model.input_unit} and gives {model.output_unit}, so it is not a model of this "
            "device (A and N)",
            hint="identify a run that was captured on the device",
        )


def check_same_device(model: Model, device: Device) -> None:
    """Raise DataError for a model that was captured on another device, where it knows its serial number."""
    if model.serial not in ("", device.info.serial):
        raise DataError(
            f"the model is of the device {model.serial}, this is {device.info.serial}",
            hint="give the model of this device, or connect that one",
        )
