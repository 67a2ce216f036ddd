"""The command line. A command is one module of `stickslip.cli` with a function of the same name, and a line here.

Nothing heavy is imported before a command runs, so that ``stickslip --help`` is quick.
"""

from __future__ import annotations

import io
import os
import signal
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from types import FrameType

from cyclopts import App, CycloptsError, MissingArgumentError

from .. import __version__
from ..errors import ArgumentError, InputError, StickslipError, nearest
from ..system import process
from ._environment import Environment

# module and function in it -> what it does, in one line; below it what its own help adds
COMMANDS = {
    "new": "Write a commented scenario or campaign file to start from.",
    "simulate": "Simulate a scenario, or the model of a run folder: trace, slip events, pictures.",
    "creep": "The static creep curve of a scenario's contacts, without inertia.\n\n"
    "Prints CSV with the columns tau (share of full friction), u (m), t (s).",
    "inspect": "Traces of a campaign, their events, repairs, omissions, and what the data can tell.",
    "fit": "Fit the static or the dynamic model to a campaign, and say where it fails.",
    "diagnose": "Find the physical effect the model lacks, add it, and test it on runs left out of the fit.",
    "open": "The workbench in the browser: compare, add an effect, watch the error fall.\n\n"
    "The server runs on this machine until Ctrl-C. Only those who have the printed address, with its random token, "
    "reach it. What was done is kept in a folder .stickslip-workbench beside the campaign's file, and comes back when "
    "the same campaign is opened again.",
    "forecast": "Forecast the next slip from how strength wanders and load rises, and score it on unseen slips.",
    "compare": "Two runs side by side: models, errors by phase, parameters and their differences.",
    "challenge": "Test the diagnosis blindly on campaigns with a hidden effect: make, seal, run, score.",
    "effects": "List the catalogue of effects, explain one, or print a model's equations.",
}

EXAMPLES = {
    "new": "new campaign steel/campaign.toml",
    "simulate": "simulate scenarios/grzemba2014.toml --set drive.velocity=200um/s --out out/run",
    "creep": "creep scenarios/grzemba2014.toml --set contact.H=0.5",
    "inspect": "inspect campaign.toml --out out/inspected",
    "fit": "fit campaign.toml --add contact-ageing --profile weakening.drop --out out/ageing",
    "diagnose": "diagnose campaign.toml --holdout v400 --time-limit 600 --out out/mine",
    "open": "open campaign.toml",
    "forecast": "forecast campaign.toml --run v050 --at 0.5",
    "compare": "compare out/base out/ageing",
    "challenge": "challenge make out/blind --cases 10 --seed 1",
    "effects": "effects contact-ageing --picture ageing.png",
}

GROUPS = ("challenge",)  # commands that have commands, and say themselves how their help looks
EXIT_CODES = "Exit codes: 0 done, 1 failure, 2 bad input, 3 finished but unresolved, 130 interrupted."
FROM_ENVIRONMENT = "Options may also come from the environment: STICKSLIP_DIAGNOSE_JOBS=4 is diagnose --jobs 4."
ABOUT = ("--help", "-h", "--version", "-V")
INTERRUPTED = 130
OPTIONS = {"effects": "add", "profiles": "profile"}  # those called otherwise than the argument


def make_app(environment: Environment | None = None) -> App:
    """The command line's application; commands are imported when they are called."""
    app = App(
        name="stickslip",
        help="Creep and stick-slip of a rough contact: simulate it, measure it, identify the missing effect.\n\n"
        f"{EXIT_CODES}\n\n{FROM_ENVIRONMENT}",
        version=f"stickslip {__version__}",
        version_flags=ABOUT[2:],
        help_flags=ABOUT[:2],
        help_format="plaintext",  # Markdown takes a third of the time; that of a command is read when it is called
        suppress_keyboard_interrupt=False,
        config=environment,
    )
    for number, (name, text) in enumerate(COMMANDS.items()):  # listed in the order of one's work
        told = f"{text}\n\nExample: `stickslip {EXAMPLES[name]}`"
        look = {} if name in GROUPS else {"help_format": "markdown"}
        app.command(f"stickslip.cli.{name}:{name}", name=name, help=told, sort_key=number, **look)
    app.register_install_completion_command(help="Have the shell complete commands and options by the tab key.")
    return app


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line and exit.

    Exit codes: 0 done, 1 failure, 2 bad input, 3 finished but unresolved, 130 interrupted.
    """
    if arguments is not None:
        return run(arguments)
    keep_interrupts()
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal that knows no µ
    try:
        sys.exit(run(sys.argv[1:]))
    finally:
        sys.unraisablehook = sys.__unraisablehook__
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the exit itself is not interrupted
        for thread in threading.enumerate():
            if isinstance(thread, threading.Timer):  # JAX's of a minute, where its start was interrupted: Python waits
                thread.cancel()


def keep_interrupts() -> None:
    """Have an interrupt raised again that came while a destructor or JAX's hook on garbage collection ran.

    Python prints such an exception and goes on; one Ctrl-C in ten was lost so.
    """

    def later() -> None:
        timer = threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT))
        timer.daemon = True
        timer.start()

    def interrupted(number: int, frame: FrameType | None) -> None:
        at = frame
        while at is not None:
            if at.f_code.co_name in ("_xla_gc_callback", "__del__"):
                return later()
            at = at.f_back
        raise KeyboardInterrupt

    def again(lost: sys.UnraisableHookArgs) -> None:
        if issubclass(lost.exc_type, KeyboardInterrupt):
            later()
        else:
            sys.__unraisablehook__(lost)

    sys.unraisablehook = again
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # a job in the background ignores it
        signal.signal(signal.SIGINT, interrupted)


def run(arguments: Sequence[str]) -> int:
    """Run a command line and return its exit code; every error is one message on stderr."""
    environment = Environment()
    try:
        process.begin()
        result = make_app(environment)(
            list(arguments), exit_on_error=False, print_error=False, result_action="return_value"
        )
        sys.stdout.flush()
        return result if isinstance(result, int) else 0
    except CycloptsError as error:
        return _fail(_usage(error))
    except InputError as error:
        if isinstance(error, ArgumentError):
            name = str(error.key)
            error = error.but(key=f"--{OPTIONS.get(name, name).replace('_', '-')}")
        taken = environment.taken
        return _fail(error.but(key=taken.get(error.key, error.key), file=taken.get(str(error.file), error.file)))
    except StickslipError as error:
        return _fail(error)
    except KeyboardInterrupt as error:
        kept = str(error) or "nothing was written"
        print(f"\nstickslip: interrupted; {kept}", file=sys.stderr)
        return INTERRUPTED
    except (MemoryError, RecursionError) as error:
        return _fail(StickslipError(f"this is too much for this machine ({str(error) or type(error).__name__})"))
    except RuntimeError as error:
        found = _of_libraries(error)
        if found is None:
            raise
        return _fail(found)
    except BrokenPipeError:  # such as  stickslip effects | head
        _mute()
        return 1
    except OSError as error:  # a full disk behind the output, a file that vanished while it was read
        _mute()
        where = f"{error.filename}: " if error.filename else ""
        return _fail(InputError(f"{where}the system refused ({error.strerror or error})"))


def _of_libraries(error: RuntimeError) -> StickslipError | None:
    """What JAX and joblib raise where memory runs out, as the program's own error; None for all else."""
    kind = type(error).__name__
    if kind in ("JaxRuntimeError", "XlaRuntimeError") and "RESOURCE_EXHAUSTED" in str(error):
        return StickslipError(f"this is too much for this machine ({str(error).splitlines()[0][:200]})")
    if kind in ("TerminatedWorkerError", "BrokenProcessPool"):
        return StickslipError(
            "a worker process was ended by the system; did memory run out?"
            "\n  to fix: repeat the command, which resumes from the finished parts; --jobs 1 takes the least memory"
        )
    return None


def _mute() -> None:
    """What is left in the buffer of stdout cannot be written; its flush at exit would complain once more."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fail(error: StickslipError) -> int:
    print(f"stickslip: {error}", file=sys.stderr)
    return error.exit_code


def _usage(error: CycloptsError) -> InputError:
    """A wrong command line in the form all messages have."""
    unused = list(getattr(error, "unused_tokens", None) or [])
    command = list(getattr(error, "command_chain", None) or [])
    hint = f"stickslip {' '.join([*command, '--help'])}"
    if not command and unused:
        option = unused[0].startswith("-")
        what = f"there is no option '{unused[0]}' before a command" if option else f"there is no command '{unused[0]}'"
        return InputError(what, hint=f"{nearest(unused[0], ABOUT if option else COMMANDS)}\n  see {hint}")
    if isinstance(error, MissingArgumentError) and not error.keyword and error.argument:
        name = error.argument.name
        name = name if error.argument.field_info.is_keyword_only else name.strip("-").upper()
        return InputError(f"{' '.join(command)} needs {name}", hint=f"see {hint}")
    return InputError(" ".join(str(error).split()), hint=f"see {hint}")
