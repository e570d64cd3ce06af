"""Two other machines with hidden effects, independent of the method: two tanks with a weir, and a DC motor with rest.

`tanks` and `motor` have the equations, `runs` what they have in common: runs, laws of effects and inputs. `recordings`
simulates and measures, `pairs` lists the words of effects, `world`, `settings` and `effects` draw, `strength` measures
an effect, `draw` draws a case from a seed, and `files` writes it.
"""
