"""The limits that scenes are held to, and those beyond which the page names a scene.

The first catch a simulation that has gone wild: what holds may still be blown, pulled or pressed harder than any
wearer does it, as the scenes are made by pairs of effects and not by taste.
"""

FASTEST = 10.0  # m/s of a vertex, over what its fall gives it: wind, hands and the body's motion together give less
STRETCHED = 3.0  # of the pattern's length: nothing that is asked for pulls harder; a spring that has gone wild does
NAMED_SPEED = 5.0  # m/s, and
NAMED_STRETCH = 1.5  # of the pattern's length: what goes beyond is told by name, and why
