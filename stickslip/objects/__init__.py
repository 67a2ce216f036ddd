"""What one works with in Python: a campaign, what an inspection says of it, a fit, a diagnosis, a forecast.

One module each, so that a campaign is read and looked at before what fits it is loaded. The command line and the
workbench are skins over these.
"""
