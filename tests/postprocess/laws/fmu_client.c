/* A program that uses the FMU. Its input and output are numbers; with an argument it uses the joint in a plane. */
#include <stdarg.h>
#include <stdio.h>
#include "fmu.c"
static int messages = 0;

static void logger(void *environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...) {
    (void)environment, (void)name, (void)status, (void)category, (void)message;
    messages++;
}

#define NEED(truth) if (!(truth)) return __LINE__ % 250 + 1
#define FINE(call) NEED((call) < fmi2Discard)

static const fmi2CallbackFunctions calls = {logger, NULL, NULL, NULL, NULL};

#if WITH_ELEMENT
/* Takes motions in a plane. Writes force, torque and their derivatives, before the step is accepted. */
static int in_a_plane(void) {
    fmi2ValueReference in[] = {EX, EY, VX, VY, OMEGA}, out[] = {FX, FY, T};
    double motion[5], value[3], slope[15], one = 1.0;
    fmi2Component joint = fmi2Instantiate("a joint", fmi2ModelExchange, GUID, "", &calls, 0, 0);
    fmi2Boolean event, end;
    int i;
    FINE(fmi2EnterInitializationMode(joint));
    FINE(fmi2ExitInitializationMode(joint));
    while (fread(motion, sizeof(double), 5, stdin) == 5) {
        FINE(fmi2SetReal(joint, in, 5, motion));
        FINE(fmi2GetReal(joint, out, 3, value));
        for (i = 0; i < 15; i++)
            FINE(fmi2GetDirectionalDerivative(joint, out + i / 5, 1, in + i % 5, 1, &one, slope + i));
        FINE(fmi2CompletedIntegratorStep(joint, 1, &event, &end));
        fwrite(value, sizeof(double), 3, stdout);
        fwrite(slope, sizeof(double), 15, stdout);
    }
    fmi2FreeInstance(joint);
    return 0;
}
#else
static int in_a_plane(void) { return 0; }
#endif

/* Takes displacements in steps of co-simulation, each after a trial step that it takes back. Writes five
   outputs of every step. */
static int along_a_line(void) {
    fmi2ValueReference in[] = {DELTA, DELTA_RATE, LENGTH, DEEPEST_START}, force = P, delta = DELTA;
    fmi2ValueReference out[] = {P, STIFFNESS, DEEPEST, RESIDUAL, EXPECTED_ERROR}, none = COUNT;
    double start[] = {0.0, 0.0, 3.0, 0.0}, bad = 0.0, step, value[5], one = 1.0, slope;
    fmi2Component joint = fmi2Instantiate("a joint", fmi2CoSimulation, "another", "", &calls, 0, 0);
    NEED(!joint && messages == 1);
    NEED((joint = fmi2Instantiate("a joint", fmi2CoSimulation, GUID, "", &calls, 0, 0)));
    FINE(fmi2SetReal(joint, in, 4, start));
    FINE(fmi2EnterInitializationMode(joint));
    FINE(fmi2SetReal(joint, in + 2, 1, &bad));
    NEED(fmi2ExitInitializationMode(joint) == fmi2Error);
    FINE(fmi2SetReal(joint, in, 4, start));
    NEED(fmi2GetReal(joint, &none, 1, value) == fmi2Error);
    NEED(fmi2SetReal(joint, &force, 1, value) == fmi2Error);
    FINE(fmi2ExitInitializationMode(joint));
    NEED(fmi2SetReal(joint, in + 2, 1, &one) == fmi2Error);
    while (fread(&step, sizeof(double), 1, stdin) == 1) {
        double trial = 2 * step;
        fmi2FMUstate before = NULL, again = NULL;
        size_t size;
        char *bytes;
        FINE(fmi2GetFMUstate(joint, &before));
        FINE(fmi2SerializedFMUstateSize(joint, before, &size));
        NEED((bytes = malloc(size)));
        FINE(fmi2SerializeFMUstate(joint, before, bytes, size));
        FINE(fmi2SetReal(joint, &delta, 1, &trial));
        FINE(fmi2DoStep(joint, 0, 1, 0));
        FINE(fmi2DeSerializeFMUstate(joint, bytes, size, &again));
        FINE(fmi2SetFMUstate(joint, again));
        free(bytes);
        FINE(fmi2FreeFMUstate(joint, &before));
        FINE(fmi2FreeFMUstate(joint, &again));
        FINE(fmi2SetReal(joint, &delta, 1, &step));
        FINE(fmi2DoStep(joint, 0, 1, 0));
        FINE(fmi2GetReal(joint, out, 5, value));
        FINE(fmi2GetDirectionalDerivative(joint, &force, 1, &delta, 1, &one, &slope));
        NEED(isfinite(slope) && (slope == value[1] || isnan(value[1])));
        fwrite(value, sizeof(double), 5, stdout);
    }
    bad = NAN;
    FINE(fmi2SetReal(joint, &delta, 1, &bad));
    NEED(fmi2DoStep(joint, 0, 1, 0) == fmi2Error);
    FINE(fmi2Reset(joint));
    FINE(fmi2GetReal(joint, out, 1, value));
    NEED(value[0] == 0.0);
    start[3] = 2 * LAW(RANGE);
    FINE(fmi2SetReal(joint, in, 4, start));
    NEED(fmi2ExitInitializationMode(joint) == fmi2Warning);
    fmi2FreeInstance(joint);
    return 0;
}

int main(int count, char **words) {
    (void)words;
    return count > 1 ? in_a_plane() : along_a_line();
}
