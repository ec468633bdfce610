"""Fuzzing: input that nobody meant, for everything that reads files of strangers.

seeds      small sound inputs of our own, made when they are wanted
mutations  changes to them, the same for the same seed
targets    what is done with an input, and which errors may end it
watch      what an input took, and what came of it
report     the counts of a run as text
python -m fuzz (with tests/ on the path, as in make fuzz): all targets for minutes, into a report
"""
