"""An effect that is armed is compiled, and nothing else: a process that binds it finds its kernels in Warp's cache."""

import subprocess
import sys

ARM = """
import sys
import warp as wp
wp.config.kernel_cache_dir = sys.argv[1]
from tryon_solver.kernels import compile_effects
compile_effects(["tryon_solver.effects.pressure"], "cpu")
"""
BIND = """
import sys
import warp as wp
wp.config.kernel_cache_dir = sys.argv[1]
from tryon_solver.effects.pressure import add_pressure_kernel
numbers = wp.zeros(1, dtype=wp.int32, device="cpu")
faces, pressure = wp.zeros(1, dtype=wp.vec3i, device="cpu"), wp.zeros(1, dtype=wp.float32, device="cpu")
x, out = wp.zeros(3, dtype=wp.vec3, device="cpu"), wp.zeros((1, 3), dtype=wp.vec3, device="cpu")
wp.launch(add_pressure_kernel, 1, [numbers, faces, pressure, x], [out], device="cpu")
"""


def lines_of(script, folder):
    done = subprocess.run([sys.executable, "-c", script, str(folder)], capture_output=True, text=True, check=True)
    return [line for line in done.stdout.splitlines() if "load on device" in line]


def test_an_armed_effect_is_compiled_once_and_nothing_else_is(tmp_path):
    first = lines_of(ARM, tmp_path)
    assert ["effects.pressure" in line for line in first] == [True], first
    assert "(compiled)" in first[0]
    bound = lines_of(BIND, tmp_path)
    assert ["effects.pressure" in line for line in bound] == [True], bound
    assert "(cached)" in bound[0]
