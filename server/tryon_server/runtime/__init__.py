"""Simulation of sessions in processes of their own; the only part of the server that knows the solver."""
