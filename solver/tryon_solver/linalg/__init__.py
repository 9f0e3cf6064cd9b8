"""Sparse rows, vectors and conjugate gradients on the device; no garments here."""
