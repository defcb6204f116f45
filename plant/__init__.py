"""The motorcycle as equations, and the library of effects that a simulation may lack.

    vehicle = load_vehicle(builtin_vehicle("demonstration"))        # vehicle_file
    simulation = Simulation(vehicle.motorcycle)                      # simulation
    state, throttle = equilibrium(simulation, gear=2, engine_speed=1466.0)
    state, out = simulation.advance(state, Inputs.held(1000, gear=2, throttle_command=throttle))
    out.slip, out.rear_angle, out["optical_lag.seen"]

Read on in this order: blocks (the numbers), equations (the physics), effects/ (what may be
missing), kernel (time), encoder, channels and sensing (the sensors), linear (one operating point).
"""
