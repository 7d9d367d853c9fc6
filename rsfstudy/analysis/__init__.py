"""Between stable and unstable: what motions do after a step, and the path that divides them."""
