"""Effects that a simulation has already, and whose numbers are not the joint's.

A twin that knew a joint a year ago, or a simulator's guess, has too much of an effect as easily as
too little. What it has too much of is no missing physics, and would be taken for some: friction
that the simulation lets fall too far bends. So such effects are doubted, taken out of it, and
looked for as if it did not have them; what is found in their place is held against what it says. A
recorded simulation cannot be taken apart: it and the joint change places.
"""
