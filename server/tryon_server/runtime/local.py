"""The runtime of one machine: a process per session, and what the solver and the demo bring along."""

from __future__ import annotations

from tryon_server.runtime.devices import AUTOMATIC, choose_device, list_devices
from tryon_server.runtime.interface import Catalogue, FabricEntry, Runtime
from tryon_server.runtime.local_processes import LocalProcesses
from tryon_server.runtime.order import Workshop
from tryon_server.settings import Settings


def local_runtime(settings: Settings) -> Runtime:
    """Sessions simulated by the solver, on this machine.

    Raises:
        ProblemError: the device of the settings is not there, or there is no body yet.
    """
    from tryon_server.runtime.bodies import load_body

    choose_device(settings.device)
    load_body(None)
    return Runtime(placement=LocalProcesses(Workshop()), catalogue=load_catalogue(), devices=list_devices)


def load_catalogue() -> Catalogue:
    """What the solver and the demo offer."""
    from tryon_server.runtime.motions import list_motions
    from tryon_solver.materials.fabric import FABRICS
    from tryon_solver.settings import PRESETS

    fabrics = tuple(
        FabricEntry(fabric.name, fabric.areal_density, fabric.thickness, fabric.strain_limit, fabric.colour)
        for fabric in FABRICS.values()
    )
    return Catalogue(motions=list_motions(), fabrics=fabrics, presets=(AUTOMATIC, *PRESETS))
