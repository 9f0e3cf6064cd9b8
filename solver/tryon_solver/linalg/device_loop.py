"""Loops whose end is decided on the device."""

from __future__ import annotations

from collections.abc import Callable

import warp as wp


def loop_on_device(more: wp.array, body: Callable[[], None]) -> None:
    """Launch what `body` launches for as long as more[0] (int32) is not zero.

    On a GPU the loop becomes a graph with a conditional node, where the driver knows such (CUDA 12.4): launched once,
    it costs the processor nothing however often it turns. `body` must neither allocate nor read back.
    """
    device = wp.get_device(more.device)
    if not (device.is_cuda and wp.is_conditional_graph_supported()):
        wp.capture_while(more, body)
        return
    with wp.ScopedCapture(device=device) as loop:
        wp.capture_while(more, body)
    wp.capture_launch(loop.graph)
