"""The runtime of one machine: a process per session, and what the solver and the demo bring along."""

from __future__ import annotations

from tryon_server.problems import problem_error
from tryon_server.runtime.devices import choose_device, list_devices
from tryon_server.runtime.interface import AUTOMATIC, Catalogue, FabricEntry, Runtime
from tryon_server.runtime.local_processes import LocalProcesses
from tryon_server.runtime.order import Workshop
from tryon_server.settings import Settings


def local_runtime(settings: Settings) -> Runtime:
    """Sessions simulated by the solver, on this machine.

    Raises:
        ProblemError: the device or the preset of the settings does not exist, or there is no body yet.
    """
    from tryon_server.runtime.bodies import load_body

    choose_device(settings.device)
    catalogue = load_catalogue()
    if settings.preset not in catalogue.presets:
        remedy = f"Choose one of: {', '.join(catalogue.presets)}"
        raise problem_error("preset.unknown", f"there is no preset {settings.preset!r}", remedy, place="preset")
    load_body(None)
    placement = LocalProcesses(Workshop(), settings.session_memory_bytes)
    return Runtime(placement=placement, catalogue=catalogue, devices=list_devices)


def load_catalogue() -> Catalogue:
    """What the solver and the demo offer."""
    from tryon_server.runtime.motions import list_motions
    from tryon_solver.effect_words.table import WORDS
    from tryon_solver.materials.fabric import FABRICS
    from tryon_solver.settings import PRESETS

    fabrics = tuple(
        FabricEntry(
            fabric.name,
            fabric.areal_density,
            fabric.thickness,
            fabric.strain_limit,
            fabric.look,
            fabric.k_bend,
            fabric.source,
            fabric.drape,
        )
        for fabric in FABRICS.values()
    )
    presets, effects = (AUTOMATIC, *PRESETS), tuple(word.described() for word in WORDS)
    return Catalogue(motions=list_motions(), fabrics=fabrics, presets=presets, effects=effects)
