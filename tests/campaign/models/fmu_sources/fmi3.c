/* The system of core.h behind FMI 3.0, co-simulation and model exchange; only the functions that a simulator needs. */
#include <stdbool.h>
#include <stdint.h>
#include "core.h"

typedef void (*Logger)(void *environment, int status, const char *category, const char *message);
enum { OK, WARNING, DISCARD, ERROR };

static int complain(Core *c, int status, const char *words) {
    char text[200];
    snprintf(text, sizeof text, "%s at %g s", words, c->time);
    ((Logger)c->logger)(c->environment, status, "logStatusError", text);
    return status;
}
static void *instantiate(const char *token, void *environment, Logger logger) {
    if (strcmp(token, GUID)) return NULL;
    Core *c = core_new();
    c->logger = (void *)logger;
    c->environment = environment;
    return c;
}
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *where, bool visible, bool log, bool events,
                                  bool early, const unsigned *required, size_t n, void *environment, Logger logger, void *update) {
    (void)name; (void)where; (void)visible; (void)log; (void)events; (void)early; (void)required; (void)n; (void)update;
    return instantiate(token, environment, logger);
}
void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *where, bool visible, bool log,
                                   void *environment, Logger logger) {
    (void)name; (void)where; (void)visible; (void)log;
    return instantiate(token, environment, logger);
}
void fmi3FreeInstance(void *v) { free(v); }
const char *fmi3GetVersion(void) { return "3.0"; }
int fmi3EnterInitializationMode(void *v, bool defined, double tolerance, double start, bool stops, double stop) {
    (void)defined; (void)tolerance; (void)stops; (void)stop;
    ((Core *)v)->time = start;
    return OK;
}
int fmi3ExitInitializationMode(void *v) { ((Core *)v)->z = core_indicator(v); return OK; }
int fmi3Terminate(void *v) { (void)v; return OK; }
int fmi3GetFloat64(void *v, const unsigned *vr, size_t n, double *value, size_t m) {
    (void)m;
    for (size_t i = 0; i < n; i++) value[i] = core_get(v, vr[i]);
    return OK;
}
int fmi3SetFloat64(void *v, const unsigned *vr, size_t n, const double *value, size_t m) {
    (void)m;
    for (size_t i = 0; i < n; i++) core_set(v, vr[i], value[i]);
    return OK;
}
int fmi3SetInt32(void *v, const unsigned *vr, size_t n, const int32_t *value, size_t m) {
    (void)m;
    for (size_t i = 0; i < n; i++) if (vr[i] == VR_MISCHIEF) ((Core *)v)->mischief = value[i];
    return OK;
}
int fmi3DoStep(void *v, double time, double step, bool no_rollback, bool *event, bool *ended, bool *early, double *reached) {
    Core *c = v;
    (void)no_rollback;
    *event = *early = *ended = false;
    if (fabs(time - c->time) > 1e-9) return complain(c, ERROR, "the step begins at another time");
    if (core_misbehaves(c)) return complain(c, ERROR, "the rotor came off");
    if (c->mischief == DISCARDS && c->time >= c->mischief_at) return DISCARD;
    core_integrate(c, step);
    *reached = c->time;
    *ended = c->mischief == ENDS && c->time >= c->mischief_at;
    return OK;
}
/* model exchange */
int fmi3EnterEventMode(void *v) { (void)v; return OK; }
int fmi3EnterContinuousTimeMode(void *v) { (void)v; return OK; }
int fmi3UpdateDiscreteStates(void *v, bool *again, bool *ended, bool *nominals, bool *values, bool *defined, double *next) {
    Core *c = v;
    *again = *nominals = false;
    *values = core_event(c);
    *defined = !c->kicked && c->kick_at < 1e29;
    *next = c->kick_at;
    *ended = c->mischief == ENDS && c->time >= c->mischief_at;
    return OK;
}
int fmi3CompletedIntegratorStep(void *v, bool no_rollback, bool *event, bool *ended) {
    Core *c = v;
    (void)no_rollback;
    *event = false;
    *ended = c->mischief == ENDS && c->time >= c->mischief_at;
    return core_misbehaves(c) ? complain(c, ERROR, "the rotor came off") : OK;
}
int fmi3SetTime(void *v, double time) { ((Core *)v)->time = time; return OK; }
int fmi3SetContinuousStates(void *v, const double *x, size_t n) { memcpy(((Core *)v)->x, x, n * sizeof *x); return OK; }
int fmi3GetContinuousStates(void *v, double *x, size_t n) { memcpy(x, ((Core *)v)->x, n * sizeof *x); return OK; }
int fmi3GetContinuousStateDerivatives(void *v, double *dx, size_t n) { (void)n; core_rates(v, ((Core *)v)->x, dx); return OK; }
int fmi3GetEventIndicators(void *v, double *z, size_t n) { (void)n; z[0] = core_indicator(v); return OK; }
int fmi3GetNominalsOfContinuousStates(void *v, double *x, size_t n) { (void)v; for (size_t i = 0; i < n; i++) x[i] = 1.0; return OK; }
/* the standard wants every function to be there, if only to refuse */
#define ABSENT(name) int name(void) { return ERROR; }
ABSENT(fmi3ActivateModelPartition) ABSENT(fmi3DeserializeFMUState) ABSENT(fmi3EnterConfigurationMode)
ABSENT(fmi3EnterStepMode) ABSENT(fmi3EvaluateDiscreteStates) ABSENT(fmi3ExitConfigurationMode) ABSENT(fmi3FreeFMUState)
ABSENT(fmi3GetAdjointDerivative) ABSENT(fmi3GetBinary) ABSENT(fmi3GetBoolean) ABSENT(fmi3GetClock)
ABSENT(fmi3GetDirectionalDerivative) ABSENT(fmi3GetFMUState) ABSENT(fmi3GetFloat32) ABSENT(fmi3GetInt16)
ABSENT(fmi3GetInt32) ABSENT(fmi3GetInt64) ABSENT(fmi3GetInt8) ABSENT(fmi3GetIntervalDecimal)
ABSENT(fmi3GetIntervalFraction) ABSENT(fmi3GetNumberOfContinuousStates) ABSENT(fmi3GetNumberOfEventIndicators)
ABSENT(fmi3GetNumberOfVariableDependencies) ABSENT(fmi3GetOutputDerivatives) ABSENT(fmi3GetShiftDecimal)
ABSENT(fmi3GetShiftFraction) ABSENT(fmi3GetString) ABSENT(fmi3GetUInt16) ABSENT(fmi3GetUInt32) ABSENT(fmi3GetUInt64)
ABSENT(fmi3GetUInt8) ABSENT(fmi3GetVariableDependencies) ABSENT(fmi3InstantiateScheduledExecution) ABSENT(fmi3Reset)
ABSENT(fmi3SerializeFMUState) ABSENT(fmi3SerializedFMUStateSize) ABSENT(fmi3SetBinary) ABSENT(fmi3SetBoolean)
ABSENT(fmi3SetClock) ABSENT(fmi3SetDebugLogging) ABSENT(fmi3SetFMUState) ABSENT(fmi3SetFloat32) ABSENT(fmi3SetInt16)
ABSENT(fmi3SetInt64) ABSENT(fmi3SetInt8) ABSENT(fmi3SetIntervalDecimal) ABSENT(fmi3SetIntervalFraction)
ABSENT(fmi3SetShiftDecimal) ABSENT(fmi3SetShiftFraction) ABSENT(fmi3SetString) ABSENT(fmi3SetUInt16)
ABSENT(fmi3SetUInt32) ABSENT(fmi3SetUInt64) ABSENT(fmi3SetUInt8)
