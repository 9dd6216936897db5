/* A joint's law as an FMU of FMI 2.0, for model exchange and co-simulation, around the law's own header.

   The file model.h includes that header. It defines LAW(name), which puts the law's name before a name, the CLEARANCE
   of the joint, the GUID, and WITH_ERROR, which is 1 if the law tells residual clearance and expected error.

   The FMU has no continuous states. Its memory is the deepest displacement of all accepted steps: fmi2DoStep and
   fmi2CompletedIntegratorStep change the memory, and trial steps leave it as it is. The event indicator changes its
   sign where the joint turns back, if delta_rate is given, and where it comes back to its deepest displacement. */

#include <stdlib.h>
#include <string.h>

#include "model.h"

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT
#endif
/* Functions of a library have their plain names; linked with others they begin with the law's name. */
#ifdef FMI2_OVERRIDE_FUNCTION_PREFIX
#define FMI(name) name
#else
#define FMI(name) LAW(name)
#endif

/* --- the types of FMI 2.0 that this file needs, written for it */

typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef char fmi2Byte;
typedef const char *fmi2String;
typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String instance, fmi2Status, fmi2String category, fmi2String message, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment environment;
} fmi2CallbackFunctions;
typedef struct {
    fmi2Boolean newDiscreteStatesNeeded, terminateSimulation, nominalsOfContinuousStatesChanged;
    fmi2Boolean valuesOfContinuousStatesChanged, nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

/* --- the joint */

/* Value references: what can be set, and what follows from it. */
enum { DELTA, DELTA_RATE, LENGTH, DEEPEST_START, SETTABLE };
enum { P = SETTABLE, STIFFNESS, DEEPEST, RESIDUAL, EXPECTED_ERROR };
#define COUNT (WITH_ERROR ? EXPECTED_ERROR + 1 : DEEPEST + 1)

typedef struct {
    double value[SETTABLE];
    LAW(state) memory;
    int running; /* whether initialization has ended */
} State;

typedef struct {
    State now;
    int warned;
    char *name;
    const fmi2CallbackFunctions *callbacks;
} Instance;

static const State NEW = {{0.0, 0.0, LAW(PIN_LENGTH), 0.0}, {0.0, 0}, 0};

/* The deepest displacement of accepted steps; before the first one it is a parameter. */
static double remembered(const State *state) {
    return state->running ? state->memory.deepest : state->value[DEEPEST_START];
}

static double value_of(const State *state, fmi2ValueReference reference) {
    double delta = state->value[DELTA], deepest = remembered(state), stiffness;
    double share = state->value[LENGTH] / LAW(PIN_LENGTH);
    double force = LAW(force)(delta, deepest, &stiffness);
    switch (reference) {
    case P: return share * force;
    case STIFFNESS: return share * stiffness;
    case DEEPEST: return LAW(deeper)(deepest, delta);
#if WITH_ERROR
    case RESIDUAL: return LAW(residual)(LAW(deeper)(deepest, delta));
    case EXPECTED_ERROR: return share * LAW(expected_error)(delta, deepest);
#endif
    default: return state->value[reference];
    }
}

/* The derivative of one variable by another: the law's own for dP/d(delta), else a central difference. */
static double derivative_of(const State *state, fmi2ValueReference unknown, fmi2ValueReference known) {
    double step = 1e-6 * (known == LENGTH ? state->value[LENGTH] : CLEARANCE);
    double stiffness = value_of(state, STIFFNESS);
    State less = *state, more = *state;
    if (unknown == P && known == DELTA && isfinite(stiffness)) return stiffness;
    less.value[known] -= step;
    more.value[known] += step;
    return (value_of(&more, unknown) - value_of(&less, unknown)) / (2 * step);
}

/* --- messages and steps */

static fmi2Status say(const Instance *joint, fmi2Status status, const char *message) {
    const fmi2CallbackFunctions *call = joint->callbacks;
    const char *category = status == fmi2Warning ? "logStatusWarning" : "logStatusError";
    if (call && call->logger) call->logger(call->environment, joint->name, status, category, "%s", message);
    return status;
}

static fmi2Status accept_step(Instance *joint) {
    State *now = &joint->now;
    if (!isfinite(now->value[DELTA])) return say(joint, fmi2Error, "delta is not a finite number");
    LAW(advance)(&now->memory, now->value[DELTA]);
    if (!now->memory.outside || joint->warned) return fmi2OK;
    joint->warned = 1;
    return say(joint, fmi2Warning, "delta is beyond the range of the law: its force goes on as a guess");
}

static int all_known(const fmi2ValueReference references[], size_t n, fmi2ValueReference end) {
    size_t i;
    for (i = 0; i < n; i++)
        if (references[i] >= end) return 0;
    return 1;
}

/* --- creation, initialization, end */

EXPORT const char *FMI(fmi2GetTypesPlatform)(void) {
    return "default";
}

EXPORT const char *FMI(fmi2GetVersion)(void) {
    return "2.0";
}

EXPORT fmi2Component FMI(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                          const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                                          fmi2Boolean logging) {
    Instance *joint = calloc(1, sizeof(Instance));
    (void)type, (void)resources, (void)visible, (void)logging;
    if (!joint) return NULL;
    joint->now = NEW;
    joint->callbacks = callbacks;
    joint->name = calloc(1, name ? strlen(name) + 1 : 1);
    if (joint->name && name) strcpy(joint->name, name);
    if (joint->name && guid && strcmp(guid, GUID) == 0) return joint;
    say(joint, fmi2Error, "the GUID of modelDescription.xml is of another FMU, or memory is exhausted");
    free(joint->name);
    free(joint);
    return NULL;
}

EXPORT void FMI(fmi2FreeInstance)(fmi2Component component) {
    if (!component) return;
    free(((Instance *)component)->name);
    free(component);
}

EXPORT fmi2Status FMI(fmi2SetDebugLogging)(fmi2Component component, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    (void)component, (void)on, (void)n, (void)categories;
    return fmi2OK;
}

EXPORT fmi2Status FMI(fmi2SetupExperiment)(fmi2Component component, fmi2Boolean with_tolerance, fmi2Real tolerance,
                                           fmi2Real start, fmi2Boolean with_stop, fmi2Real stop) {
    (void)component, (void)with_tolerance, (void)tolerance, (void)start, (void)with_stop, (void)stop;
    return fmi2OK;
}

EXPORT fmi2Status FMI(fmi2EnterInitializationMode)(fmi2Component component) {
    (void)component;
    return fmi2OK;
}

EXPORT fmi2Status FMI(fmi2ExitInitializationMode)(fmi2Component component) {
    Instance *joint = component;
    joint->now.memory.deepest = joint->now.value[DEEPEST_START];
    joint->now.running = 1;
    return accept_step(joint);
}

EXPORT fmi2Status FMI(fmi2Terminate)(fmi2Component component) {
    (void)component;
    return fmi2OK;
}

EXPORT fmi2Status FMI(fmi2Reset)(fmi2Component component) {
    Instance *joint = component;
    joint->now = NEW;
    joint->warned = 0;
    return fmi2OK;
}

/* --- values */

EXPORT fmi2Status FMI(fmi2GetReal)(fmi2Component component, const fmi2ValueReference references[], size_t n,
                                   fmi2Real values[]) {
    Instance *joint = component;
    size_t i;
    if (!all_known(references, n, COUNT)) return say(joint, fmi2Error, "fmi2GetReal: there is no such variable");
    for (i = 0; i < n; i++) values[i] = value_of(&joint->now, references[i]);
    return fmi2OK;
}

EXPORT fmi2Status FMI(fmi2SetReal)(fmi2Component component, const fmi2ValueReference references[], size_t n,
                                   const fmi2Real values[]) {
    Instance *joint = component;
    size_t i;
    if (!all_known(references, n, SETTABLE)) return say(joint, fmi2Error, "fmi2SetReal: this variable cannot be set");
    for (i = 0; i < n; i++) {
        int fixed = references[i] == LENGTH || references[i] == DEEPEST_START;
        if (fixed && joint->now.running) return say(joint, fmi2Error, "parameters are fixed after initialization");
        if (references[i] == LENGTH && !(values[i] > 0 && isfinite(values[i])))
            return say(joint, fmi2Error, "length must be a positive number");
        if (references[i] == DEEPEST_START && !(values[i] >= 0 && isfinite(values[i])))
            return say(joint, fmi2Error, "deepest_start must be a number that is not negative");
        joint->now.value[references[i]] = values[i];
    }
    return fmi2OK;
}

/* There are no variables of other types. */
#define NO_VARIABLES(Type)                                                                                        \
    EXPORT fmi2Status FMI(fmi2Get##Type)(fmi2Component component, const fmi2ValueReference references[], size_t n, \
                                         fmi2##Type values[]) {                                                   \
        (void)references, (void)values;                                                                           \
        return n ? say(component, fmi2Error, "there are no variables of type " #Type) : fmi2OK;                   \
    }                                                                                                             \
    EXPORT fmi2Status FMI(fmi2Set##Type)(fmi2Component component, const fmi2ValueReference references[], size_t n, \
                                         const fmi2##Type values[]) {                                             \
        (void)references, (void)values;                                                                           \
        return n ? say(component, fmi2Error, "there are no variables of type " #Type) : fmi2OK;                   \
    }
NO_VARIABLES(Integer)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)

EXPORT fmi2Status FMI(fmi2GetDirectionalDerivative)(fmi2Component component, const fmi2ValueReference unknowns[],
                                                    size_t n_unknowns, const fmi2ValueReference knowns[],
                                                    size_t n_knowns, const fmi2Real direction[],
                                                    fmi2Real derivative[]) {
    Instance *joint = component;
    size_t i, j;
    if (!all_known(unknowns, n_unknowns, COUNT) || !all_known(knowns, n_knowns, SETTABLE))
        return say(joint, fmi2Error, "fmi2GetDirectionalDerivative: there is no such derivative");
    for (i = 0; i < n_unknowns; i++) {
        derivative[i] = 0.0;
        for (j = 0; j < n_knowns; j++)
            derivative[i] += direction[j] * derivative_of(&joint->now, unknowns[i], knowns[j]);
    }
    return fmi2OK;
}

/* --- the state of the FMU: inputs, parameters and memory */

EXPORT fmi2Status FMI(fmi2GetFMUstate)(fmi2Component component, fmi2FMUstate *copy) {
    Instance *joint = component;
    if (!*copy) *copy = malloc(sizeof(State));
    if (!*copy) return say(joint, fmi2Error, "memory is exhausted");
    *(State *)*copy = joint->now;
    return fmi2OK;
}

EXPORT fmi2Status FMI(fmi2SetFMUstate)(fmi2Component component, fmi2FMUstate copy) {
    if (!copy) return say(component, fmi2Error, "fmi2SetFMUstate: there is no state");
    ((Instance *)component)->now = *(State *)copy;
    return fmi2OK;
}

EXPORT fmi2Status FMI(fmi2FreeFMUstate)(fmi2Component component, fmi2FMUstate *copy) {
    (void)component;
    free(*copy);
    *copy = NULL;
    return fmi2OK;
}

EXPORT fmi2Status FMI(fmi2SerializedFMUstateSize)(fmi2Component component, fmi2FMUstate copy, size_t *size) {
    (void)component, (void)copy;
    *size = sizeof(State);
    return fmi2OK;
}

EXPORT fmi2Status FMI(fmi2SerializeFMUstate)(fmi2Component component, fmi2FMUstate copy, fmi2Byte bytes[], size_t size) {
    if (!copy || size < sizeof(State)) return say(component, fmi2Error, "fmi2SerializeFMUstate: too few bytes");
    memcpy(bytes, copy, sizeof(State));
    return fmi2OK;
}

EXPORT fmi2Status FMI(fmi2DeSerializeFMUstate)(fmi2Component component, const fmi2Byte bytes[], size_t size,
                                               fmi2FMUstate *copy) {
    if (size != sizeof(State)) return say(component, fmi2Error, "fmi2DeSerializeFMUstate: this is no state of this FMU");
    if (!*copy) *copy = malloc(sizeof(State));
    if (!*copy) return say(component, fmi2Error, "memory is exhausted");
    memcpy(*copy, bytes, sizeof(State));
    return fmi2OK;
}

/* --- model exchange */

EXPORT fmi2Status FMI(fmi2EnterEventMode)(fmi2Component component) {
    (void)component;
    return fmi2OK;
}

EXPORT fmi2Status FMI(fmi2NewDiscreteStates)(fmi2Component component, fmi2EventInfo *info) {
    memset(info, 0, sizeof(*info));
    return accept_step(component);
}

EXPORT fmi2Status FMI(fmi2EnterContinuousTimeMode)(fmi2Component component) {
    (void)component;
    return fmi2OK;
}

EXPORT fmi2Status FMI(fmi2CompletedIntegratorStep)(fmi2Component component, fmi2Boolean final, fmi2Boolean *event,
                                                   fmi2Boolean *terminate) {
    (void)final;
    *event = 0;
    *terminate = 0;
    return accept_step(component);
}

EXPORT fmi2Status FMI(fmi2SetTime)(fmi2Component component, fmi2Real time) {
    (void)component, (void)time;
    return fmi2OK;
}

EXPORT fmi2Status FMI(fmi2GetEventIndicators)(fmi2Component component, fmi2Real indicators[], size_t n) {
    const State *now = &((Instance *)component)->now;
    double delta = now->value[DELTA], deepest = remembered(now);
    if (n != 1) return say(component, fmi2Error, "fmi2GetEventIndicators: there is one event indicator");
    indicators[0] = delta < deepest ? delta - deepest : now->value[DELTA_RATE];
    return fmi2OK;
}

/* There are no continuous states. */
EXPORT fmi2Status FMI(fmi2SetContinuousStates)(fmi2Component component, const fmi2Real states[], size_t n) {
    (void)states;
    return n ? say(component, fmi2Error, "there are no continuous states") : fmi2OK;
}
#define NO_STATES(name)                                                                    \
    EXPORT fmi2Status FMI(name)(fmi2Component component, fmi2Real values[], size_t n) {    \
        (void)values;                                                                      \
        return n ? say(component, fmi2Error, "there are no continuous states") : fmi2OK;   \
    }
NO_STATES(fmi2GetDerivatives)
NO_STATES(fmi2GetContinuousStates)
NO_STATES(fmi2GetNominalsOfContinuousStates)

/* --- co-simulation */

EXPORT fmi2Status FMI(fmi2DoStep)(fmi2Component component, fmi2Real time, fmi2Real step, fmi2Boolean keep) {
    (void)time, (void)step, (void)keep;
    return accept_step(component);
}

EXPORT fmi2Status FMI(fmi2CancelStep)(fmi2Component component) {
    return say(component, fmi2Error, "fmi2CancelStep: no step is pending");
}

EXPORT fmi2Status FMI(fmi2SetRealInputDerivatives)(fmi2Component component, const fmi2ValueReference references[], size_t n,
                                                   const fmi2Integer orders[], const fmi2Real values[]) {
    (void)references, (void)orders, (void)values;
    return n ? say(component, fmi2Error, "inputs are not interpolated") : fmi2OK;
}

EXPORT fmi2Status FMI(fmi2GetRealOutputDerivatives)(fmi2Component component, const fmi2ValueReference references[], size_t n,
                                                    const fmi2Integer orders[], fmi2Real values[]) {
    (void)references, (void)orders, (void)values;
    return n ? say(component, fmi2Error, "outputs have no derivatives in time") : fmi2OK;
}

/* Every step ends before fmi2DoStep returns. */
#define NO_STATUS(name, Type)                                                                          \
    EXPORT fmi2Status FMI(name)(fmi2Component component, const fmi2StatusKind kind, fmi2##Type *value) { \
        (void)component, (void)kind, (void)value;                                                      \
        return fmi2Discard;                                                                            \
    }
NO_STATUS(fmi2GetRealStatus, Real)
NO_STATUS(fmi2GetIntegerStatus, Integer)
NO_STATUS(fmi2GetBooleanStatus, Boolean)
NO_STATUS(fmi2GetStringStatus, String)
NO_STATUS(fmi2GetStatus, Status)
