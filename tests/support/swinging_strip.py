"""A strip that hangs by its upper end, how its lower end moves, and the factor of a step that says."""

import numpy as np
from small_scenes import sheet

from tryon_solver.scene import Gravity, Pins, Scene
from tryon_solver.simulation import build

G, LENGTH, DENSITY = 9.81, 0.4, 0.5  # m/s^2, m, kg/m^2


def strip(cloth, effects, settings, moved):
    """A strip of 80 mm hung by its upper end, y up, at rest where `moved` (depth) -> (N, 2) m, x and y, puts it."""
    garment, flat = sheet(5, 21, 0.08, LENGTH)
    x = np.column_stack([flat[:, 0], -flat[:, 2], 0 * flat[:, 0]])
    top = np.flatnonzero(x[:, 1] > LENGTH / 2 - 1e-6).astype(np.int32)
    depth = LENGTH / 2 - x[:, 1]
    side, sunk = moved(depth)
    # the strip's plane contains y and x; it swings along z, out of it
    place = x + np.column_stack([0 * side, -sunk, side])
    sim = build(Scene(garment, place, None, cloth, (Gravity(), Pins(top, 1e6), *effects)), settings)
    return sim, depth > LENGTH - 1e-6


def motion_of_the_end(sim, bottom, axis, count, dt):
    """(count + 1,) m: the mean coordinate of the lower end, a step apart."""
    return motion(sim, bottom / bottom.sum(), axis, count, dt)


def motion(sim, weights, axis, count, dt):
    """(count + 1,) m: the sum of the cloth's coordinates by weights (N,), a step apart."""
    out = [float(weights @ sim.cloth_positions()[:, axis].astype(np.float64))]
    for k in range(count):
        report = sim.advance(None, (k + 1) * dt)
        assert report.steps == 1
        out.append(float(weights @ sim.cloth_positions()[:, axis].astype(np.float64)))
    return np.array(out)


def factor_of(series):
    """|z| and arg z: the recurrence x_{k+1} = a x_k + b x_{k-1} + c that fits best, c for where it comes to rest."""
    system = np.column_stack([series[1:-1], series[:-2], np.ones(len(series) - 2)])
    a, b, _ = np.linalg.lstsq(system, series[2:], rcond=None)[0]
    z = np.roots([1, -a, -b])[0]
    return abs(z), abs(np.angle(z))
