"""What one works with in Python: a campaign, what an inspection says of it, a fit, a diagnosis.

The command line and the workbench are skins over these.
"""

from .campaign import Campaign, load_campaign
from .diagnosis import Diagnosis
from .fit import Fit, StaticFit
from .inspection import Inspection

__all__ = ["Campaign", "Diagnosis", "Fit", "Inspection", "StaticFit", "load_campaign"]
