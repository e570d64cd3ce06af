"""Confirmation: the simulation of the whole bench with what blocks have named, fitted to all signals at once."""
