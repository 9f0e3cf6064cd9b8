"""What the rest of the server knows of the simulations: how to start one, and what there is to choose from.

Today each session has a process of its own on this machine (local_processes.py). A placement that puts many sessions
into one process, or onto other machines, fits behind the same interface.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from tryon_server.looks.look import Look
from tryon_server.runtime.order import WorkOrder
from tryon_server.sessions.commands import Command
from tryon_server.sessions.events import Event

AUTOMATIC = "auto"  # in place of the name of a device or a preset: as this machine has it


class Simulation(Protocol):
    """One session's simulation."""

    def order(self, command: Command) -> None:
        """Tell it something; returns at once."""

    def stop(self) -> None:
        """End it; returns at once, and no event follows."""


class Placement(Protocol):
    """Starts simulations."""

    def place(self, order: WorkOrder, on_event: Callable[[Event], None]) -> Simulation:
        """Start a simulation; ``on_event`` is called from another thread, in the order in which things happen."""

    def warm(self, order: WorkOrder) -> None:
        """Do beforehand what the first simulation would have to wait for; given up when a simulation is placed."""

    def close(self) -> None:
        """End every simulation and wait until they are gone."""


@dataclass(frozen=True)
class MotionEntry:
    """A motion that the server can play, and how long it lasts [s]."""

    name: str
    seconds: float


@dataclass(frozen=True)
class FabricEntry:
    """A fabric to choose: mass per area [kg/m^2], thickness [m], largest stretch [1], how it looks, bending stiffness
    [N m], what its numbers follow, and the drape coefficients published for such cloth, least and most [1]."""

    name: str
    areal_density: float
    thickness: float
    strain_limit: float
    look: Look
    bending: float = 0.0
    source: str = ""
    drape: tuple[float, float] | None = None


@dataclass(frozen=True)
class Catalogue:
    """What there is to choose from; the first fabric and the first motion are the defaults. ``effects``, each plain
    JSON: its name, title, what it is about, and its parameters."""

    motions: tuple[MotionEntry, ...]
    fabrics: tuple[FabricEntry, ...]
    presets: tuple[str, ...]
    effects: tuple[Mapping[str, Any], ...] = ()


@dataclass(frozen=True)
class Device:
    """Something to simulate on. ``memory`` in bytes, None where the system does not tell."""

    name: str
    description: str
    memory: int | None


@dataclass(frozen=True)
class Runtime:
    """Everything that simulates, in one value.

    Attributes:
        placement: starts simulations.
        catalogue: what there is to choose from.
        devices: lists what this machine can simulate on; blocking.
    """

    placement: Placement
    catalogue: Catalogue
    devices: Callable[[], tuple[Device, ...]]
