"""What an effect's `bind(spec, context)` gets to see when a simulation is built."""

from __future__ import annotations

from dataclasses import dataclass

from tryon_solver.linalg.order_free import OrderFreeSums
from tryon_solver.materials.device import RestShape
from tryon_solver.materials.terms import BendingRows
from tryon_solver.scene import Scene
from tryon_solver.settings import Settings


@dataclass(frozen=True)
class BuildContext:
    """`rest` is the rest shape on the device, `bending` the constant bending matrix, None where no fabric has any;
    `sums` is for what several threads add to one vertex."""

    scene: Scene
    settings: Settings
    device: str
    rest: RestShape
    bending: BendingRows | None
    sums: OrderFreeSums
