"""The mass on a spring of the laws as a Python function: exact for held inputs."""

import numpy as np
from scipy import linalg, signal

from slipbench import Parameter
from slipbench.identification.mismatch.callables.description import Ports
from slipbench.identification.mismatch.callables.function_system import function_system

PARAMETERS = {
    "gain": Parameter(100.0, 20.0, unit="N/kg/V"),
    "frequency": Parameter(10.0, 1.0, unit="rad/s"),
    "damping": Parameter(0.1, 0.05),
}
PORTS = Ports(("force",), ("place",))


def spring(parameters, inputs, times):
    frequency, damping = parameters["frequency"], parameters["damping"]
    rates = np.zeros((3, 3))
    rates[0, 1] = 1.0
    rates[1] = -(frequency**2), -2.0 * damping * frequency, parameters["gain"]
    held = linalg.expm(rates * (times[1] - times[0]))
    top = signal.ss2tf(held[:2, :2], held[:2, 2:], [[1.0, 0.0]], [[0.0]])
    return {"place": signal.lfilter(top[0][0], top[1], inputs["force"])}


def system(training, simulate=spring, parameters=PARAMETERS, ports=PORTS, time_limit=None):
    return function_system(simulate, parameters, ports, training, time_limit)
