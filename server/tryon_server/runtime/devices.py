"""What this machine can simulate on. NVIDIA's driver is asked directly, so that the server makes no GPU context.

Source of the calls: CUDA Driver API, sections Initialization and Device Management.
"""

from __future__ import annotations

import ctypes
import os
import platform
import sys
from pathlib import Path

from tryon_server.problems import problem_error
from tryon_server.runtime.interface import AUTOMATIC, Device

NAME_BYTES = 256


def list_devices() -> tuple[Device, ...]:
    """The devices of this machine, the best one first."""
    return (*_gpus(), Device("cpu", _processor(), _memory()))


def choose_device(name: str) -> str:
    """The device of this name; ``auto`` is the best there is.

    Raises:
        ProblemError: there is no such device here.
    """
    names = [device.name for device in list_devices()]
    chosen = names[0] if name == AUTOMATIC else "cuda:0" if name == "cuda" else name
    if chosen not in names:
        raise problem_error(
            "device.unknown",
            f"this machine has no device {name!r}",
            f"Choose one of: {', '.join([AUTOMATIC, *names])}",
            place="device",
            status=422,
        )
    return chosen


def _gpus() -> tuple[Device, ...]:
    try:
        driver = ctypes.CDLL("nvcuda.dll" if sys.platform == "win32" else "libcuda.so.1")
    except OSError:  # no driver, no GPU
        return ()
    count = ctypes.c_int(0)
    if driver.cuInit(0) != 0 or driver.cuDeviceGetCount(ctypes.byref(count)) != 0:
        return ()
    return tuple(_gpu(driver, index) for index in range(count.value))


def _gpu(driver: ctypes.CDLL, index: int) -> Device:
    handle, name, memory = ctypes.c_int(0), ctypes.create_string_buffer(NAME_BYTES), ctypes.c_size_t(0)
    driver.cuDeviceGet(ctypes.byref(handle), index)
    driver.cuDeviceGetName(name, NAME_BYTES, handle)
    driver.cuDeviceTotalMem_v2(ctypes.byref(memory), handle)
    return Device(f"cuda:{index}", name.value.decode(errors="replace"), memory.value or None)


def _processor() -> str:
    name = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    if information.is_file():
        for line in information.read_text(errors="replace").splitlines():
            if line.startswith("model name"):
                name = line.partition(":")[2].strip()
                break
    return f"{name}, {os.cpu_count()} cores"


def _memory() -> int | None:
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # not told on this system
        return None
