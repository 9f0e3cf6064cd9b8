"""Projective dynamics by Jacobi with Chebyshev weights (Wang 2015) on the same garment, fabric and body."""

from tryon_solver.baselines.chebyshev_jacobi_pd.solver import ChebyshevJacobi

__all__ = ["ChebyshevJacobi"]
