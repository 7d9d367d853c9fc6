"""The units of a rig: from what a laboratory states to scenes, and back to what it reads."""
