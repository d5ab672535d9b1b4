"""Unsteady aerodynamics: vortex lattice and vortex-particle wake, dynamic derivatives against reduced frequency."""
