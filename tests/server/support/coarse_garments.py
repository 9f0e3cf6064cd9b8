"""The solver's drapes in a mesh of few triangles, whichever garments are ordered."""

from __future__ import annotations

from dataclasses import replace

from tryon_server.runtime import production

EDGE_LENGTH = 0.06  # m


def build(order, progress):
    return production.build_drape(replace(order, edge_length=EDGE_LENGTH), progress)
