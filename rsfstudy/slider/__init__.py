"""The physics of a spring-slider: floats in, floats out. It can be read alone.

A slider is five choices, each one file of `laws`, `normal_stress`, `fluid`, `dynamics` and
`loading`; a `scene` says which. Read in this order: `friction` puts law, normal stress and pore
pressure into one relation between stress, slip rate and state, with `states` beside it; a file of
`dynamics` says how slip rate follows; `system` makes equations of motion of both, for whatever
parts a scene has; `equations` gives what an integrator takes. Their numbers stand where `places`
says. `steady` asks the same relation for steady sliding and its stability. `closed_forms` are what
others have published.

From a law to a motion, each hop a function that the next one holds:

1. ``evolution`` of a file in `laws`: the change of the state per unit slip.
2. `states.evolutions_from_single_state` makes ``evolutions`` of it, which takes a tuple of states
   and returns one; a law of several states states that itself. `system.build_scene_functions`
   chooses.
3. `friction.build_friction_functions` adds the unknowns of a fluid or a loading behind those of the
   law: ``FrictionFunctions.evolutions``.
4. `system` makes rates of it: `system.displacement_rate_function` between ruptures, and of a rigid
   slider `system.rigid_rate_function`. In a rupture `dynamics.inertia.rupture_rate` calls it;
   between ruptures with mass, `dynamics.inertia.slip_rate` as well.
5. `equations` puts the rates of a scene, its unknowns and its numbers together.
6. `motion.columns` makes functions of them that fill arrays; a stepper calls these (the one of
   SciPy calls ``Equations.rate_function`` itself), and `motion.loop` the stepper, step by step.

Where the equations of the paper are:

    1a, 4a    friction                                   friction
    1b        slip law                                   laws.slip
    4b        slowness law                               laws.slowness
    1b to 3   effect of normal stress on the state       normal_stress.variable
    5         normal stress follows shear stress         normal_stress.variable
    6         motion with mass                           dynamics.inertia
    15        quasi-static motion                        dynamics.quasi_static, system
    7, 9      critical stiffness, no steady sliding      steady
    8, 10, 11, 14   closed forms of boundaries           closed_forms
    12, 13    stress and slip rate after a jump          friction, steady
    16, 17    a rigid slider                             system, laws.slip, laws.slowness
"""
