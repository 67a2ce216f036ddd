"""The rig as the file states it, compared with what the measured motion shows of it, before any model is fitted."""

from .finding import Finding, refuse_impossible, stopping
from .rig import rig_against_motion

__all__ = ["Finding", "refuse_impossible", "rig_against_motion", "stopping"]
