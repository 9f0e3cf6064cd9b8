"""From what a tracker sees of a person to the pose of our body, one pose at a time. METHOD.md section 11."""

from tryon_solver.body.tracking.observation import Sample, SourceSkeleton, TrackingError
from tryon_solver.body.tracking.tracker import Tracker, fits

__all__ = ["Sample", "SourceSkeleton", "Tracker", "TrackingError", "fits"]
