"""Campaigns: measured runs of one apparatus, described in a TOML file."""

from .assemble import load_trace, load_traces
from .fields import Unmeasured
from .load import Campaign, described, load_campaign
from .models import Rig
from .template import campaign_template, campaign_text

__all__ = [
    "Campaign",
    "Rig",
    "Unmeasured",
    "campaign_template",
    "campaign_text",
    "described",
    "load_campaign",
    "load_trace",
    "load_traces",
]
