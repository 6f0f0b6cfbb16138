"""Command lines with a mistake that can be told before a flow is loaded, and those that need a look inside.

Used by the test that nothing heavy is loaded for the first, and by the benchmark that times both.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from command_lines import EXCITATION, READS_ONLY, WRITERS, Writer

SIGNATURE = b"\x89HDF\r\n\x1a\n"  # enough to pass for an artefact until it is opened
THERE = {"x.h5", "x.html", "x.png", "x.csv"}  # outputs that exist


class Mistake(NamedTuple):
    """A command line, the exit code that it must end with, and pieces of what is said: where, what next."""

    words: tuple[str, ...]
    code: int
    where: str = ""
    then: str = ""


def lay_out(folder: Path) -> None:
    """Put down what the mistakes need: inputs that are there, outputs that exist."""
    names = {name for one in (*WRITERS, *READS_ONLY) for name in one.reads} | THERE
    for name in names:
        (folder / name).write_bytes(SIGNATURE)
    (folder / "other").mkdir()
    (folder / "other" / "run.csv").write_text("t_s,current_A,force_N\n0,0,0\n")
    (folder / "wrong.toml").write_text("levles = 48\n")
    (folder / "limits.toml").write_text("[limits]\ncurent_A = 1.0\n")
    (folder / "other" / "model.h5").write_bytes(SIGNATURE)
    (folder / "two words.csv").write_text("t,u,y\n0,0,0\n")
    (folder / "bare").mkdir()
    (folder / "bare.toml").write_text("")
    (folder / "pulse.toml").write_text("normal = 3\n")
    (folder / "round.toml").write_text('"normal.continuous.mean_error_reduction_percent" = [98, 90]\n')
    (folder / "words.toml").write_text('"normal.continuous.mean_error_reduction_percent" = ["a", "b"]\n')
    (folder / "quoted.toml").write_text('current_max_A = "1.2"\n')
    (folder / "percent.toml").write_text(
        '"normal.continuous.mean_error_reduction_percent" = ["90%", "98%"]\n'
    )
    (folder / "-run.h5").write_bytes(SIGNATURE)
    (folder / "back.toml").write_text('port = "C:\\Users"\n')
    (folder / "loop.csv").symlink_to("loop.csv")
    (folder / "one.toml").write_text('"normal.continuous.mean_error_reduction_percent" = 90\n')


def at_once() -> dict[str, Mistake]:
    """Mistakes in names: every command with each of its inputs absent and each of its outputs in the way."""
    found = {}
    for one in (*WRITERS, *READS_ONLY):
        for name in one.reads:
            absent = tuple(f"absent{Path(word).suffix}" if word == name else word for word in _line(one))
            found[f"{one.name}: {name} is absent"] = Mistake(absent, 3, _given_as(absent))
        for option, name in one.outputs:
            there = _line(one, {option: f"x{Path(name).suffix}"})
            found[f"{one.name}: {option} exists"] = Mistake(there, 2, f"({option})")
            nowhere = _line(one, {option: f"no/{name}"})
            found[f"{one.name}: {option} is in no folder"] = Mistake(nowhere, 2, f"no/{name} cannot")
    table = ("import", "run.csv", "--input", "u", "--output", "y", "-o", "out.h5")
    words = {
        "no such command": ("captur",),
        "no such option": ("capture", "identification", "--speeed", "1"),
        "an option is missing": ("capture", "identification"),
        "a number is none": ("capture", "identification", "-o", "out.h5", "--levels", "many"),
        "no such wire": ("capture", "identification", "-o", "out.h5", "--port", "bench:?wire=9"),
        "no such emulator": ("play", "drive.h5", "-o", "out.h5", "--port", "qemu:?seed=1"),
        "nothing to resume": ("capture", "identification", "-o", "out.h5", "--resume"),
        "a plane of one level": ("identify", "run.h5", "-o", "out.h5", "--levels", "1"),
        "a plane of too many": ("identify", "run.h5", "-o", "out.h5", "--levels", "1000"),
        "a signal of no levels": ("capture", "identification", "-o", "out.h5", "--levels", "0"),
        "no repeats": ("capture", "identification", "-o", "out.h5", "--repeats", "0"),
        "a speed of zero": ("capture", "identification", "-o", "out.h5", "--speed", "0"),
        "samples below none": ("capture", "identification", "-o", "out.h5", "--rate", "-1"),
        "no number of samples": ("capture", "identification", "-o", "out.h5", "--rate", "nan"),
        "a current without end": ("capture", "identification", "-o", "out.h5", "--current-max", "inf"),
        "a limit below none": ("play", "drive.h5", "-o", "out.h5", "--limit-force", "-1"),
        "nothing played": ("play", "drive.h5", "-o", "out.h5", "--repeats", "0"),
        "no periods": ("invert", "normal", "--model", "model.h5", "-o", "out.h5", "--periods", "0"),
        "a drive that stands": ("invert", "normal", "--model", "model.h5", "-o", "out.h5", "--slew", "0"),
        "a seed below zero": ("diagnose", "run.h5", "--model", "model.h5", "-o", "out.h5", "--seed", "-1"),
        "another such seed": ("identify", "run.h5", "-o", "out.h5", "--seed", "-1"),
        "no such signal": ("capture", "nothing", "-o", "out.h5"),
        "no such waveform": ("invert", "nothing", "--model", "model.h5", "-o", "out.h5"),
        "no such beat": ("invert", "normal", "--model", "model.h5", "-o", "out.h5", "--beat", "first"),
        "an empty force range": (
            *("invert", "normal", "--model", "model.h5", "-o", "out.h5"),
            *("--force-min", "5", "--force-max", "2"),
        ),
        "no such smoothing": ("identify", "run.h5", "-o", "out.h5", "--smoothing", "much"),
        "a figure of no format": ("plot", "run.h5", "-o", "out.txt"),
        "an option without its value": ("tune", "--drive"),
        "an option in the place of an output": ("capture", "identification", "-o", "--json"),
        "answers that no quiz asks for": (
            *("session", "--model", "model.h5", "-o", "out.h5"),
            *("--answers", "answers.txt"),
        ),
        "a value where none goes": ("capture", "identification", "-o", "out.h5", "--live=yes"),
        "an artefact named like a table": ("identify", "run.h5", "-o", "out.csv"),
        "a page named like a figure": (
            *("diagnose", "run.h5", "--model", "model.h5", "-o", "out.h5"),
            *("--html", "out.pdf"),
        ),
        "settings named like an artefact": ("tune", "-o", "out.h5"),
        "a comparison of one": ("compare", "evaluation.h5"),
        "a comparison of no format": ("compare", "evaluation.h5", "evaluation.h5", "-o", "out.txt"),
        "a time column and a rate": (*table, "--time", "t", "--rate", "5"),
        "no time and a rate": (*table, "--no-time", "--rate", "5"),
        "a rate of zero": (*table, "--rate", "0"),
        "even steps of no time": (*table, "--no-time", "--resample", "even"),
        "no such resampling": (*table, "--resample", "often"),
        "two files into one": (*table[:2], "other/run.csv", *table[2:-1], "{name}.h5"),
        "no such file of settings": ("--settings", "absent.toml", "ports"),
        "no such setting": ("--settings", "wrong.toml", "ports"),
    }
    named = {
        "--levels",
        "--repeats",
        "--speed",
        "--rate",
        "--current-max",
        "--limit-force",
        "--periods",
        "--slew",
    }
    named |= {"--answers", "--seed", "--beat", "--smoothing", "--port", "--resample"}
    found |= {
        name: Mistake(line, 2, next((word for word in line if word in named), ""))
        for name, line in words.items()
    }
    found["two files to draw"] = Mistake(("plot", "run.h5", "model.h5"), 2, "'model.h5' is one too many")
    found["an argument to a command of none"] = Mistake(
        ("tune", "now"), 2, "only options; 'now' is one too many", "to name a drive: --drive"
    )
    for name, (line, code, where, then) in _WORDS_OF_A_TIRED_HAND.items():
        found[name] = Mistake(tuple(line.split()), code, where, then)
    bounds = ("evaluate", "played.h5", "--bounds", "absent.toml")
    found["no such file of bounds"] = Mistake(bounds, 2, "absent.toml")
    found["no such CSV signal"] = Mistake(("capture", "absent.csv", "-o", "out.h5"), 3, "(argument ")
    for name, (typed, where, then) in _WORDS_IN_QUOTES.items():
        found[name] = Mistake(typed, 2, where, then)
    nowhere = ("play", "drive.h5", "-o", "out.h5", "--port", "")
    found["a port that a script left empty"] = Mistake(
        nowhere, 2, "--port must name a port", "its variable is set"
    )
    return found


# with blanks, or nothing, between the quotes
_WORDS_IN_QUOTES = {
    "an output that a script left empty": (
        *(("plot", "run.h5", "-o", ""), "-o (--out) must name a file, got an empty name"),
        "check that its variable is set",
    ),
    "an output of blanks": (
        *(("identify", "run.h5", "-o", " "), "-o (--out) must name a file, got an empty name"),
        "write the name",
    ),
    "an input that a script left empty": (
        *(("show", ""), "FILE.h5 must name a file, got an empty name", "check that its variable is set"),
    ),
    "a page that a script left empty": (
        *(("evaluate", "played.h5", "--html", ""), "--html must name a file", "write the name"),
    ),
    "settings that a script left empty": (
        *(("--settings", "", "show", "run.h5"), "--settings must name a file, got an empty name"),
        "leave it out",
    ),
    "a folder as an output": (
        *(("identify", "run.h5", "-o", "bare/"), "-o (--out) must name a file, got the folder bare/"),
        "the name of a file in it",
    ),
    "a home in quotes": (
        *(("identify", "run.h5", "-o", "~/out.h5"), "the folder ~ does not exist", "without quotes"),
    ),
    "a port of blanks": (
        *(
            ("play", "drive.h5", "-o", "out.h5", "--port", " "),
            "--port must name a port",
            "its variable is set",
        ),
    ),
    "a pulse that a script left empty": (
        *(("invert", "", "--model", "model.h5", "-o", "out.h5"), "there is no pulse ''", "name one of them"),
    ),
    "a signal that a script left empty": (
        *(("capture", "", "-o", "out.h5"), "there is no signal ''", "pulsetrainer capture identification"),
    ),
    "a pulse in capitals": (
        *(("invert", "NORMAL", "--model", "model.h5", "-o", "out.h5"), "there is no pulse 'NORMAL'"),
        "did you mean normal?",
    ),
    "an ending without a name": (
        *(("plot", "run.h5", "-o", ".png"), ".png has no name before its ending", "name it figure.png"),
    ),
    "settings of another format": (
        *(("tune", "-o", "tuned.yaml"), "tuned.yaml ends in '.yaml'", "name it tuned.toml"),
    ),
    "a blank behind an output": (
        *(("identify", "run.h5", "-o", "out.h5 "), "'out.h5 ' has a space at an end", "name it 'out.h5'"),
    ),
    "a whole line in quotes": (
        *(("show run.h5",), "there is no command 'show run.h5'", "the quotes: pulsetrainer show run.h5"),
    ),
}
# said unclearly once, tried by hand: each now says what is wrong, and what to do about it
_WORDS_OF_A_TIRED_HAND = {
    "a unit of time as an option": (
        *("import run.csv --input u --output y -o out.h5 --time-unit ms", 2),
        *("import has no option --time-unit", "write the unit in the heading of the table, such as 't [ms]'"),
    ),
    "a decimal comma": (
        *("capture identification -o out.h5 --current-max 1,2", 2),
        *("--current-max must be a number, got '1,2'", "with a point and without a unit: 1.2"),
    ),
    "a number with its unit": (
        *("capture identification -o out.h5 --current-max 1.2A", 2, "got '1.2A'", "alone, in A: 1.2"),
    ),
    "a force with its unit": (
        *("invert normal --model model.h5 -o out.h5 --force-max 20N", 2, "got '20N'", "alone, in N: 20"),
    ),
    "a share with its sign": (
        *("session --model model.h5 -o out.h5 --amplitude 50%", 2, "got '50%'", "alone, in %: 50"),
    ),
    "a force in another unit": (
        *("invert normal --model model.h5 -o out.h5 --force-max 20kN", 2, "got '20kN'"),
        "in N, without the unit: 20000\n",
    ),
    "an option of another command": (
        "identify run.h5 --model model.h5 -o out.h5",
        2,
        "no option --model",
        "pulsetrainer evaluate run.h5 --model model.h5",
    ),
    "an option that is nearly one": (
        *(
            "session --model model.h5 -o out.h5 --pulse normal",
            2,
            "no option --pulse",
            "did you mean --pulses?",
        ),
    ),
    "a pulse in the place of a drive": (
        *("play normal -o out.h5", 3, "normal (argument ", "pulsetrainer invert normal"),
    ),
    "two pulses": (
        *(
            "invert normal bifid --model model.h5 -o out.h5",
            2,
            "takes WAVEFORM; 'bifid' is one too many",
            "if it is another pulse: one at a time, each with an output",
        ),
    ),
    "a file that a look at the device does not take": (
        "doctor run.h5",
        2,
        "'run.h5' is one too many",
        "leave it out",
    ),
    "a word for a look at the device": (
        "doctor now",
        2,
        "only options; 'now' is one too many",
        "leave it out\n",
    ),
    "a port without its option": (
        *("capture identification /dev/ttyUSB0 -o out.h5", 2, "'/dev/ttyUSB0' is one too many"),
        "a port is an option: --port /dev/ttyUSB0\n",
    ),
    "two words too many": (
        "tune now then",
        2,
        "takes only options; 'now', 'then' are too many",
        "leave them out",
    ),
    "pulses with a blank": (
        *(
            "session --model model.h5 --pulses normal bifid -o out.h5",
            2,
            "only options; 'bifid' is one too many",
        ),
        "pulses are an option: --pulses normal,bifid\n",
    ),
    "a table that is absent": (
        "import absent.csv -o out.h5",
        2,
        "absent.csv does not exist; and --input (column of the input, by its heading or number) and --output",
        "no file here has a similar name; and name the columns, such as --input 2 --output 3\n",
    ),
    "json before the command": (
        *("--json show run.h5", 2, "pulsetrainer has no option --json"),
        "after the command: pulsetrainer show run.h5 --json",
    ),
    "an output before the command": (
        *("-o out.h5 identify run.h5", 2, "pulsetrainer has no option -o"),
        "after the command: pulsetrainer identify run.h5 -o out.h5",
    ),
    "a long dash": ("identify run.h5 –o out.h5", 2, "–o begins with a long dash", "again with a hyphen: -o"),
    "a long dash for two": (
        "identify run.h5 —overwrite",
        2,
        "begins with a long dash",
        "again with a hyphen: --overwrite",
    ),
    "a letter of an older option": ("identify run.h5 -f -o out.h5", 2, "no option -f", "or --overwrite?"),
    "seconds for minutes": (
        *("session --model model.h5 -o out.h5 --minutes 30s", 2, "got '30s'", "write it in min, without the"),
    ),
    "a share of no share": (
        *(
            "invert normal --model model.h5 -o out.h5 --force-max 90%",
            2,
            "got '90%'",
            "give the value itself, not a share of it: --force-max is the force at the top of the pulse",
        ),
    ),
    "a choice without its word": (
        *("identify run.h5 -o out.h5 --form", 2, "needs a value: one of auto, direct, dual, signed"),
        "write it after --form",
    ),
    "standard input": ("import - --input u --output y -o out.h5", 3, "standard input (-)", "to a file first"),
    "a pattern in quotes": ("identify ru*.h5 -o out.h5", 3, "is a pattern in quotes", "leave the quotes out"),
    "an output without its name": ("identify run.h5 -o", 2, "-o needs a value: file to write", "after -o"),
    "an option in the place of a name": (
        *(
            "capture identification -o --json",
            2,
            "-o (--out) must name a file, got the option --json",
            "write the name after -o, then --json",
        ),
    ),
    "a folder of nothing": ("identify bare -o out.h5", 3, "bare is a folder", "bare holds none"),
    "a folder as a page": ("evaluate played.h5 --html bare", 2, "'bare' is a folder", "name a file in it"),
    "a folder as a figure": ("plot run.h5 -o bare", 2, "'bare' is a folder", "name a file in it"),
    "one run twice": ("identify run.h5 run.h5 -o out.h5", 2, "run.h5 is named twice", "each file once"),
    "a quiz of one pulse": (
        *(
            "session --model model.h5 -o out.h5 --quiz 4 --pulses normal",
            2,
            "two pulses",
            "--pulses normal,bifid",
        ),
    ),
    "one dash": (
        *("session --model model.h5 -o out.h5 -rate 100", 2, "no option -rate", "did you mean --rate"),
    ),
    "one option twice": (
        *("diagnose run.h5 --model model.h5 --model model.h5 -o out.h5", 2),
        *("--model was given 2 times", "give it once"),
    ),
    "models with a comma": (
        *("evaluate run.h5 --model model.h5,model.h5", 3, "(--model)", "file once: --model model.h5\n"),
    ),
    "two models with a comma": (
        *("evaluate run.h5 --model model.h5,other/model.h5", 3, "(--model)"),
        "name them one by one: --model model.h5 --model other/model.h5\n",
    ),
    "runs with a comma": (
        *("diagnose run.h5,run.h5 --model model.h5 -o out.h5", 3, "(argument ", "each file once: run.h5\n"),
    ),
    "a file behind a switch": (
        "check model.h5 --update out.h5",
        2,
        "'out.h5' is one too many",
        "to write is an option: -o out.h5",
    ),
    "a drive refined over itself": (
        *("refine drive.h5 -o drive.h5", 2, "drive.h5 is what refine works on and would be lost\n"),
        "such as drive-2.h5, or give --overwrite to replace it",
    ),
    "an option of many letters behind one dash": (
        *("identify run.h5 -output out.h5", 2, "there is no option -output", "-o out.h5"),
    ),
    "an output behind an equals sign": (
        *("identify run.h5 -o=out.h5", 2, "there is no option -o=out.h5", "-o out.h5"),
    ),
    "a column behind one dash": (
        *("import x.csv -output force -o out.h5", 2, "no option -output\n", "two dashes: --output force\n"),
    ),
    "a unit behind one dash": (
        *(
            "import x.csv -output-unit N -o out.h5",
            2,
            "no option -output-unit\n",
            "dashes: --output-unit N\n",
        ),
    ),
    "an output of import behind one dash": (
        *(
            "import x.csv --input 1 --output 2 -output out.h5",
            2,
            "give the file to write after -o",
            "-o out.h5",
        ),
    ),
    **{
        f"{word} for a switch{'' if blank == ' ' else ' in one word'}": (
            *(f"capture identification -o out.h5 --condition{blank}{word}", 2),
            *(f"--condition is a switch and takes no value, got '{word}'", then),
        )
        for word, then in (("no", "to switch it off: --no-condition\n"), ("yes", "write --condition alone\n"))
        for blank in " ="
    },
    "no for a switch without an opposite": (
        *("show run.h5 --json no", 2, "--json is a switch and takes no value, got 'no'"),
        "leave --json out\n",
    ),
    "a pulse and a model exchanged": (
        *("invert model.h5 --model normal -o out.h5", 3, "normal (--model) does not exist"),
        "pulsetrainer invert normal --model model.h5",
    ),
    "a delay below zero": (
        *("correct run.h5 --delay -0.001 -o out.h5", 2, "got -0.001", "such as --delay 0.001"),
    ),
    "a single draw": (
        *("identify run.h5 -o out.h5 --bootstrap 1", 2, "--bootstrap must be 0, or from 2", "200 is usual"),
    ),
    "a rate with its unit": (
        *(
            "session --model model.h5 -o out.h5 --rate 75bpm",
            2,
            "got '75bpm'",
            "the number alone, in bpm: 75",
        ),
    ),
    "a word of others for evaluate": (
        "predict run.h5",
        2,
        "'predict'",
        "pulsetrainer evaluate run.h5 --model",
    ),
    "a word of others for capture": (
        "record -o out.h5",
        2,
        "'record'",
        "pulsetrainer capture identification",
    ),
    "another word for capture": ("measure", 2, "'measure'", "pulsetrainer capture identification"),
    "a word of others for identify": ("fit run.h5", 2, "'fit'", "pulsetrainer identify run.h5"),
    "a word of others for two things": (
        "calibrate",
        2,
        "'calibrate'",
        "then pulsetrainer identify run.h5 -o",
    ),
    "a word of others for the bench": (
        "simulate normal",
        2,
        "'simulate'",
        "invert normal --model model.h5 -o drive.h5, then pulsetrainer play drive.h5",
    ),
    "a port where none goes": ("identify run.h5 -o out.h5 --port bench:", 2, "no option --port", "no device"),
    "a height as a share": (
        *("invert normal --model model.h5 -o out.h5 --amplitude 50", 2, "--amplitude", "--force-max"),
    ),
    "a port to look at": ("ports --port /dev/ttyUSB0", 2, "no option --port", "pulsetrainer doctor --port"),
    "a version behind a command": ("identify --version", 2, "no option --version", "pulsetrainer --version"),
    "a diagnosis without its option": (
        *(
            "correct run.h5 diagnosis.h5 -o out.h5",
            2,
            "'diagnosis.h5' is one too many",
            "--diagnosis diagnosis.h5",
        ),
    ),
    "a name that begins with a dash": (
        *("identify -run.h5 -o out.h5", 2, "no option -run.h5", "the name of a file, write ./-run.h5"),
    ),
    "a word of another option": (
        *("identify run.h5 -o out.h5 --method relay", 2, "--method 'relay'", "option: --reading relay"),
    ),
    "a pulse of the library with an ending": (
        *("invert normal.csv --model model.h5 -o out.h5", 3, "normal.csv (argument", "without .csv"),
    ),
    "a model updated over itself": (
        *("check model.h5 --update -o model.h5 --overwrite", 2, "would be lost", "such as model-2.h5\n"),
    ),
    "a seed that is a fraction": (
        *("capture identification -o out.h5 --port bench:?seed=1.5", 2, "from 0 to 16777215, got 1.5"),
        '--port "bench:?seed=3"\n',
    ),
    "a serial number that is none": (
        *("capture identification -o out.h5 --port bench:?serial=x", 2, "of up to eight digits, got x"),
        '--port "bench:?serial=3"\n',
    ),
    "a backslash in the settings": (
        *("--settings back.toml show run.h5", 2, "back.toml cannot be read", "in single quotes"),
    ),
    "help behind one dash": ("identify -help", 2, "no option -help", "pulsetrainer identify --help"),
    "a version that is a command": (
        *("version", 2, "there is no command 'version'", "pulsetrainer --version"),
    ),
    "the settings behind the command": (
        *("capture identification -o out.h5 --settings wrong.toml", 2, "has no option --settings"),
        "pulsetrainer --settings wrong.toml capture identification -o out.h5",
    ),
    "a number in thousandths": (
        *("correct run.h5 --diagnosis diagnosis.h5 -o out.h5 --delay 1ms", 2, "got '1ms'"),
        "write it in s, without the unit: 0.001",
    ),
    "milliamperes": (
        *("capture identification -o out.h5 --current-max 1500mA", 2, "got '1500mA'"),
        "write it in A, without the unit: 1.5",
    ),
    "help of a command": (*("help session", 2, "there is no command 'help'", "pulsetrainer session --help"),),
    "a report that is a command": (
        *("report", 2, "there is no command 'report'", "pulsetrainer evaluate played.h5 --html"),
    ),
    "a page behind -o": (
        *("diagnose run.h5 --model model.h5 -o out.html", 2, "out.html ends in '.html'", "--html out.html"),
    ),
    "a page of evaluate without an ending": (
        *("evaluate played.h5 --html evaluation", 2, "has no such ending", "name it evaluation.html"),
    ),
    "a page of diagnose without an ending": (
        *("diagnose run.h5 --model model.h5 -o out.h5 --html d", 2, "d has no such ending", "name it d.html"),
    ),
    "a page of session without an ending": (
        *("session --model model.h5 -o out.h5 --html sheet", 2, "has no such ending", "name it sheet.html"),
    ),
    "a figure that is none": (*("plot run.h5 -o out.h5", 2, "out.h5 ends in '.h5'", "name it out.png"),),
    "one playback twice": ("evaluate played.h5 played.h5", 2, "played.h5 is named twice", "each file once"),
    "one table twice": (
        *("import x.csv x.csv --input u --output y -o out.h5", 2, "x.csv is named twice", "each file once"),
    ),
    "bounds of nothing": ("evaluate played.h5 --bounds bare.toml", 2, "no bounds", 'percent" = [90, 100]'),
    "a bound the wrong way round": (
        *("evaluate played.h5 --bounds round.toml", 2, "got [98, 90]", 'percent" = [90.0, 98.0]'),
    ),
    "a bound of one number": (
        *(
            "evaluate played.h5 --bounds one.toml",
            2,
            "a pair [low, high], got 90",
            "= [90, 100] if at least 90 is meant, [0, 90] if at most",
        ),
    ),
    "a bound of words": (
        *("evaluate played.h5 --bounds words.toml", 2, "got ['a', 'b']", "= [90.0, 100.0], the lower first"),
    ),
    "a delay that is no number": (
        *("correct run.h5 --diagnosis diagnosis.h5 -o out.h5 --delay nan", 2),
        *("--delay must be a finite number, 0 or more, got nan", "in s, such as --delay 0.001"),
    ),
    "a rate without end": (
        *("import run.csv --input u --output y -o out.h5 --rate inf", 2),
        *("--rate must be a finite number, got inf", "leave it out"),
    ),
    "a rhythm that is no number": (
        *("session --model model.h5 -o out.h5 --variability nan", 2, "a finite number from 0 to 25, got nan"),
        "leave it out",
    ),
    "a table that is a link to itself": (
        *(
            "import loop.csv --input u --output y -o out.h5",
            3,
            "loop.csv is a link that leads back to itself",
        ),
        "remove the link, and name the file itself",
    ),
    "a run that is a link to itself": (
        "identify loop.csv -o out.h5",
        *(3, "leads back to itself", "remove the link"),
    ),
    "changes that are a link to itself": (
        *("session --model model.h5 -o out.h5 --changes loop.csv", 3, "leads back to itself", "remove"),
    ),
    "a drive that is not named": (
        *("tune --drive", 2, "--drive needs a value: file of a drive", "write it after --drive"),
    ),
    "a bound of a pulse": (
        *(
            "evaluate played.h5 --bounds pulse.toml",
            2,
            "'normal' in pulse.toml is not the full name of a value",
            "normal.continuous.mean",
        ),
    ),
    "the shell behind the switch": (
        *(
            "--show-completion zsh",
            2,
            "takes no value, got 'zsh'",
            "start zsh, and run there: pulsetrainer --show-completion",
        ),
    ),
    "a setting of a table that is nearly one": (
        *(
            "--settings limits.toml show run.h5",
            2,
            "'limits.curent_A'",
            "did you mean current_A under [limits]?",
        ),
    ),
    "a switch with a value": (
        "show run.h5 --json=yes",
        2,
        "--json is a switch and takes no value, got 'yes'",
        "--json alone",
    ),
    "settings without their option": (
        *(
            "tune pulsetrainer.toml",
            2,
            "'pulsetrainer.toml' is one too many",
            "is an option: -o pulsetrainer.toml",
        ),
    ),
    "a model behind an option where none goes": (
        *("check --model model.h5", 2, "no option --model", "pulsetrainer check model.h5"),
    ),
    "a model beside a drive": (
        *("play drive.h5 --model model.h5 -o out.h5", 2, "no option --model", "a drive holds the model"),
    ),
    "one pulse twice": (
        *("session --model model.h5 --pulses normal,normal -o out.h5", 2, "normal is named twice"),
        "each pulse once",
    ),
    "a beginning of an option": (
        *("identify run.h5 --o out.h5", 2, "no option --o", "did you mean --out or --overwrite?\n"),
    ),
    "a table with spaces, where none goes": (
        *("show two words.csv", 2, "'words.csv' is one too many"),
        "in quotes, and import the table first: pulsetrainer import 'two words.csv' --input",
    ),
    "a table with spaces, of several files": (
        *("identify two words.csv -o out.h5", 3, "two (argument RUN.h5) does not exist"),
        "in quotes, and import the table first: pulsetrainer import 'two words.csv' --input",
    ),
    "a name with spaces, of several files": (
        "import two words.csv --input u --output y -o out.h5",
        *(3, "two (argument FILE.csv) does not exist", "in quotes: 'two words.csv'"),
    ),
    "no table of such a name": (
        *("import nothing --input u --output y -o out.h5", 3, "nothing (argument", "no file here has"),
    ),
    "a figure for a pipe": ("plot run.h5 -o -", 2, "- is standard output", "name it figure.png"),
    "a table for a pipe": ("export run.h5 -o -", 2, "- is standard output", "name it table.csv"),
    "a model for a pipe": ("identify run.h5 -o -", 2, "- is standard output", "name it out.h5"),
    "a table for a device": ("export run.h5 -o /dev/full", 2, "/dev/full is not an ordinary file", "on disk"),
    "settings without an ending": (
        *("tune -o pulsetrainer", 2, "pulsetrainer has no such ending", "name it pulsetrainer.toml"),
    ),
    "an ending without a name for a model": (
        "identify run.h5 -o .h5",
        2,
        ".h5 has no name before its ending",
        "name it out.h5",
    ),
    "another ending in another folder": (
        *("identify run.h5 -o other/out.csv", 2, "other/out.csv ends in '.csv'", "name it other/out.h5"),
    ),
    "a word in braces that is not the name": (
        *("import run.csv --input u --output y -o {nmae}.h5", 2, "has {nmae} in its name, expected {name}"),
        "write {name}.h5 for",
    ),
    "an address of a table": (
        *("import https://example.org/a.csv --input u --output y -o out.h5", 3),
        "https://example.org/a.csv (argument FILE.csv)",
        "download the file, and give its path",
    ),
    "a file in a folder that is absent": (
        *("show no/run.h5", 3, "no/run.h5 (argument FILE.h5)", "the folder no does not exist either"),
    ),
    "an option in the place of a file": (
        *("tune --drive --json", 2, "--drive must name a file, got the option --json", "after --drive"),
    ),
    "the nearest of two commands": ("imprt", 2, "there is no command 'imprt'", "did you mean import?"),
    "a command in capitals": ("SHOW run.h5", 2, "there is no command 'SHOW'", "did you mean show?"),
    "a file as a command": ("run.h5", 2, "no command 'run.h5'", "pulsetrainer show run.h5"),
    **{
        f"a port before {name}": (
            *(f"--port /dev/ttyUSB0 {name}{rest}", 2, "pulsetrainer has no option --port"),
            f"after the command: pulsetrainer {name}{rest} --port /dev/ttyUSB0",
        )
        for name, rest in (
            *(("doctor", ""), ("check", " model.h5")),
            ("capture", " identification -o out.h5"),
        )
    },
    "a table beside a figure": (
        *("plot run.h5 -o x.svg --data", 2, "beside the figure, as x.csv, which already exists"),
        "name another figure, such as -o x-2.svg",
    ),
    "minutes and seconds": (
        *(
            "session --model model.h5 -o out.h5 --minutes 1:30",
            2,
            "got '1:30'",
            "write the number alone, in min: 1.5\n",
        ),
    ),
    "a setting in quotes": (
        *("--settings quoted.toml show run.h5", 2, "sets current_max_A = '1.2'"),
        "remove the quotes: current_max_A = 1.2\n",
    ),
    "a bound in quotes": (
        *("evaluate played.h5 --bounds percent.toml", 2, "got ['90%', '98%']"),
        "= [90.0, 98.0], the lower first, without quotes and without %",
    ),
    "two ports": (
        *("play drive.h5 -o out.h5 --port bench: --port bench:?seed=3", 2, "--port was given 2 times"),
        "give it once",
    ),
    "a switch both ways": (
        *(
            "play drive.h5 -o out.h5 --track-heat --no-track-heat",
            2,
            "--track-heat and --no-track-heat were both given, and are opposites",
            "give one of the two, or neither",
        ),
    ),
    "two seeds of a bench": (
        *("play drive.h5 -o out.h5 --port bench:?seed=3&seed=4", 2, "seed is set more than once, to 3 and 4"),
        "give seed once",
    ),
    "a port before a command that takes none": (
        *("--port /dev/ttyUSB0 show run.h5", 2, "has no option --port", "leave it out: the command works on"),
    ),
    "a force for a capture": (
        *("capture identification -o out.h5 --force-max 5", 2, "no option --force-max"),
        "give a lower --current-max; --limit-force only stops the capture when the force is higher\n",
    ),
    "a force for a drive": (
        *("play drive.h5 -o out.h5 --force-max 5", 2, "no option --force-max"),
        "pulsetrainer invert normal --model model.h5 -o drive.h5 --force-max 5\n",
    ),
    "a force for a session": (
        *("session --model model.h5 -o out.h5 --force-max=5", 2, "no option --force-max"),
        "--amplitude, in % of what the model reaches\n",
    ),
    "a page of a playback": (
        *("play drive.h5 -o out.h5 --html r.html", 2, "no option --html"),
        "pulsetrainer evaluate out.h5 --html r.html\n",
    ),
    "a page of a model": (
        *("identify run.h5 -o out.h5 --html r.html", 2, "no option --html"),
        "--model out.h5 -o diagnosis.h5 --html r.html; for a figure: pulsetrainer plot out.h5\n",
    ),
    "a text of a model": ("show model.h5 -o x.txt", 2, "no option -o", "pulsetrainer export model.h5 -o"),
    "a rate for a pulse": (
        *("invert normal --model model.h5 -o out.h5 --rate 75", 2, "no option --rate"),
        "session --model model.h5 --rate 75 -o session.h5",
    ),
    "a delimiter": (
        *("import run.csv --input u --output y -o out.h5 --delimiter ;", 2, "no option --delimiter"),
        "leave it out: the delimiter is found by itself",
    ),
    "an update without its output": (
        *("check model.h5 --update", 2, "--update, which writes the updated model,", "give both"),
    ),
}


def _given_as(words: tuple[str, ...]) -> str:
    """Return the option before the absent file; where there is none, it is an argument."""
    before = words[next(place for place, word in enumerate(words) if word.startswith("absent.")) - 1]
    return f"({before})" if before.startswith("--") else "(argument "


def _line(one: Writer, outputs: dict[str, str] | None = None) -> tuple[str, ...]:
    """Return a command line, some of its outputs elsewhere."""
    names = dict(one.outputs) | (outputs or {})
    return (*one.words, *(word for pair in names.items() for word in pair))


# for the rest the artefacts must be what their names say
_BARE = ("import", "plain/run.csv", "--input", "2", "--output", "3")
PREPARATION = (
    (*EXCITATION, "-o", "run.h5"),
    ("identify", "run.h5", "--levels", "12", "-o", "model.h5"),
    ("invert", "normal", "--model", "model.h5", "-o", "drive.h5", "--periods", "1"),
    ("play", "drive.h5", "-o", "played.h5", "--repeats", "1"),
    ("session", "--model", "model.h5", "--beats", "2", "-o", "session.h5"),
    ("export", "run.h5", "-o", "plain/run.csv"),
    (*_BARE, "--input-unit", "1", "--output-unit", "1", "-o", "plain/run.h5"),
    ("identify", "plain/run.h5", "--levels", "12", "-o", "plain/model.h5"),
    ("invert", "normal", "--model", "plain/model.h5", "-o", "plain/drive.h5", "--periods", "1"),
)
_UNITS = "with --input-unit A --output-unit N"
TABLES = {
    "empty.csv": "",
    "wide.csv": "time;Spannung;Kraft;Bemerkung\n0,0;1,5;2,5;gut\n0,1;2,5;3,5;gut\n",
    "still.csv": "t,F\n0,0\n1,1\n1,2\n2,3\n",
    "bounds.toml": "normal.continuous.mean_err = [1, 2]\n",
    "bare.csv": "0,0.1,2\n1,0.2,3\n2,0.3,4\n",
    "back.csv": "Time,I [A],F [N]\n2024-01-01 10:00:03,0.1,1\n2024-01-01 10:00:02,0.2,2\n",
    "heads.csv": "Channel,CH1,CH2\nTime,Current,Force\n0,1,2\n1,2,3\n2,3,4\n3,2,3\n",
    "cells.csv": "t,I,F\n0,5mA,1N\n1,6mA,2N\n2,7mA,3N\n",
    "my pulse.csv": "t_s,force_N\n0,0\n1,1\n2,0\n",
    "twice.csv": "t,x,x\n0,1,2\n1,2,3\n",
    "low.toml": "[limits]\ncurrent_A = 0.5\n",
    "newton.toml": "[limits]\nforce_N = 4.0\n",
    "gone.toml": 'port = "/dev/ttyUSB99"\n',
    "slow.csv": "t,p\n0,0\n400,1\n600,0\n810,0\n",
    "load.csv": "t_s,current_A,load_N\n0,0,0\n1,1,1\n2,2,2\n",
    "force.csv": "t_s,current_A,force_N\n0,0,0\n1,1,1\n2,2,2\n",
    "page.csv": "<!DOCTYPE html>\n<html>, , </html>\n",
    "paper.pdf": "%PDF-1.4\n1 0 obj\n",
    "one.csv": "t_s,current_A\n0,0\n",
    "press.csv": "t_s,current_A\n0,0\n1,1.4\n2,0\n",
    "many.txt": "normal\n" * 9,
    "bad.wav": "RIFF\x04\0\0\0WAVE",
    "excel.csv": "Zeit (s);Strom (A);Kraft (N)\n0,000;0,10;1.234,5\n0,001;0,20;1.235,5\n",
}
INSIDE = {
    **{
        f"{unit} for {meant}": Mistake(
            (
                *("import", "wide.csv", "--input", "Spannung", "--output", "Kraft", "--input-unit", unit),
                *("-o", "out.h5"),
            ),
            *(3, f"'{unit}' is not a known unit", f"did you mean '{meant}'? Write --input-unit {meant}\n"),
        )
        for unit, meant in (("v", "V"), ("n", "N"), ("ma", "mA"), ("kpa", "kPa"))
    },
    **{
        f"{words[0]} with a {what} in no units": Mistake(
            words, 3, f"the {what} plain/{what}.h5 has no units, expected A and N", f"{_UNITS}, and {then}"
        )
        for what, then, words in (
            ("drive", "identify and invert it; otherwise", ("play", "plain/drive.h5", "-o", "out.h5")),
            ("model", "identify it; otherwise", ("session", "--model", "plain/model.h5", "-o", "out.h5")),
            ("model", "identify it; otherwise", ("check", "plain/model.h5")),
        )
    },
    **{
        f"{words[0]} with one of two in no units": Mistake(
            *(words, 3, "has no units"),
            "if both are of one device, and that table is in A and N: import the table of "
            f"plain/run.h5 again {_UNITS}; otherwise {apart}",
        )
        for apart, words in (
            ("identify the runs one by one\n", ("identify", "plain/run.h5", "run.h5", "-o", "out.h5")),
            ("give a model of", ("diagnose", "plain/run.h5", "--model", "model.h5", "-o", "out.h5")),
        )
    },
    "a rate that the device does not have": Mistake(
        ("capture", "identification", "-o", "out.h5", "--rate", "44100"),
        *(3, "got 44100 Hz", "10000 Hz or a whole fraction of it, such as 5000, 2500, 2000, 1000 Hz"),
    ),
    "a run and a model exchanged": Mistake(
        ("diagnose", "model.h5", "--model", "run.h5", "-o", "out.h5"),
        *(3, "expected a run, got a model", "pulsetrainer diagnose run.h5 --model model.h5 -o out.h5"),
    ),
    "two lines of headings": Mistake(
        ("import", "heads.csv", "--input", "CH1", "--output", "CH2", "-o", "out.h5"),
        *(3, "two lines of headings; the second should hold units, but 'Time' below 'Channel'"),
        "delete the first, and name the columns by the second; otherwise write a unit in place of 'Time'",
    ),
    "two lines of headings, and a rate": Mistake(
        ("import", "heads.csv", "--input", "CH1", "--output", "CH2", "--rate", "10", "-o", "out.h5"),
        *(
            3,
            "'Current' in the second line of headings of heads.csv, below 'CH1', is not a known unit",
            "by the second; otherwise give a known unit, such as --input-unit A or mm/s^2",
        ),
    ),
    "cells with their units": Mistake(
        ("import", "cells.csv", "--input", "I", "--output", "F", "-o", "out.h5"),
        *(3, "in column I: '5mA' in line 2", "write it in the heading: 'I [mA]'"),
    ),
    "a table with a blank in its name, nearly": Mistake(
        ("invert", "my pulses.csv", "--model", "model.h5", "-o", "out.h5"),
        *(3, "my pulses.csv (argument", "did you mean 'my pulse.csv'? Or name a pulse"),
    ),
    "a limit of a check": Mistake(
        ("check", "model.h5", "--limit-current", "0.005"),
        *(
            3,
            "the limit is 0.005 A (--limit-current)",
            "capture identification --current-max 0.005 -o new.h5",
        ),
    ),
    "a limit of the settings": Mistake(
        ("--settings", "low.toml", "play", "drive.h5", "-o", "out.h5"),
        *(
            3,
            "the limit is 0.5 A (limits.current_A in low.toml)",
            "raise it there to 1.5, or give --limit-current 1.5; or",
        ),
    ),
    "a limit of the force in the settings": Mistake(
        ("--settings", "newton.toml", "play", "drive.h5", "-o", "out.h5"),
        *(
            4,
            "the limit is 4 N (limits.force_N in newton.toml)",
            "raise it there to 14 or more, or give --limit-force 14; or capture again",
        ),
    ),
    "a force above its limit": Mistake(
        (*EXCITATION, "-o", "out.h5", "--limit-force", "5"),
        *(4, "force above its limit of 5 N", "raise --limit-force (the device's own is 15 N), or"),
    ),
    "a port of the settings": Mistake(
        ("--settings", "gone.toml", "play", "drive.h5", "-o", "out.h5"),
        *(4, "(it comes from port in gone.toml)", "correct it there, or give --port"),
    ),
    "a port of Windows": Mistake(
        ("play", "drive.h5", "-o", "out.h5", "--port", "COM3"),
        4,
        "no port COM3",
        "COM ports exist on Windows only",
    ),
    "a port without its folder": Mistake(
        ("play", "drive.h5", "-o", "out.h5", "--port", "ttyUSB99"),
        *(
            4,
            "there is no port ttyUSB99, nor /dev/ttyUSB99 (ports",
            "ports`; give the whole path that it shows",
        ),
    ),
    "heat of a coil that is not known": Mistake(
        ("play", "drive.h5", "-o", "out.h5", "--track-heat"),
        *(
            3,
            "holds no resistance of its coil",
            "then pulsetrainer invert normal --model long-model.h5 -o long-drive.h5",
        ),
    ),
    "a model to be resumed": Mistake(
        ("capture", "identification", "-o", "model.h5", "--resume"),
        *(2, "model.h5 is a model, not an interrupted recording", "name the recording that broke off"),
    ),
    "repeats for a fortnight": Mistake(
        ("capture", "identification", "-o", "out.h5", "--repeats", "100000"),
        *(3, "--repeats 100000 times 98001 samples", "at most --repeats 10203"),
    ),
    "a pulse in milliseconds": Mistake(
        ("invert", "slow.csv", "--model", "model.h5", "-o", "out.h5"),
        *(3, "4 periods of slow last 4080 s", "write its unit in the heading, such as t_ms"),
    ),
    "two tables of different headings": Mistake(
        (*("import", "force.csv", "load.csv", "--input", "current_A", "--output", "force_N"), "-o", "out.h5"),
        *(3, "load.csv has no column 'force_N'", "give the column by its number, counted from 1, if it is"),
    ),
    "a comma in a parameter of the bench": Mistake(
        ("capture", "identification", "-o", "out.h5", "--port", "bench:?creep=0,05"),
        *(2, "creep=0,05 is not a number", "write it with a point: creep=0.05"),
    ),
    "a web page": Mistake(
        ("import", "page.csv", "--input", "1", "--output", "2", "-o", "out.h5"), 3, "is a web page", "as CSV"
    ),
    "a paper": Mistake(
        ("import", "paper.pdf", "--input", "1", "--output", "2", "-o", "out.h5"), 3, "is a PDF", "as CSV"
    ),
    "a sound without its format": Mistake(
        ("import", "bad.wav", "--input", "1", "--output", "2", "-o", "out.h5"),
        *(3, "bad.wav is not a whole .wav file that can be read: it lacks its format", "save it again"),
    ),
    "a model without its option, for a session": Mistake(
        ("session", "model.h5", "-o", "out.h5"), 2, "--model is missing", "an option: --model model.h5"
    ),
    "steps far too fine": Mistake(
        (
            *("import", "force.csv", "--input", "current_A", "--output", "force_N", "--resample", "1e12"),
            *("-o", "out.h5"),
        ),
        *(2, "--resample to 1e+12 Hz would make 2e+12 samples out of the 3 of force.csv, expected from 2 to"),
        "give a lower rate, or --resample even",
    ),
    "steps far too coarse": Mistake(
        (
            *("import", "force.csv", "--input", "current_A", "--output", "force_N", "--resample", "0.001"),
            *("-o", "out.h5"),
        ),
        *(2, "--resample to 0.001 Hz would make 1 sample out of the 3", "give a higher rate, or"),
    ),
    "a table beyond the current": Mistake(
        ("capture", "press.csv", "-o", "out.h5", "--current-max", "0.5"),
        *(2, "press.csv goes up to 1.4 A, more than --current-max 0.5", "scale the table"),
    ),
    "a signal of one row": Mistake(("capture", "one.csv", "-o", "out.h5"), 3, "has 1 row", "a row for each"),
    "more answers than questions": Mistake(
        (
            *("session", "--model", "model.h5", "-o", "out.h5", "--quiz", "4", "--pulses", "normal,bifid"),
            *("--answers", "many.txt"),
        ),
        *(3, "many.txt has 9 answers to 4 questions", "as many as questions"),
    ),
    "a model to verify with": Mistake(
        ("extend", "run.h5", "--model", "model.h5", "--verify", "model.h5", "-o", "out.h5"),
        *(3, "run.h5: expected a diagnosis, got a run", "pulsetrainer diagnose run.h5 --model model.h5"),
    ),
    "a run for a model": Mistake(
        ("invert", "normal", "--model", "run.h5", "-o", "out.h5"),
        *(
            3,
            "got a run",
            "give a model, such as model.h5; or run `pulsetrainer identify run.h5 -o model-2.h5`",
        ),
    ),
    "a drive as a run": Mistake(
        ("identify", "drive.h5", "-o", "out.h5"), 3, "got a drive", "give a run, such as run.h5"
    ),
    "a session that is not there": Mistake(
        ("evaluate", "monday.h5"), 3, "monday.h5 (argument ", "playback or session files here: played.h5"
    ),
    "pulses with commas": Mistake(
        ("invert", "normal,bifid", "--model", "model.h5", "-o", "out.h5"),
        2,
        "no pulse",
        "one pulse at a time",
    ),
    "a force in many digits": Mistake(
        *(("invert", "normal", "--model", "model.h5", "-o", "out.h5", "--force-max", "20"), 3),
        *("to 20 N is asked for", "--force-max"),
    ),
    "a run as a signal": Mistake(
        ("capture", "run.h5", "-o", "out.h5"),
        *(3, "expected identification, diagnostic or a CSV table, got a run", "such as identification"),
    ),
    "a drive as a signal": Mistake(
        ("capture", "drive.h5", "-o", "out.h5"), 3, "got a drive", "`pulsetrainer play drive.h5 -o played.h5`"
    ),
    "a run as a pulse": Mistake(
        ("invert", "run.h5", "--model", "model.h5", "-o", "out.h5"),
        *(3, "run.h5: expected the name of a pulse or a CSV table, got a run", "such as normal"),
    ),
    "a page to be shown": Mistake(
        ("show", "page.csv"), 3, "page.csv is a web page", "open it in a browser, or give the .h5"
    ),
    "an address of another kind": Mistake(
        ("play", "drive.h5", "-o", "out.h5", "--port", "tcp://host:5000", "--dry-run"),
        *(4, "protocol 'tcp' not known", "socket://host:port"),
    ),
    "a percentage for the bench": Mistake(
        ("play", "drive.h5", "-o", "out.h5", "--port", "bench:?creep=5%"),
        *(2, "creep=5% is not a number from 0 to 0.5", "write 0.05 for 5 %\n"),
    ),
    "a table whose columns are not named": Mistake(
        ("import", "wide.csv", "-o", "out.h5"),
        2,
        "are missing; wide.csv has",
        "--input Spannung --output Kraft",
    ),
    "a table that is empty": Mistake(
        *(
            ("import", "empty.csv", "-o", "out.h5"),
            2,
            "empty.csv is empty; and --input (column of the input",
        ),
        "export the recording again; and name the columns, such as --input 2 --output 3\n",
    ),
    "a table with a column that is not named": Mistake(
        ("import", "wide.csv", "--input", "Spannung", "-o", "out.h5"),
        *(2, "--output is missing: column of the output", "such as --output Kraft\n"),
    ),
    "a session and a playback": Mistake(
        *(("evaluate", "session.h5", "played.h5"), 2),
        "got 1 playback, 1 session",
        "each by itself: pulsetrainer evaluate session.h5, and pulsetrainer evaluate played.h5\n",
    ),
    "a session, a run and a model": Mistake(
        *(("evaluate", "run.h5", "session.h5", "--model", "model.h5"), 2),
        "got 1 run, 1 session, 1 model",
        "evaluate session.h5, and pulsetrainer evaluate run.h5 --model model.h5\n",
    ),
    "a run without a model": Mistake(("evaluate", "run.h5"), 2),
    "a model without its option": Mistake(
        ("evaluate", "run.h5", "--model", "model.h5", "model.h5"), 3, "got a model", "a --model of its own"
    ),
    "a playback and a run": Mistake(
        *(("evaluate", "played.h5", "run.h5"), 2, "got 1 playback, 1 run"),
        "by itself: pulsetrainer evaluate played.h5, and pulsetrainer evaluate run.h5 --model model.h5\n",
    ),
    "a drive for a session": Mistake(
        ("session", "--model", "model.h5", "drive.h5", "-o", "out.h5"),
        *(
            2,
            "only options; 'drive.h5' is one too many",
            "a session makes its own drives; to play one: pulsetrainer play drive.h5",
        ),
    ),
    "a run for a check": Mistake(
        *(("check", "model.h5", "run.h5"), 2, "'run.h5' is one too many"),
        "leave it out; to test a model on a run: pulsetrainer evaluate run.h5 --model model.h5\n",
    ),
    "two models to check": Mistake(
        ("check", "model.h5", "plain/model.h5"), 2, "'plain/model.h5' is one too many", "one model at a time"
    ),
    "a model for a drive": Mistake(
        ("play", "drive.h5", "model.h5", "-o", "out.h5"),
        2,
        "'model.h5' is one too many",
        "a drive already holds all that",
    ),
    "a drive to tune by": Mistake(
        ("tune", "drive.h5"), 2, "'drive.h5' is one too many", "a drive is an option: --drive drive.h5\n"
    ),
    "a run to tune by": Mistake(
        ("tune", "run.h5"), 2, "'run.h5' is one too many", "to name a drive: --drive drive.h5"
    ),
    "a playback with a model": Mistake(("evaluate", "played.h5", "--model", "model.h5"), 2),
    "no extended inverse": Mistake(
        ("invert", "normal", "--model", "model.h5", "-o", "out.h5", "--method", "extended"),
        *(
            2,
            "model.h5 has no extensions",
            "pulsetrainer extend diagnosis.h5 --model model.h5 -o extended.h5",
        ),
    ),
    "nothing left to resume": Mistake(("capture", "identification", "-o", "run.h5", "--resume"), 2),
    "a quiz where no key can be pressed": Mistake(
        ("session", "--model", "model.h5", "-o", "out.h5", "--quiz", "4", "--pulses", "normal,bifid"),
        2,
        "there is no terminal",
        "--answers answers.txt",
    ),
    "a force below the range": Mistake(
        ("invert", "normal", "--model", "model.h5", "-o", "out.h5", "--force-max", "-2"),
        3,
        "-2 N is asked for, but model.h5 reaches",
        "stay inside, such as --force-max 13.6\n",
    ),
    "bounds that are no text": Mistake(
        ("evaluate", "played.h5", "--bounds", "run.h5"),
        2,
        "run.h5 has no bounds in it: it is not a text file",
        "name another file",
    ),
    "a metric that is nearly one": Mistake(
        ("evaluate", "played.h5", "--bounds", "bounds.toml"),
        2,
        "normal.continuous.mean_err",
        "Names here begin with normal.continuous and a dot, and end with mean_error_reduction_percent",
    ),
    "learnt from a drive that was not refined": Mistake(
        ("invert", "bifid", "--model", "model.h5", "-o", "out.h5", "--learnt", "drive.h5"),
        3,
        "given as --learnt was never refined",
        "pulsetrainer refine drive.h5",
    ),
    "a unit in words": Mistake(
        (
            *("import", "wide.csv", "--input", "Spannung", "--output", "Kraft", "--input-unit", "Volts"),
            *("-o", "out.h5"),
        ),
        *(3, "--input-unit 'Volts' is not a known unit", "did you mean 'V'? Write --input-unit V"),
    ),
    "a unit in words, with a prefix": Mistake(
        (
            *("import", "wide.csv", "--input", "Spannung", "--output", "Kraft", "--input-unit", "kilovolts"),
            *("-o", "out.h5"),
        ),
        *(3, "'kilovolts' is not a known unit", "did you mean 'kV'?"),
    ),
    "a word that is nearly one of a choice": Mistake(
        ("identify", "run.h5", "-o", "out.h5", "--form", "dula"),
        *(2, "--form 'dula' is not one of", "did you mean dual?"),
    ),
    "no such bench parameter": Mistake(
        ("capture", "identification", "-o", "out.h5", "--port", "bench:?crep=1"), 2
    ),
    "a bench without its colon": Mistake(
        ("capture", "identification", "-o", "out.h5", "--port", "bench"),
        4,
        "no port bench",
        "add the colon: --port bench:\n",
    ),
    "a table of a pulse that is not there": Mistake(
        ("invert", "absent.csv", "--model", "model.h5", "-o", "out.h5"),
        *(3, "absent.csv (argument WAVEFORM) does not exist", "name a pulse of the library"),
    ),
    "a bench in capitals": Mistake(
        ("play", "drive.h5", "-o", "out.h5", "--port", "BENCH:"),
        *(4, "no port BENCH:", "write it in lower case: --port bench:\n"),
    ),
    "a bench without its colon that is only planned": Mistake(
        ("play", "drive.h5", "-o", "out.h5", "--port", "bench", "--dry-run"),
        *(4, "no port bench", "add the colon: --port bench:\n"),
    ),
    "more levels than there can be": Mistake(
        ("capture", "identification", "-o", "out.h5", "--levels", "100000000"),
        *(2, "--levels must be a whole number from 2 to 10000, got 100000000", "the usual 48"),
    ),
    "a speed that no signal has": Mistake(
        ("capture", "identification", "-o", "out.h5", "--speed", "1e9"),
        *(
            3,
            "move by 1e+06 A, more than its whole range of 1.5 A, at 1e+09 A/s (--speed)",
            "a lower --speed (0.75 is usual), or a higher --rate",
        ),
    ),
    "a speed that takes for ever": Mistake(
        ("capture", "identification", "-o", "out.h5", "--speed", "1e-9"),
        *(
            3,
            "at 1e-09 A/s (--speed) the signal would last 7.35e+10 s",
            "give a higher --speed (0.75 is usual)",
        ),
    ),
    "a bench with parameters but without its colon": Mistake(
        ("capture", "identification", "-o", "out.h5", "--port", "bench?seed=3&creep=0"),
        *(4, "no port bench?seed=3", "add the colon: --port 'bench:?seed=3&creep=0'"),
    ),
    "too many levels for the coil": Mistake(
        ("capture", "identification", "-o", "out.h5", "--levels", "2000"),
        *(
            3,
            "playing this would heat the coil to 108 % of its limit, even from cold",
            "fewer --levels or --repeats, or a lower --current-max; ",
        ),
    ),
    "a pulse whose time stands still": Mistake(
        ("invert", "still.csv", "--model", "model.h5", "-o", "out.h5"), 3, "line 4", "with more digits\n"
    ),
    "a force limit that nothing keeps": Mistake(
        ("play", "drive.h5", "-o", "out.h5", "--limit-force", "0.5"),
        *(4, "a force of 13.6 N is predicted", "raise --limit-force to 14 or more; or"),
    ),
    "a heading of a table without headings": Mistake(
        ("import", "bare.csv", "--input", "current_A", "--output", "force_N", "-o", "out.h5"),
        *(3, "it has no headings", "by number: 1 is the first"),
    ),
    "a separator of thousands, as Excel writes it in German": Mistake(
        ("import", "excel.csv", "--input", "Strom (A)", "--output", "Kraft (N)", "-o", "out.h5"),
        *(3, "excel.csv has '1.234,5' in column Kraft (N), line 2", "without thousands separators"),
    ),
    "dates that go back": Mistake(
        ("import", "back.csv", "--input", "I [A]", "--output", "F [N]", "-o", "out.h5"),
        *(
            3,
            "at line 3: 2024-01-01 10:00:02 after 2024-01-01 10:00:03",
            "if the rows are out of order, sort them; if two records",
        ),
    ),
    "a heading that two columns have": Mistake(
        ("import", "twice.csv", "--input", "x", "--output", "x", "-o", "out.h5"),
        *(
            3,
            "has 2 columns with the heading 'x'; they are called x#1, x#2",
            "choose by the name with its number: 'x#1' or 'x#2'",
        ),
    ),
    "a column without a name": Mistake(
        ("import", "wide.csv", "--input", "", "--output", "Kraft", "-o", "out.h5"),
        *(
            3,
            "wide.csv has no column ''; it has time, Spannung",
            "name one of these, or give its number: 1 is the first\n",
        ),
    ),
    "a unit that nobody knows": Mistake(
        (
            *("import", "wide.csv", "--input", "Spannung", "--output", "Kraft", "--output-unit", "furlong"),
            *("-o", "out.h5"),
        ),
        *(3, "--output-unit 'furlong' is not a known unit", "give a known unit, such as --output-unit N"),
    ),
    "nobody at the other side": Mistake(
        ("play", "drive.h5", "-o", "out.h5", "--port", "socket://localhost:1"),
        *(4, "cannot reach socket://localhost:1: Connection refused\n", "the other side is listening"),
    ),
    "a file as a port": Mistake(
        ("play", "drive.h5", "-o", "out.h5", "--port", "run.h5"),
        *(4, "run.h5 is not a serial port\n", "pulsetrainer ports"),
    ),
    "a session of no beat": Mistake(
        ("session", "--model", "model.h5", "-o", "out.h5", "--beats", "0"),
        *(2, "--beats must be 1 or more and at most 345600, got 0", "about a quarter of a minute"),
    ),
    "a session of less than a beat": Mistake(
        ("session", "--model", "model.h5", "-o", "out.h5", "--minutes", "0.0001"),
        *(2, "--minutes must be 0.05 (3 s) or more and at most 1440 (a day), got 0.0001", "give --beats 20"),
    ),
    "a rate that no heart has": Mistake(
        ("session", "--model", "model.h5", "-o", "out.h5", "--rate", "1000"),
        *(2, "--rate must be 20 to 240 beats a minute, got 1000", "a usual rate is 75"),
    ),
    "a bench parameter that is no number": Mistake(
        ("play", "drive.h5", "-o", "out.h5", "--port", "bench:?seed=abc"),
        *(2, "seed=abc is not a number", "give seed a value in that range; it sets:"),
    ),
    "more bytes damaged than there are": Mistake(
        ("play", "drive.h5", "-o", "out.h5", "--port", "bench:?wire=9"),
        *(
            2,
            "must be the share of bytes to damage, from 0 to 0.1, got 9",
            'ten thousand: --port "bench:?wire=0.0001"\n',
        ),
    ),
    "answers that are no text": Mistake(
        (
            *("session", "--model", "model.h5", "-o", "out.h5", "--pulses", "normal,bifid"),
            *("--quiz", "4", "--answers", "run.h5"),
        ),
        3,
        "run.h5 cannot be read: it is not a text file",
        "one name a line",
    ),
}
_IMPORT = "import {} --input 2 --output 3 -o out.h5"
_CAPTURE = "capture {} -o out.h5"
_CHANGES = "session --model model.h5 -o out.h5 --changes {}"
_INVERT = "invert {} --model model.h5 -o out.h5"
# tables that a tired hand wrote, or a logger that crashed: command line, text, what is said, what to do
_UNREADABLE = {
    "zeros.csv": (
        *(_IMPORT, f"t,I,F\n0,0,0\n1,1,1\n2,2,13.85105{9999 * chr(0)}"),
        *("zeros.csv ends in zero bytes, in line 4: the recorder", "cut the file after line 3, or leave"),
    ),
    "long.csv": (
        *(_IMPORT, f"t,I,F\n0,0,0\n1,1,{'x' * 999}\n2,2,2\n"),
        *(f"has '{'x' * 29}…' in column F, line 3", "correct or remove that line"),
    ),
    "share.csv": (
        *(_CAPTURE, "t_s,current_A\n0,0%\n1,50%\n2,100%\n"),
        *("in column current_A: '0%' in line 2", "the heading says A: write the numbers in A, not in %"),
    ),
    "minutes.csv": (
        *(_CAPTURE, "t_s,current_A\n0:00,0\n0:05,1.2\n0:10,0\n"),
        *("in column t_s: '0:00' in line 2", "with the hour, 0:00:05, or in seconds, 5\n"),
    ),
    "dates.csv": (
        *(_INVERT, "t,value\n2024-05-01,0\n2024-05-02,1\n2024-05-03,0\n"),
        *("'2024-05-01' in line 2", "write the time in seconds, or a date with its time"),
    ),
    "blank.csv": (
        _IMPORT,
        "t,I,F\n0,0,0\n1,,1\n",
        "has a blank cell in column I, line 3",
        "remove that row, or",
    ),
    "overload.csv": (_IMPORT, "t,I,F\n0,0,0\n1,1,9.9e37\n", "(an overload) in column F, line", "remove"),
    "none.csv": (_IMPORT, "t,I,F\n0,,0\n1,,1\n2,,2\n", "no numbers in column I: all 3 rows", "name another"),
    "side.csv": (
        *(_IMPORT, "t_s,0,1,2,3\ncurrent_A,0,1,2,3\nforce_N,0,4,5,6\n"),
        *("lies on its side: the first cell of each row is a heading (t_s, current_A, force_N)", "transpose"),
    ),
    "letter.csv": (
        _IMPORT,
        "Dear colleague, please find below my measurements of yesterday.\nThe force was large, about 12 N.\n",
        *("letter.csv has no rows of numbers", "one column per quantity"),
    ),
    "data.json": (
        *(
            _IMPORT,
            '{\n "t_s": [0, 1],\n "current_A": [0, 1]\n}\n',
            "data.json is JSON, which import cannot read",
        ),
        "export it as CSV, TSV, .npz, .npy, .mat or .wav",
    ),
    "bad.npy": (_IMPORT, "zK\3\4 nothing", "not a .npy array of numbers that can be read\n", "save it again"),
    "bad.mat": (
        _IMPORT,
        "MATLAB 5.0" * 90,
        "bad.mat is not a MATLAB file that can be read\n",
        "save it again",
    ),
    "later.csv": (_CHANGES, "t_s,rate\n0,60\n0:05,80\n", "line 3: t_s is '0:05'", "write 5 (seconds)"),
    "height.csv": (_CHANGES, "t_s,amplitude\n0,80%\n", "amplitude is '80%', expected a", "write 80\n"),
    "nothing.csv": (_CAPTURE, "", "nothing.csv is empty", "write two columns: t_s,current_A"),
    "shares.csv": (
        *(_INVERT, "time;value\n0;0\n0,3;50%\n0,6;100%\n0,8;0%\n"),
        *("'50%' in column value, line 3: not a number", "write the numbers without %: 50\n"),
    ),
    "comma.csv": (
        *(_CAPTURE, "t_s,current_A\n0,0\n1,1,2\n2,0\n"),
        *(
            "has 3 columns in line 3",
            "write 1.2, or separate the columns by semicolons; otherwise remove a cell\n",
        ),
    ),
}
TABLES |= {name: text for name, (_, text, *_) in _UNREADABLE.items()}
INSIDE |= {
    name: Mistake(tuple(line.format(name).split()), 3, where, then)
    for name, (line, _, where, then) in _UNREADABLE.items()
}
