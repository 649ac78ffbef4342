// The mean conditioning index of the 3-SPR over its joint box, eight designs in lockstep: what the
// processor can do where nothing is checked. Built with -O3 -march=native -ffast-math.
#include <cmath>

namespace {

constexpr int LANES = 8, STEPS = 5;
constexpr double ROOT3 = 1.7320508075688772;
constexpr double COS[3] = {-0.5, -0.5, 1.0}, SIN[3] = {0.5 * ROOT3, -0.5 * ROOT3, 0.0};

struct Vector {
    double x, y, z;
};

inline Vector cross(Vector a, Vector b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

inline Vector sum(double p, Vector a, double q, Vector b, double r, Vector c) {
    return {p * a.x + q * b.x + r * c.x, p * a.y + q * b.y + r * c.y, p * a.z + q * b.z + r * c.z};
}

// B_i as the platform sees it, radially and along its normal.
inline void anchor(double hx, double hy, double s, double b, int i, double &radial, double &normal) {
    double scale = b / (1.0 + hx * hx + hy * hy);
    radial = scale * (1.0 - 2.0 * ((hx * hx - hy * hy) * COS[i] - 2.0 * hx * hy * SIN[i]));
    normal = 2.0 * scale * (hx * COS[i] + hy * SIN[i]) - s;
}

inline void newton(double &hx, double &hy, double &s, double a, double b, const double *q2) {
    Vector slope[3];
    double miss[3], scale = 1.0 / (1.0 + hx * hx + hy * hy);
    for (int i = 0; i < 3; ++i) {
        double radial, normal;
        anchor(hx, hy, s, b, i, radial, normal);
        double arm = radial - a, rise = normal + s;
        double gx = -arm * (4.0 * b * (hx * COS[i] - hy * SIN[i]) + 2.0 * hx * radial);
        double gy = arm * (4.0 * b * (hy * COS[i] + hx * SIN[i]) - 2.0 * hy * radial);
        gx += 2.0 * normal * (b * COS[i] - hx * rise);
        gy += 2.0 * normal * (b * SIN[i] - hy * rise);
        slope[i] = {gx * scale, gy * scale, -normal};
        miss[i] = 0.5 * (q2[i] - arm * arm - normal * normal);
    }
    Vector bc = cross(slope[1], slope[2]), ca = cross(slope[2], slope[0]);
    Vector ab = cross(slope[0], slope[1]);
    Vector step = sum(miss[0], bc, miss[1], ca, miss[2], ab);
    double inverse = 1.0 / dot(slope[0], bc);
    hx += step.x * inverse, hy += step.y * inverse, s += step.z * inverse;
}

// det J and the ratio of its singular values, by the cubic of J J^T.
inline void conditioning(double hx, double hy, double s, double a, double b, double &det,
                         double &lci) {
    Vector held[3], row[3];
    double along[3], up[3];
    for (int i = 0; i < 3; ++i) {
        double radial, normal;
        anchor(hx, hy, s, b, i, radial, normal);
        double scale = 1.0 / std::sqrt((radial - a) * (radial - a) + normal * normal);
        along[i] = (a - radial) * scale, up[i] = -normal * scale;
        held[i] = {-normal * COS[i], -normal * SIN[i], radial};
    }
    Vector bc = cross(held[1], held[2]), ca = cross(held[2], held[0]), ab = cross(held[0], held[1]);
    double inverse = 1.0 / dot(held[0], bc);
    Vector u = sum(SIN[0] * inverse, bc, SIN[1] * inverse, ca, SIN[2] * inverse, ab);
    Vector v = sum(-COS[0] * inverse, bc, -COS[1] * inverse, ca, -COS[2] * inverse, ab);
    for (int i = 0; i < 3; ++i) {
        double turn = a * up[i];
        row[i] = {along[i] * COS[i] + turn * (SIN[i] * u.x - COS[i] * u.y),
                  along[i] * SIN[i] + turn * (SIN[i] * v.x - COS[i] * v.y), up[i]};
    }
    det = dot(row[0], cross(row[1], row[2]));
    double aa = dot(row[0], row[0]), bb = dot(row[1], row[1]), cc = dot(row[2], row[2]);
    double x = dot(row[0], row[1]), y = dot(row[0], row[2]), z = dot(row[1], row[2]);
    double mean = (aa + bb + cc) / 3.0, p = aa - mean, q = bb - mean, r = cc - mean;
    double radius = std::sqrt((p * p + q * q + r * r + 2.0 * (x * x + y * y + z * z)) / 6.0);
    double half = 0.5 * (p * (q * r - z * z) - x * (x * r - y * z) + y * (x * z - y * q));
    double cosine = half / (radius * radius * radius);  // of three times the angle
    double c = std::sqrt(0.5 * std::fmax(0.0, 1.0 + cosine));  // of half of that
    double k = 0.8660254037844386 + c * (0.1611 - 0.0271 * c);  // of a sixth of it: 4 k^3 - 3 k = c
    for (int n = 0; n < 3; ++n) k -= (4.0 * k * k * k - 3.0 * k - c) / (12.0 * k * k - 3.0);
    double cos = 2.0 * k * k - 1.0, sin = std::sqrt(std::fmax(0.0, 1.0 - cos * cos));
    double largest = mean + 2.0 * radius * cos;
    double smallest = mean - radius * (cos + ROOT3 * sin);
    lci = std::sqrt(smallest / largest);
}

}  // namespace

// Fill found (n,) from designs (n, 2), n a multiple of LANES, whose boxes hold no isotropic pose.
extern "C" void gci(long n, const double *designs, double lam, long count, const double *nodes,
                    const double *weights, double *found) {
    for (long first = 0; first < n; first += LANES) {
        double a[LANES], b[LANES], leg[LANES], home[LANES];
        double volume[LANES] = {}, mean[LANES] = {};
        for (int j = 0; j < LANES; ++j) {
            a[j] = designs[2 * (first + j)], leg[j] = designs[2 * (first + j) + 1];
            b[j] = 3.0 - a[j] - leg[j];
            home[j] = std::sqrt(leg[j] * leg[j] - (b[j] - a[j]) * (b[j] - a[j]));
        }
        for (long k = 0; k < count; ++k) {
            for (int j = 0; j < LANES; ++j) {
                double q2[3], hx = 0.0, hy = 0.0, s = home[j], det, lci;
                for (int i = 0; i < 3; ++i) {
                    double q = leg[j] * (1.0 + lam * nodes[3 * k + i]);
                    q2[i] = q * q;
                }
#pragma GCC unroll 8
                for (int step = 0; step < STEPS; ++step) newton(hx, hy, s, a[j], b[j], q2);
                conditioning(hx, hy, s, a[j], b[j], det, lci);
                double part = weights[k] / det;
                volume[j] += part, mean[j] += part * lci;
            }
        }
        for (int j = 0; j < LANES; ++j) found[first + j] = mean[j] / volume[j];
    }
}
