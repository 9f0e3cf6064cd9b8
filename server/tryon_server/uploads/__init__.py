"""Import of motions and of bodies that move: checked in a process of their own, stored by content."""
