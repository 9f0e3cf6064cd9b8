"""What outlives the process: garments, sessions and the uploaded files, behind small interfaces."""

from tryon_server.persistence.blobs import BlobStore, FileBlobs
from tryon_server.persistence.garments import GarmentRecord, GarmentStore, SqlGarments
from tryon_server.persistence.sessions import SessionRecord, SessionStore, SqlSessions
from tryon_server.persistence.tables import open_database

__all__ = [
    "BlobStore",
    "FileBlobs",
    "GarmentRecord",
    "GarmentStore",
    "SessionRecord",
    "SessionStore",
    "SqlGarments",
    "SqlSessions",
    "open_database",
]
