/* The consistent linearisation of the contact forces, added up over the points of one side in the slots of a block
 * matrix.
 *
 * With jump = v(x) - v(y), the variation of the closest point is d xi = (jump . tau + d . v'(y)) / (|tau|^2 - g b),
 * where tau and b are the opposite curve's tangent and n . y'' and d = x - y; the normal turns by
 * -(v'(y) . n + b d xi) / |tau| about the unit tangent. At a vertex of the curve xi stands still. */

#include <math.h>
#include <stdint.h>

enum { TIED, REFERENCE, CURRENT };
enum { MOST = 24 }; /* nodes of a cell (degree 4: 15) and of the opposite facet (5) */

/* n facets of q points; a nodes a cell, k of them on the facet (trace), o nodes of the opposite. Nodes are counted: own
 * cell's (columns) or own facet's (rows) first, then the opposite's. slots (pairs, k + o, a + o) are the places of
 * the blocks of a facet and an opposite facet, the first pair of facet f being base[f], for the opposite low[f]. */
void contact_tangent(int32_t kinematics, int32_t n, int32_t q, int32_t a, int32_t k, int32_t o,
                     const double *own_shape, const double *gradient, const int32_t *trace, const double *outward,
                     const double *weight, double share, const double *gamma, const uint8_t *active,
                     const double *pressure, const double *traction, const double *separation, const double *gap,
                     const double *moduli, const double *shape, const double *slope, const double *normal,
                     const double *tangent, const double *bend, const uint8_t *slides, const int32_t *facet,
                     const int32_t *base, const int32_t *low, const int32_t *slots, double *values)
{
    for (int32_t i = 0; i < n * q; i++) {
        if (!active[i]) continue;
        const int32_t f = i / q, columns = a + o, rows = k + o;
        const double *N = outward + 2 * i, *C = moduli + 9 * i, *nu = normal + 2 * i;
        double jump[MOST], jump_slope[MOST], row_jump[MOST], row_slope[MOST];
        double t[MOST][2][2]; /* derivative of the traction sigma N: component, then displacement */
        for (int c = 0; c < a; c++) {
            jump[c] = own_shape[i * a + c], jump_slope[c] = 0;
            const double gx = gradient[2 * (i * a + c)], gy = gradient[2 * (i * a + c) + 1];
            double s[3][2]; /* stress xx, yy, xy from a displacement of this node in x and y */
            for (int r = 0; r < 3; r++) {
                s[r][0] = C[3 * r] * gx + C[3 * r + 2] * gy;
                s[r][1] = C[3 * r + 1] * gy + C[3 * r + 2] * gx;
            }
            for (int j = 0; j < 2; j++) {
                t[c][0][j] = N[0] * s[0][j] + N[1] * s[2][j];
                t[c][1][j] = N[0] * s[2][j] + N[1] * s[1][j];
            }
        }
        for (int c = 0; c < o; c++) {
            jump[a + c] = -shape[i * o + c], jump_slope[a + c] = slope[i * o + c];
            for (int j = 0; j < 4; j++) t[a + c][j / 2][j % 2] = 0;
        }
        for (int r = 0; r < k; r++) row_jump[r] = own_shape[i * a + trace[f * k + r]], row_slope[r] = 0;
        for (int r = 0; r < o; r++) row_jump[k + r] = -shape[i * o + r], row_slope[k + r] = slope[i * o + r];

        const double w = -share * weight[i], g = gamma[i], p = pressure[i];
        const int32_t *slot = slots + (int64_t)(base[f] + facet[i] - low[f]) * rows * columns;
        if (kinematics == TIED) {
            for (int r = 0; r < rows; r++)
                for (int c = 0; c < columns; c++) {
                    double *block = values + 4 * (int64_t)slot[r * columns + c];
                    for (int ij = 0; ij < 4; ij++)
                        block[ij] += w * row_jump[r] * (t[c][ij / 2][ij % 2] - (ij % 3 ? 0 : g * jump[c]));
                }
            continue;
        }
        double dp[MOST][2], turn[MOST][2], d_xi[MOST][2], unit[2] = {0, 0};
        for (int c = 0; c < columns; c++)
            for (int j = 0; j < 2; j++) {
                dp[c][j] = nu[0] * t[c][0][j] + nu[1] * t[c][1][j] - g * jump[c] * nu[j];
                turn[c][j] = d_xi[c][j] = 0;
            }
        if (kinematics == CURRENT) {
            const double *tau = tangent + 2 * i, *d = separation + 2 * i, b = bend[i];
            const double speed = sqrt(tau[0] * tau[0] + tau[1] * tau[1]);
            const double slide = slides[i] ? 1 / (speed * speed - gap[i] * b) : 0;
            unit[0] = tau[0] / speed, unit[1] = tau[1] / speed;
            /* p follows the turning normal through t . n and, where y is a vertex, through the gap */
            const double lever = g * (d[0] * unit[0] + d[1] * unit[1])
                                 - (traction[2 * i] * unit[0] + traction[2 * i + 1] * unit[1]);
            for (int c = 0; c < columns; c++)
                for (int j = 0; j < 2; j++) {
                    d_xi[c][j] = slide * (jump[c] * tau[j] + jump_slope[c] * d[j]);
                    turn[c][j] = (jump_slope[c] * nu[j] + b * d_xi[c][j]) / speed;
                    dp[c][j] += lever * turn[c][j];
                }
        }
        for (int r = 0; r < rows; r++) {
            const double v = w * row_jump[r], v_unit = v * p, slid = w * p * row_slope[r];
            const double x[2] = {v * nu[0], v * nu[1]}, y[2] = {v_unit * unit[0], v_unit * unit[1]};
            const double z[2] = {slid * nu[0], slid * nu[1]};
            for (int c = 0; c < columns; c++) {
                double *block = values + 4 * (int64_t)slot[r * columns + c];
                for (int ij = 0; ij < 4; ij++) {
                    const int l = ij / 2, j = ij % 2;
                    block[ij] += x[l] * dp[c][j] - y[l] * turn[c][j] - z[l] * d_xi[c][j];
                }
            }
        }
    }
}
