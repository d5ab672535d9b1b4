/* A linear system x' = (A + k K) x + B u, y = C x, with what is needed to see whether a simulator treats an FMU well:
   a state event (the first output crosses a limit), a time event (a state is kicked), and ways to misbehave on demand.
   N, M, P, A0, A1, B0, C0 come from system.h, which is written for one system. */
#ifndef CORE_H
#define CORE_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "system.h"

/* value references */
enum { VR_TIME = 0, VR_INPUT = 100, VR_OUTPUT = 200, VR_STATE = 300, VR_DERIVATIVE = 400,
       VR_K = 1, VR_LIMIT = 2, VR_KICK_AT = 3, VR_KICK = 4, VR_CROSSED_AT = 5, VR_MISCHIEF = 6, VR_MISCHIEF_AT = 7 };

/* what mischief the integer parameter asks for */
enum { PRINTS = 1, FAILS = 2, NOT_A_NUMBER = 3, ABORTS = 4, ENDS = 5, DISCARDS = 6, HANGS = 7 };

typedef struct {
    double time, x[N], u[M];
    double k, limit, kick_at, kick, crossed_at, z, mischief_at;
    int mischief, kicked;
    void *logger, *environment;
    const char *name;
} Core;

static Core *core_new(void) {
    Core *c = calloc(1, sizeof(Core));
    c->k = 1.0;
    c->limit = 1e30;
    c->kick_at = 1e30;
    c->crossed_at = -1.0;
    return c;
}

static void core_rates(const Core *c, const double *x, double *dx) {
    for (int i = 0; i < N; i++) {
        dx[i] = 0.0;
        for (int j = 0; j < N; j++) dx[i] += (A0[i][j] + c->k * A1[i][j]) * x[j];
        for (int j = 0; j < M; j++) dx[i] += B0[i][j] * c->u[j];
    }
}

static double core_output(const Core *c, int row) {
    double y = 0.0;
    for (int j = 0; j < N; j++) y += C0[row][j] * c->x[j];
    return c->mischief == NOT_A_NUMBER && c->time >= c->mischief_at ? NAN : y;
}

static double core_indicator(const Core *c) { return core_output(c, 0) - c->limit; }

/* Runge-Kutta of fourth order over a fixed number of parts of the step: the co-simulation's own integrator */
static void core_integrate(Core *c, double step) {
    const int parts = (int)ceil(step / 1e-3 - 1e-9);
    const double h = step / parts;
    double k1[N], k2[N], k3[N], k4[N], y[N];
    for (int n = 0; n < parts; n++) {
        core_rates(c, c->x, k1);
        for (int i = 0; i < N; i++) y[i] = c->x[i] + 0.5 * h * k1[i];
        core_rates(c, y, k2);
        for (int i = 0; i < N; i++) y[i] = c->x[i] + 0.5 * h * k2[i];
        core_rates(c, y, k3);
        for (int i = 0; i < N; i++) y[i] = c->x[i] + h * k3[i];
        core_rates(c, y, k4);
        for (int i = 0; i < N; i++) c->x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
    }
    c->time += step;
}

/* what happens at an event; 1 where a state was changed */
static int core_event(Core *c) {
    if (core_indicator(c) > -1e-9 && c->crossed_at < 0.0) c->crossed_at = c->time;
    if (c->kicked || c->time < c->kick_at - 1e-12) return 0;
    c->kicked = 1;
    c->x[0] += c->kick;
    return 1;
}

static double core_get(const Core *c, unsigned vr) {
    if (vr >= VR_DERIVATIVE && vr < VR_DERIVATIVE + N) { double dx[N]; core_rates(c, c->x, dx); return dx[vr - VR_DERIVATIVE]; }
    if (vr >= VR_STATE && vr < VR_STATE + N) return c->x[vr - VR_STATE];
    if (vr >= VR_OUTPUT && vr < VR_OUTPUT + P) return core_output(c, vr - VR_OUTPUT);
    if (vr >= VR_INPUT && vr < VR_INPUT + M) return c->u[vr - VR_INPUT];
    switch (vr) {
    case VR_TIME: return c->time;
    case VR_K: return c->k;
    case VR_LIMIT: return c->limit;
    case VR_KICK_AT: return c->kick_at;
    case VR_KICK: return c->kick;
    case VR_CROSSED_AT: return c->crossed_at;
    case VR_MISCHIEF_AT: return c->mischief_at;
    }
    return NAN;
}

static void core_set(Core *c, unsigned vr, double value) {
    if (vr >= VR_STATE && vr < VR_STATE + N) c->x[vr - VR_STATE] = value;
    if (vr >= VR_INPUT && vr < VR_INPUT + M) c->u[vr - VR_INPUT] = value;
    switch (vr) {
    case VR_K: c->k = value; break;
    case VR_LIMIT: c->limit = value; break;
    case VR_KICK_AT: c->kick_at = value; break;
    case VR_KICK: c->kick = value; break;
    case VR_MISCHIEF_AT: c->mischief_at = value; break;
    }
}

/* misbehaviour that does not depend on the standard; 1 where the step is to fail */
static int core_misbehaves(Core *c) {
    if (c->mischief == 0 || c->time < c->mischief_at) return 0;
    if (c->mischief == PRINTS) printf("the unit says hello at %g\n", c->time);
    if (c->mischief == ABORTS) abort();
    if (c->mischief == HANGS) for (volatile int on = 1; on;) { }
    return c->mischief == FAILS;
}

#endif
