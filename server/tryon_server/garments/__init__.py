"""Import of garment patterns: checked in a process of their own, stored by content."""
