"""Models of fabric: one file = energy, projection, gradient and constant matrix of ONE model, with its source."""
