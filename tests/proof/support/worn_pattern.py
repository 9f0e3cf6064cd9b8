"""A pattern, dressed once for all the motions it is worn in: cases in several processes share a folder."""

from __future__ import annotations

import fcntl
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from case import Case

from tryon_server.runtime.solver_drape import SolverDrape
from tryon_server.runtime.wardrobe import wardrobe_key
from tryon_server.runtime.worn_garment import alone
from tryon_solver.body.model import BodyModel
from tryon_solver.body.pose import Pose
from tryon_solver.dressing.dress import Dressed, dress
from tryon_solver.dressing.to_fit import Fitted, dress_to_fit
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.size import mesh_in_size, mesh_with_vertices
from tryon_solver.geometry.weld import weld
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.scene import WORN, Effect, Scene
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import Simulation, build

PATTERNS = Path(__file__).resolve().parents[3] / "server" / "tryon_server" / "demo" / "patterns"

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Worn:
    """A garment as it hangs on the body in its rest pose."""

    simulation: Simulation
    drape: SolverDrape
    size: float
    fit: str  # what there is to say about size and fit
    seconds: float  # that dressing took, whichever case did it


def worn_pattern(case: Case, body: BodyModel, wardrobe: Path, tell: Tell) -> Worn:
    """The case's garment, dressed by this case or by the one before that had the same.

    All start from what was kept, so that none depends on which of them dressed. Raises what dressing raises.
    """
    path = PATTERNS / f"{case.garment}.json"
    path = path if path.is_file() else Path(case.garment)
    pattern, fabric = load_pattern(path), FABRICS[case.fabric]
    own = dict(case.settings)
    settings = replace(PRESETS[case.preset], **{k: v for k, v in own.items() if "." not in k})  # type: ignore[arg-type]

    def mesh(size: float) -> PanelMesh:
        if case.edge:
            return mesh_in_size(pattern, case.edge, size)
        return mesh_with_vertices(pattern, case.vertices, size)

    def put_on(size: float) -> Dressed:
        return dress(mesh(size), body, fabric, settings, case.device)

    choices = fabric, settings, case.device, case.edge, case.vertices, case.size
    kept = wardrobe / f"{wardrobe_key(path.read_bytes(), body, choices)}.npz"
    wardrobe.mkdir(parents=True, exist_ok=True)
    with kept.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not kept.exists():
            begun = time.perf_counter()
            sized = Fitted(put_on(case.size), case.size) if case.size else None
            fitted = sized or dress_to_fit(put_on, mesh(1.0), body)
            hang_up(kept, fitted, time.perf_counter() - begun)
    state = np.load(kept)
    size, fit, seconds = float(state["size"]), str(state["fit"]), float(state["seconds"])
    tell(f"dressed in {seconds:.0f} s; {fit}")
    panels = mesh(size)
    joined = weld(panels)
    garment = Garment(joined.vertex_of_corner, joined.uv_corners, joined.panel_of_face, joined.vertex_count)
    scene = Scene(garment, state["cloth"].astype(np.float64), body, fabric, effects_with(own))
    simulation = build(scene, settings, case.device, Pose.rest(body), state["surface"].astype(np.float64))
    own = alone(simulation, panels.panel_names, None)
    return Worn(simulation, SolverDrape(simulation, Pose.rest(body), (own,), body), size, fit, seconds)


def effects_with(own: Mapping[str, float | int | str]) -> tuple[Effect, ...]:
    """What is worn, with the values that are set as `Friction.presliding`; names without a dot are no effect's."""
    effects = {type(effect).__name__: effect for effect in WORN}
    for name, value in own.items():
        kind, dot, field = name.partition(".")
        if dot and kind not in effects:
            raise ValueError(f"{name}: there is no effect {kind}; the effects are {', '.join(effects)}")
        if dot:
            effects[kind] = replace(effects[kind], **{field: value})  # type: ignore[arg-type]
    return tuple(effects.values())


def hang_up(path: Path, fitted: Fitted, seconds: float) -> None:
    """Keep the garment as it hangs, whole or not at all."""
    simulation, opening = fitted.dressed.simulation, fitted.upper_opening()
    said = [fitted.describe(), *([opening.advice] if opening is not None and opening.advice else [])]
    draft = path.with_suffix(".draft.npz")
    np.savez(
        draft,
        cloth=simulation.cloth_positions(),
        surface=simulation.body_positions(),
        size=fitted.size,
        fit="; ".join(said),
        seconds=seconds,
    )
    draft.replace(path)
