/* A joint's law as an FMU of FMI 2.0, for model exchange and co-simulation, around the law's own header.

   The file fmu-model.h includes that header. It defines LAW(name), which puts the law's name before a name, the CLEARANCE
   of the joint, the GUID, WITH_ERROR, which is 1 if the law tells residual clearance and expected error, and
   WITH_ELEMENT, which is 1 if the header has a force element.

   The FMU holds a joint along a line (delta to P), and a joint in a plane (ex, ey, vx, vy, omega to Fx, Fy, T). Each
   has a memory of its own: the deepest displacement of all accepted steps, in a plane by direction. fmi2DoStep and
   fmi2CompletedIntegratorStep change the memory, and trial steps leave it as it is. There are no continuous states.
   The event indicator changes its sign where the joint along a line turns back, if delta_rate is given, and where it
   comes back to its deepest displacement. */

#include <stdlib.h>
#include <string.h>

#include "fmu-model.h"

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT
#endif
/* Functions of a library have their plain names. To link several FMUs into one program define FMI2_FUNCTION_PREFIX:
   names then begin with the law's name. */
#ifdef FMI2_FUNCTION_PREFIX
#define FMI(name) LAW(name)
#else
#define FMI(name) name
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

/* Value references: inputs, parameters, outputs. */
enum {
    DELTA, DELTA_RATE,
#if WITH_ELEMENT
    EX, EY, VX, VY, OMEGA, DAMPING, MU_STATIC, MU_DYNAMIC, STICK_SPEED,
#endif
    LENGTH, DEEPEST_START, P, STIFFNESS, DEEPEST,
#if WITH_ERROR
    RESIDUAL, EXPECTED_ERROR,
#endif
#if WITH_ELEMENT
    FX, FY, T,
#endif
    COUNT,
    SETTABLE = P,
    PARAMETERS = LENGTH - 4 * WITH_ELEMENT /* the first one */
};

typedef struct {
    double value[SETTABLE];
    LAW(state) memory;
#if WITH_ELEMENT
    LAW(element_state) memory_in_plane;
#endif
    int running; /* whether initialization has ended */
} State;

typedef struct {
    State now;
    int warned;
    char *name;
    const fmi2CallbackFunctions *callbacks;
} Instance;

static void start(Instance *joint) {
    State *now = &joint->now;
    memset(now, 0, sizeof(*now));
    now->value[LENGTH] = LAW(PIN_LENGTH);
#if WITH_ELEMENT
    now->value[DAMPING] = LAW(CONTACT).damping;
    now->value[MU_STATIC] = LAW(CONTACT).mu_static;
    now->value[MU_DYNAMIC] = LAW(CONTACT).mu_dynamic;
    now->value[STICK_SPEED] = LAW(CONTACT).stick_speed;
#endif
    joint->warned = 0;
}

/* The deepest displacement of accepted steps; before the first one it is a parameter. */
static double remembered(const State *state) {
    return state->running ? state->memory.deepest : state->value[DEEPEST_START];
}

static double share_of(const State *state) {
    return state->value[LENGTH] / LAW(PIN_LENGTH);
}

#if WITH_ELEMENT
/* Fx, Fy or T of a pin of LAW(PIN_LENGTH); by ex, ey, vx, vy or omega its derivative, by -1 itself. */
static double in_plane(const State *state, int of, int by) {
    const double *value = state->value;
    double force[3], jacobian[15];
    LAW(contact) contact = {value[DAMPING], value[MU_STATIC], value[MU_DYNAMIC], value[STICK_SPEED]};
    LAW(element)(&state->memory_in_plane, &contact, value + EX, force, jacobian);
    return by < 0 ? force[of] : jacobian[5 * of + by];
}
#endif

static double value_of(const State *state, fmi2ValueReference reference) {
    double delta = state->value[DELTA], deepest = remembered(state), stiffness;
    double share = share_of(state);
    double force = LAW(force)(delta, deepest, &stiffness);
    switch (reference) {
    case P: return share * force;
    case STIFFNESS: return share * stiffness;
    case DEEPEST: return LAW(deeper)(deepest, delta);
#if WITH_ERROR
    case RESIDUAL: return LAW(residual)(LAW(deeper)(deepest, delta));
    case EXPECTED_ERROR: return share * LAW(expected_error)(delta, deepest);
#endif
#if WITH_ELEMENT
    case FX: case FY: case T: return share * in_plane(state, reference - FX, -1);
#endif
    default: return state->value[reference];
    }
}

/* The derivative of one variable by another: the law's own for P and for forces in the plane, else a central
   difference. */
static double derivative_of(const State *state, fmi2ValueReference unknown, fmi2ValueReference known) {
    double step = 1e-6 * fmax(fabs(state->value[known]), CLEARANCE), exact = NAN;
    State less = *state, more = *state;
    if (unknown == P && known == DELTA) exact = value_of(state, STIFFNESS);
#if WITH_ELEMENT
    if (unknown >= FX && unknown <= T && known >= EX && known <= OMEGA)
        exact = share_of(state) * in_plane(state, unknown - FX, known - EX);
#endif
    if (isfinite(exact)) return exact;
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
    int outside, i;
    for (i = 0; i < SETTABLE; i++)
        if (!isfinite(now->value[i])) return say(joint, fmi2Error, "an input is not a finite number");
    LAW(advance)(&now->memory, now->value[DELTA]);
    outside = now->memory.outside || !LAW(in_range)(now->memory.deepest);
#if WITH_ELEMENT
    LAW(advance_element)(&now->memory_in_plane, now->value[EX], now->value[EY]);
    outside = outside || now->memory_in_plane.outside;
#endif
    if (!outside || joint->warned) return fmi2OK;
    joint->warned = 1;
    return say(joint, fmi2Warning, "the pin is beyond the range of the law: its force goes on as a guess");
}

/* What is wrong with the parameters; NULL if nothing is. */
static const char *fault_of(const double value[]) {
    if (!(value[LENGTH] > 0)) return "length must be a positive number";
    if (!(value[DEEPEST_START] >= 0)) return "deepest_start must not be negative";
#if WITH_ELEMENT
    if (!(value[DAMPING] >= 0)) return "damping must not be negative";
    if (!(value[MU_STATIC] >= value[MU_DYNAMIC] && value[MU_DYNAMIC] >= 0))
        return "mu_dynamic must not be negative, and mu_static not smaller than mu_dynamic";
    if (!(value[STICK_SPEED] > 0)) return "stick_speed must be a positive number";
#endif
    return NULL;
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
    start(joint);
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

#define NOTHING_TO_DO(name)                               \
    EXPORT fmi2Status FMI(name)(fmi2Component component) { \
        (void)component;                                  \
        return fmi2OK;                                    \
    }
NOTHING_TO_DO(fmi2EnterInitializationMode)
NOTHING_TO_DO(fmi2EnterEventMode)
NOTHING_TO_DO(fmi2EnterContinuousTimeMode)
NOTHING_TO_DO(fmi2Terminate)

EXPORT fmi2Status FMI(fmi2ExitInitializationMode)(fmi2Component component) {
    Instance *joint = component;
    const char *fault = fault_of(joint->now.value);
    if (fault) return say(joint, fmi2Error, fault);
    joint->now.memory.deepest = joint->now.value[DEEPEST_START];
    joint->now.running = 1;
    return accept_step(joint);
}

EXPORT fmi2Status FMI(fmi2Reset)(fmi2Component component) {
    start(component);
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
        if (references[i] >= PARAMETERS && joint->now.running)
            return say(joint, fmi2Error, "parameters are fixed after initialization");
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

static fmi2Status keep(fmi2Component component, const void *state, fmi2FMUstate *copy) {
    if (!*copy) *copy = malloc(sizeof(State));
    if (!*copy) return say(component, fmi2Error, "memory is exhausted");
    memcpy(*copy, state, sizeof(State));
    return fmi2OK;
}

EXPORT fmi2Status FMI(fmi2GetFMUstate)(fmi2Component component, fmi2FMUstate *copy) {
    return keep(component, &((Instance *)component)->now, copy);
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
    return keep(component, bytes, copy);
}

/* --- model exchange */

EXPORT fmi2Status FMI(fmi2NewDiscreteStates)(fmi2Component component, fmi2EventInfo *info) {
    memset(info, 0, sizeof(*info));
    return accept_step(component);
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
