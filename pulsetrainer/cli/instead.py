"""What people type that this program calls, or takes, another way: what to type instead."""

from __future__ import annotations

# what is often given as an argument to a command that has none of that kind
INSTEAD = {
    "session": "pulses are separated by commas, a model is an option: --pulses normal,bifid --model model.h5",
    "check": "-o names the file that --update writes: pulsetrainer check model.h5 --update -o {extra}",
    "tune": "a drive is an option: pulsetrainer tune --drive {extra}",
    "ports": "to look at one: pulsetrainer doctor --port {extra}",
    "correct": "a diagnosis is an option: --diagnosis {extra}",
    "doctor": "a port is an option: pulsetrainer doctor --port {extra}",
    "invert": "one pulse at a time: run it once for each, with an output of its own",
    "capture": "one signal at a time: run it once for each, with an output of its own",
    "play": "one drive at a time; a drive already holds what is needed of its model",
}
# of them, those that are no file's name
NO_FILE = {"ports", "doctor"}
SWITCHED = ("yes", "no", "true", "false", "on", "off")
SHELLS = ("bash", "zsh", "fish", "powershell", "pwsh")  # that typer writes a completion for
NO_COMMAND = {
    "version": "pulsetrainer --version",
    "help": "pulsetrainer --help, or pulsetrainer identify --help",
    "predict": "evaluate predicts a run: pulsetrainer evaluate run.h5 --model model.h5",
    "record": "pulsetrainer capture identification -o run.h5",
    "measure": "pulsetrainer capture identification -o run.h5",
    "fit": "pulsetrainer identify run.h5 -o model.h5",
    "calibrate": "of a model: pulsetrainer capture identification -o run.h5; of a coil: pulsetrainer tune",
    "simulate": "the simulated device is the port bench:, which is the default: pulsetrainer capture --help",
    "report": "evaluate writes it: pulsetrainer evaluate played.h5 --html report.html",
}
NO_OPTION = {
    "check --model": "give the model without an option: pulsetrainer check model.h5",
    "play --model": "leave it out: a drive holds the model that it was made with",
    "refine --model": "leave it out: a drive holds the model that it was made with",
    "identify --model": "to test a model on a run: pulsetrainer evaluate {behind}",
    "invert --amplitude": "the height of a drive is a force: --force-max, and --force-min",
    "ports --port": "to look at one: pulsetrainer doctor --port PORT",
    "capture --force-max": "to limit the force: --limit-force {value}",
    "session --force-max": "the height is --amplitude, in % of what the model reaches; to limit the force: "
    "--limit-force {value}",
    "play --html": "evaluate writes it: pulsetrainer evaluate played.h5 --html {value}",
    "identify --html": "diagnose writes it: pulsetrainer diagnose run.h5 --model model.h5 -o diagnosis.h5 "
    "--html {value}; for a figure: pulsetrainer plot model.h5",
    "show -o": "to write a table: pulsetrainer export model.h5 -o model.csv",
    "show --out": "to write a table: pulsetrainer export model.h5 -o model.csv",
    "invert --rate": "a pulse has its own rate; in a session: pulsetrainer session --rate {value}",
    "import --delimiter": "leave it out: the delimiter is recognised",
    "--version": "pulsetrainer --version",
    "--port": "leave it out: the command works on files, and needs no device",
    "import --time-unit": "write the unit in the heading of the table, such as 't [ms]', or give --rate",
}
