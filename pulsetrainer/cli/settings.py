"""The settings file as the parser takes it: by command and option."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pulsetrainer.files.settings import SETTINGS, Setting


def takers(setting: Setting, commands: Mapping[str, Any]) -> dict[str, str]:
    """Return which of the program's commands take a setting, each with the parameter of its function.

    They are those with an option of the setting's environment variable.
    """
    return {
        name: parameter.name
        for name, command in commands.items()
        for parameter in command.params
        if parameter.envvar == setting.variable
    }


def defaults(values: Mapping[str, Any], commands: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return settings as the parser takes them: by command and by parameter of its function."""
    found: dict[str, dict[str, Any]] = {}
    for setting in SETTINGS:
        if setting.key in values:
            for command, parameter in takers(setting, commands).items():
                found.setdefault(command, {})[parameter] = values[setting.key]
    return found
