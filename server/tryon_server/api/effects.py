"""Effects that act in a session: which there are, what is asked for, what they take."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

from fastapi import APIRouter, Request, Response
from fastapi.encoders import jsonable_encoder
from fastapi.responses import JSONResponse

from tryon_protocol import AUTO, EffectsMessage, EffectState, ProtocolError
from tryon_server.api.access import ServicesDep
from tryon_server.api.body import json_body, read_json
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.jobs import answer
from tryon_server.api.models import EffectReply, EffectRequest, EffectsReply, EffectWordReply, JobReply
from tryon_server.api.prefer import Wait, WaitDep
from tryon_server.problems import ProblemError, problem_error
from tryon_server.services import Services
from tryon_server.sessions.actions import Action
from tryon_server.sessions.effect_talk import EffectTalk
from tryon_server.streaming.jobs import Progress
from tryon_server.streaming.live_session import LiveSession

router = APIRouter(prefix="/api", tags=["effects"], responses=ERROR_REPLIES)

LATER: dict[int | str, dict[str, Any]] = {
    202: {
        "model": EffectsReply | JobReply,
        "description": "The garment is not worn yet: what is asked for is `kept` until it is. Or, with a `Location`, "
        "it takes longer: its job, which goes on",
    }
}
BINDING = Progress("binding", "It is bound beside what is worn")
Ask = Callable[[EffectTalk], tuple[int, list[Action]]]


@router.get("/effects")
async def list_effects(services: ServicesDep) -> list[EffectWordReply]:
    """All effects that a session can be asked for, and their parameters."""
    return [EffectWordReply.model_validate(dict(word)) for word in services.runtime.catalogue.effects]


@router.get("/sessions/{session_id}/effects")
async def session_effects(session_id: str, services: ServicesDep, measure: bool = False) -> EffectsReply:
    """The effects of a live session, and the plan of its steps; with `measure` what each takes, measured now. While the
    garment is put on first: what is `kept` until then."""
    if measure:
        return _reply(await _asked(session_id, services, lambda effects: effects.measure()))
    return _reply(await _newest(session_id, services))


@router.get("/sessions/{session_id}/effects/{name}")
async def session_effect(session_id: str, name: str, services: ServicesDep) -> EffectReply:
    """One effect of a live session; of `auto` whether what garment and motion may call for is armed by itself."""
    newest = await _newest(session_id, services)
    if not newest.effects:
        raise _early()
    return _one(newest, name)


@router.put(
    "/sessions/{session_id}/effects/{name}",
    response_model=EffectsReply,
    responses=LATER,
    openapi_extra=json_body(EffectRequest),
)
async def set_effect(
    session_id: str, name: str, request: Request, services: ServicesDep, wait: WaitDep
) -> Response:
    """Have an effect act in a live session, or armed, or changed; answered once it is, or by 202 where that takes
    longer than `Prefer` says. What is refused changes nothing.

    Asked for before the garment is worn it is kept, and made so once it is; what that garment can't have is listed as
    refused then. The name `auto` has those armed that garment and motion may call for.
    """
    wish = read_json(await request.body(), EffectRequest)
    return await _change(session_id, services, wait, name, wish)


@router.delete("/sessions/{session_id}/effects/{name}", response_model=EffectsReply, responses=LATER)
async def remove_effect(session_id: str, name: str, services: ServicesDep, wait: WaitDep) -> Response:
    """Have an effect act no longer in a live session; answered once it does not, or by 202. Kept as what is set is."""
    return await _change(session_id, services, wait, name, None)


async def _change(
    session_id: str, services: Services, wait: Wait, name: str, wish: EffectRequest | None
) -> Response:
    state: Literal["absent", "armed", "active"] = "absent" if wish is None else wish.state
    parameters = None if wish is None else wish.parameters

    async def made() -> EffectsReply:
        return _reply(await _asked(session_id, services, lambda effects: effects.change(name, state, parameters)))

    if not (await _live(session_id, services)).machine.effects.dressed:
        return JSONResponse(jsonable_encoder(await made()), 202)
    job = services.jobs.begin(
        session_id, "effect", "", made(), status=200, progress=lambda: BINDING, give_up=_goes_on
    )
    return await answer(job, services, wait)


def _goes_on() -> None:
    """An effect that is being bound can't be stopped, but taken away again."""


async def _live(session_id: str, services: Services) -> LiveSession:
    """The session. Raises ProblemError 404, 409 where it has ended."""
    live = await services.sessions.living(session_id)
    return live


async def _newest(session_id: str, services: Services) -> EffectsMessage:
    """What was told last. Raises ProblemError 404, 409 where there is nothing to tell."""
    newest = (await _live(session_id, services)).machine.effects.newest
    if newest is None:
        raise _early()
    return newest


def _early() -> ProblemError:
    message, remedy = "the garment is still being dressed", "Ask once the session's state is `running`"
    return problem_error("effects.early", message, remedy, place="session", status=409)


async def _asked(session_id: str, services: Services, ask: Ask) -> EffectsMessage:
    """What is told once what is asked is done. Raises ProblemError 404, 409, 422."""
    live = await _live(session_id, services)
    try:
        return await live.ask_effects(ask)
    except ProtocolError as error:
        status = 422 if error.code == "effect_refused" else 409
        code = f"effect.{error.code.removeprefix('effect_')}"
        raise problem_error(
            code, error.message, error.remedy, place=error.place.removeprefix("$."), status=status
        ) from error


def _one(effects: EffectsMessage, name: str) -> EffectReply:
    if name == AUTO:
        return EffectReply.model_validate(EffectState(name=AUTO, state="active" if effects.auto else "absent"))
    for effect in effects.effects:
        if effect.name == name:
            return EffectReply.model_validate(effect)
    remedy = f"Use one of {', '.join(effect.name for effect in effects.effects)}"
    raise problem_error("effect.unknown", f"there is no effect {name!r:.80}", remedy, place="name", status=404)


def _reply(effects: EffectsMessage) -> EffectsReply:
    return EffectsReply.model_validate(effects)


