"""Optional effects, one file each: plain functions of floats that `equations` assembles for a
scene.
"""
