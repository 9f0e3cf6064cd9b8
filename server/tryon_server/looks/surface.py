"""What a garment's surface is drawn with: pictures that repeat over its pattern."""

from __future__ import annotations

from dataclasses import dataclass

from tryon_server.looks.look import Colour, Look
from tryon_server.looks.maps import SHEEN_ROUGHNESS, map_png, sheen_colour, tile_size

PNG = "image/png"


@dataclass(frozen=True)
class Repeat:
    """A picture file of that kind (MIME) which repeats every `size` m along the pattern's u and v."""

    content: bytes
    size: tuple[float, float]
    kind: str = PNG


@dataclass(frozen=True)
class Surface:
    """The maps of a surface, and its soft shine, linear RGB."""

    name: str
    colour: Repeat
    normal: Repeat
    roughness: Repeat
    sheen: Colour
    sheen_roughness: float


@dataclass(frozen=True)
class Finish:
    """What is done to a fabric's looks: a dye in place of its own colour, linear RGB, and a picture printed over it."""

    dye: Colour | None = None
    printed: Repeat | None = None


def surface_of(name: str, look: Look, finish: Finish = Finish()) -> Surface:
    """The surface of the fabric of this name."""
    size = tile_size(look)
    return Surface(
        name=name,
        colour=finish.printed or Repeat(map_png(look, "colour", finish.dye), size),
        normal=Repeat(map_png(look, "normal"), size),
        roughness=Repeat(map_png(look, "roughness"), size),
        sheen=sheen_colour(look),
        sheen_roughness=SHEEN_ROUGHNESS,
    )
