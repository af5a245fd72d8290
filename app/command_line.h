#pragma once

namespace medulla {

// The whole program. Returns the exit code: 0 done, 1 input or run failed, 2 wrong usage, 3 golden or comparison
// mismatch, 4 not at rest in time, 130 interrupted. Results go to standard output, everything else to standard error.
int runCommandLine(int argc, char** argv);

}  // namespace medulla
