// The same adaptive Dormand-Prince 5(4) as scalar_dopri.py in C++, one engagement at a time.
//
// Steps end at the breakpoints of the current. Lock-up is located on the cubic Hermite interpolant of the last step.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

using State = std::array<double, 5>;  // pressure, its rate, piston state, input speed, output speed

struct Curves {
    const double *ratio, *torque, *capacity;  // 13 values each, over the speed ratio

    double converter(double w, double speed) const {
        const double nu = std::min(1.0, std::max(0.0, w / speed));
        const int i = nu < 0.8 ? std::min(int(nu * 10), 8) : std::min(8 + int((nu - 0.8) * 20), 11);
        const double share = (nu - ratio[i]) / (ratio[i + 1] - ratio[i]);
        const double factor = torque[i] + share * (torque[i + 1] - torque[i]);
        const double k = capacity[i] + share * (capacity[i + 1] - capacity[i]);
        return speed * speed * factor / (k * k);
    }
};

struct Engagement {
    const double *p;
    Curves curves;
    double speed, inertia, brake;
    double t0, u0, slope;  // of the current's present segment

    State rates(double t, const State &y) const {
        const auto [x1, x2, x3, w, v] = y;
        const double u = u0 + slope * (t - t0);
        const double dx2 = (6 * p[2] * (u - p[1]) - 6 * x1) / (p[0] * p[0]) - (4 * x2 + 2 * p[2] * slope) / p[0];
        const double dx3 = (p[4] * (x1 - p[7]) + p[3] * x2 - p[6] * x3) / p[5];
        const double z = std::min(p[9], std::max(0.0, p[8] * x3));
        const double width = p[19] * p[9];
        const double s = std::min(1.0, std::max(0.0, 1 - (p[9] - z) / width));
        const double per_gap = s > 0 ? (1 - s) * (1 + 2 * s) / width : 1 / (p[9] - z);
        const double contact = z / (p[9] - p[11]) * 1e5 * std::max(0.0, x1);
        const double torque = p[12] * per_gap * (w / p[14] - v) + s * s * (3 - 2 * s) * p[13] * contact;
        const double drive = curves.converter(w, speed) - p[17] * w - p[16];
        const double net = p[14] * torque - brake - p[18] * v;
        return {x2, dx2, dx3, (drive - torque) / p[15], v > 0 || net > 0 ? net / inertia : 0.0};
    }
};

constexpr int STAGES = 7;
constexpr double NODES[STAGES] = {0.0, 0.2, 0.3, 0.8, 8.0 / 9, 1.0, 1.0};
constexpr double WEIGHTS[STAGES][STAGES - 1] = {
    {},
    {1.0 / 5},
    {3.0 / 40, 9.0 / 40},
    {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
    {35.0 / 384, 0.0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
constexpr double ERROR[STAGES] = {71.0 / 57600,      0.0,        -71.0 / 16695, 71.0 / 1920,
                                  -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
constexpr State SCALES = {1.0, 100.0, 1e-3, 100.0, 10.0};

// The share of a step after which the cubic from `value` to `next`, with the changes `slow`, `fast`, is zero.
static double root(double value, double next, double slow, double fast) {
    double low = 0.0, high = 1.0;
    for (int i = 0; i < 40; ++i) {
        const double x = 0.5 * (low + high);
        const double cubic = (1 - x) * (1 - x) * (value * (1 + 2 * x) + slow * x)
                             + x * x * (next * (3 - 2 * x) + fast * (x - 1));
        (cubic > 0 ? low : high) = x;
    }
    return high;
}

static double shifting_time(Engagement run, const double *time, const double *current, int breakpoints,
                            double initial_speed, double rtol) {
    const double *p = run.p;
    State y = {0.0, 0.0, p[10], initial_speed, 0.0};
    double t = 0.0, h = 1e-3;
    for (int line = 0; line + 1 < breakpoints; ++line) {
        const double end = time[line + 1];
        run.t0 = time[line], run.u0 = current[line];
        run.slope = (current[line + 1] - run.u0) / (end - run.t0);
        State k[STAGES] = {run.rates(t, y)};
        while (t < end) {
            const bool last = t + h >= end * (1 - 1e-14);
            const double step = last ? end - t : h;
            State next;
#pragma GCC unroll 7
            for (int stage = 1; stage < STAGES; ++stage) {
                for (int i = 0; i < 5; ++i) {
                    double sum = WEIGHTS[stage][0] * k[0][i];
#pragma GCC unroll 7
                    for (int j = 1; j < stage; ++j) sum += WEIGHTS[stage][j] * k[j][i];
                    next[i] = y[i] + step * sum;
                }
                k[stage] = run.rates(t + NODES[stage] * step, next);
            }
            double error = 0.0;
            for (int i = 0; i < 5; ++i) {
                double sum = 0.0;
#pragma GCC unroll 7
                for (int j = 0; j < STAGES; ++j) sum += ERROR[j] * k[j][i];
                error = std::max(error, std::abs(step * sum / (rtol * SCALES[i])));
            }
            const double factor = 0.9 * std::pow(error + 1e-12, -0.2);
            if (error > 1) {
                h = step * std::max(0.2, factor);
                continue;
            }
            const State &first = k[0], &final = k[STAGES - 1];
            const double slip = y[3] / p[14] - y[4], new_slip = next[3] / p[14] - next[4];
            if (new_slip <= 0)
                return t + step * root(slip, new_slip, step * (first[3] / p[14] - first[4]),
                                       step * (final[3] / p[14] - final[4]));
            t = last ? end : t + step;
            y = next;
            y[4] = std::max(0.0, y[4]);
            k[0] = k[STAGES - 1];
            h = std::max(step, last ? h : 0.0) * std::min(5.0, std::max(0.2, factor));
        }
    }
    return std::numeric_limits<double>::quiet_NaN();
}

// Shifting times (points, conditions) in s. Arrays are contiguous: `vectors` (points, parameters), the current over the
// time of each profile (profiles, breakpoints), and `initial`, the input speed at the start (points, conditions).
extern "C" void shifting_times(int points, int conditions, int parameters, int breakpoints, const double *vectors,
                               const std::int64_t *profile, const double *profile_time, const double *profile_current,
                               const double *speed, const double *inertia, const double *brake, const double *initial,
                               const double *ratio, const double *torque, const double *capacity, double rtol,
                               double *out) {
    for (int m = 0; m < points; ++m)
        for (int i = 0; i < conditions; ++i) {
            const Engagement run = {vectors + m * parameters, {ratio, torque, capacity}, speed[i], inertia[i], brake[i],
                                    0.0, 0.0, 0.0};
            const std::int64_t first = profile[i] * breakpoints, at = std::int64_t(m) * conditions + i;
            out[at] = shifting_time(run, profile_time + first, profile_current + first, breakpoints, initial[at], rtol);
        }
}
