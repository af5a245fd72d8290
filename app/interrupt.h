#pragma once

#include <exception>

namespace medulla {

// Thrown by checkInterrupt(): unwinds the run, so that every unfinished file removes itself. Exit code 130.
struct Interrupted : std::exception {
  const char* what() const noexcept override { return "interrupted"; }
};

// From now on SIGINT, SIGTERM and SIGHUP only raise a flag, however often they come: ending at once would leave
// unfinished files behind. What the program was started to ignore (nohup, jobs in the background) stays ignored.
// SIGQUIT still ends the process. Nor does a limit on the size of files or a reader that left: writing fails there.
void watchInterrupts();
void checkInterrupt();  // throws Interrupted once a signal came

}  // namespace medulla
