/* The system of core.h behind FMI 2.0, co-simulation and model exchange; only the functions that a simulator needs. */
#include "core.h"

typedef void (*Logger)(void *environment, const char *name, int status, const char *category, const char *message, ...);
typedef struct { Logger logger; void *allocate, *release, *step_finished; void *environment; } Callbacks;
typedef struct { int again, ended, nominals, values, defined; double next; } EventInfo;
enum { OK, WARNING, DISCARD, ERROR };

static int complain(Core *c, int status, const char *words) {
    ((Logger)c->logger)(c->environment, c->name, status, "logStatusError", "%s at %g s", words, c->time);
    return status;
}

void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *where, const Callbacks *calls, int visible, int log) {
    (void)kind; (void)where; (void)visible; (void)log;
    if (strcmp(guid, GUID)) return NULL;
    Core *c = core_new();
    c->logger = (void *)calls->logger;
    c->environment = calls->environment;
    c->name = strcpy(malloc(strlen(name) + 1), name);
    return c;
}
void fmi2FreeInstance(void *v) { free((char *)((Core *)v)->name); free(v); }
const char *fmi2GetVersion(void) { return "2.0"; }
const char *fmi2GetTypesPlatform(void) { return "default"; }
int fmi2SetupExperiment(void *v, int defined, double tolerance, double start, int stops, double stop) {
    (void)defined; (void)tolerance; (void)stops; (void)stop;
    ((Core *)v)->time = start;
    return OK;
}
int fmi2EnterInitializationMode(void *v) { (void)v; return OK; }
int fmi2ExitInitializationMode(void *v) { ((Core *)v)->z = core_indicator(v); return OK; }
int fmi2Terminate(void *v) { (void)v; return OK; }
int fmi2GetReal(void *v, const unsigned *vr, size_t n, double *value) {
    for (size_t i = 0; i < n; i++) value[i] = core_get(v, vr[i]);
    return OK;
}
int fmi2SetReal(void *v, const unsigned *vr, size_t n, const double *value) {
    for (size_t i = 0; i < n; i++) core_set(v, vr[i], value[i]);
    return OK;
}
int fmi2SetInteger(void *v, const unsigned *vr, size_t n, const int *value) {
    for (size_t i = 0; i < n; i++) if (vr[i] == VR_MISCHIEF) ((Core *)v)->mischief = value[i];
    return OK;
}
int fmi2DoStep(void *v, double time, double step, int no_rollback) {
    Core *c = v;
    (void)no_rollback;
    if (fabs(time - c->time) > 1e-9) return complain(c, ERROR, "the step begins at another time");
    if (core_misbehaves(c)) return complain(c, ERROR, "the rotor came off");
    if (c->mischief == DISCARDS && c->time >= c->mischief_at) return DISCARD;
    core_integrate(c, step);
    return OK;
}
/* model exchange */
int fmi2EnterEventMode(void *v) { (void)v; return OK; }
int fmi2EnterContinuousTimeMode(void *v) { (void)v; return OK; }
int fmi2NewDiscreteStates(void *v, EventInfo *info) {
    Core *c = v;
    memset(info, 0, sizeof *info);
    info->values = core_event(c);
    info->defined = !c->kicked && c->kick_at < 1e29;
    info->next = c->kick_at;
    info->ended = c->mischief == ENDS && c->time >= c->mischief_at;
    return OK;
}
int fmi2CompletedIntegratorStep(void *v, int no_rollback, int *event, int *ended) {
    Core *c = v;
    (void)no_rollback;
    *event = 0;
    *ended = c->mischief == ENDS && c->time >= c->mischief_at;
    return core_misbehaves(c) ? complain(c, ERROR, "the rotor came off") : OK;
}
int fmi2SetTime(void *v, double time) { ((Core *)v)->time = time; return OK; }
int fmi2SetContinuousStates(void *v, const double *x, size_t n) { memcpy(((Core *)v)->x, x, n * sizeof *x); return OK; }
int fmi2GetContinuousStates(void *v, double *x, size_t n) { memcpy(x, ((Core *)v)->x, n * sizeof *x); return OK; }
int fmi2GetDerivatives(void *v, double *dx, size_t n) { (void)n; core_rates(v, ((Core *)v)->x, dx); return OK; }
int fmi2GetEventIndicators(void *v, double *z, size_t n) { (void)n; z[0] = core_indicator(v); return OK; }
int fmi2GetNominalsOfContinuousStates(void *v, double *x, size_t n) { (void)v; for (size_t i = 0; i < n; i++) x[i] = 1.0; return OK; }
/* the standard wants every function to be there, if only to refuse */
#define ABSENT(name) int name(void) { return ERROR; }
ABSENT(fmi2CancelStep) ABSENT(fmi2DeSerializeFMUstate) ABSENT(fmi2FreeFMUstate) ABSENT(fmi2GetBoolean)
ABSENT(fmi2GetBooleanStatus) ABSENT(fmi2GetDirectionalDerivative) ABSENT(fmi2GetFMUstate) ABSENT(fmi2GetInteger)
ABSENT(fmi2GetIntegerStatus) ABSENT(fmi2GetRealOutputDerivatives) ABSENT(fmi2GetRealStatus) ABSENT(fmi2GetStatus)
ABSENT(fmi2GetString) ABSENT(fmi2GetStringStatus) ABSENT(fmi2Reset) ABSENT(fmi2SerializeFMUstate)
ABSENT(fmi2SerializedFMUstateSize) ABSENT(fmi2SetBoolean) ABSENT(fmi2SetDebugLogging) ABSENT(fmi2SetFMUstate)
ABSENT(fmi2SetRealInputDerivatives) ABSENT(fmi2SetString)
