"""Arguments of the objects: a single name stands for itself, and what cannot be meant is refused before any work."""

import ast
import inspect
import re
from pathlib import Path
from types import SimpleNamespace

import pytest

import stickslip as ss
from stickslip.cli import run
from stickslip.errors import ArgumentError, InputError
from stickslip.objects.fit_plots import FitPlots
from stickslip.objects.fitted_run import FittedRun
from stickslip.objects.forecast import ForecastPlots
from stickslip.objects.posterior import sample
from stickslip.system.progress import silent

SHIPPED = Path(__file__).parents[2] / "scenarios" / "hidden-effect" / "campaign.toml"


@pytest.fixture(scope="module")
def campaign():
    return ss.load_campaign(SHIPPED)


def test_a_model_that_is_none_is_refused(campaign):
    with pytest.raises(InputError) as refused:
        campaign.fit(model="dyn")
    said = str(refused.value)
    assert "no such model" in said and "'dyn'" in said and "allowed" in said and "to fix" in said


def test_a_misspelt_argument_is_refused_by_the_method_itself(campaign):
    for name, ask in (("fit", campaign.fit), ("diagnose", campaign.diagnose)):
        with pytest.raises(TypeError, match=rf"Campaign\.{name}\(\) .* 'holdot'"):
            ask(holdot="v050")


@pytest.mark.parametrize(
    "arguments",
    [
        {"model": "static", "effects": "wear"},
        {"model": "static", "holdout": "v050"},
    ],
)
def test_an_argument_of_the_other_model_is_refused(campaign, arguments):
    key = list(arguments)[-1]
    with pytest.raises(InputError, match=f"{key}: an argument of the") as refused:
        campaign.fit(**arguments)
    assert "leave it out" in refused.value.hint


def test_the_static_model_is_the_same_by_either_name_and_has_choices_of_its_own(campaign):
    one, other, faster = campaign.fit(model="static"), campaign.fit_static(), campaign.fit_static(v_lim="10 um/s")
    assert one.arrays.identical(other.arrays)
    assert faster.result["static"] != one.result["static"]
    with pytest.raises(TypeError, match=r"fit_static\(\) got an unexpected keyword argument 'aling'"):
        campaign.fit_static(aling="paper")


@pytest.mark.slow
def test_a_single_name_is_not_read_letter_by_letter(campaign, tmp_path):
    assert [k.name for k in campaign.prepare("v050").runs] == [k.name for k in campaign.prepare(["v050"]).runs]
    assert "v050" not in [k.name for k in campaign.prepare("v050").runs]
    asks = {
        "waer": (lambda name: campaign.fit(effects=name), lambda name: campaign.diagnose(candidates=name)),
        "v051": (lambda name: campaign.fit(holdout=name), lambda name: campaign.diagnose(holdout=name, jobs=1)),
        str(tmp_path / "own.py"): (lambda name: ss.load_campaign(SHIPPED, name),),
    }
    for name, calls in asks.items():
        for ask in calls:
            with pytest.raises(InputError, match=name):
                ask(name)


@pytest.mark.slow
def test_a_fit_takes_a_single_name(campaign):
    fit = campaign.fit()
    with pytest.raises(InputError, match=r"weakening\.dorp"):
        fit.refit(locked="weakening.dorp")
    change = "drive.velocity=0.8 mm/s"
    one, several = (fit.scenario(changes).file.drive for changes in (change, [change]))
    assert one == several == fit.scenario(drive="0.8 mm/s").file.drive
    assert fit.simulate(drive="0.8 mm/s", events=1).sizes == fit.simulate(change, events=1).sizes


def test_scenario_and_simulate_take_the_same_and_return_their_own():
    scenario, simulate = map(inspect.signature, (ss.Fit.scenario, ss.Fit.simulate))
    assert scenario.parameters == simulate.parameters
    assert (scenario.return_annotation, simulate.return_annotation) == ("Scenario", "xarray.Dataset")


def test_a_run_is_asked_for_by_one_word_everywhere():
    asked = (
        *(ss.Campaign.levels, ss.Campaign.forecast, ss.Campaign.to_xarray, ss.Fit.simulate_cycles, ss.Fit.scenario),
        *(ss.Fit.simulate, FitPlots.trace, FitPlots.force, FitPlots.creep, FittedRun.scenario, FittedRun.model_of),
    )
    for method in asked:
        assert "run" in inspect.signature(method).parameters, method


@pytest.mark.parametrize(
    ("missing", "extra", "ask"),
    [
        ("panel", "workbench", ss.workbench),
        ("distributed", "distributed", lambda campaign: ss.study(SHIPPED)),
        ("nutpie", "posterior", lambda campaign: sample(campaign, 1, 1, 1, 0, silent)),
    ],
)
def test_a_package_that_is_missing_is_named_with_how_to_install_it(campaign, monkeypatch, missing, extra, ask):
    monkeypatch.setattr("stickslip.system.extras.find_spec", lambda name: None if name == missing else name)
    with pytest.raises(InputError, match=f"needs {missing}, which is not installed") as refused:
        ask(campaign)
    assert refused.value.hint == f"pip install 'stickslip[{extra}]'"


def test_an_argument_is_called_by_its_name_in_python_and_by_its_option_on_the_command_line(campaign, capsys):
    with pytest.raises(ArgumentError, match=r"^max_effects: out of range"):
        campaign.diagnose(max_effects=0)
    with pytest.raises(ArgumentError, match=r"^effects: the effect only changes the shape"):
        campaign.fit("roll-off")
    assert run(["diagnose", str(SHIPPED), "--max-effects", "0"]) == 2
    assert "--max-effects: out of range" in capsys.readouterr().err


def test_fits_to_be_compared_have_names(campaign):
    with pytest.raises(InputError, match="fits: fits are compared by their names") as refused:
        ss.compare([campaign])
    assert "allowed: fits by name" in str(refused.value)


def test_what_is_given_in_the_wrong_place_is_told_where_it_goes(campaign):
    with pytest.raises(InputError, match=r"(?s)effects: a model is no effect.*campaign\.fit\(model=\"static\"\)"):
        campaign.fit("static")
    for given in (str(SHIPPED), campaign):
        with pytest.raises(ArgumentError, match=r"(?s)^scenario: no scenario.*ss\.load_scenario"):
            ss.simulate(given)
    assert ss.Campaign.from_traces(campaign.traces[0]).names == [campaign.names[0]]


def test_where_there_is_nothing_to_choose_from_no_list_is_offered():
    with pytest.raises(InputError, match="not in the model") as refused:
        ss.Fit.remove(SimpleNamespace(effects=()), "wear")
    assert "to fix" not in str(refused.value)


def test_examples_in_docstrings_are_calls_that_are_taken():
    """``fit.profile("weakening.drop")`` in that of the method itself."""
    found = []
    for cls in (ss.Campaign, ss.Fit, FitPlots, ForecastPlots):
        for name, method in inspect.getmembers(cls, inspect.isfunction):
            for code in re.findall(rf"``\w+(?:\.plot)?\.{name}(\(.+?\))``", inspect.getdoc(method) or ""):
                call = ast.parse(f"f{code}", mode="eval").body
                inspect.signature(method).bind(None, *call.args, **{k.arg: k.value for k in call.keywords})
                found.append(name)
    assert {"add", "with_values", "refit", "profile", "simulate", "forecast", "residual"} <= set(found)
