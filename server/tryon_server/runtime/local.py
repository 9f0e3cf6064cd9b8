"""The runtime of one machine: a process per session, and what the solver and the demo bring along."""

from __future__ import annotations

from tryon_server.runtime.devices import list_devices
from tryon_server.runtime.interface import Catalogue, FabricEntry, Runtime
from tryon_server.runtime.local_processes import LocalProcesses
from tryon_server.runtime.order import Workshop


def local_runtime() -> Runtime:
    """Sessions simulated by the solver, on this machine."""
    return Runtime(placement=LocalProcesses(Workshop()), catalogue=load_catalogue(), devices=list_devices)


def load_catalogue() -> Catalogue:
    """What the solver and the demo offer."""
    from tryon_solver.materials.fabric import FABRICS
    from tryon_solver.settings import PRESETS

    from tryon_server.runtime.motions import list_motions

    fabrics = tuple(
        FabricEntry(fabric.name, fabric.areal_density, fabric.thickness, fabric.strain_limit, fabric.colour)
        for fabric in FABRICS.values()
    )
    return Catalogue(motions=list_motions(), fabrics=fabrics, presets=("auto", *PRESETS))
