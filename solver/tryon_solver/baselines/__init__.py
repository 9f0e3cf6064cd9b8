"""Other solvers of the same garments, to compare with: they share the solver's data and none of its kernels."""
