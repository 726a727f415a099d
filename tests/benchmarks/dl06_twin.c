/* The production run of one or more DL06 loops by hand: what pidcfg.sim.engine.kernel.advance does for them, and their noise.

   The records are those of the Python sources (records.h is written from them by twin.py), so that both work on the same
   arrays and leave the same bits. What rarely happens (mode requests, profiles, auto-tune) ends the program. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "records.h"

#define ROUNDING_MAGIC 6755399441055744.0
#define UNBOUNDED 1e18
enum { MANUAL = 1, AUTO = 2, CASCADE = 4, ALARMS = 0x3f8, RATE_OF_CHANGE = 512, LOG_COLUMNS = 5 };

typedef struct {
    int64_t step, n_plants, n_loops, n_bands, n_gauges, n_shown, columns, noise_from, reached, every, room;
    Plant *plants;
    Config *configs;
    State *states;
    double *signals;
    const double *noise;
    Meter *meters;
    Band *bands;
    Gauge *gauges;
    int64_t *rows, *counts;
    double *trend;
    const int64_t *shown;
} Run;

/* --- the controller ------------------------------------------------------------------------------------------------ */

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
    double centre = c->square_root ? sp * fabs(sp) : sp, deviation = fabs(pv - centre);
    status = latched(status, 128, deviation - c->yellow, c->hysteresis);
    status = latched(status, 256, deviation - c->red, c->hysteresis);
    if (fabs(pv - old) > c->rate_of_change) status |= RATE_OF_CHANGE;
    else status &= ~(int64_t)RATE_OF_CHANGE;
    s->status = status;
    s->alarm_band_sp = sp;
    s->alarm_band_low = UNBOUNDED;
    s->alarm_band_high = -UNBOUNDED;
    if ((status & ALARMS) == 0) {
        double band = fmin(c->yellow, c->red);
        s->alarm_band_low = fmax(fmax(c->low, c->low_low), centre - band);
        s->alarm_band_high = fmin(fmin(c->high, c->high_high), centre + band);
    }
}

static double position(const Config *c, State *s, double e) {
    double bias = s->bias, change = s->ki * e;
    if (change != 0.0) {
        if (c->bias_freeze && ((change > 0.0 && s->out >= c->out_max) || (change < 0.0 && s->out <= c->out_min))) change = 0.0;
        bias += change;
    }
    if (bias > c->out_max) bias = c->out_max;
    else if (bias < c->out_min) bias = c->out_min;
    s->bias = bias;
    if (s->kd == 0.0) {
        s->derivative_input_1 = e;
        return s->kp * e + bias;
    }
    double y = s->filter_share == 1.0 ? e : s->derivative_input_1 + s->filter_share * (e - s->derivative_input_1), slope = y - s->derivative_input_1;
    s->derivative_input_1 = y;
    return s->kp * e + s->kd * slope + bias;
}

static void sample(int64_t i, const Config *configs, State *states, double *signals) {
    const Config *c = &configs[i];
    State *s = &states[i];
    if (s->pending || c->is_special) abort();
    double pv = (signals[c->in_slot] - c->pv_low) * c->pv_span / c->pv_width + c->pv_min;
    if (pv >= c->pv_max) pv = c->pv_max;
    else if (pv > c->pv_min) pv = pv + ROUNDING_MAGIC - ROUNDING_MAGIC;
    else pv = c->pv_min;
    double old = s->pv;
    if (c->filter < 1.0) pv = old + c->filter * (pv - old) + ROUNDING_MAGIC - ROUNDING_MAGIC;
    s->pv = pv;
    int64_t status = s->status;
    double sp = status & CASCADE ? states[c->major].out : s->sp;
    if (sp < c->sp_min) sp = c->sp_min;
    else if (sp > c->sp_max) sp = c->sp_max;
    double change = pv - old, fast = c->rate_of_change;
    if (pv < s->alarm_band_low || pv > s->alarm_band_high || sp != s->alarm_band_sp || change > fast || -change > fast) {
        alarms(c, s, pv, old, sp);
        double centre = c->square_root ? sp * fabs(sp) : sp;
        signals[c->sp_slot] = c->pv_low + (centre - c->pv_min) * c->pv_width / c->pv_span;
    }
    if (!(status & MANUAL)) {
        double m = position(c, s, (sp - pv) / c->span);
        if (m > 2147483647.0 || m < -2147483647.0) abort();
        if (m > c->output_high_limit) m = c->output_high_limit;
        if (m < c->output_low_limit) m = c->output_low_limit;
        s->unrounded_output = m;
        s->out = m + ROUNDING_MAGIC - ROUNDING_MAGIC;
    }
    signals[c->pv_slot] = c->pv_low + (pv - c->pv_min) * c->pv_width / c->pv_span;
    signals[c->out_slot] = c->out_low + (s->out - c->out_min) * c->out_width / c->out_span;
    signals[c->bias_slot] = c->out_low + (s->bias + ROUNDING_MAGIC - ROUNDING_MAGIC - c->out_min) * c->out_width / c->out_span;
}

static void scan(int64_t tick, int64_t loops, const Config *configs, State *states, double *signals) {
    for (int64_t i = 0; i < loops; i++) {
        State *s = &states[i];
        if (tick < s->due) continue;
        if (configs[i].slow) abort();
        int64_t due = s->due + s->period;
        s->due = due > tick ? due : tick + s->period;
        sample(i, configs, states, signals);
    }
}

/* --- what is measured ---------------------------------------------------------------------------------------------- */

static void turn(Meter *m, double pv, int64_t k) {
    double before = m->last_swing, swing = fabs(m->extreme - m->turn_value);
    int64_t period = m->extreme_at - m->turn_before;
    m->last_swing = swing;
    if (m->extreme_at >= m->last_third) {
        if (m->turns == 0 && m->calm_turns > 0) m->turns = 1;
        if (m->turns == 1) {
            m->first_turn = m->extreme_at;
            m->swing_sum = 0.0;
            m->shortest_period = INT64_C(1) << 62;
            m->longest_period = 0;
        } else if (m->turns > 1) {
            m->swing_sum += swing;
            if (m->turns == 2) m->first_swing = swing;
            else {
                if (period < m->shortest_period) m->shortest_period = period;
                if (period > m->longest_period) m->longest_period = period;
            }
        }
        m->turns++;
    }
    if (m->calm_turns == 1) {
        m->calm_first_turn = m->extreme_at;
        m->calm_swing_sum = m->widest_swing = 0.0;
        m->calm_shortest_period = INT64_C(1) << 62;
        m->calm_longest_period = 0;
    } else if (m->calm_turns > 1) {
        m->calm_swing_sum += swing;
        if (swing > m->widest_swing) m->widest_swing = swing;
        if (m->calm_turns == 2) {
            m->calm_first_swing = swing;
            m->growing_swings = m->max_growing_swings = 0;
        } else {
            if (period < m->calm_shortest_period) m->calm_shortest_period = period;
            if (period > m->calm_longest_period) m->calm_longest_period = period;
            m->growing_swings = swing > 1.1 * before ? m->growing_swings + 1 : 0;
            if (m->growing_swings > m->max_growing_swings) m->max_growing_swings = m->growing_swings;
        }
    }
    m->calm_turns++;
    m->turn_value = m->extreme;
    m->turn_before = m->last_turn;
    m->last_turn = m->extreme_at;
    m->direction = -m->direction;
    m->extreme = pv;
    m->extreme_at = k;
}

static void watch_swings(Meter *m, double pv, int64_t k) {
    if (m->in_control == 0 || m->extreme_at < 0) {
        m->extreme = pv;
        m->extreme_at = k;
        m->turns = m->calm_turns = 0;
    } else if (m->direction > 0 ? pv > m->extreme : pv < m->extreme) {
        m->extreme = pv;
        m->extreme_at = k;
    } else if ((m->direction > 0 ? m->extreme - pv : pv - m->extreme) > m->min_swing) turn(m, pv, k);
}

static void watch_end(Meter *m, double pv, double sp, int64_t k) {
    if (sp > pv) {
        if (m->error_sign <= 0) {
            m->error_sign = 1;
            m->sign_since = k;
        }
    } else if (m->error_sign >= 0) {
        m->error_sign = -1;
        m->sign_since = k;
    }
    if (k >= m->window_middle) {
        m->final_error += sp - pv;
        m->final_sp += sp;
    } else if (k >= m->window_start) {
        m->early_error += sp - pv;
        m->early_sp += sp;
    }
    if (k == m->last_third) {
        m->last_third_status |= m->status;
        m->last_third_aux |= m->aux_status;
    }
}

static void follow_step(Meter *m, double pv, double sp, int64_t k) {
    if ((m->has_step == 0 || k <= m->locked_until) && sp != m->sp_before) {
        m->has_step = 1;
        m->sp_after = sp;
    }
    if (m->has_step == 1 && m->rise_to < 0) {
        double share = (pv - m->sp_before) / (m->sp_after - m->sp_before);
        if (share >= 0.1 && m->rise_from < 0) m->rise_from = k;
        if (share >= 0.632 && m->reached_at < 0) m->reached_at = k;
        if (share >= 0.9) m->rise_to = k;
    }
}

static void measure(Meter *m, const double *signals, int64_t k) {
    double pv = signals[m->pv], sp = signals[m->sp], out = signals[m->out];
    if (m->in_control == 1) {
        if (sp != pv) {
            double e = fabs(sp - pv);
            m->iae += e;
            m->ise += e * e;
            m->itae += e * (double)k;
            if (e > m->band) m->last_outside = k;
        }
        if (m->event_at >= 0 && k < m->step_until) {
            if (pv > m->peak_high) m->peak_high = pv;
            else if (pv < m->peak_low) m->peak_low = pv;
            if (m->rise_to < 0 || k <= m->locked_until) follow_step(m, pv, sp, k);
            if (m->has_step == 1 && fabs(m->sp_after - pv) > m->band) m->step_error += fabs(m->sp_after - pv);
        }
    }
    if (out != m->last_out) {
        m->variation += fabs(out - m->last_out);
        m->last_out = out;
        if (out > m->out_high) m->out_high = out;
        else if (out < m->out_low) m->out_low = out;
    }
    if (pv > m->pv_high) m->pv_high = pv;
    else if (pv < m->pv_low) m->pv_low = pv;
    if (sp != m->last_sp) {
        m->last_sp = sp;
        if (fabs(sp - m->sp_anchor) > m->band) {
            m->sp_anchor = sp;
            m->sp_moved_at = k;
        }
        if (sp > m->sp_high) m->sp_high = sp;
        else if (sp < m->sp_low) m->sp_low = sp;
    }
    if (k >= m->watch_from) watch_end(m, pv, sp, k);
    if (k >= m->swings_from) watch_swings(m, pv, k);
}

/* --- the run ------------------------------------------------------------------------------------------------------- */

int64_t advance(int64_t k, int64_t last, int64_t zero, const Run *run) {
    Run r = *run;
    for (; k < last; k++) {
        int64_t now = k - zero;
        if (k > r.reached)
            for (int64_t i = 0; i < r.n_plants; i++) {
                Plant *p = &r.plants[i];
                if (p->source < 0 || p->length > 0 || p->model != 0) abort();
                double y = p->y + p->a * (p->gain * r.signals[p->source] + p->load - p->y);
                if (y > p->high) y = p->high;
                else if (y < p->low) y = p->low;
                p->y = r.signals[p->slot] = y;
            }
        if (r.columns > 0)
            for (int64_t i = 0; i < r.n_plants; i++) {
                Plant *p = &r.plants[i];
                if (p->column >= 0)
                    r.signals[p->measured] = r.signals[p->slot] + p->sigma * r.noise[(k - r.noise_from) * r.columns + p->column];
            }
        scan(k * r.step, r.n_loops, r.configs, r.states, r.signals);
        for (int64_t i = 0; i < r.n_loops; i++)
            if (r.states[i].status != r.meters[i].status || r.states[i].notice || r.states[i].aux_status != r.meters[i].aux_status) abort();
        for (int64_t i = 0; i < r.n_loops; i++) measure(&r.meters[i], r.signals, now);
        if (r.counts[2] > 0)
            for (int64_t i = 0; i < r.n_bands; i++) {
                Meter *m = &r.meters[r.bands[i].loop];
                double away = fabs(r.signals[m->pv] - m->sp_after);
                if (m->event_at >= 0 && m->in_control == 1 && now < m->step_until && (m->has_step == 0 || away > r.bands[i].share * fabs(m->sp_after - m->sp_before)))
                    r.bands[i].last_outside = now;
            }
        for (int64_t i = 0; i < r.n_gauges; i++) {
            Gauge *g = &r.gauges[i];
            if (g->first <= now && now <= g->last) {
                double value = r.signals[g->slot];
                if (value < g->low) g->low = value;
                if (value > g->high) g->high = value;
            }
        }
        if (r.every > 0 && now % r.every == 0) {
            for (int64_t i = 0; i < r.n_shown; i++) r.trend[r.counts[1] * r.n_shown + i] = r.signals[r.shown[i]];
            r.counts[1]++;
        }
    }
    return k;
}

/* --- noise: the Mersenne Twister as Python has it, and Box and Muller's numbers -------------------------------------- */

static uint32_t word(int64_t *state) {
    if (state[624] >= 624) {
        for (int i = 0; i < 624; i++) {
            uint32_t y = ((uint32_t)state[i] & 0x80000000u) | ((uint32_t)state[(i + 1) % 624] & 0x7fffffffu);
            state[i] = (uint32_t)state[(i + 397) % 624] ^ (y >> 1) ^ (y & 1 ? 0x9908b0dfu : 0u);
        }
        state[624] = 0;
    }
    uint32_t y = (uint32_t)state[state[624]++];
    y ^= y >> 11;
    y ^= (y << 7) & 0x9d2c5680u;
    y ^= (y << 15) & 0xefc60000u;
    return y ^ (y >> 18);
}

static double uniform(int64_t *state) {
    uint32_t high = word(state) >> 5, low = word(state) >> 6;
    return (high * 67108864.0 + low) * (1.0 / 9007199254740992.0);
}

int64_t normals(int64_t rows, int64_t column, int64_t columns, int64_t *state, double *spare, double *noise) {
    for (int64_t row = 0; row < rows; row++) {
        double z = spare[0];
        if (spare[1] != 0.0) spare[1] = 0.0;
        else {
            double angle = uniform(state) * (2.0 * 3.141592653589793);
            double radius = sqrt(-2.0 * log(1.0 - uniform(state)));
            z = cos(angle) * radius;
            spare[0] = sin(angle) * radius;
            spare[1] = 1.0;
        }
        noise[row * columns + column] = 0.0 + z;
    }
    return rows;
}
