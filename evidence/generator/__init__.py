"""Simulated test benches with hidden effects, independent of the method: own equations, integrator, forms and draws.

It imports numpy, scipy, h5py and the standard library only, which a test checks. `draw_bench` draws a bench,
`draw_effect` a law of random shape for one of the `dependences`, `world` and `temptations` are deviations of a bench
that are no effect, `strength` measures an effect, `case` and `run` simulate, `files` and `truth` describe. `equations`
have the states of `states`, integrated by `stepping`; an effect can change every quantity in them.
"""
