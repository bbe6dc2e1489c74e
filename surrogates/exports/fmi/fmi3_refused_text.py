"""Functions of ``fmi3Functions.h`` for what the FMI 3.0 wrapper does not offer: present, as FMI asks, and refusing."""

UNUSED = {
    "Binary variables, clocks and dependencies per element": {
        "GetBinary": "const fmi3ValueReference v[], size_t n, size_t sizes[], fmi3Binary values[], size_t nValues",
        "SetBinary": "const fmi3ValueReference v[], size_t n, const size_t sizes[], const fmi3Binary values[], "
        "size_t nValues",
        "GetClock": "const fmi3ValueReference v[], size_t n, fmi3Clock values[]",
        "SetClock": "const fmi3ValueReference v[], size_t n, const fmi3Clock values[]",
        "GetIntervalDecimal": "const fmi3ValueReference v[], size_t n, fmi3Float64 intervals[], "
        "fmi3IntervalQualifier qualifiers[]",
        "GetIntervalFraction": "const fmi3ValueReference v[], size_t n, fmi3UInt64 counters[], "
        "fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]",
        "GetShiftDecimal": "const fmi3ValueReference v[], size_t n, fmi3Float64 shifts[]",
        "GetShiftFraction": "const fmi3ValueReference v[], size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[]",
        "SetIntervalDecimal": "const fmi3ValueReference v[], size_t n, const fmi3Float64 intervals[]",
        "SetIntervalFraction": "const fmi3ValueReference v[], size_t n, const fmi3UInt64 counters[], "
        "const fmi3UInt64 resolutions[]",
        "SetShiftDecimal": "const fmi3ValueReference v[], size_t n, const fmi3Float64 shifts[]",
        "SetShiftFraction": "const fmi3ValueReference v[], size_t n, const fmi3UInt64 counters[], "
        "const fmi3UInt64 resolutions[]",
        "GetNumberOfVariableDependencies": "fmi3ValueReference v, size_t *nDependencies",
        "GetVariableDependencies": "fmi3ValueReference dependent, size_t elementsOfDependent[], "
        "fmi3ValueReference independents[], size_t elementsOfIndependents[], fmi3DependencyKind kinds[], "
        "size_t nDependencies",
    },
    "Derivatives": {
        "GetDirectionalDerivative": "const fmi3ValueReference unknowns[], size_t nUnknowns, "
        "const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, "
        "fmi3Float64 sensitivity[], size_t nSensitivity",
        "GetAdjointDerivative": "const fmi3ValueReference unknowns[], size_t nUnknowns, "
        "const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, "
        "fmi3Float64 sensitivity[], size_t nSensitivity",
        "GetOutputDerivatives": "const fmi3ValueReference v[], size_t n, const fmi3Int32 orders[], "
        "fmi3Float64 values[], size_t nValues",
    },
    "Configuration mode and event mode": {
        "EnterConfigurationMode": "",
        "ExitConfigurationMode": "",
        "EnterEventMode": "",
        "EnterStepMode": "",
        "EvaluateDiscreteStates": "",
        "UpdateDiscreteStates": "fmi3Boolean *needUpdate, fmi3Boolean *terminate, fmi3Boolean *nominalsChanged, "
        "fmi3Boolean *valuesChanged, fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime",
    },
    "Model exchange and scheduled execution": {
        "EnterContinuousTimeMode": "",
        "CompletedIntegratorStep": "fmi3Boolean noSet, fmi3Boolean *enterEventMode, fmi3Boolean *terminate",
        "SetTime": "fmi3Float64 time",
        "SetContinuousStates": "const fmi3Float64 states[], size_t n",
        "GetContinuousStateDerivatives": "fmi3Float64 derivatives[], size_t n",
        "GetEventIndicators": "fmi3Float64 indicators[], size_t n",
        "GetContinuousStates": "fmi3Float64 states[], size_t n",
        "GetNominalsOfContinuousStates": "fmi3Float64 nominals[], size_t n",
        "GetNumberOfEventIndicators": "size_t *n",
        "GetNumberOfContinuousStates": "size_t *n",
        "ActivateModelPartition": "fmi3ValueReference clock, fmi3Float64 time",
    },
}
"""Parameters, after the instance, of the functions for what this FMU does not offer; all of them refuse."""

OTHER_TYPES = """\
/* Only co-simulation is offered. */
fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
    fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage)
{
    (void)instanceName;
    (void)instantiationToken;
    (void)resourcePath;
    (void)visible;
    if (logMessage != NULL && loggingOn) {
        logMessage(instanceEnvironment, fmi3Error, fmuErrors, "not instantiated: this FMU is for co-simulation");
    }
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
    fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate, fmi3LockPreemptionCallback lockPreemption,
    fmi3UnlockPreemptionCallback unlockPreemption)
{
    (void)clockUpdate;
    (void)lockPreemption;
    (void)unlockPreemption;
    return fmi3InstantiateModelExchange(instanceName, instantiationToken, resourcePath, visible, loggingOn,
        instanceEnvironment, logMessage);
}
"""


def _refusing(name: str, parameters: str) -> str:
    """A function that refuses, whatever it is given."""
    names = [p.split()[-1].lstrip("*").removesuffix("[]") for p in parameters.split(",")] if parameters else []
    comma = ",\n    " if parameters else ""
    unused = "".join(f"    (void){n};\n" for n in names)
    return (
        f"fmi3Status fmi3{name}(fmi3Instance instance{comma}{parameters})\n{{\n{unused}"
        '    return fmuRefuse((fmuInstance *)instance, "this FMU does not offer that");\n}\n'
    )


REFUSED = (
    "".join(
        f"/* {title}: not offered. */\n" + "\n".join(_refusing(n, p) for n, p in functions.items()) + "\n"
        for title, functions in UNUSED.items()
    )
    + OTHER_TYPES
)
