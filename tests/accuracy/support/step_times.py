"""How long steps take at a garment's own scale: played on in the motion, without a reference to hold them to."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from accuracy_case import AccuracyCase
from error_measures import rounded
from methods import Method
from recorded import Writer
from steppers import NO_CONTACTS, stepper_of
from worn_start import worn_at_start

from tryon_solver.baselines.newton_ipc import Motion

WARM = 3  # steps that are not timed: what is compiled and captured on the way is done


def measure_times(
    case: AccuracyCase, methods: Mapping[str, Method], device: str, writer: Writer, tell: Callable[[str], None]
) -> None:
    """A row of each method: `method`, the `ms` of each of the case's `states` steps, and means of what was told of
    them. All begin alike; a trial, which is no state to go on from, is made there again and again."""
    worn = worn_at_start(case, device)
    start = Motion(worn.x, worn.v, worn.scene.pose_at(0))
    known = {row["method"] for row in writer.rows}
    for name, method in methods.items():
        if name in known:
            continue
        stepper = stepper_of(worn.scene, method, device)
        stepper.begin(start, NO_CONTACTS)
        ended = []
        for number in range(1, WARM + case.states + 1):
            if method.solver == "trial":
                stepper.begin(start, NO_CONTACTS)
            ended.append(stepper.step(worn.scene.pose_at(1 if method.solver == "trial" else number), case.dt))
        timed = ended[WARM:]
        told = {key: rounded(sum(float(end.told[key]) for end in timed) / len(timed)) for key in timed[0].told}
        writer.add([{"method": name, "cloth_vertices": len(worn.v), "ms": [rounded(end.ms) for end in timed], **told}])
        tell(f"{name}: {sum(end.ms for end in timed) / len(timed):.1f} ms")
