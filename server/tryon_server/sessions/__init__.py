"""A session as a state machine without input or output: what arrived and when, in; what to send and to order, out."""

from tryon_server.sessions.actions import Action, Close, End, Order, Send, SendFrame
from tryon_server.sessions.machine import OWN_MOTION, Rules, Session

__all__ = ["OWN_MOTION", "Action", "Close", "End", "Order", "Rules", "Send", "SendFrame", "Session"]
