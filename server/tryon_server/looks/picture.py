"""What an uploaded picture is, from its own bytes: a PNG or a JPEG that browsers and glTF readers show.

Pictures are handed on as they are: nothing here decodes pixels, since whoever shows one does. A PNG's pixels are
inflated once, to see that they are all there and in rows that can be read. PNG: https://www.w3.org/TR/png-3; JPEG:
ITU-T T.81.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

from tryon_server.problems import ProblemError, problem_error

PNG_SIGNATURE, JPEG_START, JPEG_END = b"\x89PNG\r\n\x1a\n", b"\xff\xd8", b"\xff\xd9"
LEAST_SIDE, LARGEST_SIDE = 8, 4096  # pixels
CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}  # of PNG's colour types
BY_PALETTE = 3  # the colour type whose pixels are numbers of a palette's colours
FILTERS = 5  # that a row of pixels may be stored by, from 0
DEPTHS = {0: (1, 2, 4, 8, 16), 2: (8, 16), 3: (1, 2, 4, 8), 4: (8, 16), 6: (8, 16)}
BASELINE, EXTENDED, PROGRESSIVE = 0xC0, 0xC1, 0xC2  # JPEG's frames that everybody reads
OTHER_FRAMES = (*range(0xC3, 0xC4), *range(0xC5, 0xC8), *range(0xC9, 0xCC), *range(0xCD, 0xD0))
SCAN = 0xDA
ALONE = (0x01, *range(0xD0, 0xD9))  # markers without a length
SAVE_AGAIN = "Save it again as PNG, or as JPEG in RGB, and upload that"


@dataclass(frozen=True)
class Picture:
    """Its MIME type and its sides in pixels."""

    kind: str
    width: int
    height: int


def read_picture(content: bytes) -> Picture:
    """What a file shows.

    Raises:
        ProblemError: 422, it is no whole PNG or JPEG, or its sides are not of LEAST_SIDE to LARGEST_SIDE pixels.
    """
    if content.startswith(PNG_SIGNATURE):
        return _png(content)
    if content.startswith(JPEG_START):
        return _jpeg(content)
    raise _unreadable("it is neither PNG nor JPEG")


def _png(content: bytes) -> Picture:
    header, palette, pixels = b"", b"", bytearray()
    at, kind = len(PNG_SIGNATURE), b""
    while kind != b"IEND":
        if at + 12 > len(content):
            raise _unreadable(f"the file ends at byte {len(content)}, before its last chunk: it was cut off")
        (length,), kind = struct.unpack(">I", content[at : at + 4]), content[at + 4 : at + 8]
        body, check = content[at + 8 : at + 8 + length], content[at + 8 + length : at + 12 + length]
        if len(check) < 4 or struct.unpack(">I", check)[0] != zlib.crc32(kind + body):
            raise _unreadable(f"the chunk {kind.decode('latin1')!r} at byte {at} is damaged")
        if not header and kind != b"IHDR":
            raise _unreadable(f"it begins with {kind.decode('latin1')!r} and not with IHDR")
        if kind == b"IHDR":
            header = body
        elif kind == b"PLTE":
            palette = body
        elif kind == b"IDAT":
            pixels += body
        at += 12 + length
    if len(header) != 13:
        raise _unreadable(f"its header has {len(header)} bytes, not 13")
    width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", header)
    if depth not in DEPTHS.get(colour, ()) or interlaced > 1:
        raise _unreadable(f"colour type {colour} with {depth} bits and interlace method {interlaced} are not PNG's")
    if colour == BY_PALETTE and (len(palette) % 3 or not 3 <= len(palette) <= 3 << depth):
        raise _unreadable(f"its pixels are of a palette (PLTE), and that has {len(palette)} bytes")
    checked = _sized("image/png", width, height)
    rows = _passes(width, height) if interlaced else [(width, height)]
    sizes = [(high, 1 + (wide * CHANNELS[colour] * depth + 7) // 8) for wide, high in rows if wide and high]
    inflated, at = _inflate(bytes(pixels), sum(high * size for high, size in sizes)), 0
    for high, size in sizes:
        if any(first >= FILTERS for first in inflated[at : at + high * size : size]):
            raise _unreadable(f"a row of its pixels is stored by none of PNG's {FILTERS} filters: they are damaged")
        at += high * size
    return checked


def _passes(width: int, height: int) -> list[tuple[int, int]]:
    """Columns and rows of each pass of an interlaced PNG (Adam7)."""
    grid = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))
    return [(-(-(width - x) // across), -(-(height - y) // down)) for x, y, across, down in grid]


def _inflate(packed: bytes, expected: int) -> bytes:
    """The pixels' rows. Raises ProblemError unless there are as many bytes of them as there should be."""
    inflating = zlib.decompressobj()
    try:
        inflated = inflating.decompress(packed, expected + 1)
    except zlib.error as error:
        raise _unreadable("its pixels can't be inflated: they are damaged") from error
    if len(inflated) != expected:
        amount = "more" if len(inflated) > expected else "fewer"
        raise _unreadable(f"its pixels take {amount} bytes than its header says")
    return inflated


def _jpeg(content: bytes) -> Picture:
    found = None
    at = len(JPEG_START)
    while True:
        if at + 4 > len(content) or content[at] != 0xFF:
            raise _unreadable(f"there is no marker at byte {at}: it was cut off, or is damaged")
        marker = content[at + 1]
        if marker == 0xFF or marker in ALONE:  # padding, or nothing follows
            at += 1 if marker == 0xFF else 2
            continue
        (length,) = struct.unpack(">H", content[at + 2 : at + 4])
        body = content[at + 4 : at + 2 + length]
        if length < 2 or len(body) < length - 2:
            raise _unreadable(f"the file ends at byte {len(content)}, in a segment: it was cut off")
        if marker in OTHER_FRAMES:
            raise _unreadable("it is lossless, hierarchical or arithmetically coded, which browsers don't show")
        if marker in (BASELINE, EXTENDED, PROGRESSIVE):
            found = _jpeg_frame(body)
        if marker == SCAN:
            break
        at += 2 + length
    if found is None:
        raise _unreadable("it has pixels, but nowhere says how many")
    if JPEG_END not in content[at:]:
        raise _unreadable(f"the file ends at byte {len(content)}, in its pixels: it was cut off")
    return found


def _jpeg_frame(body: bytes) -> Picture:
    """Of a frame's header: bits, height, width and how many colours."""
    if len(body) < 6:
        raise _unreadable("its frame's header is too short")
    bits, height, width, colours = struct.unpack(">BHHB", body[:6])
    if bits != 8 or colours not in (1, 3):
        raise _unreadable(f"it has {colours} colours of {bits} bits; grey or RGB of 8 bits is shown everywhere")
    return _sized("image/jpeg", width, height)


def _sized(kind: str, width: int, height: int) -> Picture:
    for name, side in (("wide", width), ("high", height)):
        if not LEAST_SIDE <= side <= LARGEST_SIDE:
            message = f"the picture is {side} pixels {name}; {LEAST_SIDE} to {LARGEST_SIDE} can be taken"
            raise problem_error("print.size", message, "Scale it, and upload that", place="body", status=422)
    return Picture(kind, width, height)


def _unreadable(why: str) -> ProblemError:
    return problem_error("print.unreadable", f"the picture can't be read: {why}", SAVE_AGAIN, place="body", status=422)
