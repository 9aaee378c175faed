/* Both layers for Siconos: M(x) x'' + F_int(t, x, x') = reactions, in the openings x1 = theta_1, x2 = -theta_2 (`eomnl`). */
#include <math.h>

/* The places of the numbers in z. */
enum { BETA0, DAMPING, STIFFNESS_RATIO, MASS_RATIO, DISSIPATION_RATIO, VERTICAL, HORIZONTAL, FREQUENCY, GROUND };

/* The horizontal loads on the lower and the upper layer, the ground's acceleration included. */
static void loads(double t, const double *z, double *lower, double *upper)
{
  double wave = sin(z[FREQUENCY] * t), ground = -z[FREQUENCY] * z[FREQUENCY] * z[GROUND] * wave;
  *upper = z[HORIZONTAL] * wave - ground;
  *lower = *upper - z[MASS_RATIO] * ground;
}

void mass(unsigned int n, const double *x, double *m, unsigned int size, double *z)
{
  m[0] = 1 + z[MASS_RATIO];
  m[1] = m[2] = cos(2 * z[BETA0] + x[0] + x[1]);
  m[3] = 1;
}

void internal(double t, unsigned int n, const double *x, const double *v, double *f, unsigned int size, double *z)
{
  double b1 = z[BETA0] + x[0], b2 = z[BETA0] + x[1], twist = sin(b1 + b2), lower, upper;
  loads(t, z, &lower, &upper);
  f[0] = -lower * sin(b1) - z[VERTICAL] * cos(b1) + z[DISSIPATION_RATIO] * z[DAMPING] * v[0] + z[STIFFNESS_RATIO] * x[0]
         - twist * v[1] * v[1];
  f[1] = upper * sin(b2) - z[VERTICAL] * cos(b2) + z[DAMPING] * v[1] + x[1] - twist * v[0] * v[0];
}

/* Derivatives to the openings and to their velocities, columns one after the other. */
void internal_by_opening(double t, unsigned int n, const double *x, const double *v, double *j, unsigned int size, double *z)
{
  double b1 = z[BETA0] + x[0], b2 = z[BETA0] + x[1], twist = cos(b1 + b2), lower, upper;
  loads(t, z, &lower, &upper);
  j[0] = -lower * cos(b1) + z[VERTICAL] * sin(b1) + z[STIFFNESS_RATIO] - twist * v[1] * v[1];
  j[1] = -twist * v[0] * v[0];
  j[2] = -twist * v[1] * v[1];
  j[3] = upper * cos(b2) + z[VERTICAL] * sin(b2) + 1 - twist * v[0] * v[0];
}

void internal_by_velocity(double t, unsigned int n, const double *x, const double *v, double *j, unsigned int size, double *z)
{
  double twist = sin(2 * z[BETA0] + x[0] + x[1]);
  j[0] = z[DISSIPATION_RATIO] * z[DAMPING];
  j[1] = -2 * twist * v[0];
  j[2] = -2 * twist * v[1];
  j[3] = z[DAMPING];
}

/* A sine that acts on the first coordinate of a linear structure; z has its amplitude and its frequency. */
void wave(double t, unsigned int n, double *f, unsigned int size, double *z)
{
  for (unsigned int i = 0; i < n; i++) f[i] = 0;
  f[0] = z[0] * sin(z[1] * t);
}
