"""The JSON of the REST side. Lengths in metres, areas in square metres, times in seconds (dates since 1970)."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Name = Annotated[str, Field(pattern="^[^\\x00]*$")]  # a database's text can't hold the character 0


class Model(BaseModel):
    """A frozen value; unknown fields in requests are errors, so that a misspelt one is not ignored."""

    model_config = ConfigDict(frozen=True, extra="forbid", from_attributes=True)


class ProblemReply(Model):
    """What is wrong, where, and what to do about it."""

    code: str
    place: str
    message: str
    remedy: str


class HealthReply(Model):
    """That the server is up."""

    status: str
    version: str
    sessions: int = Field(description="live sessions")


class GarmentReply(Model):
    """A stored garment; vertices and triangles are those of the mesh that checked it, sessions choose their own."""

    id: str
    name: str
    panel_count: int
    seam_count: int
    vertex_count: int
    triangle_count: int
    area: float = Field(description="of fabric, m^2")
    created: float
    notes: list[str] = Field(description="of a mesh: units, axes and rest shape as found, and what was mended")


class MotionReply(Model):
    """A motion that the server can play."""

    name: str
    seconds: float


class FabricReply(Model):
    """A fabric to choose."""

    name: str
    areal_density: float = Field(description="kg/m^2")
    thickness: float = Field(description="m")
    strain_limit: float = Field(description="largest stretch; 1.1 is ten per cent longer than the pattern")
    colour: tuple[float, float, float] = Field(description="linear RGB, 0 to 1")


class DeviceReply(Model):
    """Something that this server can simulate on."""

    name: str
    description: str
    memory: int | None = Field(description="bytes")


class SessionRequest(Model):
    """What a new session is to be."""

    garment: Name = Field(description="id of a garment")
    motion: Name | None = Field(None, description="name of a motion; null: a client streams the poses")
    fabric: Name | None = Field(None, description="name of a fabric; null: the first of GET /api/fabrics")
    preset: Name | None = Field(None, description="draft, live, fit or auto; null: the server's choice")


class SessionReply(Model):
    """A session. ``stream`` is the path of its websocket; ``state`` and ``detail`` as in the protocol's status."""

    id: str
    garment: str
    motion: str | None
    fabric: str
    preset: str
    created: float
    state: str
    detail: str
    viewers: int
    stream: str
