"""Who may come in, what can be opened, and effects of one's own that are saved while it runs."""

from __future__ import annotations

import http.client
import socket
import threading
import time
import urllib.error
import urllib.request
from contextlib import closing
from pathlib import Path, PurePosixPath

import pytest

from stickslip.cli import run
from stickslip.errors import InputError
from stickslip.inference.fit.serialised import KEY, record
from stickslip.objects import example as example_file
from stickslip.objects.example import copied, example, to_work_in
from stickslip.system.runstore import json_text
from stickslip.workbench import own_effects
from stickslip.workbench.history_file import FOLDER
from stickslip.workbench.open_paths import campaign_of, offered, opened
from stickslip.workbench.serve import PATIENCE, _free
from stickslip.workbench.session import Note, Session

from .browser import Served
from .conftest import SCENARIO

pytestmark = pytest.mark.slow

EFFECT = '''"""An effect of one's own."""

from jax import Array

from stickslip.effects import BodyForce
from stickslip.effects import parameter


class Pull(BodyForce):
    """A constant pull."""

    tag = "own-pull"
    summary = "a constant pull"
    equation = "F = F_0"
    amplitude = "pull"
    family = "block"

    pull: Array = parameter(0.0, unit="N", lower=-0.05, upper=0.05, null=0.0, doc="force on the block")

    def force(self, state, motion, contact):
        return self.pull
'''


@pytest.fixture(scope="module")
def served(folder):
    made = Served(folder / "campaign.toml")
    yield made
    assert made.end() == 0


@pytest.mark.parametrize("after", [0.3, PATIENCE + 0.3, PATIENCE + 1.0])
def test_it_ends_cleanly_in_the_midst_of_a_fit(folder, after):
    for kept in (folder / FOLDER).glob("*"):
        kept.unlink()
    made = Served(folder / "campaign.toml")
    time.sleep(after)
    assert made.end() == 0


def _status(url: str, **headers: str) -> int:
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=20) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        return int(error.code)


def test_only_the_address_with_its_token_opens(served):
    root, token = served.url.rstrip("/").rsplit("/", 1)
    assert len(token) > 20
    assert _status(served.url) == _status(f"{served.url}favicon.ico") == 200
    for path in (
        "",
        "/",
        f"/{token[:-1]}/",
        "/static/js/bokeh.min.js",
        "/ws",
        f"/x/{token}/",
        f"/{token}x/",
        "//",
        "/%00",
    ):
        assert _status(root + path) == 403, path


def test_a_wrong_request_is_answered_and_the_server_lives(served):
    root, token = served.url.rstrip("/").rsplit("/", 1)
    for path in ("/ws", "/autoload.js", "/../../etc/passwd", "/static/../../../../etc/passwd", "/nothing", "/?page=99",
                 "/?theme=%3Cscript%3E", "/static/%2e%2e/%2e%2e/serve.py"):  # fmt: skip
        assert 200 <= _status(f"{root}/{token}{path}") < 500, path
    assert _status(served.url) == 200


def test_other_pages_cannot_talk_to_it(served):
    host, path = served.url.removeprefix("http://").split("/", 1)

    def asked(origin: str) -> int:
        key = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13", "Origin": origin}
        connection = http.client.HTTPConnection(host, timeout=20)
        try:
            connection.request("GET", f"/{path}ws", headers={**key, "Sec-WebSocket-Key": "MDEyMzQ1Njc4OWFiY2RlZg=="})
            return connection.getresponse().status
        finally:
            connection.close()

    assert asked("http://example.org") == 403
    assert asked(f"http://{host}") != 403


def test_it_listens_on_this_machine_only(served):
    port = int(served.url.split(":")[2].split("/")[0])
    with socket.socket() as other:
        other.settimeout(2.0)
        with pytest.raises(OSError):
            other.connect((_own_address(), port))


def _own_address() -> str:
    """Of this machine, other than the loopback; a documentation address where it has none."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        try:
            asked.connect(("192.0.2.1", 9))
            return str(asked.getsockname()[0])
        except OSError:
            return "192.0.2.1"


def test_a_port_that_is_taken_is_said():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(InputError, match="leave --port out"):
            _free("127.0.0.1", taken.getsockname()[1])
    with pytest.raises(InputError):
        _free("127.0.0.1", 70000)
    with pytest.raises(InputError):
        _free("192.0.2.1", 0)


def test_the_port_of_ones_choice_is_taken(folder):
    port = _free("127.0.0.1", 0)
    served = Served(folder / "campaign.toml", "--port", str(port))
    try:
        assert served.url.startswith(f"http://127.0.0.1:{port}/")
        assert urllib.request.urlopen(served.url, timeout=30).status == 200
    finally:
        assert served.end() == 0


def test_another_address_answers_in_place_of_the_usual_one(folder):
    served = Served(folder / "campaign.toml", "--address", "127.0.0.2")
    try:
        assert served.url.startswith("http://127.0.0.2:") and "from other machines" not in served.said
        assert urllib.request.urlopen(served.url, timeout=30).status == 200
        with pytest.raises(urllib.error.HTTPError):  # the token is asked for there too
            urllib.request.urlopen(served.url.rsplit("/", 2)[0] + "/", timeout=30)
        with pytest.raises(urllib.error.URLError, match="refused"):
            urllib.request.urlopen(served.url.replace("127.0.0.2", "127.0.0.1"), timeout=30)
    finally:
        assert served.end() == 0


@pytest.mark.parametrize(("address", "said"), [("192.0.2.7", True), ("0.0.0.0", True), ("127.0.0.1", False)])
def test_an_address_that_others_reach_is_said_to_be(folder, monkeypatch, capsys, address, said):
    asked = {}
    monkeypatch.setattr("stickslip.workbench.serve.serve", lambda session, **more: asked.update(more))
    assert run(["open", str(folder / "campaign.toml"), "--address", address]) == 0
    assert asked["address"] == address and asked["port"] == 0
    assert (f"reached from other machines under {address}" in capsys.readouterr().out) == said


def test_a_scenario_is_simulated_and_opened(tmp_path):
    scenario = tmp_path / "rig.toml"
    scenario.write_text((SCENARIO.parent / "grzemba2014.toml").read_text())
    served = Served(scenario)
    try:
        assert "written to rig-simulated" in served.said
        page = urllib.request.urlopen(served.url, timeout=30).read().decode()
        assert "<title>stickslip" in page
        result = tmp_path / "rig-simulated" / "result.json"
        written = result.stat().st_mtime_ns
        assert opened(tmp_path / "rig-simulated").campaign.traces[0].time.size > 1000
    finally:
        assert served.end() == 0
    served = Served(scenario)  # the same scenario is not simulated anew
    try:
        assert not served.said and result.stat().st_mtime_ns == written
    finally:
        assert served.end() == 0


def test_what_is_missing_to_run_it_is_said(monkeypatch, capsys):
    monkeypatch.setattr("stickslip.system.extras.find_spec", lambda name: None if name == "panel" else name)
    assert run(["open", "campaign.toml"]) == 2
    assert "pip install 'stickslip[workbench]'" in capsys.readouterr().err


def test_a_campaign_that_is_none_is_said(tmp_path, capsys):
    assert run(["open", str(tmp_path / "none.toml")]) == 2
    assert "none.toml" in capsys.readouterr().err


def test_a_run_folder_opens_the_campaign_it_was_made_from(folder, tmp_path):
    (tmp_path / "result.json").write_text(
        json_text({"kind": "fit", "inputs": [{"file": str(folder / "campaign.toml"), "sha256": ""}]})
    )
    assert opened(tmp_path).campaign.description.path.name == "campaign.toml"
    with pytest.raises(InputError, match="not found"):
        campaign_of(tmp_path, {"inputs": [{"file": "gone.toml"}]})


def test_a_saved_model_stands_again(folder, base, aged, tmp_path, monkeypatch):
    from stickslip.objects.campaign import Campaign

    name = "contact-ageing.rate"
    moved = aged.with_values({name: 1.1 * aged.values[name]})
    inputs = [{"file": str(folder / "campaign.toml"), "sha256": ""}]
    (tmp_path / "result.json").write_text(json_text({"kind": "fit", "inputs": inputs, KEY: record(moved.fitted)}))
    monkeypatch.setattr(Campaign, "fit", lambda self, effects=(): aged if list(effects) == ["contact-ageing"] else base)
    with closing(opened(tmp_path)) as session:
        session.begin(keep=False)
        assert [step.fit.effects for step in session.steps] == [(), ("contact-ageing",), ("contact-ageing",)]
        assert session.fit.values[name] == pytest.approx(moved.values[name])
        assert list(session.steps[-1].changed) == [name]
        session.undo()
        assert session.fit is aged and session.saved is None


def test_a_saved_model_stands_again_without_the_runs_it_had_not_seen(folder, base, aged, tmp_path, monkeypatch):
    from stickslip.objects.campaign import Campaign

    inputs = [{"file": str(folder / "campaign.toml"), "sha256": ""}]
    result = {"kind": "fit", "inputs": inputs, KEY: record(base.fitted), "kept_aside": ["v400"]}
    (tmp_path / "result.json").write_text(json_text(result))
    asked = []

    def fit(self, effects=(), holdout=()):
        asked.append((list(effects), list(holdout)))
        return aged if holdout else base

    monkeypatch.setattr(Campaign, "fit", fit)
    with closing(opened(tmp_path)) as session:
        session.begin(keep=False)
        assert asked == [([], []), ([], ["v400"])]
        (_, step, *_) = session.steps
        assert "holdout=['v400']" in step.code and step.command.endswith("--holdout v400")


def test_what_lies_in_a_folder_is_offered(folder, tmp_path):
    (tmp_path / "scenario.toml").write_text("[block]\n")
    assert [p.name for p in offered(tmp_path)] in ([], ["campaign.toml"])
    found = offered(folder)
    assert folder / "campaign.toml" in found


def test_the_shipped_example_is_worked_on_in_a_copy(tmp_path, monkeypatch, base):
    from stickslip.objects.campaign import Campaign

    of_package = example()
    before = sorted(p.name for p in of_package.parent.iterdir())
    assert (
        copied(of_package, tmp_path) and not copied(of_package, of_package.parents[1]) and not copied(of_package, None)
    )
    monkeypatch.setattr(Campaign, "fit", lambda self: base)
    with closing(Session(offers=(of_package,), home=tmp_path)) as session:
        session.open(0)
        assert session.campaign.description.path == tmp_path / "hidden-effect" / "campaign.toml"
    assert sorted(p.name for p in of_package.parent.iterdir()) == before
    again = to_work_in(of_package, tmp_path)  # which is not written over
    assert again == tmp_path / "hidden-effect" / "campaign.toml"


def test_one_of_what_is_offered_is_opened_and_nothing_else(folder, monkeypatch, base):
    from stickslip.objects.campaign import Campaign

    monkeypatch.setattr(Campaign, "fit", lambda self: base)
    with closing(Session(offers=(folder / "campaign.toml",))) as session:
        session.open(1)
        session.open(-1)
        assert session.campaign is None
        session.open(0)
        assert session.campaign is not None and session.fit is not None


def _until(true, seconds=20.0):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_an_effect_that_is_saved_is_loaded_anew(tmp_path, campaign):
    path = Path(tmp_path / "own_effect.py")
    path.write_text(EFFECT)
    session = Session(campaign=campaign, effect_files=(path,))
    ended = own_effects.watch(session, (path,))
    try:
        time.sleep(0.5)
        path.write_text(EFFECT.replace("A constant pull", "Another pull"))
        _until(lambda: session.loaded == 1)
        assert isinstance(session.said, Note)
        assert "own-pull" in session.said
        path.write_text(EFFECT + "\n1 / 0\n")
        _until(lambda: "ZeroDivisionError" in session.said)
        line = len((EFFECT + "\n1 / 0").splitlines())
        assert f"line {line}" in session.said and "own_effect.py" in session.said
        path.write_text("def (")
        _until(lambda: "not valid Python" in session.said)
        aside = tmp_path / "aside.py"  # as an editor does that writes aside and renames
        aside.write_text(EFFECT)
        aside.replace(path)
        _until(lambda: session.loaded == 2)
    finally:
        ended.set()
    assert threading.active_count() < 50


def test_the_example_is_offered_without_a_clone(tmp_path, monkeypatch):
    """As a wheel installs it: beside the packages, known to the distribution's list of files."""
    site = tmp_path / "lib" / "site-packages"
    campaign = tmp_path / "share" / "stickslip" / "hidden-effect" / "campaign.toml"
    campaign.parent.mkdir(parents=True)
    campaign.write_text("[[trace]]\n")

    class Installed(PurePosixPath):
        def locate(self):
            return site / self

    listed = [Installed("stickslip/__init__.py"), Installed("../../share/stickslip/hidden-effect/campaign.toml")]
    monkeypatch.setattr(example_file, "__file__", str(site / "stickslip" / "objects" / "example.py"))
    monkeypatch.setattr(example_file, "files", lambda name: listed if name == "stickslip" else None)
    (tmp_path / "empty").mkdir()
    assert offered(tmp_path / "empty") == [campaign]
    monkeypatch.setattr(example_file, "files", lambda name: None)  # an editable install without its sources
    assert offered(tmp_path / "empty") == []
