#pragma once

#include <stdexcept>

// ^C as an exception: long loops unwind, so that unfinished files are removed by their owners.
namespace medulla {

struct Interrupted : std::runtime_error {
  Interrupted() : std::runtime_error("interrupted") {}
};

// From now on SIGINT, SIGTERM and SIGHUP are noted instead of ending the process. Only the first: a second one ends it
// at once, for a loop that never asks.
void noteInterrupts();

// Throws Interrupted once a signal was noted. Costs one load: fit for every dynamics frame and picture.
void throwIfInterrupted();

}  // namespace medulla
