"""HTTP: parse, ask a service, reply."""
