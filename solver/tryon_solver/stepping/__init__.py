"""The verbs of step.py, one idea a file."""
