"""How many threads a launch has whose blocks add up together, or whose length only the device knows."""

BLOCK = 128  # threads that add up their shares before one of them goes on with the sum
MOST_THREADS = 1 << 18  # more than any GPU runs at once: beyond that each takes several elements


def whole_blocks(count: int) -> int:
    """Threads for `count` elements in whole blocks, since all of a block must be there to add up; launched with
    `block_dim` BLOCK, each takes every so-manieth element."""
    return min(-(-count // BLOCK) * BLOCK, MOST_THREADS)
