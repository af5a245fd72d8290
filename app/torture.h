#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "physics/dynamics/world.h"

// Trials of stability: bodies that are put where no scene would put them, or pulled as no hand would, and let go.
namespace medulla {

struct TortureMethod {
  std::string name;
  Integrator integrator = Integrator::explicitEuler;
  int order = 1;
};
const std::vector<TortureMethod>& tortureMethods();

// The names of the trials, in the order in which a table lists them: ways to be disturbed, other bodies, tools.
std::vector<std::string> tortureTrials();

struct TortureOutcome {
  bool survived = false;                      // every state stayed finite
  std::optional<double> recoveredAt;          // s, from then on within 1 % of the body's diagonal of its rest
  double startEnergy = 0, largestEnergy = 0;  // J, kinetic and elastic; the start's counts what a tool gave
};

// One trial of one body, alone, without gravity or contact, in steps of `step` (s), for as long as its slowest mode
// takes to die, or until it has recovered. The body must be held somewhere. Throws std::runtime_error where the trial
// or the body is not known or not held. Trials may run side by side.
TortureOutcome torture(
    const BodyDescription& body, const TortureMethod& method, const std::string& trial, double step,
    const std::function<void()>& afterStep = [] {});

// How many steps that takes at most. Throws likewise.
double tortureSteps(const BodyDescription& body, const std::string& trial, double step);

// s, the largest stable step of the explicit method by its own estimate, of the body alone.
double tortureLimit(const BodyDescription& body);

}  // namespace medulla
