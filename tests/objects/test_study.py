"""Many campaigns side by side: the same numbers as one by one, and a failure spoils nothing."""

from pathlib import Path

import numpy as np
import pytest

import stickslip as ss
from stickslip.errors import InputError

SHIPPED = Path(__file__).parents[2] / "scenarios" / "hidden-effect" / "campaign.toml"
RIG = {
    "mass": "89.4 g",
    "spring_stiffness": "980.218 N/m",
    "contacts": 4,
    "normal_force": "0.31 N",
    "friction_coefficient": {"guess": 0.21, "lower": 0.15, "upper": 0.3},
}


@pytest.mark.slow
def test_a_study_has_the_numbers_of_the_fits_and_says_what_failed(tmp_path):
    broken = tmp_path / "broken.toml"
    broken.write_text('schema = 1\n[[trace]]\nfile = "none.csv"\nsampling_rate = "1 kHz"\n')
    told = []
    found = ss.study(
        {"shipped": SHIPPED, "broken": broken}, workers=1, progress=lambda text, share: told.append((text, share))
    )
    fit = ss.load_campaign(SHIPPED).fit()
    for name, value in fit.values.items():
        assert float(found.value.sel(campaign="shipped", parameter=name)) == pytest.approx(value, rel=1e-9)
    assert float(found.unseen_error.sel(campaign="shipped")) == pytest.approx(fit.unseen_error, rel=1e-9)
    assert float(found.cycles.sel(campaign="shipped")) == 38
    assert np.isnan(found.value.sel(campaign="broken")).all()
    assert "none.csv" in str(found.note.sel(campaign="broken").values) or "signal" in str(
        found.note.sel(campaign="broken").values
    )
    assert str(found.note.sel(campaign="shipped").values) == ""
    assert told[-1][1] == 1.0 and {t for t, _ in told} == {"shipped", "broken"}


@pytest.mark.slow
def test_a_campaign_without_a_file_is_sent_as_it_is():
    campaign = ss.load_campaign(SHIPPED)
    made = ss.Campaign.from_traces([campaign["v100"], campaign["v200"]], rig=RIG)
    found = ss.study({"made": made}, workers=1)
    fit = made.fit()
    for name, value in fit.values.items():
        assert float(found.value.sel(campaign="made", parameter=name)) == pytest.approx(value, rel=1e-9)


@pytest.mark.slow
def test_a_single_campaign_and_a_single_effect_stand_for_themselves():
    found = ss.study(SHIPPED, "waer", workers=1)
    assert list(found.campaign.values) == ["hidden-effect"] and "'waer'" in str(found.note.values[0])


def test_campaigns_need_names_of_their_own():
    with pytest.raises(InputError, match="unique name"):
        ss.study([SHIPPED, SHIPPED])
    with pytest.raises(InputError):
        ss.study([])
    with pytest.raises(InputError, match=r"^workers: "):  # by the argument's name, which is no option here
        ss.study(SHIPPED, workers=0)
    with pytest.raises(InputError, match="has no name"):
        ss.study(ss.load_example())
    with pytest.raises(InputError, match="has no name"):
        ss.study([ss.load_example()])
