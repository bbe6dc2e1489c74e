"""The FMI 3.0 wrapper's fixed text: every function of ``fmi3Functions.h``, those of other interface types refusing."""

from .fmi3_refused_text import REFUSED

INSTANCE = """\
typedef struct {
    fmuValues values;
    fmi3LogMessageCallback logger;
    fmi3InstanceEnvironment environment;
    fmi3Boolean logging;
} fmuInstance;

static fmi3Status fmuRefuse(const fmuInstance *fmu, const char *message)
{
    if (fmu != NULL && fmu->logging && fmu->logger != NULL) {
        fmu->logger(fmu->environment, fmi3Error, fmuErrors, message);
    }
    return fmi3Error;
}

/* From one phase to the next. */
static fmi3Status fmuEnter(fmuInstance *fmu, int from, int to)
{
    if (fmu == NULL || fmu->values.phase != from) {
        return fmuRefuse(fmu, "this function may not be called now");
    }
    fmu->values.phase = to;
    return fmi3OK;
}

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
    const fmi3String categories[])
{
    fmuInstance *fmu = (fmuInstance *)instance;

    if (fmu == NULL || (nCategories > 0 && categories == NULL)) {
        return fmi3Error;
    }
    for (size_t i = 0; i < nCategories; ++i) {
        if (categories[i] == NULL || strcmp(categories[i], fmuErrors) != 0) {
            return fmuRefuse(fmu, "there is no such log category");
        }
    }
    fmu->logging = loggingOn;
    return fmi3OK;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken,
    fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
    fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
    size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate)
{
    fmuInstance *fmu;

    (void)resourcePath;
    (void)visible;
    (void)earlyReturnAllowed;
    (void)requiredIntermediateVariables;
    (void)intermediateUpdate;
    if (instanceName == NULL || instantiationToken == NULL || strcmp(instantiationToken, fmuToken) != 0
        || eventModeUsed || nRequiredIntermediateVariables > 0) {
        if (logMessage != NULL && loggingOn) {
            logMessage(instanceEnvironment, fmi3Error, fmuErrors,
                "not instantiated: another token than in modelDescription.xml, or event mode or intermediate update");
        }
        return NULL;
    }
    fmu = (fmuInstance *)calloc(1, sizeof *fmu);
    if (fmu != NULL) {
        fmu->logger = logMessage;
        fmu->environment = instanceEnvironment;
        fmu->logging = loggingOn;
        fmuStart(&fmu->values);
    }
    return fmu;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    free(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
    fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    fmuInstance *fmu = (fmuInstance *)instance;

    (void)toleranceDefined;
    (void)tolerance;
    (void)stopTimeDefined;
    (void)stopTime;
    if (fmuEnter(fmu, fmuInstantiated, fmuInitializing) != fmi3OK) {
        return fmi3Error;
    }
    fmu->values.time = startTime;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    return fmuEnter((fmuInstance *)instance, fmuInitializing, fmuStepping);
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    return fmuEnter((fmuInstance *)instance, fmuStepping, fmuTerminated);
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    fmuInstance *fmu = (fmuInstance *)instance;

    if (fmu == NULL) {
        return fmi3Error;
    }
    fmuStart(&fmu->values);
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
    fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
    fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    fmuInstance *fmu = (fmuInstance *)instance;

    (void)noSetFMUStatePriorToCurrentPoint;
    if (fmuEnter(fmu, fmuStepping, fmuStepping) != fmi3OK) {
        return fmi3Error;
    }
    if (eventHandlingNeeded == NULL || terminateSimulation == NULL || earlyReturn == NULL
        || lastSuccessfulTime == NULL) {
        return fmuRefuse(fmu, "an argument is NULL");
    }
    if (!fmuStep(&fmu->values, currentCommunicationPoint, communicationStepSize)) {
        return fmuRefuse(fmu, "the step size is not a number above zero");
    }
    *eventHandlingNeeded = fmi3False;
    *terminateSimulation = fmi3False;
    *earlyReturn = fmi3False;
    *lastSuccessfulTime = fmu->values.time;
    return fmi3OK;
}

"""

VARIABLES = """\
fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Float64 values[], size_t nValues)
{
    fmuInstance *fmu = (fmuInstance *)instance;

    if (fmu == NULL || nValues != nValueReferences) {
        return fmuRefuse(fmu, "all variables are scalars: as many values as value references are wanted");
    }
    for (size_t i = 0; i < nValueReferences; ++i) {
        if (!fmuGet(&fmu->values, valueReferences[i], &values[i])) {
            return fmuRefuse(fmu, "there is no Float64 variable with that value reference");
        }
    }
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Float64 values[], size_t nValues)
{
    fmuInstance *fmu = (fmuInstance *)instance;

    if (fmu == NULL || nValues != nValueReferences || fmu->values.phase == fmuTerminated) {
        return fmuRefuse(fmu, "inputs may not be set now, or there are not as many values as value references");
    }
    for (size_t i = 0; i < nValueReferences; ++i) {
        if (!fmuSet(&fmu->values, valueReferences[i], values[i])) {
            return fmuRefuse(fmu, "there is no Float64 input with that value reference");
        }
    }
    return fmi3OK;
}

fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Int32 values[], size_t nValues)
{
    fmuInstance *fmu = (fmuInstance *)instance;

    if (fmu == NULL || nValues != nValueReferences) {
        return fmuRefuse(fmu, "all variables are scalars: as many values as value references are wanted");
    }
    for (size_t i = 0; i < nValueReferences; ++i) {
        if (valueReferences[i] != fmuStatusReference) {
            return fmuRefuse(fmu, "there is no Int32 variable with that value reference");
        }
        fmuUpdate(&fmu->values);
        values[i] = (fmi3Int32)fmu->values.status;
    }
    return fmi3OK;
}

/* Types of which there are no variables: refused unless nothing is asked for. */
#define fmuNoGetter(type) \\
    fmi3Status fmi3Get##type(fmi3Instance instance, const fmi3ValueReference valueReferences[], \\
        size_t nValueReferences, fmi3##type values[], size_t nValues) \\
    { \\
        (void)valueReferences; \\
        (void)values; \\
        (void)nValues; \\
        return nValueReferences == 0 ? fmi3OK : fmuRefuse((fmuInstance *)instance, "there are no such variables"); \\
    }
#define fmuNoSetter(type) \\
    fmi3Status fmi3Set##type(fmi3Instance instance, const fmi3ValueReference valueReferences[], \\
        size_t nValueReferences, const fmi3##type values[], size_t nValues) \\
    { \\
        (void)valueReferences; \\
        (void)values; \\
        (void)nValues; \\
        return nValueReferences == 0 ? fmi3OK : fmuRefuse((fmuInstance *)instance, "there are no such inputs"); \\
    }

fmuNoGetter(Float32)
fmuNoGetter(Int8)
fmuNoGetter(UInt8)
fmuNoGetter(Int16)
fmuNoGetter(UInt16)
fmuNoGetter(UInt32)
fmuNoGetter(Int64)
fmuNoGetter(UInt64)
fmuNoGetter(Boolean)
fmuNoGetter(String)
fmuNoSetter(Float32)
fmuNoSetter(Int8)
fmuNoSetter(UInt8)
fmuNoSetter(Int16)
fmuNoSetter(UInt16)
fmuNoSetter(Int32)
fmuNoSetter(UInt32)
fmuNoSetter(Int64)
fmuNoSetter(UInt64)
fmuNoSetter(Boolean)
fmuNoSetter(String)

"""

STATE = """\
fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    if (instance == NULL || FMUState == NULL) {
        return fmi3Error;
    }
    if (*FMUState == NULL) {
        *FMUState = calloc(1, sizeof(fmuValues));
    }
    if (*FMUState == NULL) {
        return fmuRefuse((fmuInstance *)instance, "out of memory");
    }
    memcpy(*FMUState, &((fmuInstance *)instance)->values, sizeof(fmuValues));
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    if (instance == NULL || FMUState == NULL) {
        return fmuRefuse((fmuInstance *)instance, "there is no state to set");
    }
    memcpy(&((fmuInstance *)instance)->values, FMUState, sizeof(fmuValues));
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    (void)instance;
    if (FMUState != NULL) {
        free(*FMUState);
        *FMUState = NULL;
    }
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
    (void)FMUState;
    if (instance == NULL || size == NULL) {
        return fmi3Error;
    }
    *size = sizeof(fmuValues);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size)
{
    if (instance == NULL || FMUState == NULL || serializedState == NULL || size != sizeof(fmuValues)) {
        return fmuRefuse((fmuInstance *)instance, "the state is missing, or the size is not that of a state");
    }
    memcpy(serializedState, FMUState, sizeof(fmuValues));
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
    fmi3FMUState *FMUState)
{
    if (instance == NULL || FMUState == NULL || serializedState == NULL || size != sizeof(fmuValues)) {
        return fmuRefuse((fmuInstance *)instance, "the state is missing, or the size is not that of a state");
    }
    *FMUState = NULL; /* what lies there is not ours to reuse */
    if (fmi3GetFMUState(instance, FMUState) != fmi3OK) {
        return fmi3Error;
    }
    memcpy(*FMUState, serializedState, sizeof(fmuValues));
    return fmi3OK;
}

"""

WRAPPER = INSTANCE + VARIABLES + STATE + REFUSED
