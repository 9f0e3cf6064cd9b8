"""The buffers between parties of different speed: bounded, and what must not be lost is not."""

import asyncio
import threading

import pytest

from tryon_server.runtime.kernel_news import kernel_news
from tryon_server.runtime.mailbox import Mailbox
from tryon_server.sessions.commands import FollowMotion, Run, WearFabric
from tryon_server.streaming.outbox import CONTROL_BYTES_MAX, CONTROL_MESSAGES_MAX, Closing, Outbox, OutboxFullError


def taken(outbox: Outbox, count: int) -> list:
    async def take():
        return [await asyncio.wait_for(outbox.take(), 1.0) for _ in range(count)]

    return asyncio.run(take())


def test_outbox_keeps_the_order_of_control_and_frames():
    outbox = Outbox()
    outbox.put_control(b"topology")
    outbox.put_frame(b"key", stands_alone=True)
    outbox.put_frame(b"delta", stands_alone=False)
    outbox.put_control(b"status", "status")
    assert taken(outbox, 4) == [b"topology", b"key", b"delta", b"status"]


def test_frame_that_stands_alone_replaces_frames_that_were_not_sent():
    outbox = Outbox()
    outbox.put_frame(b"old", stands_alone=True)
    outbox.put_frame(b"delta", stands_alone=False)
    outbox.put_control(b"error")
    outbox.put_frame(b"new", stands_alone=True)
    assert taken(outbox, 2) == [b"error", b"new"]


def test_newest_of_a_kind_replaces_the_unsent_one_but_other_control_is_never_dropped():
    outbox = Outbox()
    for k in range(1000):
        outbox.put_control(b"report %d" % k, "report")
    for k in range(CONTROL_MESSAGES_MAX - 1):
        outbox.put_control(b"error %d" % k)
    with pytest.raises(OutboxFullError):
        outbox.put_control(b"one too many")
    assert taken(outbox, 2) == [b"report 999", b"error 0"]
    outbox.put_control(b"there is room again")


def test_bytes_of_control_are_capped():
    outbox = Outbox()
    outbox.put_control(b"x" * (CONTROL_BYTES_MAX - 10))
    with pytest.raises(OutboxFullError):
        outbox.put_control(b"y" * 11)


def test_closing_comes_after_what_was_queued_and_nothing_comes_after_it():
    outbox = Outbox()
    outbox.put_control(b"goodbye")
    outbox.close(1001, "over")
    outbox.put_control(b"late")
    outbox.put_frame(b"late", stands_alone=True)
    outbox.close(1000, "again")
    assert taken(outbox, 2) == [b"goodbye", Closing(1001, "over")]
    assert outbox.closing.is_set()
    with pytest.raises(asyncio.TimeoutError):
        taken(outbox, 1)


def test_overflow_forgets_what_the_client_would_not_read():
    outbox = Outbox()
    outbox.put_control(b"unread")
    outbox.overflow(1008, "reads nothing")
    assert taken(outbox, 1) == [Closing(1008, "reads nothing")]


def test_mailbox_keeps_the_newest_of_each_kind_in_order_of_arrival():
    box = Mailbox()
    for command in (Run(True), WearFabric("denim"), FollowMotion("walk"), Run(False), FollowMotion(None)):
        box.put(command)
    assert box.take() == [WearFabric("denim"), Run(False), FollowMotion(None)]


def test_mailbox_lets_its_reader_go_when_it_is_closed():
    box, got = Mailbox(), []
    reader = threading.Thread(target=lambda: got.append(box.take()))
    reader.start()
    box.close()
    reader.join(5.0)
    assert got == [[]]


def test_compiled_modules_are_news_and_nothing_of_warp_is_printed(capsys):
    news = []
    with kernel_news(news.append):
        print("Warp 1.19.0 initialized:")
        print("Module tryon_solver.contact.pairs 566e84a load on device 'cpu' took 0.49 ms  (cached)")
        print("Module tryon_solver.body.skinning 6d1a80e load on device 'cpu' took 2006.39 ms  (compiled)")
    assert news == ["Compiling kernels, once per machine: 1 so far, the last one skinning"]
    assert capsys.readouterr().out == ""
