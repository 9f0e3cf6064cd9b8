"""What the solver did for frames, as clients are told it (PROTOCOL.md section 5)."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from .message_base import U32, Message

MOST_PRICES = 256
"""Frames that one report tells of, at most."""


class FramePrice(Struct, frozen=True, kw_only=True):
    """What accuracy one frame was solved to, and what that took."""

    solver_ms: Annotated[float, Meta(ge=0, description="ms of wall time from pose taken to frame solved")]
    error: Annotated[float | None, Meta(description="m, as `report.error`; null: unknown")]
    late_ms: Annotated[float, Meta(ge=0, description="as `report.late_ms`")] = 0


class ReportMessage(Message, tag="report", frozen=True, kw_only=True):
    """What the solver did for one published frame. Sent at most a few times a second, the newest wins."""

    seq: Annotated[U32, Meta(description="the frame this speaks of")]
    t_sim: Annotated[float, Meta(description="s, time of the pose that frame shows, poses' clock")]
    iterations: Annotated[int, Meta(ge=0, description="outer iterations of the last step")]
    residual: Annotated[float, Meta(description="relative residual at the end of the last step, dimensionless")]
    min_gap: Annotated[
        float | None,
        Meta(
            description="m, smallest distance of a contact pair less its offset; below 0 it is closer than its offset, "
            "at -gap_offset its surfaces would touch; null: none near"
        ),
    ]
    max_stretch: Annotated[float, Meta(description="largest principal stretch, 1 is unstretched")]
    body_lag: Annotated[float, Meta(description="m, largest distance of the simulated body from the posed skin")]
    pairs: Annotated[int, Meta(ge=0, description="contact pairs in the last step")]
    retries: Annotated[int, Meta(ge=0, description="steps voided and redone for this frame")]
    times_ms: Annotated[dict[str, float], Meta(description="ms of wall time spent for this frame, by stage")]
    solver_ms: Annotated[float, Meta(ge=0, description="ms of wall time from pose taken to frame solved")]
    frames_per_second: Annotated[float, Meta(ge=0, description="1/s, published frames per wall second, recent mean")]
    real_time_factor: Annotated[
        float, Meta(ge=0, description="simulated seconds per wall second, recent mean; 1 is real time")
    ]
    gap_offset: Annotated[
        float | None,
        Meta(description="m, that pair's offset, the thickness kept between its surfaces: they are the sum apart"),
    ] = None
    advice: Annotated[str, Meta(description='for people: what is out of bounds, and what to try; "": nothing is')] = ""
    asleep: Annotated[bool, Meta(description="nothing moves: the garment is left as it is until it does")] = False
    error: Annotated[
        float | None,
        Meta(description="m, estimated RMS distance of the cloth from where a step's equations balance; null: unknown"),
    ] = None
    late_ms: Annotated[float, Meta(ge=0, description="ms that solving took beyond `status.deadline_ms`")] = 0
    solved: Annotated[
        tuple[FramePrice, ...],
        Meta(
            description=f"each frame solved since the report before, published or not, the oldest first, of more than "
            f"{MOST_PRICES} the newest; none of a garment asleep"
        ),
    ] = ()
