"""The pattern-space subspace: spline basis, reduced matrices, and the reduced searches built on them."""
