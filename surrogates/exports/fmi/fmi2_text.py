"""The FMI 2.0 wrapper's fixed text: every function that the standard asks of a co-simulation slave (section 4.2)."""

WRAPPER = """\
typedef struct {
    fmuValues values;
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
    fmi2Boolean logging;
    char name[];
} fmuInstance;

static fmi2Status fmuRefuse(const fmuInstance *fmu, const char *message)
{
    if (fmu != NULL && fmu->logging && fmu->logger != NULL) {
        fmu->logger(fmu->environment, fmu->name, fmi2Error, fmuErrors, message);
    }
    return fmi2Error;
}

/* From one phase to the next. */
static fmi2Status fmuEnter(fmuInstance *fmu, int from, int to)
{
    if (fmu == NULL || fmu->values.phase != from) {
        return fmuRefuse(fmu, "this function may not be called now");
    }
    fmu->values.phase = to;
    return fmi2OK;
}

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
    const fmi2String categories[])
{
    fmuInstance *fmu = (fmuInstance *)c;

    if (fmu == NULL || (nCategories > 0 && categories == NULL)) {
        return fmi2Error;
    }
    for (size_t i = 0; i < nCategories; ++i) {
        if (categories[i] == NULL || strcmp(categories[i], fmuErrors) != 0) {
            return fmuRefuse(fmu, "there is no such log category");
        }
    }
    fmu->logging = loggingOn;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
    fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean loggingOn)
{
    fmuInstance *fmu;
    size_t length;

    (void)fmuResourceLocation;
    (void)visible;
    if (instanceName == NULL || fmuType != fmi2CoSimulation || fmuGUID == NULL || strcmp(fmuGUID, fmuToken) != 0) {
        if (functions != NULL && functions->logger != NULL && loggingOn) {
            functions->logger(functions->componentEnvironment, instanceName != NULL ? instanceName : "", fmi2Error,
                fmuErrors, "not instantiated: for co-simulation only, with the GUID of modelDescription.xml");
        }
        return NULL;
    }
    length = strlen(instanceName) + 1;
    fmu = (fmuInstance *)calloc(1, sizeof *fmu + length);
    if (fmu == NULL) {
        return NULL;
    }
    memcpy(fmu->name, instanceName, length);
    if (functions != NULL) {
        fmu->logger = functions->logger;
        fmu->environment = functions->componentEnvironment;
    }
    fmu->logging = loggingOn;
    fmuStart(&fmu->values);
    return fmu;
}

void fmi2FreeInstance(fmi2Component c)
{
    free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
    fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    fmuInstance *fmu = (fmuInstance *)c;

    (void)toleranceDefined;
    (void)tolerance;
    (void)stopTimeDefined;
    (void)stopTime;
    if (fmuEnter(fmu, fmuInstantiated, fmuInstantiated) != fmi2OK) {
        return fmi2Error;
    }
    fmu->values.time = startTime;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    return fmuEnter((fmuInstance *)c, fmuInstantiated, fmuInitializing);
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    return fmuEnter((fmuInstance *)c, fmuInitializing, fmuStepping);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    return fmuEnter((fmuInstance *)c, fmuStepping, fmuTerminated);
}

fmi2Status fmi2Reset(fmi2Component c)
{
    fmuInstance *fmu = (fmuInstance *)c;

    if (fmu == NULL) {
        return fmi2Error;
    }
    fmuStart(&fmu->values);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    fmuInstance *fmu = (fmuInstance *)c;

    for (size_t i = 0; i < nvr; ++i) {
        if (fmu == NULL || vr[i] == fmuTimeReference || !fmuGet(&fmu->values, vr[i], &value[i])) {
            return fmuRefuse(fmu, "there is no Real variable with that value reference");
        }
    }
    return fmu != NULL ? fmi2OK : fmi2Error;
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[])
{
    fmuInstance *fmu = (fmuInstance *)c;

    for (size_t i = 0; i < nvr; ++i) {
        if (fmu == NULL || vr[i] != fmuStatusReference) {
            return fmuRefuse(fmu, "there is no Integer variable with that value reference");
        }
        fmuUpdate(&fmu->values);
        value[i] = fmu->values.status;
    }
    return fmu != NULL ? fmi2OK : fmi2Error;
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    (void)vr;
    (void)value;
    return nvr == 0 ? fmi2OK : fmuRefuse((fmuInstance *)c, "there are no Boolean variables");
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[])
{
    (void)vr;
    (void)value;
    return nvr == 0 ? fmi2OK : fmuRefuse((fmuInstance *)c, "there are no String variables");
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    fmuInstance *fmu = (fmuInstance *)c;

    if (fmu == NULL || fmu->values.phase == fmuTerminated) {
        return fmuRefuse(fmu, "inputs may not be set now");
    }
    for (size_t i = 0; i < nvr; ++i) {
        if (!fmuSet(&fmu->values, vr[i], value[i])) {
            return fmuRefuse(fmu, "there is no Real input with that value reference");
        }
    }
    return fmi2OK;
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[])
{
    (void)vr;
    (void)value;
    return nvr == 0 ? fmi2OK : fmuRefuse((fmuInstance *)c, "there are no Integer inputs");
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[])
{
    (void)vr;
    (void)value;
    return nvr == 0 ? fmi2OK : fmuRefuse((fmuInstance *)c, "there are no Boolean variables");
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[])
{
    (void)vr;
    (void)value;
    return nvr == 0 ? fmi2OK : fmuRefuse((fmuInstance *)c, "there are no String variables");
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    if (c == NULL || FMUstate == NULL) {
        return fmi2Error;
    }
    if (*FMUstate == NULL) {
        *FMUstate = calloc(1, sizeof(fmuValues));
    }
    if (*FMUstate == NULL) {
        return fmuRefuse((fmuInstance *)c, "out of memory");
    }
    memcpy(*FMUstate, &((fmuInstance *)c)->values, sizeof(fmuValues));
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate)
{
    if (c == NULL || FMUstate == NULL) {
        return fmuRefuse((fmuInstance *)c, "there is no state to set");
    }
    memcpy(&((fmuInstance *)c)->values, FMUstate, sizeof(fmuValues));
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    (void)c;
    if (FMUstate != NULL) {
        free(*FMUstate);
        *FMUstate = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size)
{
    (void)FMUstate;
    if (c == NULL || size == NULL) {
        return fmi2Error;
    }
    *size = sizeof(fmuValues);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size)
{
    if (c == NULL || FMUstate == NULL || serializedState == NULL || size != sizeof(fmuValues)) {
        return fmuRefuse((fmuInstance *)c, "the state is missing, or the size is not that of a state");
    }
    memcpy(serializedState, FMUstate, sizeof(fmuValues));
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
    fmi2FMUstate *FMUstate)
{
    if (c == NULL || FMUstate == NULL || serializedState == NULL || size != sizeof(fmuValues)) {
        return fmuRefuse((fmuInstance *)c, "the state is missing, or the size is not that of a state");
    }
    *FMUstate = NULL; /* what lies there is not ours to reuse */
    if (fmi2GetFMUstate(c, FMUstate) != fmi2OK) {
        return fmi2Error;
    }
    memcpy(*FMUstate, serializedState, sizeof(fmuValues));
    return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
    const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    (void)vUnknown_ref;
    (void)nUnknown;
    (void)vKnown_ref;
    (void)nKnown;
    (void)dvKnown;
    (void)dvUnknown;
    return fmuRefuse((fmuInstance *)c, "directional derivatives are not offered");
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
    const fmi2Integer order[], const fmi2Real value[])
{
    (void)vr;
    (void)order;
    (void)value;
    return nvr == 0 ? fmi2OK : fmuRefuse((fmuInstance *)c, "inputs are not interpolated");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
    const fmi2Integer order[], fmi2Real value[])
{
    (void)vr;
    (void)order;
    (void)value;
    return nvr == 0 ? fmi2OK : fmuRefuse((fmuInstance *)c, "derivatives of outputs are not offered");
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
    fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    fmuInstance *fmu = (fmuInstance *)c;

    (void)noSetFMUStatePriorToCurrentPoint;
    if (fmuEnter(fmu, fmuStepping, fmuStepping) != fmi2OK) {
        return fmi2Error;
    }
    if (!fmuStep(&fmu->values, currentCommunicationPoint, communicationStepSize)) {
        return fmuRefuse(fmu, "the step size is not a number above zero");
    }
    return fmi2OK;
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    return fmuRefuse((fmuInstance *)c, "no step is pending: steps end when fmi2DoStep returns");
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value)
{
    (void)s;
    (void)value;
    return c != NULL ? fmi2Discard : fmi2Error; /* of use only while a step is pending, which none ever is */
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    if (c == NULL || value == NULL) {
        return fmi2Error;
    }
    if (s != fmi2LastSuccessfulTime) {
        return fmi2Discard;
    }
    *value = ((fmuInstance *)c)->values.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value)
{
    (void)s;
    (void)value;
    return c != NULL ? fmi2Discard : fmi2Error;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value)
{
    if (c == NULL || value == NULL) {
        return fmi2Error;
    }
    if (s != fmi2Terminated) {
        return fmi2Discard;
    }
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value)
{
    (void)s;
    (void)value;
    return c != NULL ? fmi2Discard : fmi2Error;
}
"""
