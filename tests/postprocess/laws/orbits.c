/* Work done on a joint along closed orbits, slow, without friction: two rounds of each, from a new joint.
   Reads orbits (two sums of sines and cosines, and the largest eccentricity) and writes two works each. */

#include <stdio.h>
#include "law.h"

enum { STEPS = 200000, WAVES = 4 };
typedef struct {
    double size[2][2][WAVES];
    double largest;
} Waves;

static double orbit[STEPS + 1][2];

/* Fill the orbit, which ends where it begins. */
static void follow(const Waves *waves) {
    double far = 0.0;
    for (int i = 0; i <= STEPS; i++) {
        double angle = 2 * 3.141592653589793 * (i % STEPS) / STEPS;
        for (int a = 0; a < 2; a++) {
            orbit[i][a] = 0.0;
            for (int k = 0; k < WAVES; k++) {
                orbit[i][a] += waves->size[a][0][k] * cos((k + 1) * angle);
                orbit[i][a] += waves->size[a][1][k] * sin((k + 1) * angle);
            }
        }
        far = fmax(far, sqrt(orbit[i][0] * orbit[i][0] + orbit[i][1] * orbit[i][1]));
    }
    for (int i = 0; i <= STEPS; i++)
        for (int a = 0; a < 2; a++) orbit[i][a] *= waves->largest / far;
}

/* The work along one step, by Gauss's rule of three points. */
static double step(const law_element_state *memory, const double start[2], const double end[2]) {
    static const double place[3] = {0.1127016653792583, 0.5, 0.8872983346207417};
    static const double weight[3] = {5. / 18, 8. / 18, 5. / 18};
    const law_contact frictionless = {0.0, 0.0, 0.0, 1.0};
    double force[3], jacobian[15], work = 0.0;
    for (int k = 0; k < 3; k++) {
        double motion[5] = {0.0};
        for (int a = 0; a < 2; a++) motion[a] = start[a] + place[k] * (end[a] - start[a]);
        law_element(memory, &frictionless, motion, force, jacobian);
        for (int a = 0; a < 2; a++) work -= weight[k] * force[a] * (end[a] - start[a]);
    }
    return work;
}

int main(void) {
    Waves waves;
    while (fread(&waves, sizeof waves, 1, stdin) == 1) {
        law_element_state memory = {{0.0}, 0};
        follow(&waves);
        for (int round = 0; round < 2; round++) {
            double work = 0.0;
            for (int i = 0; i < STEPS; i++) {
                work += step(&memory, orbit[i], orbit[i + 1]);
                law_advance_element(&memory, orbit[i + 1][0], orbit[i + 1][1]);
            }
            fwrite(&work, sizeof work, 1, stdout);
        }
    }
    return 0;
}
