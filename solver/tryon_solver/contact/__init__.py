"""Incremental potential contact: candidates, distances, barrier, friction, continuous collision detection, bounds."""
