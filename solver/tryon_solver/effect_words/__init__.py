"""Names, parameters and states of effects as people write them: in a pattern, over the wire, in the page."""
