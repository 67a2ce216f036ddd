"""What one works with in Python: a campaign, what an inspection says of it, a fit, a diagnosis, a
forecast.

The command line and the workbench are skins over these.
"""

from .campaign import Campaign, load_campaign
from .diagnosis import Diagnosis
from .fit import Fit
from .forecast import Forecast
from .inspection import Inspection

__all__ = ["Campaign", "Diagnosis", "Fit", "Forecast", "Inspection", "StaticFit", "load_campaign"]
from .static_fit import StaticFit
