"""What people type that this program calls, or takes, another way: what to type instead."""

from __future__ import annotations

# of a word too many, by the command and the kind of file, if it is one: what else there is to do
BEHIND = {
    "": "to look into a file: pulsetrainer show {extra}",
    "session waveform": "a session makes its own drives; to play one: pulsetrainer play {extra} -o played.h5",
    "check run": "to test a model on a run: pulsetrainer evaluate {extra} --model model.h5",
    "tune": "to name a drive: --drive drive.h5",
    "ports": "to look at one port: pulsetrainer doctor --port {port}",
    "invert": "if it is another pulse: one at a time, each with an output of its own",
    "capture": "if it is another signal: one at a time, each with an output of its own",
    "play model": "a drive already holds all that is needed of its model",
    "FILE.h5": "one file at a time, its name in quotes if it has spaces; to compare evaluations or "
    "sessions: pulsetrainer compare a.h5 b.h5",
}
SWITCHED = ("yes", "no", "true", "false", "on", "off", "0", "1")
OFF = ("no", "false", "off", "0")
SHELLS = ("bash", "zsh", "fish", "powershell", "pwsh")  # that typer writes a completion for
NO_COMMAND = {
    "version": "pulsetrainer --version",
    "help": "pulsetrainer --help, or pulsetrainer identify --help",
    "predict": "evaluate predicts a run: pulsetrainer evaluate run.h5 --model model.h5",
    "record": "pulsetrainer capture identification -o run.h5",
    "measure": "pulsetrainer capture identification -o run.h5",
    "fit": "pulsetrainer identify run.h5 -o model.h5",
    "calibrate": "to model the device: pulsetrainer capture identification -o run.h5, then "
    "pulsetrainer identify run.h5 -o model.h5; to set the gains of the current control: pulsetrainer tune",
    "simulate": "without --port every command plays on the simulated device: pulsetrainer invert normal "
    "--model model.h5 -o drive.h5, then pulsetrainer play drive.h5 -o played.h5",
    "report": "evaluate writes it: pulsetrainer evaluate played.h5 --html report.html",
}
NO_OPTION = {
    "check --model": "give the model without an option: pulsetrainer check model.h5",
    "play --model": "leave it out: a drive holds the model that it was made with",
    "refine --model": "leave it out: a drive holds the model that it was made with",
    "identify --model": "to test a model on a run: pulsetrainer evaluate {behind}",
    "invert --amplitude": "the height of a drive is given as a force: --force-max, and --force-min",
    "ports --port": "to look at one port: pulsetrainer doctor --port {value}",
    "capture --force-max": "a capture sets the current, not the force: give a lower --current-max; "
    "--limit-force only stops the capture when the force is higher",
    "session --force-max": "the height is --amplitude, in % of what the model reaches",
    "play --html": "evaluate writes it: pulsetrainer evaluate {out} --html {value}",
    "identify --html": "diagnose writes it: pulsetrainer diagnose run.h5 --model {out} -o diagnosis.h5 "
    "--html {value}; for a figure: pulsetrainer plot {out}",
    "show -o": "to write a table: pulsetrainer export model.h5 -o model.csv",
    "show --out": "to write a table: pulsetrainer export model.h5 -o model.csv",
    "invert --rate": "a pulse has its own rate; a session sets it: "
    "pulsetrainer session --model model.h5 --rate {value} -o session.h5",
    "import --delimiter": "leave it out: the delimiter is found by itself",
    "--force-max": "the height is that of the drive: pulsetrainer invert normal --model model.h5 -o drive.h5 "
    "--force-max {value}",
    "--version": "pulsetrainer --version",
    "--port": "leave it out: the command works on files, and needs no device",
    "import --time-unit": "write the unit in the heading of the table, such as 't [ms]', or give --rate",
}
