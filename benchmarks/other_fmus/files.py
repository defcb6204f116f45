"""Files beside the FMUs of the cases: interface, step, parameters, inputs, outputs and states."""

DAHLQUIST = """interface = "{interface}"
step = "100 ms"
period = "100 ms"
stretch = "3 s"

[parameters]
k = {{ value = 0.2, plus_minus = 0.05 }}

[outputs.level]
variable = "x"
role = "level"
size = {{ value = 1 }}
"""
BALL = """interface = "model_exchange"
step = "10 ms"
period = "10 ms"
stretch = "0.5 s"

[parameters]
e = { value = 0.7, plus_minus = 0.1 }
g = { value = -9.81, unit = "m/s^2", plus_minus = 0.2 }

[outputs.height]
variable = "h"
role = "height"
size = { value = 1, unit = "m" }

[states.position]
variable = "h"
rate = "speed"
size = { value = 1, unit = "m" }
first = { value = 0, unit = "m" }

[states.speed]
variable = "v"
along = "speed"
size = { value = 3, unit = "m/s" }
first = { value = 0, unit = "m/s" }
"""
OSCILLATOR = """interface = "{interface}"
step = "{step}"
period = "{period}"
stretch = "5 s"

[parameters]
mu = {{ value = 1, plus_minus = 0.2 }}

[outputs.position]
variable = "x0"
role = "position"
size = {{ value = 1 }}

[outputs.speed]
variable = "x1"
role = "speed"
size = {{ value = 1 }}
"""
STATES = """
[states.place]
variable = "x0"
rate = "rate"
size = { value = 1 }

[states.rate]
variable = "x1"
along = "rate"
size = { value = 1 }
"""
SPACE = "\n".join(
    (
        'interface = "model_exchange"\nstep = "50 ms"\nperiod = "50 ms"\nstretch = "3 s"\n',
        "[parameters]",
        *(
            f'a{k}{k} = {{ variable = "A[{k},{k}]", value = {a}, plus_minus = {0.2 * abs(a):g} }}'
            for k, a in ((1, -1.0), (2, -2.0), (3, -0.5))
        ),
        *(
            f'a{i}{j} = {{ variable = "A[{i},{j}]", value = {a}, plus_minus = 0 }}'
            for i, j, a in ((1, 2, 0.5), (2, 3, 0.7), (3, 1, -0.3))
        ),
        *(f'd{k} = {{ variable = "D[{k},{k}]", value = 0, plus_minus = 0 }}' for k in (1, 2, 3)),
        *(
            f'\n[{kind}s.{n}{k}]\nvariable = "{n}[{k}]"\nrole = "{n}{k}"\nsize = {{ value = 1 }}'
            for kind, n in (("input", "u"), ("output", "y"))
            for k in (1, 2, 3)
        ),
    )
)
THROUGH = """interface = "model_exchange"
step = "100 ms"
period = "100 ms"
stretch = "3 s"

[inputs.command]
variable = "Float64_continuous_input"
role = "command"
held = false
size = { value = 1 }

[inputs.number]
variable = "Int32_input"
role = "number"
size = { value = 1 }

[inputs.switch]
variable = "Boolean_input"
role = "switch"
size = { value = 1 }

[outputs.shown]
variable = "Float64_continuous_output"
role = "shown"
size = { value = 1 }

[outputs.number_shown]
variable = "Int32_output"
role = "number shown"
size = { value = 1 }

[outputs.switch_shown]
variable = "Boolean_output"
role = "switch shown"
size = { value = 1 }
"""
STAIR = """interface = "model_exchange"
step = "100 ms"
period = "100 ms"
stretch = "3 s"

[outputs.counted]
variable = "counter"
role = "counted"
size = { value = 5 }
"""
DAMPER = """interface = "model_exchange"
step = "2 ms"
period = "4 ms"
stretch = "0.2 s"

[parameters]
stiffness = { variable = "spring.c", value = 10000, unit = "N/m", plus_minus = 1000 }
damping = { variable = "damper.d", value = 10, unit = "N*s/m", plus_minus = 3 }

[inputs.force]
variable = "f"
role = "force"
size = { value = 300, unit = "N" }

[outputs.stretch]
variable = "damper.s_rel"
role = "stretch"
size = { value = 0.1, unit = "m" }

[states.length]
variable = "damper.s_rel"
rate = "speed"
size = { value = 0.1, unit = "m" }

[states.speed]
variable = "damper.v_rel"
along = "speed"
size = { value = 5, unit = "m/s" }
"""
CLUTCHES = "\n".join(
    (
        'step = "10 ms"\nperiod = "10 ms"\nstretch = "0.5 s"\n',
        '[parameters]\nfrequency = { variable = "freqHz", value = 0.2, unit = "Hz", plus_minus = 0.03 }',
        '\n[inputs.torque]\nvariable = "inputs"\nrole = "torque"\nsize = { value = 3 }',
        *(
            f'\n[outputs.speed_{k}]\nvariable = "outputs[{k}]"\nrole = "speed {k}"\n'
            'size = { value = 5, unit = "rad/s" }'
            for k in (1, 2, 3, 4)
        ),
    )
)
MASSES = """interface = "co_simulation"
step = "50 ms"
period = "50 ms"
stretch = "5 s"

[parameters]
second_start = { variable = "_D_outputAlias_x2", value = 1, plus_minus = 0.2 }
first_speed = { variable = "_D_outputAlias_v1", value = 1, plus_minus = 0.2 }

[outputs.first]
variable = "x1"
role = "first"
size = { value = 1 }

[outputs.second]
variable = "x2"
role = "second"
size = { value = 1 }
"""
