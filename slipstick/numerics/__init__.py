"""Numerics under all packages: products of small matrices, threads, wide vectors, and units of quantities."""

__all__ = ["matrix_product", "quantities", "register_tile", "threads", "wide_vectors"]
