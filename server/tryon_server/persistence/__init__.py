"""What outlives the process: garments, sessions and the uploaded files, behind small interfaces."""

from tryon_server.persistence.blobs import BlobStore, FileBlobs
from tryon_server.persistence.garments import GarmentRecord, GarmentStore, SqlGarments
from tryon_server.persistence.sessions import SessionRecord, SessionStore, SqlSessions
from tryon_server.persistence.tables import open_database
from tryon_server.persistence.uploads import BodyRecord, MotionRecord, SqlUploads, UploadStore, digest_in_use

__all__ = [
    "BlobStore",
    "BodyRecord",
    "FileBlobs",
    "GarmentRecord",
    "GarmentStore",
    "MotionRecord",
    "SessionRecord",
    "SessionStore",
    "SqlGarments",
    "SqlSessions",
    "SqlUploads",
    "UploadStore",
    "digest_in_use",
    "open_database",
]
