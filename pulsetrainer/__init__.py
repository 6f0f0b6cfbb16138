"""A hysteretic solenoid that presses a true arterial pulse, without a force sensor in the loop."""

__version__ = "0.1.0"
