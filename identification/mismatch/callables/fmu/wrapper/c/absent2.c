/* Functions of FMI 2.0 that a wrapper does not offer, as its description says. */
#define ABSENT(name) \
    int name(void) { return 3; }

ABSENT(fmi2GetFMUstate)
ABSENT(fmi2SetFMUstate)
ABSENT(fmi2FreeFMUstate)
ABSENT(fmi2SerializedFMUstateSize)
ABSENT(fmi2SerializeFMUstate)
ABSENT(fmi2DeSerializeFMUstate)
ABSENT(fmi2GetDirectionalDerivative)
ABSENT(fmi2SetRealInputDerivatives)
ABSENT(fmi2GetRealOutputDerivatives)
ABSENT(fmi2CancelStep)
ABSENT(fmi2GetStatus)
ABSENT(fmi2GetRealStatus)
ABSENT(fmi2GetIntegerStatus)
ABSENT(fmi2GetBooleanStatus)
ABSENT(fmi2GetStringStatus)
