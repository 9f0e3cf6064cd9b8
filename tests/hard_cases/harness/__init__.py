"""Runs a hard case and judges it: one driver, one watch, one set of limits for all."""
