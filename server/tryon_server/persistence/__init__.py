"""What outlives the process: garments, sessions, edits and the uploaded files, behind small interfaces."""

from tryon_server.persistence.blobs import BlobStore, FileBlobs
from tryon_server.persistence.edits import EditRecord, EditStore, SqlEdits, Waiting
from tryon_server.persistence.finishes import FinishRecord, FinishStore, SqlFinishes
from tryon_server.persistence.garments import GarmentRecord, GarmentStore, SqlGarments
from tryon_server.persistence.kept_files import KeptFiles
from tryon_server.persistence.outfits import OutfitRecord, OutfitStore, SqlOutfits, WornRecord
from tryon_server.persistence.sessions import FIT, SessionRecord, SessionStore, Size, SqlSessions
from tryon_server.persistence.tables import open_database
from tryon_server.persistence.uploads import (
    BodyRecord,
    MotionRecord,
    PrintRecord,
    SqlUploads,
    UploadStore,
    digest_in_use,
)

__all__ = [
    "FIT",
    "BlobStore",
    "BodyRecord",
    "EditRecord",
    "EditStore",
    "FileBlobs",
    "FinishRecord",
    "FinishStore",
    "GarmentRecord",
    "GarmentStore",
    "KeptFiles",
    "MotionRecord",
    "OutfitRecord",
    "OutfitStore",
    "PrintRecord",
    "SessionRecord",
    "SessionStore",
    "Size",
    "SqlEdits",
    "SqlFinishes",
    "SqlGarments",
    "SqlOutfits",
    "SqlSessions",
    "SqlUploads",
    "UploadStore",
    "Waiting",
    "WornRecord",
    "digest_in_use",
    "open_database",
]
