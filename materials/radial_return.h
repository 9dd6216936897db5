#include <stdint.h>

/* strain (n, k) has the components places (k,) of a stress with s components: [xx, yy, zz, xy], or with s = 6 [xx, yy,
 * zz, xy, yz, zx]. Returns the number of points that yield; the others get the moduli elastic (k, k). */
int32_t radial_return(int32_t n, int32_t s, int32_t k, const int32_t *places, const double *strain,
    const double *old_plastic, const double *old_peeq, double lam, double mu, double yield_stress, double hardening,
    const double *elastic, double *stress, double *moduli, double *plastic, double *peeq);
