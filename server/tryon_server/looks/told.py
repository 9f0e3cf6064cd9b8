"""What a command line tells of a garment's looks."""

from __future__ import annotations

from pathlib import Path

from tryon_server.looks.dye import read_dye
from tryon_server.looks.picture import read_picture
from tryon_server.looks.surface import Finish, Repeat
from tryon_server.problems import problem_error


def told_finish(dye: str | None, picture: Path | None, width: float | None) -> Finish:
    """A dye (RRGGBB), or a print: the file of a picture and how wide it is on the cloth [m].

    Raises:
        ProblemError: a dye that is no colour, or beside a print; a picture without a width, or a width without one; or
            one that can't be read.
    """
    if picture is None and width is not None:
        raise problem_error("print.unused", "--print-width says nothing without --print", "Give both, or neither")
    if picture is None:
        return Finish(dye=read_dye(dye))
    if dye is not None:
        raise problem_error("dye.unused", "a print takes the place of the colour", "Leave out --dye, or --print")
    if width is None:
        raise problem_error("print.width", "--print does not say how wide it is on the cloth", "Give --print-width")
    try:
        content = picture.read_bytes()
    except OSError as error:
        raise problem_error(
            "print.unreadable", f"{picture} can't be read: {error.strerror}", "Correct --print", place="--print"
        ) from error
    found = read_picture(content)
    return Finish(printed=Repeat(content, (width, width * found.height / found.width), found.kind))
