"""A session as a state machine without input or output: what arrived and when, in; what to send and to order, out."""

from tryon_server.sessions.actions import Action, Close, End, Order, Send, SendFrame
from tryon_server.sessions.machine import Session
from tryon_server.sessions.rules import Rules
from tryon_server.sessions.status import OWN_MOTION
from tryon_server.sessions.wardrobe import WardrobeSession

__all__ = ["OWN_MOTION", "Action", "Close", "End", "Order", "Rules", "Send", "SendFrame", "Session", "WardrobeSession"]
