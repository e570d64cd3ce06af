"""FMUs of a first-order lag, level' = (gain * drive - level) / time_constant, for tests."""

import shutil
import subprocess
import zipfile
from pathlib import Path

import fmpy
import pytest

SLAVE = '''
import math
import os
import time

from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Integer, Real


class NAME(Fmi2Slave):
    def __init__(self, **named):
        super().__init__(**named)
        self.level, self.gain, self.drive, self.tau, self.teeth = 0.0, 2.0, 1.0, 0.5, 1
        for name in ("gain", "tau"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        self.register_variable(Integer("teeth", causality=Fmi2Causality.parameter,
                                       variability=Fmi2Variability.tunable))
        self.register_variable(Real("drive", causality=Fmi2Causality.input))
        self.register_variable(Real("level", causality=Fmi2Causality.output))

    def do_step(self, instant, step):
        if self.gain > 3.5:
            os.abort()
        if self.gain > 3.0:
            while True:
                pass
        if self.gain > 2.7:
            raise ValueError
        if self.gain > 2.5:
            return False
        target = self.gain * self.drive * self.teeth
        self.level = target + (self.level - target) * math.exp(-step / self.tau)
        return True
'''

SLAVE_3 = '''
import math

from pythonfmu3 import Float64, Fmi3Causality, Fmi3Slave, Fmi3Variability


class NAME(Fmi3Slave):
    def __init__(self, **named):
        super().__init__(**named)
        self.time, self.level, self.gain, self.drive, self.tau = 0.0, 0.0, 2.0, 1.0, 0.5
        self.register_variable(Float64("time", causality=Fmi3Causality.independent,
                                       variability=Fmi3Variability.continuous))
        for name in ("gain", "tau"):
            self.register_variable(Float64(name, causality=Fmi3Causality.parameter,
                                           variability=Fmi3Variability.tunable))
        self.register_variable(Float64("drive", causality=Fmi3Causality.input))
        self.register_variable(Float64("level", causality=Fmi3Causality.output))

    def do_step(self, instant, step):
        target = self.gain * self.drive
        self.level = target + (self.level - target) * math.exp(-step / self.tau)
        return True
'''

EXCHANGE = r'''
#include <stddef.h>
#include <stdlib.h>

typedef struct { double time, gain, drive, constant, level, offset; } Lag;
static double *place(Lag *lag, unsigned reference) {
    double *places[] = {&lag->gain, &lag->drive, &lag->constant, &lag->level, NULL, &lag->offset};
    return places[reference];
}
static double rate(Lag *lag) { return (lag->gain * lag->drive + lag->offset - lag->level) / lag->constant; }
#define OK(name, ...) int name(__VA_ARGS__) { return 0; }
#define NONE(name, ...) int name(__VA_ARGS__) { return 3; }

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
OK(fmi2SetDebugLogging, void *c, int on, size_t n, const char *const *categories)
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const void *callbacks,
                      int visible, int logging) {
    Lag *lag = calloc(1, sizeof(Lag));
    lag->gain = 2; lag->drive = 1; lag->constant = 0.5;
    return lag;
}
void fmi2FreeInstance(void *c) { free(c); }
OK(fmi2SetupExperiment, void *c, int defined, double tolerance, double start, int stopping, double stop)
OK(fmi2EnterInitializationMode, void *c)
OK(fmi2ExitInitializationMode, void *c)
OK(fmi2Terminate, void *c)
OK(fmi2Reset, void *c)
int fmi2GetReal(void *c, const unsigned *references, size_t n, double *values) {
    for (size_t i = 0; i < n; i++) values[i] = references[i] == 4 ? rate(c) : *place(c, references[i]);
    return 0;
}
int fmi2SetReal(void *c, const unsigned *references, size_t n, const double *values) {
    for (size_t i = 0; i < n; i++) *place(c, references[i]) = values[i];
    return 0;
}
NONE(fmi2GetInteger, void *c, const unsigned *r, size_t n, int *v)
NONE(fmi2GetBoolean, void *c, const unsigned *r, size_t n, int *v)
NONE(fmi2GetString, void *c, const unsigned *r, size_t n, const char **v)
NONE(fmi2SetInteger, void *c, const unsigned *r, size_t n, const int *v)
NONE(fmi2SetBoolean, void *c, const unsigned *r, size_t n, const int *v)
NONE(fmi2SetString, void *c, const unsigned *r, size_t n, const char *const *v)
NONE(fmi2GetFMUstate, void *c, void **s)
NONE(fmi2SetFMUstate, void *c, void *s)
NONE(fmi2FreeFMUstate, void *c, void **s)
NONE(fmi2SerializedFMUstateSize, void *c, void *s, size_t *n)
NONE(fmi2SerializeFMUstate, void *c, void *s, char *b, size_t n)
NONE(fmi2DeSerializeFMUstate, void *c, const char *b, size_t n, void **s)
NONE(fmi2GetDirectionalDerivative, void *c, const unsigned *u, size_t n, const unsigned *k, size_t m, const double *d,
     double *e)
OK(fmi2EnterEventMode, void *c)
typedef struct { int needed, terminate, nominals, values, timed; double next; } Events;
int fmi2NewDiscreteStates(void *c, Events *events) { *events = (Events){0}; return 0; }
OK(fmi2EnterContinuousTimeMode, void *c)
int fmi2CompletedIntegratorStep(void *c, int fixed, int *event, int *terminate) { *event = *terminate = 0; return 0; }
int fmi2SetTime(void *c, double time) { ((Lag *)c)->time = time; return 0; }
int fmi2SetContinuousStates(void *c, const double *x, size_t n) { ((Lag *)c)->level = x[0]; return 0; }
int fmi2GetDerivatives(void *c, double *rates, size_t n) { rates[0] = rate(c); return 0; }
OK(fmi2GetEventIndicators, void *c, double *z, size_t n)
int fmi2GetContinuousStates(void *c, double *x, size_t n) { x[0] = ((Lag *)c)->level; return 0; }
int fmi2GetNominalsOfContinuousStates(void *c, double *x, size_t n) { x[0] = 1; return 0; }
'''

DESCRIPTION = '''<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="lag" guid="{lag}" numberOfEventIndicators="0">
  <ModelExchange modelIdentifier="lag"/>
  <UnitDefinitions>
    <Unit name="mm"><BaseUnit m="1" factor="0.001"/></Unit>
    <Unit name="s"><BaseUnit s="1"/></Unit>
  </UnitDefinitions>
  <DefaultExperiment startTime="1" stopTime="3" tolerance="1e-9" stepSize="0.01"/>
  <ModelVariables>
    <ScalarVariable name="lag.gain" valueReference="0" causality="parameter" variability="tunable">
      <Real start="2"/></ScalarVariable>
    <ScalarVariable name="drive" valueReference="1" causality="input"><Real unit="mm" start="1"/></ScalarVariable>
    <ScalarVariable name="lag.T" valueReference="2" causality="parameter" variability="fixed">
      <Real unit="s" start="0.5"/></ScalarVariable>
    <ScalarVariable name="level" valueReference="3" causality="output" initial="exact">
      <Real unit="mm" start="0"/></ScalarVariable>
    <ScalarVariable name="der(level)" valueReference="4"><Real derivative="4"/></ScalarVariable>
    <ScalarVariable name="offset" valueReference="5" causality="parameter" variability="fixed">
      <Real unit="N.m2/m2" start="0"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="4"/></Outputs>
    <Derivatives><Unknown index="5"/></Derivatives>
    <InitialUnknowns><Unknown index="5"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
'''


def build_co_simulation(folder: Path, name: str) -> Path:
    """An FMU of a Python class `name`, in whose gain trouble is hidden."""
    from pythonfmu import FmuBuilder

    script = folder / f"{name}.py"
    script.write_text(SLAVE.replace("NAME", name))
    return Path(FmuBuilder.build_FMU(script, dest=folder))


def build_fmi_3(folder: Path, name: str) -> Path:
    """An FMU of FMI 3 for co-simulation."""
    from pythonfmu3 import FmuBuilder

    script = folder / f"{name}.py"
    script.write_text(SLAVE_3.replace("NAME", name))
    return Path(FmuBuilder.build_FMU(script, dest=folder))


def build_model_exchange(folder: Path) -> Path:
    """An FMU of C code; skips the test where no compiler is."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no C compiler `cc`")
    (folder / "lag.c").write_text(EXCHANGE)
    subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", folder / "lag.so", folder / "lag.c"], check=True)
    return pack(folder / "lag.fmu", DESCRIPTION, folder / "lag.so")


def pack(path: Path, description: str, library: Path | None = None, platform: str = fmpy.platform) -> Path:
    """An FMU with this model description."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        if library is not None:
            archive.write(library, f"binaries/{platform}/lag.so")
    return path
