"""The simulator: parameters and conditions in, shifting times and signals out."""
