"""Simulated test benches with hidden effects, independent of the method: own equations, integrator, forms and draws.

It imports numpy, scipy, h5py and the standard library only, which a test checks. `draw_bench` draws a bench, `draw_effect`
a law of random shape for a pair of `dependences`, `world` and `temptations` the deviations of a bench that are no effect,
`strength` scales an effect, `case` and `run` simulate, `files` and `truth` write. `equations` have the states of
`states`, integrated by `stepping`; an effect can change every quantity in them.
"""
