"""The program without its start: a process that has loaded it all forks a child for each command.

Loading numpy, scipy, h5py and the parser costs more than most commands that the tests run. A child of the
fork runs the program's own ``main``, with its own folder, environment and streams. What a test says about the
start itself (what is loaded, the threads, a terminal, signals) needs a real start: ``program.cold``.

    python -IS tests/warm.py SOCKET WORDS...     passes a command on, as the program on a shell's PATH does
"""

import atexit
import json
import os
import select
import socket
import sys
import traceback

END = b"\n"


def serve(path: str) -> None:
    """Load the program, then run a command for each connection, until standard input is closed."""
    import importlib
    import pkgutil

    import pulsetrainer

    for module in pkgutil.walk_packages(pulsetrainer.__path__, "pulsetrainer."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    import typer
    from scipy import fft, interpolate, linalg, ndimage, optimize, signal, sparse, special, stats  # noqa: F401

    from pulsetrainer.cli import app

    _draw_once()
    app.app = typer.main.get_command(app.app)  # the parser, made once for all children
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(path)
    listener.listen(64)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    while True:
        ready, _, _ = select.select([listener, sys.stdin], [], [])
        if sys.stdin in ready:  # whoever started this has gone
            os.killpg(0, signal.SIGKILL)
        connection, _ = listener.accept()
        if os.fork() == 0:
            _keep(connection)
        connection.close()
        _reap()


def _draw_once() -> None:
    """Load what a figure and a table load when the first of them is made: fonts, formats, styles."""
    import io

    import rich.console
    import rich.markup
    import rich.table  # noqa: F401
    from matplotlib.figure import Figure

    figure = Figure()
    figure.subplots().set_title("once")
    for form in ("svg", "png", "pdf"):
        figure.savefig(io.BytesIO(), format=form)


def _reap() -> None:
    while True:
        try:
            if os.waitpid(-1, os.WNOHANG)[0] == 0:
                return
        except ChildProcessError:
            return


def _keep(connection: socket.socket) -> None:
    """Run one command in a child and answer its exit code."""
    order, streams, _, _ = socket.recv_fds(connection, 1 << 20, 3)
    while not order.endswith(END):
        order += connection.recv(1 << 20)
    child = os.fork()
    if child == 0:
        connection.close()
        _become(json.loads(order), streams)
    _, status = os.waitpid(child, 0)
    connection.sendall(str(os.waitstatus_to_exitcode(status)).encode())
    os._exit(0)


def _become(order: dict, streams: list[int]) -> None:
    """Be the program, to the end of this process."""
    import pulsetrainer
    from pulsetrainer.cli.app import main

    code = 1
    try:
        for number, stream in enumerate(streams):
            os.dup2(stream, number)
            os.close(stream)
        os.chdir(order["folder"])
        os.environ.clear()
        os.environ.update(order["env"])
        if "COVERAGE_PROCESS_START" in os.environ:  # which test runs what: tests/mutation
            import coverage

            coverage.Coverage.current().switch_context(os.environ.get("PYTEST_CURRENT_TEST", ""))
        sys.argv = [os.path.join(pulsetrainer.__path__[0], "__main__.py"), *order["words"]]  # noqa: PTH118
        main()
    except SystemExit as end:
        code = int(end.code or 0)
    except BaseException:
        traceback.print_exc()
    finally:
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def run(path: str, words: list[str], folder: str, env: dict[str, str], streams: tuple[int, int, int]) -> int:
    """Hand a command to the process behind ``path``, with the streams that it shall have; return its code."""
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(path)
        order = json.dumps({"words": words, "folder": folder, "env": env}).encode() + END
        sent = socket.send_fds(connection, [order], list(streams))
        if sent < len(order):  # even an empty rest would be sent, to one who may have answered and gone
            connection.sendall(order[sent:])
        answer = connection.recv(64)
    if not answer:
        raise RuntimeError(f"the process that runs the commands ended during {words}")
    return int(answer)


if __name__ == "__main__":
    if sys.argv[1] == "--serve":
        serve(sys.argv[2])
    sys.exit(run(sys.argv[1], sys.argv[2:], os.getcwd(), dict(os.environ), (0, 1, 2)))  # noqa: PTH109
