"""A real server, real websockets, real processes: what the network and the operating system can do to a session."""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import signal
import time

import msgspec
import numpy as np
import pytest
import websockets
from live_server import LiveServer

from tryon_client import connect
from tryon_protocol import (
    ErrorMessage,
    GoodbyeMessage,
    HelloMessage,
    PauseMessage,
    PlayMessage,
    PoseMessage,
    ProtocolError,
    ReportMessage,
    SetAccuracyMessage,
    SetFabricMessage,
    SetMotionMessage,
    StatusMessage,
    Topology,
    decode_server,
    encode,
)

REST = [(0.0, 0.0, 0.0, 1.0)] * 3


def run(coroutine):
    return asyncio.run(asyncio.wait_for(coroutine, 60.0))


async def take_frames(stream, count: int) -> list:
    frames = []
    async for frame in stream.frames():
        frames.append(frame)
        if len(frames) == count:
            break
    return frames


async def until(stream, wanted, seconds: float = 10.0):
    """The first event that ``wanted`` likes."""
    async with asyncio.timeout(seconds) if hasattr(asyncio, "timeout") else contextlib.AsyncExitStack():
        async for event in stream:
            if wanted(event):
                return event
    raise AssertionError("the stream ended before the event came")


def raw(server, session_id: str, **options):
    """A websocket that does only what the test does."""
    return websockets.connect(server.stream_url(session_id), subprotocols=["tryon.v1"], compression=None, **options)


@pytest.fixture(scope="module")
def swaying(live):
    """A session that plays a motion, for tests that leave it as they found it."""
    return live.open()


def test_frames_of_a_motion_arrive_in_order_and_follow_it(live, swaying):
    async def scenario():
        async with connect(live.stream_url(swaying)) as stream:
            frames = await take_frames(stream, 60)
            assert [frame.seq for frame in frames] == list(range(frames[0].seq, frames[0].seq + 60))
            assert frames[0].stands_alone
            assert stream.topology.cloth_vertex_count == 144
            assert stream.status.state == "running"
            moving = [frame for frame in frames if frame.t_sim > 0]
            assert moving[-1].t_sim > 0.3
            for frame in moving:
                assert frame.root[0] == pytest.approx(0.1 * math.sin(2 * math.pi * frame.t_sim), abs=1e-4)

    run(scenario())


def test_poses_of_a_client_are_solved_for_and_bad_ones_are_answered(live):
    async def scenario():
        async with connect(live.stream_url(live.open(motion=None))) as stream:
            await until(stream, lambda event: isinstance(event, Topology))
            await stream.send_pose((0.0, 0.0, 0.0), REST, t=1.0)
            await stream.send_pose((0.0, math.nan, 0.0), REST, t=1.1)
            error = await until(stream, lambda event: isinstance(event, ErrorMessage))
            assert (error.code, error.place, error.fatal) == ("invalid_pose", "$.root[1]", False)
            await stream.send_pose((0.0, 0.0, 0.0), REST[:2], t=1.2)
            error = await until(stream, lambda event: isinstance(event, ErrorMessage))
            assert "head" in error.message
            newest = await stream.send_pose((0.05, 0.0, 0.0), REST, t=1.3)
            frame = await until(stream, lambda event: getattr(event, "pose_seq", 0) == newest)
            assert frame.root[0] <= 0.05

    run(scenario())


@pytest.mark.parametrize("code", [1000, pytest.param(1001, marks=pytest.mark.long), None])
def test_poses_of_a_client_that_closed_its_connection_give_way_at_once_and_of_one_that_broke_do_not(live, code):
    """``code`` of the close frame; None: the connection is cut off without any."""

    async def scenario():
        session = live.open(motion=None)
        async with connect(live.stream_url(session)) as stream:
            await until(stream, lambda event: isinstance(event, Topology))
            async with raw(live, session) as websocket:
                await websocket.send(encode(HelloMessage(versions=(1,), client="test")))
                pose = PoseMessage(
                    subject="wearer",
                    convention="model-local",
                    frame="session",
                    t=1.0,
                    seq=7,
                    root=(0.0, 0.0, 0.0),
                    rotations=tuple(REST),
                )
                await websocket.send(encode(pose))
                await until(stream, lambda event: getattr(event, "pose_seq", 0) == pose.seq)
                if code is None:
                    websocket.transport.abort()
                else:
                    await websocket.close(code)
            # The server hears of the end a little later than this test.
            while live.http.get(f"/api/sessions/{session}").json()["viewers"] > 1:
                await asyncio.sleep(0.02)
            newest = await stream.send_pose((0.05, 0.0, 0.0), REST, t=1.0)
            answer = await until(
                stream, lambda event: isinstance(event, ErrorMessage) or getattr(event, "pose_seq", 0) == newest
            )
            assert getattr(answer, "code", None) == ("pose_source_taken" if code is None else None)

    run(scenario())


def test_a_session_that_is_asked_for_does_not_end_for_want_of_a_connection(tmp_path):
    """Who looks for a size over REST waits for minutes without a websocket."""
    server = LiveServer(tmp_path, session_grace_seconds=1.5)
    session = server.open()
    for _ in range(10):
        time.sleep(0.3)
        assert server.http.get(f"/api/sessions/{session}").json()["state"] != "closed"
    time.sleep(2.5)
    ended = server.http.get(f"/api/sessions/{session}").json()
    assert (ended["state"], ended["detail"]) == ("closed", "Nobody was watching any more")
    server.stop()


def test_a_session_that_is_edited_over_rest_does_not_end_for_want_of_a_connection(tmp_path):
    """Refused or made: who edits waits for it, as who reads its pattern does."""
    server = LiveServer(tmp_path, session_grace_seconds=1.5)
    session = server.open()
    path = f"/api/sessions/{session}"
    asked = (
        lambda: server.http.post(f"{path}/edits", json={"edit": {"kind": "move_seam"}}),
        lambda: server.http.get(f"{path}/edits"),
        lambda: server.http.get(f"{path}/pattern"),
    )
    for ask in asked:
        for _ in range(8):
            time.sleep(0.3)
            assert ask().status_code != 409
    assert server.http.get(path).json()["state"] != "closed"
    server.stop()


def test_the_cloth_goes_on_while_no_poses_come_and_frames_with_it(live):
    session = live.open(motion=None)

    async def scenario():
        async with connect(live.stream_url(session)) as stream:
            await until(stream, lambda event: isinstance(event, Topology))
            for k in range(20):
                await stream.send_pose((0.005 * k, 0.0, 0.0), REST, t=1.0 + 0.02 * k)
                await asyncio.sleep(0.02)
            following = lambda event: isinstance(event, StatusMessage) and event.state == "running"  # noqa: E731
            await until(stream, following)
            await until(stream, lambda event: isinstance(event, StatusMessage) and event.state == "waiting")
            return await take_frames(stream, 30)

    frames = run(scenario())
    moments = np.array([frame.t_sim for frame in frames])
    np.testing.assert_allclose(moments, 1.0 + 0.02 * 19, atol=1e-9, err_msg="the time of the pose that is held")
    assert np.ptp([frame.t_published for frame in frames]) > 0.4
    assert np.abs(frames[-1].cloth - frames[0].cloth).max() > 1e-3
    assert all(frame.pose_seq == 20 for frame in frames)
    np.testing.assert_allclose([frame.root for frame in frames], [frames[0].root] * len(frames), atol=1e-9)
    live.http.delete(f"/api/sessions/{session}")


def test_a_wearer_who_appears_far_away_is_seen_there_at_once(live):
    """Ten kilometres from the session's origin, with cloth and body where the wearer is and nothing on the way."""

    async def scenario():
        async with connect(live.stream_url(live.open(motion=None))) as stream:
            topology = await until(stream, lambda event: isinstance(event, Topology))
            newest = await stream.send_pose((10_000.25, 0.0, -10_000.0), REST, t=1.0)
            frame = await until(stream, lambda event: getattr(event, "pose_seq", 0) == newest)
            assert np.abs(frame.root - [10_000.25, 0.0, -10_000.0]).max() < 0.5
            sheet = frame.cloth - frame.root
            assert sheet[:, :2].min() == pytest.approx(0.0, abs=1e-4)
            assert sheet[:, :2].max() == pytest.approx(0.5, abs=1e-4)
            assert frame.offset_count == 0, "the body is where its pose says"
            np.testing.assert_allclose(frame.body - frame.root, topology.body.rest_vertices, atol=1e-4)

    run(scenario())


def test_a_message_beyond_all_measure_closes_that_connection_only(live, swaying):
    async def scenario():
        async with connect(live.stream_url(swaying)) as other:
            async with raw(live, swaying) as websocket:
                # the server may close before all is sent
                with contextlib.suppress(websockets.exceptions.ConnectionClosed):
                    await websocket.send(bytes(2 * 2**20))
                await websocket.wait_closed()
                assert websocket.close_code == 1009
            assert len(await take_frames(other, 3)) == 3

    run(scenario())


def test_vanished_and_stalled_clients_delay_nobody(live, swaying):
    async def scenario():
        stalled = await raw(live, swaying, max_queue=1)
        await stalled.send(b"\x83\xa4type\xa5hello\xa8versions\x91\x01\xa6client\xa1x")
        vanished = await raw(live, swaying)
        await vanished.send(b"\x83\xa4type\xa5hello\xa8versions\x91\x01\xa6client\xa1y")
        async with connect(live.stream_url(swaying)) as stream:
            await take_frames(stream, 10)
            vanished.transport.abort()
            frames = await take_frames(stream, 60)
            numbers = [frame.seq for frame in frames]
            assert numbers == list(range(numbers[0], numbers[0] + 60)), "the quick client misses no frame"
        stalled.transport.abort()

    run(scenario())


@pytest.mark.parametrize("data", [b"", b"\xc1\x00\x00", b"\x00" * 40, b"\x93\x01\x02\x03"])
def test_malformed_bytes_are_answered_and_the_connection_goes_on(live, swaying, data):
    async def scenario():
        async with connect(live.stream_url(swaying)) as stream:
            await stream._connection.send(data)
            await until(stream, lambda event: isinstance(event, ErrorMessage))
            assert len(await take_frames(stream, 3)) == 3

    run(scenario())


def test_of_a_burst_of_choices_the_newest_stands_and_frames_are_solved_so(live):
    session_id = live.open()

    async def scenario():
        async with connect(live.stream_url(session_id)) as stream:
            await take_frames(stream, 2)
            for k in range(1, 401):
                await stream._connection.send(encode(SetAccuracyMessage(accuracy=1e-5 * k, deadline_ms=100.0 + k)))
            await until(stream, lambda event: isinstance(event, StatusMessage) and event.deadline_ms == 500.0)
            await until(stream, lambda event: isinstance(event, ReportMessage) and event.error == 1e-5 * 400)

    run(scenario())
    told = live.http.get(f"/api/sessions/{session_id}").json()
    assert (told["accuracy"], told["deadline_ms"]) == (1e-5 * 400, 500.0)


def test_another_preset_comes_in_force_in_the_stream_and_another_client_sees_it(live):
    session_id = live.open(preset="draft")

    async def scenario():
        async with connect(live.stream_url(session_id)) as stream, connect(live.stream_url(session_id)) as other:
            first = (await take_frames(stream, 2))[-1]
            await stream.send(SetAccuracyMessage(preset="live", accuracy=1e-4))
            await stream.send(SetAccuracyMessage(preset="fit", accuracy=1e-4))
            for one in (stream, other):
                await until(one, lambda event: isinstance(event, StatusMessage) and event.preset_in_force == "fit")
                report = await until(one, lambda event: isinstance(event, ReportMessage) and event.iterations == 8)
                assert report.error == 1e-4
            assert (await take_frames(stream, 2))[-1].topology_id == first.topology_id

    run(scenario())


def test_a_burst_of_numbered_commands_that_are_wrong_is_answered_one_by_one(live, swaying):
    """The client reads: that all of them are there before the first is answered must not look as if it did not."""

    async def scenario():
        async with connect(live.stream_url(swaying)) as stream:
            await take_frames(stream, 2)
            for number in range(400):
                wrong = {"type": "set_accuracy", "deadline_ms": -1.0, "request": number}
                await stream._connection.send(msgspec.msgpack.encode(wrong))
            for number in range(400):
                fault = await until(stream, lambda event: isinstance(event, ErrorMessage))
                assert (fault.place, fault.request) == ("$.deadline_ms", number)
            assert len(await take_frames(stream, 3)) == 3

    run(scenario())


def test_garbage_instead_of_hello_closes_that_connection_only(live, swaying):
    async def scenario():
        async with raw(live, swaying) as websocket:
            await websocket.send(b"garbage")
            assert decode_server(await websocket.recv()).fatal
            with pytest.raises(websockets.ConnectionClosed) as closed:
                await websocket.recv()
            assert closed.value.rcvd.code == 4400
        async with connect(live.stream_url(swaying)) as stream:
            assert len(await take_frames(stream, 3)) == 3

    run(scenario())


@pytest.mark.parametrize("path", ["/api/sessions", "/api/garments"])
def test_session_goes_on_while_somebody_sends_without_end(live, swaying, path):
    async def scenario():
        async with connect(live.stream_url(swaying)) as stream:
            await take_frames(stream, 2)
            reader, writer = await asyncio.open_connection("127.0.0.1", live.port)
            head = f"POST {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\n"
            writer.write(head.encode())
            for _ in range(24):  # 1 MiB each, beyond every cap
                writer.write(b"100000\r\n" + b"0," * 2**19 + b"\r\n")
                await writer.drain()
                await take_frames(stream, 1)
            assert (await reader.readline()).startswith(b"HTTP/1.1 413")
            writer.close()

    run(scenario())


def test_killed_simulation_is_told_with_advice_and_others_go_on(live, swaying):
    doomed = live.open()

    async def scenario():
        async with connect(live.stream_url(doomed)) as stream, connect(live.stream_url(swaying)) as second:
            await take_frames(stream, 3)
            await take_frames(second, 3)
            os.kill(live.pid(doomed), signal.SIGKILL)
            with pytest.raises(ProtocolError) as error:
                await take_frames(stream, 10_000)
            assert error.value.code == "simulation_failed"
            assert "signal 9" in error.value.message
            assert len(await take_frames(second, 20)) == 20

    run(scenario())
    ended = live.http.get(f"/api/sessions/{doomed}").json()
    assert ended["state"] == "closed"
    assert "signal 9" in ended["detail"]
    assert live.http.get("/api/health").json()["status"] == "ok"


def test_simulation_that_ends_by_itself_is_told_too(live):
    session_id = live.open(fabric="crash")

    async def scenario():
        async with connect(live.stream_url(session_id)) as stream:
            with pytest.raises(ProtocolError, match="status 7"):
                await take_frames(stream, 10_000)

    run(scenario())


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="only Linux tells what a process has taken")
def test_a_simulation_that_takes_too_much_memory_is_ended_and_the_others_go_on(tmp_path):
    server = LiveServer(tmp_path, session_memory_bytes=2**30)
    try:
        modest, greedy = server.open(), server.open(fabric="greedy")

        async def scenario():
            async with connect(server.stream_url(modest)) as other:
                await take_frames(other, 3)
                async with connect(server.stream_url(greedy)) as stream:
                    with pytest.raises(ProtocolError) as error:
                        await take_frames(stream, 10_000)
                assert error.value.code == "simulation_failed"
                assert "more memory than the 1 GiB" in error.value.message
                assert error.value.remedy
                assert len(await take_frames(other, 20)) == 20

        run(scenario())
        ended = server.http.get(f"/api/sessions/{greedy}").json()
        assert (ended["state"], "memory" in ended["detail"]) == ("closed", True)
    finally:
        server.stop()


def test_garment_that_cannot_be_dressed_says_so_and_another_fabric_is_dressed_anew(live):
    session_id = live.open(fabric="tight")

    async def scenario():
        async with connect(live.stream_url(session_id)) as stream:
            status = await until(stream, lambda event: isinstance(event, StatusMessage) and event.state == "failed")
            assert status.detail == "a seam of 'tube' stayed open. Enlarge the pieces."
            await stream.send(SetFabricMessage(fabric="cotton"))
            assert (await take_frames(stream, 3))[-1].topology_id == 1
            await stream.send(SetFabricMessage(fabric="denim"))
            frame = await until(
                stream, lambda event: getattr(event, "cloth", None) is not None and event.topology_id == 2
            )
            assert frame.stands_alone
            if stream.status.fabric != "denim":
                await until(stream, lambda event: isinstance(event, StatusMessage) and event.fabric == "denim")
            await stream.send(SetMotionMessage(motion="moonwalk", request=9))
            error = await until(stream, lambda event: isinstance(event, ErrorMessage))
            assert (error.code, error.request) == ("unknown_motion", 9)

    run(scenario())


def test_pause_stops_the_frames_and_play_goes_on_from_there(live, swaying):
    async def scenario():
        async with connect(live.stream_url(swaying)) as stream:
            await take_frames(stream, 50)
            await stream.send(PauseMessage())
            await until(stream, lambda event: isinstance(event, StatusMessage) and event.state == "paused")
            held = None
            with contextlib.suppress(asyncio.TimeoutError, TimeoutError):
                while True:
                    held = await asyncio.wait_for(anext(stream.frames()), 0.5)
            await stream.send(PlayMessage())
            frame = (await take_frames(stream, 1))[0]
            assert held is None or frame.t_sim - held.t_sim < 0.1

    run(scenario())


def test_client_without_zstd_gets_frames_it_can_read_beside_one_that_has_it(live, swaying):
    async def scenario():
        async with (
            connect(live.stream_url(swaying)) as first,
            connect(live.stream_url(swaying), codecs=()) as second,
        ):
            one, two = await asyncio.gather(take_frames(first, 20), take_frames(second, 20))
            assert all(frame.stands_alone for frame in two)
            assert not all(frame.stands_alone for frame in one)

    run(scenario())


def test_unknown_session_and_missing_subprotocol_are_refused(live):
    async def scenario():
        with pytest.raises(ProtocolError, match="no live session"):
            async with connect(live.stream_url("nobody")):
                pass
        with pytest.raises(websockets.InvalidStatus) as refused:
            await websockets.connect(live.stream_url("nobody"))
        assert refused.value.response.status_code == 400

    run(scenario())


def test_pages_of_other_origins_cannot_open_a_stream(live, swaying):
    async def scenario():
        with pytest.raises(websockets.InvalidStatus) as refused:
            await raw(live, swaying, origin="http://evil.example")
        assert refused.value.response.status_code == 403
        own = await raw(live, swaying, origin=f"http://127.0.0.1:{live.port}")
        await own.close()

    run(scenario())


def test_compression_of_the_websocket_is_never_negotiated(live, swaying):
    async def scenario():
        async with websockets.connect(live.stream_url(swaying), subprotocols=["tryon.v1"]) as websocket:
            assert "Sec-WebSocket-Extensions" not in websocket.response.headers

    run(scenario())


def test_deleted_session_says_goodbye(live):
    session_id = live.open()

    async def scenario():
        async with connect(live.stream_url(session_id)) as stream:
            await take_frames(stream, 2)
            await asyncio.to_thread(live.http.delete, f"/api/sessions/{session_id}")
            assert [event async for event in stream][-1] == GoodbyeMessage(reason="Ended by request", retry_after=None)

    run(scenario())


def test_stopping_server_closes_with_1001_and_tells_when_to_come_back(tmp_path):
    server = LiveServer(tmp_path)
    session_id = server.open()

    async def scenario():
        async with connect(server.stream_url(session_id)) as stream:
            await take_frames(stream, 3)
            stopping = asyncio.create_task(asyncio.to_thread(server.stop))
            async for _ in stream:
                pass
            await stopping
            assert stream.goodbye.retry_after >= 2.0
            assert stream._connection.close_code == 1001

    run(scenario())
    pid_gone_by = time.monotonic() + 5.0
    placement = server.app.state.services.runtime.placement
    while placement._processes:
        assert time.monotonic() < pid_gone_by, "simulations outlive the server"
