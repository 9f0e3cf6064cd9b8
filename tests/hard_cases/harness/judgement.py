"""From a recording to figures, and to the limits that were broken: the same for every case."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import limits
import numpy as np
from limits import Broken
from over_time import trembling, worst_trembling
from scipy.signal import butter, sosfiltfilt
from scipy.spatial import cKDTree

from harness.recording import Recording
from harness.rest import STILL, asleep_too_soon, fastest_on_waking, longest_unmoved, moved_asleep, restless
from harness.scene import Asked
from harness.unfinished import longest_behind, longest_frozen, longest_over, void_share

GROWTH = 0.01  # of the energy at play, by which the energy may grow beyond the work done
GROWTH_AT_REST = 0.05  # the same of what is at play after the stop, which is next to nothing
CREEPING = 0.01  # m/s: moving at this speed is always at play
FROZEN = 0.5  # s: so long a garment may stay in its last safe state
VOID_SHARE = 0.5  # of the frames of any second, which may be in it
QUIET = 1e-3  # m/s RMS of all motion, where the case says from when on
WAKING = 0.1  # m/s of the fastest vertex in the first frame after sleep
CATCHING_UP = 0.5  # s after the stop within which the surface is back at the skin
OFF_TRACKER = 0.1  # m: told, not judged, how long the surface is farther from where a tracker has told the skin to be
TOLD_LAG = 1e-4  # m by which a reported lag may differ from the true one,
TOLD_GAP = 1e-5  # m by which a gap
TOLD_STRETCH = 1e-3  # and by which a stretch
NOISE_SPEED = 10e-3  # m/s RMS of the surface of a body that stands, told by a noisy tracker
NOISE_ABOVE = 5.0  # Hz
UNASKED = "too little time after the stop to judge the rest"
NOISE_MOTION = 0.3e-3  # m RMS of the cloth against the surface under it, above that


def growth(record: Recording, first: int = 0) -> np.ndarray:
    """By how much E - W is above its least value before, as a share of the energy at play, in each frame from `first`.

    At play: the largest kinetic energy, the ranges of what is stored and of the potential in gravity; all from the
    frame `first` on.
    """
    kinetic, stored, fall = (np.array(e[first:]) for e in (record.kinetic, record.stored, record.fall))
    free = kinetic + stored + fall - np.array(record.work[first : len(record.kinetic)])
    rise = free - np.minimum.accumulate(free)
    creeping = 0.5 * record.total_mass * CREEPING**2
    at_play = max(kinetic.max() + np.ptp(stored) + np.ptp(fall), creeping)
    shares: np.ndarray = rise / at_play
    return shares


def growth_at_rest(record: Recording, stops: float) -> np.ndarray | None:
    """The same of the time from half a second after the stop on, when little is at play; None where there is none."""
    first = round((stops + CATCHING_UP) / record.dt)
    return growth(record, first) if not record.failure and first < record.frames else None


def stretches_off(record: Recording) -> list[float]:
    """By how much the reported largest stretch is not that of the frame, after the start."""
    return [abs(told - true) for told, true in zip(record.told_stretch, record.stretch_true[1:])]


def shaken(record: Recording, stops: float) -> float | None:
    """RMS [m/s] above 8 Hz from 0.5 s after the stop; None when too little time is left."""
    first = round(stops / record.dt)
    if record.failure or first >= record.frames:
        return None
    return trembling(np.array(record.cloth[first:]), 1 / record.dt)


def shaken_most(record: Recording, stops: float) -> float | None:
    """The same of the worst second of that time."""
    first = round(stops / record.dt)
    if record.failure or first >= record.frames:
        return None
    return worst_trembling(np.array(record.cloth[first:]), 1 / record.dt)


def under_noise(record: Recording) -> tuple[float, float] | None:
    """RMS speed of the surface [m/s], and of the cloth's place against the surface under it above 5 Hz [m].

    Over the second half of the run: a stream's body first walks into its stream. None where it was not measured. The
    surface under a vertex of the cloth is the vertex of it that is nearest half way through.
    """
    if not record.surface or record.failure:
        return None
    first = len(record.surface) // 2
    surface = np.array(record.surface[first:], np.float64)
    cloth = np.array(record.cloth[1 + first :], np.float64)
    speed = np.diff(surface, axis=0) / record.dt
    _, under = cKDTree(surface[0]).query(cloth[0])
    fast = butter(4, NOISE_ABOVE, "high", fs=1 / record.dt, output="sos")
    apart = sosfiltfilt(fast, cloth - surface[:, under], axis=0)
    return tuple(float(np.sqrt((v**2).sum(-1).mean())) for v in (speed, apart))  # type: ignore[return-value]


def lost(record: Recording, case: Asked) -> float | None:
    """Of what the case is about, at the end; None where that can't be told."""
    return None if case.lost is None or record.failure else case.lost(record.cloth[-1])


def figures(record: Recording, asked: Asked) -> dict[str, Any]:
    """What the table shows."""
    grown = growth(record)
    later = growth_at_rest(record, asked.stops) if asked.rests else None
    kinetic = np.array(record.kinetic)
    return {
        "vertices": len(record.cloth[0]),
        "frames": record.frames,
        "asked": len(record.verdicts),
        "moves": record.moves,
        "not_free": len(record.colliding),
        "unclean": sum(not verdict.clean for _, verdict in record.verdicts),
        "growth": float(grown.max()),
        "growth_frame": int(grown.argmax()),
        "growth_at_rest": None if later is None else float(later.max()),
        "stretch_most": max(record.stretch_most),
        "stretch_max": max(record.stretch_max),
        "strain_limit": record.strain_limit,
        "lag_max": max(record.lag, default=0.0),
        "lag_end": record.lag[-1] if record.lag else 0.0,
        "void": sum(record.retries),
        "reverts": sum(record.reverts),
        "frozen": longest_frozen(record)[0],
        "void_share": void_share(record)[0],
        "behind": longest_behind(record, limits.LAG_MAX)[0],
        "off_tracker": max(record.off_tracker, default=None),
        "behind_tracker": longest_over(record.off_tracker, OFF_TRACKER, record.dt)[0],
        "min_gap": min(record.min_gap, default=None),
        "gap_off": max((off for _, off in record.gaps_off), default=None),
        "stretch_off": max(stretches_off(record), default=0.0),
        "trembling": shaken(record, asked.stops) if asked.rests else None,
        "trembling_most": shaken_most(record, asked.stops) if asked.rests else None,
        "restless": restless(record, asked.quiet),
        "asleep": sum(record.asleep) * record.dt,
        "waking": fastest_on_waking(record),
        "speed_at_end": float(np.sqrt(2 * kinetic[-1] / record.total_mass)),
        "worn": all(record.worn) if record.worn else None,
        "slid": max(record.slid, default=None),
        "ms": float(np.median(record.ms)) if record.ms else None,
        "cpu_ms": float(np.median(record.cpu_ms)) if record.cpu_ms else None,
        "lost": lost(record, asked),
        "noise": under_noise(record),
    }


def broken(record: Recording, asked: Asked) -> list[Broken]:
    """Every limit that was not kept, the first and the worst frame named."""
    return list(_broken(record, asked))


def _broken(record: Recording, case: Asked) -> Iterator[Broken]:
    numbers = range(len(record.cloth))
    stepped = range(1, len(record.lag) + 1)
    asked = [k for k, _ in record.verdicts]

    def counted(name: str, values: list[bool]) -> Iterator[Broken]:
        yield from limits.over(name, asked, [float(value) for value in values], 0)

    verdicts = [verdict for _, verdict in record.verdicts]
    yield from counted("not a number", [not v.finite for v in verdicts])
    yield from counted("cloth through cloth", [v.self_intersecting for v in verdicts])
    yield from counted("cloth through body", [v.body_intersecting for v in verdicts])
    yield from counted("cloth inside the body", [v.inside != 0 for v in verdicts])
    frames = sorted({k for k, _ in record.colliding})
    yield from limits.over("a sub-step that collides", frames, [1.0] * len(frames), 0)
    yield from limits.over("a leap between sub-steps", record.leaps, [1.0] * len(record.leaps), 0)
    yield from limits.over("energy without work (share of what is at play)", numbers, growth(record), GROWTH)
    later = growth_at_rest(record, case.stops) if case.rests else None
    if later is not None:
        name = "energy without work at rest (share)"
        yield from limits.over(name, numbers[-len(later) :], later, GROWTH_AT_REST)
    most, any_ = limits.STRETCH_MOST * record.strain_limit, limits.STRETCH_ANY * record.strain_limit
    yield from limits.over("stretch, 99.9 %", numbers, record.stretch_most, most)
    yield from limits.over("stretch, max", numbers, record.stretch_max, any_)
    yield from _too_long("time in the last safe state [s]", longest_frozen(record), record.dt, FROZEN)
    share, frame = void_share(record)
    if not share <= VOID_SHARE:
        yield Broken("share of a second's frames with void steps", frame, frame, 1, share, VOID_SHARE)
    yield from _too_long("awake, moving and yet left as it was [s]", longest_unmoved(record), record.dt, FROZEN)
    if not case.squeezed and not case.pinches:
        yield from _too_long("time behind the skin [s]", longest_behind(record, limits.LAG_MAX), record.dt, CATCHING_UP)
    settled = [k for k in stepped if k * record.dt >= case.stops + CATCHING_UP - 1e-9]
    bound = limits.PINCHED_LAG_MAX if case.squeezed else limits.LAG_MAX
    yield from limits.over(
        "surface behind the skin after the stop [m]", settled, [record.lag[k - 1] for k in settled], bound
    )
    off = [abs(told - true) for told, true in zip(record.told_lag, record.lag)]
    yield from limits.over("reported lag off by [m]", stepped, off, TOLD_LAG)
    yield from limits.over("reported stretch off by", stepped, stretches_off(record), TOLD_STRETCH)
    measured = [k for k, _ in record.gaps_off]
    yield from limits.over("reported gap off by [m]", measured, [off for _, off in record.gaps_off], TOLD_GAP)
    unsaid = [float(r > 0 and "void" not in a) for r, a in zip(record.retries, record.advice)]
    yield from limits.over("void steps that the advice keeps quiet about", stepped, unsaid, 0)
    if case.rests:
        yield from limits.run_over("trembling [m/s]", shaken(record, case.stops), limits.TREMBLING)
        still = restless(record, case.quiet) is None
        too_short = still and (case.quiet is not None or shaken(record, case.stops) is None)
        unasked = not record.failure and too_short
        yield from limits.run_over(UNASKED, float(unasked), 0)
        gone = not record.failure and max(record.pairs) > 0 and record.pairs[-1] == 0
        yield from limits.run_over("touches nothing at the end", float(gone and not case.parts), 0)
    yield from limits.run_over("lost of what it is about", lost(record, case), 0)
    yield from limits.run_over("all motion at rest [m/s]", restless(record, case.quiet), QUIET)
    never_woke = case.wakes and fastest_on_waking(record) is None
    yield from limits.run_over("never asleep, or never woken", float(never_woke), 0)
    yield from limits.run_over("fastest vertex on waking [m/s]", fastest_on_waking(record), WAKING)
    yield from limits.over("asleep, and yet it moved or worked", stepped, moved_asleep(record), 0)
    yield from limits.over("speed before sleep [m/s]", stepped, asleep_too_soon(record), STILL)
    shaking = under_noise(record)
    if shaking is not None:
        yield from limits.run_over("speed of the surface under noise [m/s]", shaking[0], NOISE_SPEED)
        yield from limits.run_over("cloth on the surface under noise, above 5 Hz [m]", shaking[1], NOISE_MOTION)
    if record.worn:
        yield from limits.over("no longer worn", stepped, [float(not worn) for worn in record.worn], 0)
        yield from limits.over("an opening slid along its limb [m]", stepped, record.slid, limits.SLID)


def _too_long(limit: str, found: tuple[float, int], dt: float, bound: float) -> Iterator[Broken]:
    """Broken where something went on for longer than `bound` s, told by the frame in which it ended."""
    seconds, frame = found
    if not seconds <= bound:
        yield Broken(limit, frame, frame, round(seconds / dt), seconds, bound)


def judged(record: Recording, asked: Asked, stated: Mapping[str, str]) -> dict[str, Any]:
    """Figures and broken limits, ready for JSON; what is only stated is listed apart."""
    found = broken(record, asked)
    return {
        **figures(record, asked),
        "failure": record.failure,
        "broken": [b.plain() for b in found if b.limit not in stated],
        "stated": [{**b.plain(), "reason": stated[b.limit]} for b in found if b.limit in stated],
        "advice": sorted({a for a in record.advice if a}, key=lambda text: (len(text), text))[-1:],
    }
