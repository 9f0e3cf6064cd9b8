"""Which devices a simulation can run on."""

from __future__ import annotations

from dataclasses import dataclass

import warp as wp


@dataclass(frozen=True)
class DeviceInfo:
    """`name` as `build` takes it; `description` for people; `memory` bytes, None for the processor."""

    name: str
    description: str
    memory: int | None


def available_devices() -> tuple[DeviceInfo, ...]:
    """The devices of this machine, GPUs first."""
    wp.init()
    found = [DeviceInfo(d.alias, d.name, int(d.total_memory)) for d in wp.get_cuda_devices()]
    return (*found, DeviceInfo("cpu", "processor", None))
