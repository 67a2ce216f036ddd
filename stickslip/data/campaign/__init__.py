"""Campaigns: measured runs of one apparatus, described in a TOML file."""

from .assemble import file_sha256, load_trace, load_traces
from .fields import Unmeasured
from .load import Campaign, described, load_campaign
from .models import CampaignFile, Channel, Rig, TraceEntry
from .template import campaign_template, campaign_text

__all__ = [
    "Campaign",
    "CampaignFile",
    "Channel",
    "Rig",
    "TraceEntry",
    "Unmeasured",
    "campaign_template",
    "campaign_text",
    "described",
    "file_sha256",
    "load_campaign",
    "load_trace",
    "load_traces",
]
