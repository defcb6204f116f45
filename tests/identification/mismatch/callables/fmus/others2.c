/* Functions of FMI 2.0 that the spring does not offer: each is an error. */
#define X(name) int name(void) { return 3; }
X(fmi2CancelStep) X(fmi2DeSerializeFMUstate) X(fmi2FreeFMUstate) X(fmi2GetBoolean)
X(fmi2GetBooleanStatus) X(fmi2GetDirectionalDerivative) X(fmi2GetFMUstate) X(fmi2GetInteger)
X(fmi2GetIntegerStatus) X(fmi2GetNominalsOfContinuousStates) X(fmi2GetRealOutputDerivatives)
X(fmi2GetRealStatus) X(fmi2GetStatus) X(fmi2GetString) X(fmi2GetStringStatus)
X(fmi2SerializeFMUstate) X(fmi2SerializedFMUstateSize) X(fmi2SetBoolean) X(fmi2SetDebugLogging)
X(fmi2SetFMUstate) X(fmi2SetInteger) X(fmi2SetRealInputDerivatives) X(fmi2SetString)
