/* Functions of FMI 3.0 without a use here. Without CAN frames there are no variables of other types
   than Float64, no clocks and no events. */
#include <stddef.h>
#include "tables.h"

#define NONE_OF_THIS_TYPE(name) \
    int name(void *c, const unsigned *r, size_t n) { return (void)c, (void)r, n ? 3 : 0; }
#define NO_INSTANCE(name) \
    void *name() { return NULL; }
#define ABSENT(name) \
    int name() { return 3; }

NO_INSTANCE(fmi3InstantiateModelExchange)
NO_INSTANCE(fmi3InstantiateScheduledExecution)
NONE_OF_THIS_TYPE(fmi3GetFloat32)
NONE_OF_THIS_TYPE(fmi3GetInt8)
NONE_OF_THIS_TYPE(fmi3GetUInt8)
NONE_OF_THIS_TYPE(fmi3GetInt16)
NONE_OF_THIS_TYPE(fmi3GetUInt16)
NONE_OF_THIS_TYPE(fmi3GetInt32)
NONE_OF_THIS_TYPE(fmi3GetUInt32)
NONE_OF_THIS_TYPE(fmi3GetInt64)
NONE_OF_THIS_TYPE(fmi3GetUInt64)
NONE_OF_THIS_TYPE(fmi3GetString)
NONE_OF_THIS_TYPE(fmi3SetFloat32)
NONE_OF_THIS_TYPE(fmi3SetInt8)
NONE_OF_THIS_TYPE(fmi3SetUInt8)
NONE_OF_THIS_TYPE(fmi3SetInt16)
NONE_OF_THIS_TYPE(fmi3SetUInt16)
NONE_OF_THIS_TYPE(fmi3SetInt32)
NONE_OF_THIS_TYPE(fmi3SetUInt32)
NONE_OF_THIS_TYPE(fmi3SetInt64)
NONE_OF_THIS_TYPE(fmi3SetUInt64)
NONE_OF_THIS_TYPE(fmi3SetString)
ABSENT(fmi3GetNumberOfVariableDependencies)
ABSENT(fmi3GetVariableDependencies)
ABSENT(fmi3GetDirectionalDerivative)
ABSENT(fmi3GetAdjointDerivative)
ABSENT(fmi3EnterConfigurationMode)
ABSENT(fmi3ExitConfigurationMode)
ABSENT(fmi3GetIntervalFraction)
ABSENT(fmi3GetShiftDecimal)
ABSENT(fmi3GetShiftFraction)
ABSENT(fmi3SetIntervalDecimal)
ABSENT(fmi3SetIntervalFraction)
ABSENT(fmi3SetShiftDecimal)
ABSENT(fmi3SetShiftFraction)
ABSENT(fmi3EvaluateDiscreteStates)
ABSENT(fmi3EnterContinuousTimeMode)
ABSENT(fmi3CompletedIntegratorStep)
ABSENT(fmi3SetTime)
ABSENT(fmi3SetContinuousStates)
ABSENT(fmi3GetContinuousStateDerivatives)
ABSENT(fmi3GetEventIndicators)
ABSENT(fmi3GetContinuousStates)
ABSENT(fmi3GetNominalsOfContinuousStates)
ABSENT(fmi3GetNumberOfEventIndicators)
ABSENT(fmi3GetNumberOfContinuousStates)
ABSENT(fmi3GetOutputDerivatives)
ABSENT(fmi3ActivateModelPartition)

#ifndef FRAMES
ABSENT(fmi3EnterEventMode)
NONE_OF_THIS_TYPE(fmi3GetBoolean)
NONE_OF_THIS_TYPE(fmi3GetBinary)
NONE_OF_THIS_TYPE(fmi3GetClock)
NONE_OF_THIS_TYPE(fmi3SetBoolean)
NONE_OF_THIS_TYPE(fmi3SetBinary)
NONE_OF_THIS_TYPE(fmi3SetClock)
ABSENT(fmi3GetIntervalDecimal)
ABSENT(fmi3UpdateDiscreteStates)
ABSENT(fmi3EnterStepMode)
#endif
