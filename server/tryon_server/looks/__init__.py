"""How fabrics look: maps of their weave, made here alone, for the page and for files."""
