"""The workbench: a campaign and its model in the browser, skins over :mod:`stickslip.objects`."""
