"""Writes protocol/ts/src/generated.ts from the message types, or checks that it is up to date.

python -m tryon_protocol.generate_ts            write the file
python -m tryon_protocol.generate_ts --check    exit with status 1 when the file differs from the types
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

from msgspec import NODEFAULT, inspect

from . import conventions, effect_messages, frames, grid, messages, outfit_messages, report_messages, window

OUTPUT = Path(__file__).resolve().parents[1] / "ts" / "src" / "generated.ts"
_SCALARS: dict[type[inspect.Type], str] = {
    inspect.IntType: "number",
    inspect.FloatType: "number",
    inspect.StrType: "string",
    inspect.BoolType: "boolean",
    inspect.BytesType: "Uint8Array",
    inspect.NoneType: "null",
    inspect.AnyType: "unknown",
}


def typescript() -> str:
    """The whole file."""
    parts = [
        "// Written by `python -m tryon_protocol.generate_ts` from protocol/tryon_protocol/messages.py. Don't edit.",
        *_constants(),
    ]
    client, server = get_args(messages.ClientMessage), get_args(messages.ServerMessage)
    nested = [
        *(messages.ArrayData, messages.GarmentTopology, messages.ClothTopology, messages.BodyTopology),
        *(messages.DesignEdge, messages.DesignPanel, messages.DesignSeam, messages.DesignPatch),
        *(messages.ChangeStatus, report_messages.FramePrice),
        *(messages.DesignEdit, effect_messages.EffectState, effect_messages.KeptEffect, outfit_messages.WornGarment),
    ]
    structs: list[inspect.StructType] = []
    for struct in inspect.multi_type_info([*nested, *client, *server]):
        assert isinstance(struct, inspect.StructType)
        structs.append(struct)
        parts.append(_interface(struct))
    for name, members in (("ClientMessage", client), ("ServerMessage", server)):
        union = "\n".join(f"  | {member.__name__}" for member in members)
        tags = ", ".join(json.dumps(member.__struct_config__.tag) for member in members)
        constant = re.sub(r"(?<!^)(?=[A-Z])", "_", name).upper() + "_TYPES"
        parts.append(f"export type {name} =\n{union};")
        parts.append(f'export const {constant}: readonly {name}["type"][] = [{tags}];')
    parts.extend(_guard(struct) for struct in structs if struct.tag is not None)
    return "\n\n".join(parts) + "\n"


def _constants() -> Iterator[str]:
    values = {
        "SUBPROTOCOL": messages.SUBPROTOCOL,
        "MAJOR_VERSION": messages.MAJOR_VERSION,
        "MAX_CLIENT_MESSAGE_BYTES": messages.MAX_CLIENT_MESSAGE_BYTES,
        "POSE_CONVENTION": messages.POSE_CONVENTION,
        "POSE_FRAME": messages.POSE_FRAME,
        "POSE_CLOCK": messages.POSE_CLOCK,
        "CREDIT": window.CREDIT,
        "FRAME_MAGIC": frames.MAGIC,
        "FRAME_KIND": frames.KIND_FRAME,
        "FRAME_HEADER_BYTES": frames.HEADER_BYTES,
        "FLAG_OFFSETS_ZSTD": frames.FLAG_OFFSETS_ZSTD,
        "ORIGIN_LIMIT": frames.ORIGIN_LIMIT,
        "GRID": grid.GRID,
    }
    yield "\n".join(f"export const {name} = {json.dumps(value)};" for name, value in values.items())
    names = {
        "WEBXR_JOINTS": conventions.WEBXR_JOINTS,
        "WEBXR_REQUIRED": conventions.CONVENTIONS["webxr"].required,
        "MEDIAPIPE_JOINTS": conventions.MEDIAPIPE_JOINTS,
    }
    yield "\n".join(f"export const {name}: readonly string[] = {json.dumps(value)};" for name, value in names.items())
    codecs = ", ".join(f"{codec.name}: {codec.value}" for codec in frames.Codec)
    yield f"export const Codec = {{ {codecs} }} as const;"


def _interface(struct: inspect.StructType) -> str:
    lines = [*_comment(struct.cls.__doc__ or "", ""), f"export interface {struct.cls.__name__} {{"]
    if struct.tag is not None:
        lines.append(f"  type: {json.dumps(struct.tag)};")
    for field in struct.fields:
        optional = "" if field.required else "?"
        lines.extend(_comment(_description(field), "  "))
        lines.append(f"  {field.encode_name}{optional}: {_type(field.type)};")
    return "\n".join([*lines, "}"])


def _guard(struct: inspect.StructType) -> str:
    name = struct.cls.__name__
    test = f"return message.type === {json.dumps(struct.tag)};"
    return f"export function is{name}(message: {{ type: string }}): message is {name} {{\n  {test}\n}}"


def _description(field: inspect.Field) -> str:
    text = ""
    if isinstance(field.type, inspect.Metadata):
        text = (field.type.extra_json_schema or {}).get("description", "")
    if field.default is not NODEFAULT:
        text += f". Default: {json.dumps(field.default)}"
    return text


def _type(kind: inspect.Type) -> str:
    if isinstance(kind, inspect.Metadata):
        return _type(kind.type)
    if type(kind) in _SCALARS:
        return _SCALARS[type(kind)]
    if isinstance(kind, inspect.LiteralType):
        return " | ".join(json.dumps(value) for value in kind.values)
    if isinstance(kind, inspect.UnionType):
        members = [_type(member) for member in kind.types]
        return " | ".join(sorted(members, key="null".__eq__))
    if isinstance(kind, inspect.TupleType):
        return f"readonly [{', '.join(_type(item) for item in kind.item_types)}]"
    if isinstance(kind, inspect.VarTupleType):
        item = _type(kind.item_type)
        return f"readonly ({item})[]" if " " in item else f"readonly {item}[]"
    if isinstance(kind, inspect.DictType):
        return f"Record<{_type(kind.key_type)}, {_type(kind.value_type)}>"
    if isinstance(kind, inspect.StructType):
        return str(kind.cls.__name__)
    raise TypeError(f"{kind}: no TypeScript for this type. Teach it to _type() in {__name__}.")


def _comment(text: str, indent: str) -> list[str]:
    wrapped = textwrap.wrap(" ".join(text.split()), 110 - len(indent))
    if len(wrapped) <= 1:
        return [f"{indent}/** {line} */" for line in wrapped]
    return [f"{indent}/**", *(f"{indent} * {line}" for line in wrapped), f"{indent} */"]


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tryon_protocol.generate_ts", description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; fail when the file is out of date")
    options: Any = parser.parse_args(arguments)
    text = typescript()
    if not options.check:
        OUTPUT.parent.mkdir(parents=True, exist_ok=True)
        OUTPUT.write_text(text, encoding="utf-8")
        return 0
    if OUTPUT.exists() and OUTPUT.read_text(encoding="utf-8") == text:
        return 0
    print(f"{OUTPUT} differs from the message types: run `python -m tryon_protocol.generate_ts` and commit it.")
    return 1


if __name__ == "__main__":
    sys.exit(main())
