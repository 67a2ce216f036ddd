"""Fitting: the paper's static model per creep process, and the dynamic model to all runs of a campaign together."""
