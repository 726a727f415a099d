/* The hot path of src/pidcfg/sim/controllers/dl06.py (sample, position, alarms, scan) and a first-order plant, by hand.

   cc -O2 -ffp-contract=off dl06_twin.c -o dl06_twin && ./dl06_twin 8 5000000
   prints the seconds, and a checksum that equals that of the Python and numba runs. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define NEAREST 6755399441055744.0
#define UNBOUNDED 1e18
enum { MANUAL = 1, AUTO = 2, CASCADE = 4, ALARMS = 0x3f8, RATE_OF_CHANGE = 512 };

typedef struct {
    int64_t sig_in, sig_pv, sig_sp, sig_out, sig_bias, curved, freeze, major, slow, velocity, on_pv, step_bias, root;
    double pv_low, pv_width, pv_min, pv_max, pv_span, out_low, out_width, out_min, out_max, out_span;
    double filter, span, sp_min, sp_max, m_low, m_high;
    double low_low, low, high, high_high, yellow, red, rate_of_change, hysteresis;
} Config;

typedef struct {
    int64_t due, period, busy, status;
    double sp, pv, bias, out, kp, ki, kd, lag, m, x1, quiet_low, quiet_high, quiet_sp, last_sp;
} State;

static int64_t latched(int64_t status, int64_t bit, double excess, double hysteresis) {
    if (excess > 0.0) return status | bit;
    if (excess <= -hysteresis) return status & ~bit;
    return status;
}

static void alarms(const Config *c, State *s, double pv, double old, double sp) {
    int64_t status = latched(s->status, 8, c->low_low - pv, c->hysteresis);
    status = latched(status, 16, c->low - pv, c->hysteresis);
    status = latched(status, 32, pv - c->high, c->hysteresis);
    status = latched(status, 64, pv - c->high_high, c->hysteresis);
    double centre = c->root ? sp * fabs(sp) : sp, deviation = fabs(pv - centre);
    status = latched(status, 128, deviation - c->yellow, c->hysteresis);
    status = latched(status, 256, deviation - c->red, c->hysteresis);
    if (fabs(pv - old) > c->rate_of_change) status |= RATE_OF_CHANGE;
    else status &= ~(int64_t)RATE_OF_CHANGE;
    s->status = status;
    s->quiet_sp = sp;
    s->quiet_low = UNBOUNDED;
    s->quiet_high = -UNBOUNDED;
    if ((status & ALARMS) == 0) {
        double band = fmin(c->yellow, c->red);
        s->quiet_low = fmax(fmax(c->low, c->low_low), centre - band);
        s->quiet_high = fmin(fmin(c->high, c->high_high), centre + band);
    }
}

static double position(const Config *c, State *s, double e, double x) {
    double bias = s->bias, change = s->ki * e;
    if (change != 0.0) {
        if (c->freeze && ((change > 0.0 && s->out >= c->out_max) || (change < 0.0 && s->out <= c->out_min))) change = 0.0;
        bias += change;
    }
    if (bias > c->out_max) bias = c->out_max;
    else if (bias < c->out_min) bias = c->out_min;
    s->bias = bias;
    double m = s->kp * e + bias;
    if (s->kd != 0.0) {
        change = s->lag * (x - s->x1);
        s->x1 += change;
        m += s->kd * change;
    }
    return m;
}

static void sample(int64_t i, const Config *cfg, State *st, double *sig) {
    const Config *c = &cfg[i];
    State *s = &st[i];
    double pv = (sig[c->sig_in] - c->pv_low) * c->pv_span / c->pv_width + c->pv_min;
    if (pv >= c->pv_max) pv = c->pv_max;
    else if (pv > c->pv_min) pv = pv + NEAREST - NEAREST;
    else pv = c->pv_min;
    double old = s->pv;
    if (c->filter < 1.0) pv = old + c->filter * (pv - old) + NEAREST - NEAREST;
    s->pv = pv;
    if (s->busy) abort(); /* rare work is not part of the benchmark */
    int64_t status = s->status;
    double sp = status & CASCADE ? st[c->major].out : s->sp;
    if (sp < c->sp_min) sp = c->sp_min;
    else if (sp > c->sp_max) sp = c->sp_max;
    double change = pv - old, fast = c->rate_of_change;
    if (pv < s->quiet_low || pv > s->quiet_high || sp != s->quiet_sp || change > fast || -change > fast) {
        alarms(c, s, pv, old, sp);
        double centre = c->root ? sp * sp : sp;
        sig[c->sig_sp] = c->pv_low + (centre - c->pv_min) * c->pv_width / c->pv_span;
    }
    if (!(status & MANUAL)) {
        if (c->curved || c->velocity || c->on_pv || (c->step_bias && sp != s->last_sp)) abort();
        double e = (sp - pv) / c->span;
        double m = position(c, s, e, e);
        if (m > 2147483647.0 || m < -2147483647.0) abort();
        if (m > c->m_high) m = c->m_high;
        if (m < c->m_low) m = c->m_low;
        s->m = m;
        s->out = m + NEAREST - NEAREST;
    }
    sig[c->sig_pv] = c->pv_low + (pv - c->pv_min) * c->pv_width / c->pv_span;
    sig[c->sig_out] = c->out_low + (s->out - c->out_min) * c->out_width / c->out_span;
    sig[c->sig_bias] = c->out_low + (s->bias + NEAREST - NEAREST - c->out_min) * c->out_width / c->out_span;
}

static void scan(int64_t tick, int64_t loops, const Config *cfg, State *st, double *sig) {
    for (int64_t i = 0; i < loops; i++) {
        State *s = &st[i];
        if (tick < s->due) continue;
        if (cfg[i].slow) abort();
        int64_t due = s->due + s->period;
        s->due = due > tick ? due : tick + s->period;
        sample(i, cfg, st, sig);
    }
}

int main(int argc, char **argv) {
    int64_t loops = argc > 1 ? atoll(argv[1]) : 1, steps = argc > 2 ? atoll(argv[2]) : 1000000, period = 500000;
    Config *cfg = calloc(loops, sizeof *cfg);
    State *st = calloc(loops, sizeof *st);
    double *sig = calloc(5 * loops, sizeof *sig);
    for (int64_t i = 0; i < loops; i++) {
        double kc = 2.0, ti = 20.0, td = 1.0, ts = 0.5;
        cfg[i] = (Config){.sig_in = 5 * i, .sig_pv = 5 * i + 1, .sig_sp = 5 * i + 2, .sig_out = 5 * i + 3,
            .sig_bias = 5 * i + 4, .freeze = 1, .major = -1, .pv_width = 100.0, .pv_max = 4095.0, .pv_span = 4095.0,
            .out_width = 100.0, .out_max = 4095.0, .out_span = 4095.0, .filter = 0.5, .span = 4095.0, .sp_min = 100.0,
            .sp_max = 4000.0, .m_low = 0.0, .m_high = 4095.0, .low_low = -2.0, .low = -1.0, .high = 3500.0,
            .high_high = 3800.0, .yellow = 4000.0, .red = 4090.0, .rate_of_change = 500.0, .hysteresis = 4.0};
        st[i] = (State){.period = period, .status = AUTO, .sp = 2000.0, .kp = kc * 4095.0, .ki = kc * 4095.0 * ts / ti,
            .kd = kc * 4095.0 * td / ts, .lag = ts / (ts + td / 10.0), .quiet_low = UNBOUNDED, .quiet_high = -UNBOUNDED};
    }
    struct timespec from, to;
    clock_gettime(CLOCK_MONOTONIC, &from);
    for (int64_t k = 0; k < steps; k++) {
        for (int64_t i = 0; i < loops; i++) {
            double y = sig[5 * i];
            sig[5 * i] = y + 0.0125 * (sig[5 * i + 3] - y + (k / 200 % 2 ? 5.0 : 0.0));
        }
        scan(k * period, loops, cfg, st, sig);
    }
    clock_gettime(CLOCK_MONOTONIC, &to);
    double sum = 0.0;
    for (int64_t i = 0; i < loops; i++) sum += sig[5 * i] + st[i].bias + st[i].out;
    printf("%.6f %.17g\n", (to.tv_sec - from.tv_sec) + (to.tv_nsec - from.tv_nsec) * 1e-9, sum);
    return 0;
}
