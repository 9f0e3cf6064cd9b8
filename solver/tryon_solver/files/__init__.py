"""Files as strangers' programs write them: meshes, and what is said of their units and axes."""
