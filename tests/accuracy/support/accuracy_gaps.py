"""What was asked for and has no figure."""

from __future__ import annotations

from collections.abc import Sequence

from accuracy_case import scenes, takes_such_steps
from accuracy_data import CPU, Found, Measured
from accuracy_deadlines import Timed
from families import FAMILIES

from tryon_solver.settings import PRESETS

ASKED = 50  # states of a scene
PEERS = ("vbd", "style3d")
UNSAID = ("layered_skirt", "peers")  # the garment that Newton can't be told


def not_measured(found: Found, timed: Sequence[Timed]) -> list[str]:
    """In words, each."""
    swept = [measured for measured in found.errors if measured.of_solver("trial")]
    said = [*on_a_gpu(found), *families_gone(found), *peers_gone(found), *steps_gone(found)]
    said += states_gone(found, swept)
    if not any(times.device == CPU for times in found.times):
        said.append("Times at a garment's scale on a CPU: these columns are empty.")
    there = {times.case.scene for times in found.times}
    gone = [case.scene for case in scenes(1 / 60) if case.scene not in there]
    if gone:
        said.append(f"Times at a garment's scale of {'; '.join(gone)}.")
    if not timed:
        said.append("Deadlines: there are no results of the bench here.")
    return [*said, *ALWAYS]


ALWAYS = [
    "Solver error by mesh, d_hat and thickness: a tailor's measures alone vary these. Single steps are of one mesh of "
    "each garment, at the settings' own contact sizes.",
]


def on_a_gpu(found: Found) -> list[str]:
    """Single steps on a GPU."""
    there = [measured for measured in found.errors if measured.on_gpu]
    if not there:
        return [
            "Errors of single steps on a GPU, and so Pareto plots of it: errors are of the CPU, and of a GPU there are "
            "times at a garment's scale, beside the errors that the same settings have on the CPU, and deadlines."
        ]
    here = [measured for measured in found.errors if not measured.on_gpu]
    families = dict.fromkeys(family for measured in here for family in measured.family.values())
    scenes_of = {
        family: [{m.case.scene for m in of if family in m.family.values()} for of in (there, here)]
        for family in families
    }
    some = [f"{family} in {len(on)} of {len(of)} scenes" for family, (on, of) in scenes_of.items() if on and on < of]
    none = [family for family, (on, _) in scenes_of.items() if not on]
    said = [f"On a GPU, of single steps: {', '.join(some)} (as `--families` names them)."] if some else []
    return said + ([f"On a GPU, of single steps: {', '.join(none)}: all of these are of the CPU."] if none else [])


def families_gone(found: Found) -> list[str]:
    """Families of which no scene was measured on the CPU, and of the others scenes that lack them, by length of step;
    what Newton can't be told is told of apart."""
    said = []
    here = [measured for measured in (*found.errors, *found.trajectories) if not measured.on_gpu]
    for dt in dict.fromkeys(measured.case.dt for measured in here):
        families = {case.scene: {UNSAID[1]} if case.garment == UNSAID[0] else set[str]() for case in scenes(dt)}
        had: set[str] = set()
        for measured in here:
            if measured.case.dt == dt:
                families.setdefault(measured.case.scene, set()).update(measured.family.values())
                had.update(measured.family.values())
        none = [family for family in FAMILIES if family not in had]
        gone = {scene: [f for f in FAMILIES if f in had - there] for scene, there in families.items()}
        lacking = [f"{scene} ({', '.join(of)})" for scene, of in gone.items() if of]
        step = f"In steps of 1/{1 / dt:.0f} s, as `--families` names it:"
        if none:
            said.append(f"{step} {', '.join(none)}, of all scenes.")
        if lacking:
            said.append(f"{step} {'; '.join(lacking)}.")
    return said


def peers_gone(found: Found) -> list[str]:
    """NVIDIA's Newton."""
    said = []
    if any(measured.case.garment == UNSAID[0] for measured in found.errors):
        said.append(
            "Newton's VBD and Style3D of the layered skirt: its layer is sewn onto other cloth, and Newton has no "
            "springs that end within a triangle."
        )
    if not any(measured.of_solver(*PEERS) and measured.on_gpu for measured in found.errors):
        said.append("Newton's VBD and Style3D on a GPU, for which they are made.")
    return said


def steps_gone(found: Found) -> list[str]:
    """Presets that were never measured in steps of their own."""
    names = dict.fromkeys(name for measured in found.presets for name in measured.presets)
    own = {name for m in found.presets for name in m.presets if takes_such_steps(name, m.case.dt)}
    gone = [f"`{name}` (1/{1 / PRESETS[name].largest_step:.0f} s)" for name in names if name not in own]
    return [f"In steps as short as their own: {' and '.join(gone)}; they take the others' here."] if gone else []


def states_gone(found: Found, swept: Sequence[Measured]) -> list[str]:
    """Cases of fewer states than were asked for."""
    few: dict[str, list[str]] = {}
    for measured in found.presets:
        if measured.case.states < ASKED:
            step = f"steps of 1/{1 / measured.case.dt:.0f} s"
            few.setdefault(f"{step} have {measured.case.states}", []).append(measured.case.scene)
    said = [f"{step} in {len(of)} scene{'s' * (len(of) > 1)}" for step, of in few.items()]
    most = max((len(measured.shared) for measured in swept), default=0)
    if most and most < ASKED:
        fewer = [f"{m.case.scene} {len(m.shared)}" for m in swept if len(m.shared) < most]
        rest = f", but for {'; '.join(fewer)}" * bool(fewer)
        said.append(f"what is swept, and other solvers, have every fifth state or fewer, {most} in all{rest}")
    on_gpu = [len(m.states(name)) for m in found.errors if m.on_gpu for name in m.of_solver(*PEERS)]
    if on_gpu and most:
        said.append(f"other solvers have {min(on_gpu)} to {max(on_gpu)} on a GPU")
    return [f"{ASKED} states of each scene: {'; '.join(said)}."] if said else []
