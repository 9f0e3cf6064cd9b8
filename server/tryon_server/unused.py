"""What can be told of a garment, a body or a motion, and of which kinds of them it says anything: one table for the
command line, which refuses what says nothing, and for uploads, which note it."""

from __future__ import annotations

from collections.abc import Mapping

from tryon_server.problems import ProblemError, problem_error

MESHES = ("frames", "glb", "mesh")
USES: dict[str, dict[str, tuple[str, ...]]] = {
    "garment": {"units": ("mesh",), "up": ("mesh",), "rest_shape": ("mesh",)},
    "body": {"units": MESHES, "up": MESHES, "facing": MESHES, "fps": ("frames",), "animation": ("glb",)},
    "motion": {"units": ("file",), "up": ("file",), "facing": ("file",), "joints": ("file",)},
}
"""Of what it is told -> what is told, as a reading has it -> the kinds that it says something of."""
WHY = {
    "garment": {"pattern": "the garment is a sewing pattern, which says its lengths and has no axes"},
    "body": {
        "default": "the body is the default one",
        "model": "the body is a model of its own skeleton, in metres with Y up",
        "frames": "the body is a file of frames",
        "glb": "the body is a .glb, whose animation says its times",
        "mesh": "the body is a mesh that stands still",
    },
    "motion": {"none": "there is no --motion"},
}
INSTEAD = {  # what it would say something of
    "garment": "give a garment that is a mesh (.obj, .glb)",
    "body": "give a --body that it says something of",
    "motion": "give a --motion",
}


def option(subject: str, what: str) -> str:
    """The command's option that tells it."""
    before = "" if subject == "garment" else f"{subject}-"
    return f"--{before}{what.removesuffix('s') if what == 'joints' else what.replace('_', '-')}"


def unused(subject: str, kind: str | None, told: Mapping[str, object]) -> tuple[list[str], str]:
    """The options that tell what says nothing of a subject of this kind, and why; none where the kind is not known.

    `told`: what is told -> its value, None where it is not, as ``vars`` of a reading has it.
    """
    if kind is None:
        return [], ""
    vain = [what for what, kinds in USES[subject].items() if told.get(what) is not None and kind not in kinds]
    return [option(subject, what) for what in vain], WHY[subject].get(kind, "")


def refuse_unused(subject: str, kind: str | None, told: Mapping[str, object]) -> None:
    """Raises ProblemError naming the options that say nothing of a subject of this kind; as `unused`."""
    options, why = unused(subject, kind, told)
    if options:
        raise _refusal(options, why, INSTEAD[subject])


def note_unused(subject: str, kind: str | None, told: Mapping[str, object]) -> tuple[str, ...]:
    """The same as a note for people."""
    options, why = unused(subject, kind, told)
    return (f"{', '.join(options)} said nothing: {why}",) if options else ()


def _refusal(options: list[str], why: str, instead: str) -> ProblemError:
    says = "says" if len(options) == 1 else "say"
    it = "it" if len(options) == 1 else "them"
    return problem_error(
        "option.unused", f"{', '.join(options)} {says} nothing here: {why}", f"Leave {it} out, or {instead}"
    )
