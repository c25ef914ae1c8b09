"""Recorded motion: what clips and generated sequences become before a body walks a route with them."""
