"""What a device can do at most, measured: bytes a second in a copy, operations a second in multiply-adds; and the time
of a launch."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import warp as wp

wp.set_module_options({"enable_backward": False})

COPIED = {True: 1 << 26, False: 1 << 23}  # float32 of an array, on a GPU or not: beyond its caches
CHAINS = wp.constant(8)  # of multiply-adds in a thread that do not wait for each other
LINKS = wp.constant(256)  # multiply-adds in each
THREADS = {True: 1 << 20, False: 1 << 11}
LAUNCHES = {True: 20, False: 3}  # that are timed together
ROUNDS = 7


@wp.kernel
def multiply_add_kernel(factor: float, added: float, out: wp.array(dtype=wp.float32)):
    a = float(wp.tid())
    b = a + 1.0
    c = a + 2.0
    d = a + 3.0
    e = a + 4.0
    f = a + 5.0
    g = a + 6.0
    h = a + 7.0
    for _ in range(LINKS):
        a = a * factor + added
        b = b * factor + added
        c = c * factor + added
        d = d * factor + added
        e = e * factor + added
        f = f * factor + added
        g = g * factor + added
        h = h * factor + added
    out[wp.tid()] = a + b + c + d + e + f + g + h


def ceilings(device: str) -> tuple[float, float]:
    """Bytes a second, read and written, of a streaming copy, and operations a second of multiply-adds, two each."""
    cuda = bool(wp.get_device(device).is_cuda)
    source = wp.zeros(COPIED[cuda], dtype=wp.float32, device=device)
    target = wp.zeros_like(source)
    copied = min(rounds(lambda: wp.copy(target, source), device))  # a roof is the most, however busy a round was
    out: wp.array = wp.zeros(THREADS[cuda], dtype=wp.float32, device=device)
    added = min(rounds(lambda: wp.launch(multiply_add_kernel, len(out), [0.999, 1e-3], [out], device=device), device))
    operations = 2 * int(CHAINS) * int(LINKS) * len(out)
    return 8 * len(source) / copied, operations / added


def seconds(launch: Callable[[], object], device: str) -> float:
    """Median time of what `launch` launches [s]."""
    return float(np.median(rounds(launch, device)))


def rounds(launch: Callable[[], object], device: str) -> list[float]:
    """The same [s] of each round of many launches: on a GPU in a graph, between two events."""
    cuda = bool(wp.get_device(device).is_cuda)
    count = LAUNCHES[cuda]
    launch()  # compiles
    wp.synchronize_device(device)
    if not cuda:
        return [of_a_loop(launch, count) for _ in range(ROUNDS)]
    with wp.ScopedCapture(device) as captured:
        for _ in range(count):
            launch()
    stream = wp.get_stream(device)
    took = []
    for _ in range(ROUNDS):
        begun = stream.record_event(wp.Event(device, enable_timing=True))
        wp.capture_launch(captured.graph)
        done = stream.record_event(wp.Event(device, enable_timing=True))
        took.append(1e-3 * wp.get_event_elapsed_time(begun, done) / count)
    return took


def of_a_loop(launch: Callable[[], object], count: int) -> float:
    """Time of a launch [s] on a processor, which is done when it returns."""
    begun = time.perf_counter()
    for _ in range(count):
        launch()
    return (time.perf_counter() - begun) / count
