"""Effects a scene may call for, one module each, imported on demand by registry.py."""
