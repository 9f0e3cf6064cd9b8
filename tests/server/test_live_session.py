"""The event loop around a session: slow readers are cut off, the end is told once, nothing is ordered after it."""

import asyncio

from session_driver import RULES

from tryon_protocol import HelloMessage, encode
from tryon_server.sessions import Session
from tryon_server.sessions.events import Gone, Troubled
from tryon_server.streaming.live_session import LiveSession
from tryon_server.streaming.outbox import CONTROL_MESSAGES_MAX, Closing

HELLO = encode(HelloMessage(versions=(1,), client="test"))


class Simulation:
    def __init__(self) -> None:
        self.orders, self.stopped = [], 0

    def order(self, command) -> None:
        self.orders.append(command)

    def stop(self) -> None:
        self.stopped += 1


def scenario(act) -> tuple[Simulation, list]:
    """Run ``act(live, send_event)`` around a session; its simulation and how it ended."""
    simulation, ends = Simulation(), []

    async def body():
        events = []
        session = Session("one", RULES, "walk", "cotton", lambda: "token", 0.0)

        def start(on_event):
            events.append(on_event)
            return simulation

        live = LiveSession(session, start, lambda _, reason: ends.append(reason))
        await act(live, events[0])
        live.end("over")
        await asyncio.sleep(0)

    asyncio.run(body())
    return simulation, ends


def test_client_that_reads_nothing_is_cut_off_and_the_others_go_on():
    async def act(live, send_event):
        slow, slow_box = live.connect()
        quick, quick_box = live.connect()
        for client in (slow, quick):
            live.receive(client, HELLO)
        for k in range(CONTROL_MESSAGES_MAX + 5):
            await asyncio.to_thread(send_event, Troubled("simulation_failed", "$", f"step {k}", "wait"))
            await asyncio.sleep(0)
            while quick_box._entries:
                await quick_box.take()
        assert slow_box.closing.is_set()
        assert await slow_box.take() == Closing(1008, "The client reads nothing")
        assert not quick_box.closing.is_set()
        assert live.machine.viewer_count == 1
        live.disconnect(slow)

    scenario(act)


def test_end_stops_the_simulation_once():
    async def act(live, _send_event):
        live.end("asked for")
        live.end("asked again")

    simulation, ends = scenario(act)
    assert (simulation.stopped, ends) == (1, ["asked for"])


def test_simulation_that_is_gone_ends_the_session_for_its_clients():
    async def act(live, send_event):
        client, box = live.connect()
        live.receive(client, HELLO)
        await asyncio.to_thread(send_event, Gone("its process was ended by signal 9"))
        await asyncio.sleep(0)
        items = [await box.take() for _ in range(len(box._entries))]
        assert items[-1].code == 1000
        assert live.machine.ended

    _, ends = scenario(act)
    assert "signal 9" in ends[0]
    assert len(ends) == 1


def test_event_after_the_loop_has_closed_is_no_error():
    kept = []

    async def act(_live, send_event):
        kept.append(send_event)

    scenario(act)
    kept[0](Gone("late"))
