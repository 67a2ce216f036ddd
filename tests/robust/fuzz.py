"""Fuzzing of everything that reads a file: mutations of valid files, and random bytes.

Only the program's own errors may come out. ``python -m tests.robust.fuzz --number 100000`` prints what else did, and
writes docs/results/robustness.json. Input
``n`` of a seed is always the same: ``--first n --number 1 --keep FOLDER`` keeps it. With ``--commands`` what is refused
goes through a command of the program as well, which must end with 2, in words, and leave no file; of what can be read
every fiftieth is inspected to the end.

Inputs are read in child processes of many inputs each, with bounded memory: compiled libraries crash and hang too.
The program's own precaution against that (`stickslip.data.readers.guarded_reading`) costs a process for each file and
is switched off at first; an input that takes a child down is read again with it.
"""

from __future__ import annotations

import argparse
import faulthandler
import io
import json
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from tests.kept_results import keep_table

from .seeds import beside, seeds, tables

PATIENCE = 10  # s of processor time for one input; the slowest valid one takes a tenth of a second
MEMORY = 6 << 30  # bytes of address space of a child
CHUNK = 2000  # inputs of a child
MOST_CRASHES = 200
MANY = 100_000  # inputs from which a campaign is kept
GUARDED = "crashed the library that reads them, refused by the guard"

_ODD = [
    b"", b"0", b"-1", b"1e999", b"-1e999", b"nan", b"inf", b"1e-320", b"9" * 40, b"2147483648", b"-9223372036854775809",
    b"\x00", b"\x00" * 8, b"\xff" * 4, b"\xff" * 8, b"\x7f\xff\xff\xff", b"\xff\xff\xff\x7f", b"\r", b"\n", b"\r\n",
    b"\xef\xbb\xbf", b"\xff\xfe", b"\xc3\x28", b"\xe2\x80\xae", b"'", b'"', b"#", b",", b";", b"    -1\n", b"%s%n",
    b"[" * 3000, b"{a=" * 1500, b"true", b"[]", b"{}", b'""', b"'''", b'"""', b"1979-05-27T07:32:00Z", b"0x10", b"1_0",
    b'"1 um/s"', b'"1 N"', b'"1e400 m"', b'"-5 s"', b'"m m m"', b'"9**9**9 s"', b'"(((((((((((((((((s)"', b'"nan s"',
    b'"../../etc/passwd"', b'"/dev/zero"', b'"."', b'"\\u0000"', b'"/"', b'"\\uD800"', b"{ column = 0, unit = 's' }",
    b'{ guess = "1 N", lower = 2, upper = nan }', b"[[trace]]", b"[drive]", b"a.b.c.d = 1", b"<script>", b"__import__",
]  # fmt: skip


def mutated(rng: np.random.Generator, pool: list[tuple[str, bytes]]) -> tuple[str, bytes]:
    """A file made from a valid one by one to eight changes; one in twenty is random bytes."""
    name, content = pool[rng.integers(len(pool))]
    if rng.random() < 0.05:
        return name, rng.bytes(int(rng.integers(0, 400)))
    data = bytearray(content)
    for _ in range(int(rng.integers(1, 9)) if rng.random() < 0.5 else 1):
        a = int(rng.integers(len(data) + 1))
        b = min(a + int(2 ** rng.uniform(0, 8)), len(data))
        kind = rng.integers(10)
        if kind == 0 and data:
            data[min(a, len(data) - 1)] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            data[a:b] = rng.bytes(b - a)
        elif kind == 2:
            del data[a:b]
        elif kind == 3:
            data[a:a] = data[a:b] * int(rng.integers(1, 4))
        elif kind == 4:
            del data[a:]
        elif kind == 5:
            other = pool[rng.integers(len(pool))][1]
            c = int(rng.integers(len(other) + 1))
            data[a:b] = other[c : c + int(2 ** rng.uniform(0, 10))]
        elif kind == 6:
            data[a : a + 8] = int(rng.integers(-(2**62), 2**62)).to_bytes(8, "little", signed=True)
        else:
            _odd_field(rng, data, a, b)
    return name, bytes(data)


def _odd_field(rng: np.random.Generator, data: bytearray, a: int, b: int) -> None:
    """Put something odd in place of a field, a TOML value or a line, else of a few bytes."""
    odd = _ODD[rng.integers(len(_ODD))]
    patterns = (rb"(?<=[,;\t\n ])[-+.\w]+", rb"(?<== )[^\n]*", rb"(?<=\n)[^\n]*(?=\n)", rb'"[^"\n]*"', rb"(?<=\n)\w+")
    fields = [m.span() for m in re.finditer(patterns[rng.integers(len(patterns))], data)]
    if fields and rng.random() < 0.8:
        a, b = fields[rng.integers(len(fields))]
    data[a:b] = odd


def inputs(seed: int, number: int) -> tuple[str, bytes]:
    """Name and content of an input: two in three are measurements, the others campaigns and scenarios."""
    rng = np.random.default_rng([seed, number])
    return mutated(rng, _pool("tables") if rng.random() < 1 / 3 else _pool("seeds"))


_POOLS: dict[str, list[tuple[str, bytes]]] = {}


def _pool(kind: str) -> list[tuple[str, bytes]]:
    if kind not in _POOLS:
        _POOLS[kind] = seeds() if kind == "seeds" else tables()
    return _POOLS[kind]


def load(path: Path) -> None:
    """Read a file with everything that reads it."""
    if path.name.startswith("campaign"):
        from stickslip.data.campaign import load_campaign, load_traces

        load_traces(load_campaign(path))
    elif path.name.startswith("scenario"):
        from stickslip.simulation.scenario.drive import load_point
        from stickslip.simulation.scenario.load import load_scenario

        scenario = load_scenario(path)
        load_point(scenario.file.drive, scenario.folder)
    else:
        from stickslip.data.campaign import load_campaign, load_traces

        campaign = path.parent / "of-one.toml"
        campaign.write_text(
            f'schema = 1\n[rig]\n[[trace]]\nfile = "{path.name}"\nsampling_rate = "1 kHz"\n'
            'displacement = { column = 1, unit = "um" }\ndrive_velocity = "50 um/s"\n'
        )
        load_traces(load_campaign(campaign))


def prepare(folder: Path) -> None:
    """Load what is valid, so that everything is imported before a clock runs."""
    for name, content in (*tables(), *seeds()):
        for other, text in (*beside().items(), (name, content)):
            (folder / other).write_bytes(text)
        load(folder / name)


class Hang(BaseException):
    """An input took longer than it may."""


@contextmanager
def patience(seconds: int) -> Iterator[None]:
    """Raise `Hang` in what takes too long; what does not come back from compiled code either ends the process."""

    def late(signal: int, frame: Any) -> None:
        raise Hang(f"more than {seconds} s")

    before = signal.signal(signal.SIGVTALRM, late)
    try:
        signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
        faulthandler.dump_traceback_later(20 * seconds, exit=True, file=sys.__stderr__)
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def try_one(folder: Path, name: str, content: bytes) -> tuple[str, str]:
    """Load an input in an empty folder: ``("refused" | "read" | "fault", what)``."""
    from stickslip.errors import InputError

    for old in folder.iterdir():
        old.unlink()
    for other, text in beside().items() if name.endswith(".toml") else ():
        (folder / other).write_bytes(text)
    path = folder / name
    path.write_bytes(content)
    allowed = {p.name for p in folder.iterdir()} | {"of-one.toml"}
    try:
        with patience(PATIENCE), warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            load(path)
    except InputError as error:
        if not str(error).strip() or "Traceback" in str(error):
            return "fault", f"a message without words: {error!r}"
        outcome = "refused", error.what[:50]
    except (Exception, Hang) as error:
        last = traceback.extract_tb(error.__traceback__)
        own = [f for f in last if "stickslip" in f.filename and "robust" not in f.filename] or last
        return "fault", f"{type(error).__name__} at {Path(own[-1].filename).name}:{own[-1].lineno}: {str(error)[:120]}"
    else:
        outcome = "read", ""
    left = {p.name for p in folder.iterdir()} - allowed
    if left:
        return "fault", f"left behind: {sorted(left)}"
    spoken = [f"{w.category.__name__}: {str(w.message)[:80]}" for w in caught]
    return ("fault", f"warned: {spoken[0]}") if spoken else outcome


COMMANDS = {
    "scenario": (["simulate"], ["creep"]),
    "campaign": (["inspect"], ["fit", "--model", "static"], ["fit", "--model", "inertial"], ["diagnose"]),
}


def command_of(name: str, number: int) -> list[str]:
    """The command that an input goes through."""
    kind = "scenario" if name.startswith("scenario") else "campaign"
    first, *more = COMMANDS[kind][number % len(COMMANDS[kind])]
    return [first, name if name.endswith(".toml") else "of-one.toml", *more]


def try_command(folder: Path, arguments: list[str], refused: bool) -> str:
    """Run a command on what `try_one` has left in the folder; what was wrong with its end, if anything."""
    from stickslip.cli import run

    before = {p.name for p in folder.iterdir()}
    said = io.StringIO()
    command, name, *more = arguments
    try:
        with patience(4 * PATIENCE), redirect_stderr(said), redirect_stdout(io.StringIO()):
            code = run([command, str(folder / name), *more, "--out", str(folder / "out")])
    except (Exception, Hang) as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        return f"{command}: {type(error).__name__} at {Path(last.filename).name}:{last.lineno}: {str(error)[:120]}"
    words = said.getvalue()
    left = {p.name for p in folder.iterdir()} - before
    if "Traceback" in words:
        return f"{command}: a traceback: {words[-200:]}"
    if code == 2 and (left or not words.startswith("stickslip: ")):
        return f"{command}: refused, and left {sorted(left)}, said {words[:100]!r}"
    if (refused and code != 2) or code not in (0, 2, 3):
        return f"{command}: ended with {code}: {words[:100]!r}"
    shutil.rmtree(folder / "out", ignore_errors=True)
    return ""


def child(seed: int, first: int, number: int, state: Path, guarded: bool, commands: bool) -> None:
    """Try inputs one after the other; every outcome is a line of JSON on stdout, so that a crash loses no other."""
    import resource

    from stickslip.data.readers import guarded_reading

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    guarded_reading.ENABLED, guarded_reading.PATIENCE = guarded, 4.0
    with tempfile.TemporaryDirectory() as folder:
        prepare(Path(folder))
        for n in range(first, first + number):
            state.write_text(str(n))
            outcome, what = try_one(Path(folder), *inputs(seed, n))
            counts = Counter([outcome])
            if commands and (outcome == "refused" or (outcome == "read" and n % 50 == 0)):
                name = inputs(seed, n)[0]
                arguments = command_of(name, n // 2)
                if outcome == "read":
                    arguments = ["inspect", arguments[1]]
                if outcome == "refused" or not name.startswith("scenario"):
                    counts[f"through {arguments[0]}"] += 1
                    what = try_command(Path(folder), arguments, outcome == "refused")
                    outcome = "fault" if what else outcome
            if outcome == "fault":
                print(json.dumps({"input": n, "what": what}), flush=True)
            print(json.dumps(dict(counts)), flush=True)


def _child(
    seed: int,
    first: int,
    number: int,
    state: Path,
    guarded: bool,
    counts: Counter[str],
    faults: dict[str, list[int]],
    commands: bool = False,
) -> tuple[int, str]:
    """Have a process try inputs; its exit code and the end of what it said."""
    command = [sys.executable, "-m", "tests.robust.fuzz", "--child", str(state)]
    command += ["--seed", str(seed), "--first", str(first), "--number", str(number), *["--guarded"] * guarded]
    command += ["--commands"] * commands
    done = subprocess.run(command, capture_output=True, text=True, errors="replace")
    for line in done.stdout.splitlines():
        try:
            row = json.loads(line)
        except ValueError:
            row = {"input": first, "what": f"printed: {line[:80]}"}
        if "input" in row:
            faults.setdefault(re.sub(r"0x[0-9a-f]+|\d+", "N", row["what"]), []).append(row["input"])
        else:
            counts.update(row)
    return done.returncode, done.stderr.strip()[-300:]


def campaign(
    seed: int, first: int, number: int, seconds: float, tell: Callable[[str], None], commands: bool = False
) -> dict[str, Any]:
    """Try many inputs in children; what came out, by kind."""
    counts: Counter[str] = Counter()
    faults: dict[str, list[int]] = {}
    n, crashes, began = first, 0, time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        state = Path(folder) / "state"
        while n < first + number and crashes < MOST_CRASHES and time.monotonic() - began < seconds:
            size = min(CHUNK, first + number - n)
            code, words = _child(seed, n, size, state, False, counts, faults, commands)
            if code == 0:
                n += size
            else:
                at = int(state.read_text())
                n, crashes = at + 1, crashes + 1
                code, again = _child(seed, at, 1, state, True, Counter(), faults, commands)
                counts["crash" if code else GUARDED] += 1
                if code:
                    faults.setdefault(f"the process ended with {code}: {words} {again}", []).append(at)
            tell(
                f"{n - first} inputs in {time.monotonic() - began:.0f} s: {dict(counts)}, {len(faults)} kinds of fault"
            )
    return {"inputs": n - first, "seed": seed, "counts": dict(counts), "faults": faults}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--number", type=int, default=MANY)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after so long")
    parser.add_argument("--keep", type=Path, help="write the inputs into this folder instead of trying them")
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--commands", action="store_true", help="what is refused goes through a command as well")
    parser.add_argument("--guarded", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child is not None:
        child(options.seed, options.first, options.number, options.child, options.guarded, options.commands)
        return 0
    if options.keep is not None:
        options.keep.mkdir(parents=True, exist_ok=True)
        for n in range(options.first, options.first + options.number):
            name, content = inputs(options.seed, n)
            (options.keep / f"{n}-{name}").write_bytes(content)
        return 0
    found = campaign(options.seed, options.first, options.number, options.seconds, print, options.commands)
    for what, where in sorted(found["faults"].items(), key=lambda item: -len(item[1])):
        print(f"{len(where)} x {what}\n    inputs {where[:6]}")
    print(f"{found['inputs']} inputs, seed {found['seed']}: {found['counts']}")
    if not options.first and found["inputs"] >= MANY:
        command = f"python -m tests.robust.fuzz --number {found['inputs']} --seed {options.seed}"
        command += " --commands" * options.commands
        keep_table("robustness", command, "damaged files", ["what", "number"], table(found), seed=options.seed)
    return 1 if found["faults"] else 0


def table(found: dict[str, Any]) -> list[list[str]]:
    """What became of the inputs, and the commands that were run on them."""
    counts = found["counts"]
    through = {what.partition(" ")[2]: n for what, n in counts.items() if what.startswith("through ")}
    numbers = {
        "damaged files": found["inputs"],
        **{what: counts.get(what, 0) for what in ("refused", "read", GUARDED)},
        "commands run on them": sum(through.values()), **dict(sorted(through.items(), key=lambda item: -item[1])),
        "neither read nor refused with a message": sum(len(where) for where in found["faults"].values()),
    }  # fmt: skip
    return [[what, f"{number:,}".replace(",", " ")] for what, number in numbers.items()]


if __name__ == "__main__":
    sys.exit(main())
