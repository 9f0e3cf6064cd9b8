"""Edits of a sewing pattern as values: each makes another specification of one, or is refused with the reason."""
