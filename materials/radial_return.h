#include <stdint.h>

/* Returns the number of points that yield; the others get the moduli elastic (3, 3) to the bit. */
int32_t radial_return(int32_t n, const double *strain, const double *old_plastic,
    const double *old_peeq, double lam, double mu, double yield_stress, double hardening, const double *elastic,
    double *stress, double *moduli, double *plastic, double *peeq);
