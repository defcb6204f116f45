/* Functions of FMI 2.0 without a use here: there are no variables of other types than Real. */
#include <stddef.h>

#define NONE_OF_THIS_TYPE(name) \
    int name(void *c, const unsigned *r, size_t n, void *v) { return (void)c, (void)r, (void)v, n ? 3 : 0; }
#define ABSENT(name) \
    int name() { return 3; }

NONE_OF_THIS_TYPE(fmi2GetInteger)
NONE_OF_THIS_TYPE(fmi2GetBoolean)
NONE_OF_THIS_TYPE(fmi2GetString)
NONE_OF_THIS_TYPE(fmi2SetInteger)
NONE_OF_THIS_TYPE(fmi2SetBoolean)
NONE_OF_THIS_TYPE(fmi2SetString)
ABSENT(fmi2GetDirectionalDerivative)
ABSENT(fmi2SetRealInputDerivatives)
ABSENT(fmi2GetRealOutputDerivatives)
ABSENT(fmi2CancelStep)
ABSENT(fmi2GetIntegerStatus)
ABSENT(fmi2GetBooleanStatus)
ABSENT(fmi2GetStringStatus)
