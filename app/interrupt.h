#pragma once

#include <exception>

namespace medulla {

// Thrown by checkInterrupt(): unwinds the run, so that every unfinished file removes itself. Exit code 130.
struct Interrupted : std::exception {
  const char* what() const noexcept override { return "interrupted"; }
};

// From now on SIGINT, SIGTERM and SIGHUP only raise a flag. A second SIGINT ends the process at once.
void watchInterrupts();
bool interruptRequested();
void checkInterrupt();  // throws Interrupted once a signal came

}  // namespace medulla
