"""The command line as a user meets it: quick, one message for bad input, exit codes, nothing half-written."""

from __future__ import annotations

import ast
import csv
import importlib
import io
import json
import os
import signal
import subprocess
import sys
import time
import warnings
import zlib
from pathlib import Path

import numpy as np
import psutil
import pytest

import stickslip
from stickslip import cli
from stickslip.cli import COMMANDS, run
from stickslip.system.cache import heal

SHIPPED = Path(__file__).parents[1] / "scenarios" / "hidden-effect"
SCENARIO = """
schema = 1
title = "small"
[block]
mass = "89.4 g"
spring_stiffness = "1000 N/m"
[drive]
velocity = "200 um/s"
events = 2
[contact]
kind = "power-law"
normal_force = "1.24 N"
friction_coefficient = 0.21
u_max = "0.95 um"
p = 3.3
bins = 32
[output]
sampling_rate = "2 kHz"
"""


@pytest.fixture(autouse=True)
def no_cache(monkeypatch):
    """Tests leave the user's cache alone."""
    monkeypatch.setenv("STICKSLIP_NO_CACHE", "1")


@pytest.fixture
def scenario(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("rig.toml").write_text(SCENARIO)
    return "rig.toml"


def shell(*arguments: str, **options) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "stickslip.cli", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, **options)


def _spent(run, *arguments, **options) -> float:
    """Processor time of a command (s): what others do on this machine does not count."""
    before = os.times()
    assert run(*arguments, **options).returncode == 0
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def test_help_is_quick_and_imports_nothing_heavy():
    code = (
        "import sys; from stickslip.cli import run; run(['--help'])\n"
        "heavy = {'jax', 'numpy', 'diffrax', 'matplotlib', 'xarray', 'pydantic', 'pint', 'scipy'} & set(sys.modules)\n"
        "sys.exit(', '.join(heavy) or 0)"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert found.stderr == ""
    assert found.returncode == 0
    for name in COMMANDS:
        assert name in found.stdout
    parser = [sys.executable, "-c", "import cyclopts, rich.console, rich.table"]
    assert min(_spent(shell, "--help") for _ in range(5)) < 2.5 * min(
        _spent(subprocess.run, parser, check=True) for _ in range(5)
    )


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command_imports_no_jax(name):
    code = f"import sys; from stickslip.cli import run; run(['{name}', '--help']); sys.exit('jax' in sys.modules)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert found.returncode == 0, found.stderr
    assert COMMANDS[name].split(",")[0].split(":")[0][:20] in " ".join(found.stdout.split())


@pytest.mark.parametrize("name", COMMANDS)
def test_help_is_broken_into_lines_by_the_width_alone(name, monkeypatch, capsys):
    """In a line as long as it takes, every option has one."""
    monkeypatch.setenv("COLUMNS", "900")
    assert run([name, "--help"]) == 0
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("│")]
    assert rows and not [row for row in rows if row.startswith("│" + 8 * " ")]
    assert not [row for row in rows if "[default: False]" in row], "a flag that is not given is off"


def test_commands_are_listed_in_the_order_of_ones_work(capsys):
    for arguments, order in (([], list(COMMANDS)), (["challenge"], ["make", "seal", "run", "score"])):
        assert run([*arguments, "--help"]) == 0
        first = [line[2:].split(" ")[0] for line in capsys.readouterr().out.splitlines() if line.startswith("│ ")]
        assert [name for name in first if name in order] == order


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_an_example_that_is_understood(name, capsys):
    example = cli.EXAMPLES[name]
    assert run([name, "--help"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert f"Example: stickslip {example}" in told and " ".join(COMMANDS[name].split()) in told
    assert cli.make_app().parse_args(example.split(), exit_on_error=False, print_error=False)


@pytest.mark.parametrize("option", ["--version", "-V"])
def test_the_version_is_told_with_the_programs_name(capsys, option):
    assert run([option]) == 0
    assert capsys.readouterr().out.split() == ["stickslip", stickslip.__version__]


def test_the_shell_completes_commands_and_options(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))  # a line is added to .bashrc there
    script = tmp_path / "stickslip.bash"
    assert run(["--install-completion", "--shell", "bash", "--output", str(script)]) == 0
    ask = f'source {script}; COMP_WORDS=(stickslip "$@"); COMP_CWORD=$#; _stickslip; echo "${{COMPREPLY[@]}}"'
    for words, completed in ((["diag"], "diagnose"), (["fit", "--ad"], "--add"), (["challenge", "sc"], "score")):
        done = subprocess.run(["bash", "-c", ask, "bash", *words], capture_output=True, text=True, timeout=60)
        assert done.stdout.split() == [completed], done.stderr


def test_help_says_the_exit_codes(capsys):
    assert run(["--help"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "Exit codes: 0 done, 1 failure, 2 bad input, 3 finished but unresolved, 130 interrupted." in told
    assert "Prints CSV" not in told, "the list has the first line of each"


def test_importing_the_package_imports_nothing():
    code = "import sys, stickslip; assert 'jax' not in sys.modules and 'numpy' not in sys.modules; stickslip.InputError"
    assert subprocess.run([sys.executable, "-c", code], timeout=60).returncode == 0


def test_a_notebook_keeps_what_it_compiles_where_it_is_asked_to(tmp_path):
    code = (
        "import stickslip as ss; folder = ss.keep_compiled(); import jax, jax.numpy as jnp;"
        "assert ss.keep_compiled() == folder;"  # the cell is run again
        "jax.jit(lambda x: x + 1.0)(jnp.ones(3)).block_until_ready(); print(folder, len([*folder.iterdir()]))"
    )
    own = {k: v for k, v in os.environ.items() if not k.startswith(("JAX_", "STICKSLIP_"))}
    made = subprocess.run(
        [sys.executable, "-c", code], env={**own, "XDG_CACHE_HOME": str(tmp_path)}, capture_output=True, text=True,
        timeout=60,
    )  # fmt: skip
    folder, number = made.stdout.split()
    assert Path(folder).is_relative_to(tmp_path) and int(number) > 0


def test_public_names_are_there():
    import stickslip

    for name in stickslip.__all__:
        assert getattr(stickslip, name) is not None
    assert dir(stickslip) == sorted(stickslip.__all__)
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        stickslip.simulat  # noqa: B018


def test_a_type_checker_sees_every_public_name_where_it_is():
    """The block for type checkers, which never runs, names what is loaded when it is first used."""
    import stickslip

    (block,) = (
        node for node in ast.parse(Path(stickslip.__file__).read_text()).body
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    )  # fmt: skip
    found = {
        name.asname: getattr(importlib.import_module(".".join(filter(None, ("stickslip", node.module)))), name.name)
        for node in block.body if isinstance(node, ast.ImportFrom) for name in node.names
    }  # fmt: skip
    found |= {"find_events": found.pop("_segment"), "make_effect": found.pop("_make")}
    assert type(stickslip.workbench) is found.pop("CallableModule")
    assert {"__version__", "workbench", *found} == set(stickslip.__all__)
    for name, value in found.items():
        assert getattr(stickslip, name) is value


def test_simulate_prints_a_table_and_writes_nothing_unasked(scenario, capsys):
    assert run(["simulate", scenario]) == 0
    out = capsys.readouterr()
    assert "2 slip events" in out.out
    assert "recurrence" in out.out
    assert out.err == ""
    assert os.listdir() == ["rig.toml"]  # noqa: PTH208


def test_json_is_valid_and_alone_on_stdout(scenario, capsys):
    assert run(["simulate", scenario, "--json", "--set", "contact.p=2"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert len(result["events"]) == 2
    assert result["events"][0]["recurrence"] is None
    assert result["scenario"]["contact"]["p"] == 2
    assert result["changes"] == ["contact.p=2"]
    assert result["units"]["slip"] == "m"


def test_run_folder_rules(scenario, capsys):
    assert run(["simulate", scenario, "--out", "out"]) == 0
    first = Path("out/result.json").read_text()
    assert "trace.png" in capsys.readouterr().out
    assert run(["simulate", scenario, "--out", "out"]) == 2
    assert "--force" in capsys.readouterr().err
    assert Path("out/result.json").read_text() == first
    assert run(["simulate", scenario, "--out", "out", "--force", "--set", "drive.events=1"]) == 0
    assert len(json.loads(Path("out/result.json").read_text())["events"]) == 1


def test_overrides_may_follow_one_set(scenario, capsys):
    assert run(["simulate", "--set", "contact.p=2", "drive.events=1", scenario, "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["changes"] == ["contact.p=2", "drive.events=1"]


ROUGH = ["--set", 'contact={kind="rough-line", normal_force=0.3, friction_coefficient=0.2, H=0.5, springs=64}']
BAD = {
    "no such file": (["simulate", "rg.toml"], ["rg.toml", "did you mean 'rig.toml'"]),
    "no unit": (["simulate", "rig.toml", "--set", "block.mass=3 x"], ["--set", "block.mass", "3 x"]),
    "mass zero": (["simulate", "rig.toml", "--set", "block.mass=0"], ["block.mass", "above 0 kg"]),
    "negative load": (
        ["simulate", "rig.toml", "--set", "contact.normal_force=-1N"],
        ["contact.normal_force", "above 0 N"],
    ),
    "unknown key": (["simulate", "rig.toml", "--set", "contact.umax=1um"], ["did you mean 'u_max'"]),
    "no scenario": (["simulate", "--set", "a.b=1"], ["needs SCENARIO"]),
    "two scenarios": (["simulate", "rig.toml", "rig2.toml"], ["more than one"]),
    "unknown option": (["simulate", "rig.toml", "--ot", "x"], ["--ot"]),
    "unknown command": (["simulat"], ["did you mean 'simulate'"]),
    "unknown option before a command": (["--verison"], ["no option '--verison'", "did you mean '--version'"]),
    "not a series": (["simulate", "rig.toml", "--sweep", "drive.velocity=1:2"], ["not a series"]),
    "series of nothing": (
        ["simulate", "rig.toml", "--sweep", "drive.velocty=1e-5:1e-4:3"],
        ["did you mean 'velocity'"],
    ),
    "series in a wrong unit": (
        ["simulate", "rig.toml", "--sweep", "drive.velocity=20um/s:1mm:3"],
        ["drive.velocity", "'mm'", "m/s"],
    ),
    "values in a wrong unit": (["simulate", "rig.toml", "--sweep", "drive.velocity=20um/s,1mm"], ["'mm'", "m/s"]),
    "full contact": (
        ["simulate", "rig.toml", *ROUGH, "--set", "contact.h_rms=1nm"],
        ["rig.toml", "line_length L", "h_rms", "F_n"],
    ),
    "creep in full contact": (["creep", "rig.toml", *ROUGH, "--set", "contact.h_rms=1nm"], ["rig.toml", "h_rms"]),
    "unknown effect": (["effects", "wear-and-tear"], ["wear"]),
    "unknown model": (["effects", "--model", "static,weer"], ["did you mean 'wear'"]),
    "no such thing": (["new", "thing"], ["thing"]),
    "too few points": (["creep", "rig.toml", "--points", "1"], ["--points"]),
    "folder of others": (["simulate", "rig.toml", "--out", "."], ["."]),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_message_and_exit_code_2(scenario, capsys, case):
    arguments, words = BAD[case]
    assert (
        run([*arguments, *(["--out", "out"] if arguments[0] == "simulate" and "--out" not in arguments else [])]) == 2
    )
    out = capsys.readouterr()
    assert out.out == ""
    assert out.err.startswith("stickslip: ")
    assert "Traceback" not in out.err
    assert out.err.count("stickslip: ") == 1
    for word in words:
        assert word in out.err
    assert os.listdir() == ["rig.toml"]  # noqa: PTH208


def test_a_failing_solver_is_exit_code_1(scenario, capsys, monkeypatch):
    from stickslip.errors import SolveError

    def fail(*args, **kwargs):
        raise SolveError("the integration stopped at t = 1 s: loosen the tolerance")

    monkeypatch.setattr("stickslip.simulation.scenario.simulation.integrate", fail)
    assert run(["simulate", scenario, "--out", "out"]) == 1
    assert "loosen the tolerance" in capsys.readouterr().err
    assert os.listdir() == ["rig.toml"]  # noqa: PTH208


def test_interrupting_a_run_leaves_nothing(scenario, capsys, monkeypatch):
    def interrupt(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr("stickslip.simulation.scenario.simulation.integrate", interrupt)
    assert run(["simulate", scenario, "--out", "out"]) == 130
    assert "nothing was written" in capsys.readouterr().err
    assert os.listdir() == ["rig.toml"]  # noqa: PTH208


def in_series(monkeypatch, interrupted: int) -> list[float]:
    """Interrupts one of the runs of a series; what is returned are the exponents of all that were begun."""
    from stickslip.objects import sweep

    real, begun = sweep.simulate, []

    def simulate(scenario, *args):
        begun.append(scenario.file.contact.p)
        if len(begun) == interrupted:
            raise KeyboardInterrupt
        return real(scenario, *args)

    monkeypatch.setattr(sweep, "simulate", simulate)
    return begun


def kept(folder: str) -> dict:
    """Everything that a run folder says but how long it took."""
    found = json.loads(Path(folder, "result.json").read_text())
    return {key: value for key, value in found.items() if key != "seconds"}


def test_an_interrupted_series_resumes_from_its_finished_runs(scenario, capsys, monkeypatch):
    series = ["simulate", scenario, "--sweep", "contact.p=2,3,4"]
    begun = in_series(monkeypatch, 2)
    assert run([*series, "--out", "out"]) == 130
    assert "1 finished runs are kept, and the same command resumes from them" in capsys.readouterr().err
    assert not Path("out").exists()
    assert run([*series, "--out", "out"]) == 0
    assert begun == [2, 3, 3, 4]
    assert run([*series, "--out", "at-once"]) == 0
    assert kept("out") == kept("at-once")
    for name in ("arrays.nc", "series.csv"):
        assert Path("out", name).read_bytes() == Path("at-once", name).read_bytes()
    assert sorted(p.name for p in Path("out").iterdir()) == sorted(p.name for p in Path("at-once").iterdir())


@pytest.mark.slow
def test_a_series_does_not_resume_from_another_or_from_damaged_runs(scenario, monkeypatch):
    begun = in_series(monkeypatch, 3)
    assert run(["simulate", scenario, "--sweep", "contact.p=2,3,4", "--out", "out"]) == 130
    first, _ = sorted(Path("out.partial/pieces").iterdir(), key=lambda path: path.stat().st_mtime_ns)
    damaged = bytearray(first.read_bytes())
    middle = len(damaged) // 2
    damaged[middle : middle + 4096] = bytes(4096)  # a page that a failing disk did not write
    first.write_bytes(damaged)
    assert run(["simulate", scenario, "--sweep", "contact.p=2,3,4", "--out", "out"]) == 0
    assert begun == [2, 3, 4, 2, 4]
    begun = in_series(monkeypatch, 2)
    assert run(["simulate", scenario, "--sweep", "contact.p=2,3,4", "--out", "other"]) == 130
    assert run(["simulate", scenario, "contact.bins=80", "--sweep", "contact.p=2,3,4", "--out", "other"]) == 0
    assert begun == [2, 3, 2, 3, 4]


@pytest.mark.slow
def test_a_series_takes_up_finished_runs_of_its_values_and_nothing_else_that_lies_there(scenario, monkeypatch):
    begun = in_series(monkeypatch, 3)
    assert run(["simulate", scenario, "--sweep", "contact.p=2,3,4", "--out", "out"]) == 130
    for name in ("trace-05.csv", "models.npz"):  # of a command that was killed while it wrote
        Path("out.partial", name).write_text("old")
    assert run(["simulate", scenario, "--sweep", "contact.p=3,2.5", "--out", "out", "--jobs", "2"]) == 0
    assert begun[:3] == [2, 3, 4] and 3 not in begun[3:]
    assert [r["value"] for r in json.loads(Path("out/result.json").read_text())["runs"]] == [3, 2.5]
    assert sorted(os.listdir("out")) == [  # noqa: PTH208
        "arrays.nc", "result.json", "series.csv", "series.png", "static_vs_inertial.png"
    ]  # fmt: skip


@pytest.mark.parametrize("fails", ["a run", "a picture"])
def test_a_series_that_cannot_go_on_says_what_is_kept(scenario, capsys, monkeypatch, fails):
    from stickslip.errors import SolveError
    from stickslip.objects import sweep
    from stickslip.show import simulated

    real, done = sweep.simulate, []

    def simulate(*args):
        if fails == "a run" and done:
            raise SolveError("the integration stopped at t = 1 s: loosen the tolerance")
        done.append(1)
        return real(*args)

    def drawn(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr(sweep, "simulate", simulate)
    if fails == "a picture":
        monkeypatch.setattr(simulated, "write_series", drawn)
    code = run(["simulate", scenario, "--out", "out", "--sweep", "contact.p=2,3"])
    said = capsys.readouterr().err
    assert code == (1 if fails == "a run" else 130)
    assert f"{len(done)} finished runs are kept, and the same command resumes from them" in said
    assert ("loosen the tolerance" in said) == (fails == "a run")


def test_an_interrupt_that_falls_into_a_destructor_is_not_lost():
    code = """
import signal, time
from stickslip.cli import keep_interrupts

class Hook:
    def __del__(self):
        raise KeyboardInterrupt

signal.signal(signal.SIGINT, signal.default_int_handler)
keep_interrupts()
try:
    Hook()
    time.sleep(5)
    print("lost")
except KeyboardInterrupt:
    print("kept")
"""
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert found.stdout.strip() == "kept"
    assert found.stderr == ""


def test_the_exit_does_not_wait_for_a_timer_that_an_interrupted_library_left():
    code = (
        "import sys, threading; from stickslip.cli import main; threading.Timer(60.0, print).start()\n"
        "sys.argv = ['stickslip', '--version']; main()"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=30)
    assert found.returncode == 0
    assert found.stderr == ""


@pytest.mark.slow
@pytest.mark.parametrize("command", ["simulate", "fit"])
def test_a_signal_ends_the_program_cleanly(command, scenario, tmp_path):
    """In the middle of its work."""
    long = {
        "simulate": [scenario, "--out", "out", "--set", "drive.events=90000"],
        "fit": [str(SHIPPED / "campaign.toml"), "--add", "rate-and-state", "--out", "out"],
    }
    before = sorted(SHIPPED.iterdir())
    # a shell's background job ignores the signal and hands that on; a person's terminal does not
    process = subprocess.Popen(
        [sys.executable, "-m", "stickslip.cli", command, *long[command]],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    try:
        deadline = time.monotonic() + 60
        # the folder of a fit is begun when all is fitted; it has spent as much long after its imports, before its end
        spent = psutil.Process(process.pid).cpu_times
        while time.monotonic() < deadline:
            if spent().user > 4.0 if command == "fit" else Path("out.partial").exists():
                break
            time.sleep(0.05)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130
    assert "interrupted" in err
    assert "Traceback" not in err
    assert os.listdir() == ["rig.toml"]  # noqa: PTH208
    assert sorted(SHIPPED.iterdir()) == before


def test_a_series_of_runs(scenario, capsys):
    assert run(["simulate", scenario, "--sweep", "drive.velocity=100um/s:400um/s:3", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["table"]["value"] == pytest.approx([1e-4, 2e-4, 4e-4])
    recurrence = result["table"]["recurrence"]
    assert recurrence[0] > recurrence[1] > recurrence[2]


def test_creep_is_csv(scenario, capsys):
    assert run(["creep", scenario]) == 0
    rows = list(csv.reader(io.StringIO(capsys.readouterr().out)))
    assert rows[0] == ["tau", "u", "t"]
    tau, u, t = np.array(rows[1:], float).T
    assert tau[0] == 0 and tau[-1] == 1
    np.testing.assert_allclose(u[1:-1], 0.95e-6 * (1 - (1 - tau[1:-1]) ** (1 / 3.3)), rtol=2e-4)
    np.testing.assert_allclose(t, (0.21 * 1.24 * tau / 1000.0 + u) / 2e-4, rtol=1e-9)


def test_creep_into_a_folder(scenario, capsys):
    assert run(["creep", scenario, "--out", "out", "--points", "50", "--time", "paper"]) == 0
    lines = Path("out/creep.csv").read_text().splitlines()
    assert lines[0] == "tau,u,t"
    assert len(lines) == 51
    assert float(lines[-1].split(",")[2]) == pytest.approx(0.21 * 1.24 / 1000 / 2e-4)
    assert json.loads(Path("out/result.json").read_text())["kind"] == "creep"
    assert Path("out/creep.png").stat().st_size > 5000


def test_creep_of_a_standing_drive_is_refused(scenario, capsys):
    changes = ["--set", "drive.events=1", "--set", "drive.velocity=0"]
    assert run(["creep", scenario, *changes]) == 2
    assert "without drive motion" in capsys.readouterr().err


def test_new_files_are_not_overwritten(scenario, capsys):
    assert run(["new", "scenario"]) == 0
    assert run(["new", "campaign", "mine.toml"]) == 0
    assert run(["new", "scenario"]) == 2
    assert "--force" in capsys.readouterr().err
    assert run(["new", "scenario", "--force"]) == 0
    assert run(["new", "scenario", "-"]) == 0
    assert "[contact]" in capsys.readouterr().out
    assert run(["new", "scenario", "nowhere/x.toml"]) == 2
    assert sorted(os.listdir()) == ["mine.toml", "rig.toml", "scenario.toml"]  # noqa: PTH208


def test_a_new_scenario_runs(scenario, capsys):
    assert run(["new", "scenario"]) == 0
    short = ["drive.events=1", "contact.bins=32", "contact.springs=256", "output.sampling_rate=2000"]
    assert run(["simulate", "scenario.toml", *(part for text in short for part in ("--set", text))]) == 0
    assert "1 slip event" in capsys.readouterr().out


def test_effects_are_listed_and_explained(capsys):
    assert run(["effects"]) == 0
    listed = capsys.readouterr().out
    assert run(["effects", "contact-ageing"]) == 0
    explained = capsys.readouterr().out
    for word in ("contact-ageing", "sensor-drift", "friction:", "sensor:"):
        assert word in listed
    for word in ("rate", "onset_time", "confused with", "source", "ln"):
        assert word in explained


def test_equations_of_a_model(capsys):
    assert run(["effects", "--model", "static"]) == 0
    assert "healing_time" not in capsys.readouterr().out
    assert run(["effects", "--model", "static,inertia,contact-ageing"]) == 0
    full = capsys.readouterr().out
    for word in ("block.mass", "weakening.healing_time", "contact-ageing.rate", "0.0894"):
        assert word in full
    assert run(["effects", "--model", "static,inertia,contact-ageing", "--latex"]) == 0
    latex = capsys.readouterr().out
    assert r"\ddot x" in latex and r"\begin{align*}" in latex
    for other in ([], ["contact-ageing"]):
        assert run(["effects", *other, "--latex"]) == 2
        assert "belongs to --model" in capsys.readouterr().err


OWN = """
from jax import Array
from stickslip.effects import BodyForce, parameter

class Push(BodyForce):
    tag = "my-push"
    summary = "a constant push"
    equation = "F = F_0"
    amplitude = "size"
    family = "block"
    size: Array = parameter(0.0, unit="N", lower=-1.0, upper=1.0, null=0.0, doc="push")

    def force(self, state, motion, contact):
        return self.size
"""


def test_an_effect_of_ones_own_is_listed(tmp_path, capsys):
    (tmp_path / "push.py").write_text(OWN)
    assert run(["effects", "my-push", "--effect", str(tmp_path / "push.py")]) == 0
    assert "a constant push" in capsys.readouterr().out
    assert run(["effects", "--effect", str(tmp_path / "none.py")]) == 2


@pytest.mark.parametrize("value", ["nan", "1e400"])
def test_a_series_of_no_numbers_is_refused(scenario, capsys, value):
    assert run(["simulate", scenario, "--sweep", f"drive.velocity={value}"]) == 2
    assert "drive.velocity" in capsys.readouterr().err


def test_titles_with_formula_signs_are_drawn_as_they_stand(scenario, tmp_path, capsys):
    text = Path(scenario).read_text().replace('"small"', r"'$\foo$ 50 %'")
    Path(scenario).write_text(text)
    assert run(["creep", scenario, "--out", str(tmp_path / "creep")]) == 0
    assert run(["simulate", scenario, "--out", str(tmp_path / "run")]) == 0
    assert (tmp_path / "run" / "trace.png").is_file()


def test_the_folder_one_is_in_is_no_new_run_folder(scenario, tmp_path, monkeypatch, capsys):
    inside = tmp_path / "inside"
    inside.mkdir()
    monkeypatch.chdir(inside)
    code = run(["creep", scenario, "--out", "."])
    assert code in (0, 2)
    assert "Traceback" not in capsys.readouterr().err


def test_broken_entries_of_the_cache_are_removed(tmp_path, capsys):
    (tmp_path / "good-cache").write_bytes(zlib.compress(b"code" * 100))
    (tmp_path / "cut-cache").write_bytes(zlib.compress(b"code" * 100)[:-8])
    (tmp_path / "other").write_bytes(b"x")
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        heal(tmp_path)
        warnings.warn("Error reading persistent compilation cache entry for 'jit_f': zlib.error", stacklevel=1)
        warnings.warn("Error writing persistent compilation cache entry for 'jit_f': full", stacklevel=1)
        warnings.warn("Error writing persistent compilation cache entry for 'jit_g': full", stacklevel=1)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["good-cache", "other"]
    assert capsys.readouterr().err.count("compiled code cannot be kept") == 1


@pytest.mark.parametrize(
    ("kind", "text", "words"),
    [
        ("JaxRuntimeError", "RESOURCE_EXHAUSTED: Out of memory allocating 8 bytes", "too much for this machine"),
        ("TerminatedWorkerError", "A worker process managed by the executor", "did memory run out"),
    ],
)
def test_memory_that_runs_out_in_a_library_is_one_message(monkeypatch, capsys, kind, text, words):
    def fail(environment: object) -> None:
        raise type(kind, (RuntimeError,), {})(text)

    monkeypatch.setattr(cli, "make_app", fail)
    assert run([]) == 1
    assert words in capsys.readouterr().err
    monkeypatch.setattr(cli, "make_app", lambda _: (x for x in ()).throw(RuntimeError("a fault of our own")))
    with pytest.raises(RuntimeError):
        run([])


@pytest.mark.slow
def test_a_picture_of_an_effect(tmp_path, capsys):
    picture = tmp_path / "drift.png"
    assert run(["effects", "sensor-drift", "--picture", str(picture)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert run(["effects", "sensor-drift", "--picture", str(picture)]) == 2
    assert run(["effects", "--picture", str(picture)]) == 2
    capsys.readouterr()
    assert run(["effects", "sensor-drift", "--picture", str(tmp_path / "drift.jpg")]) == 2
    assert capsys.readouterr().out == ""


def test_values_of_an_effect_have_their_unit():
    from stickslip.cli.effects import _given
    from stickslip.physics.effects import catalogue

    assert _given(catalogue.get("viscous-drag"), {"drag": 0.012, "exponent": 2.0}) == "drag = 12 mN, exponent = 2"


@pytest.mark.slow
def test_a_terminal_shows_both_traces_beside_the_explanation(capsys, monkeypatch):
    assert run(["effects", "residual-load"]) == 0
    piped = capsys.readouterr().out.splitlines()
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert run(["effects", "residual-load"]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert [line for line in shown if line in piped and line] == [line for line in piped if line]
    number = shown.index("without:")
    assert shown[number - 1].startswith("spring force derived from the reading, from ")
    without, with_it = shown[number + 1 : number + 6], shown[number + 7 : number + 12]
    assert shown[number + 6] == "with lost = 0.196:"
    assert any(line.strip() for line in without)
    assert with_it != without  # the effect is seen


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="threads are counted as Linux lists them")
@pytest.mark.parametrize("chosen", ["", "2"])
def test_linear_algebra_takes_one_thread_unless_told_otherwise(chosen):
    environment = {key: value for key, value in os.environ.items() if not key.endswith("_THREADS")}
    environment |= {"OPENBLAS_NUM_THREADS": chosen} if chosen else {}
    code = (
        "import os; from stickslip.cli import run; run(['--help'])\n"
        "import numpy as np; np.linalg.svd(np.ones((300, 300)))\n"
        "print('threads:', len(os.listdir('/proc/self/task')), file=__import__('sys').stderr)"
    )
    found = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=60)
    cores = len(os.sched_getaffinity(0))
    assert found.stderr == f"threads: {min(int(chosen or 1), cores)}\n"


@pytest.mark.slow
def test_compiled_code_is_kept_and_can_be_switched_off(scenario, tmp_path_factory):
    home = tmp_path_factory.mktemp("cache")
    set_here = ("JAX_", "STICKSLIP_", "EQX_")
    environment = {key: value for key, value in os.environ.items() if not key.startswith(set_here)}
    environment["XDG_CACHE_HOME"] = str(home)
    found = shell("simulate", scenario, env=environment)
    assert found.returncode == 0, found.stderr
    assert list((home / "stickslip" / "traced").iterdir()), "the trace of the integrator must be kept"
    kept = list((home / "stickslip" / "compiled").glob("jit_call-*"))  # of what was traced before
    assert kept, "the integrator itself must be in the cache"
    off = tmp_path_factory.mktemp("off")
    code = "from stickslip.system import cache; assert cache.keep_compiled() is None; import os, equinox\n"
    code += "assert equinox._config.EQX_ON_ERROR == 'nan'"  # else it would compile code with other last digits
    environment |= {"XDG_CACHE_HOME": str(off), "STICKSLIP_NO_CACHE": "1"}
    assert subprocess.run([sys.executable, "-c", code], env=environment, timeout=60).returncode == 0
    assert list(off.iterdir()) == []
    (off / "file").write_text("")
    environment |= {"XDG_CACHE_HOME": str(off / "file"), "STICKSLIP_NO_CACHE": "0"}
    assert subprocess.run([sys.executable, "-c", code], env=environment, timeout=60).returncode == 0
