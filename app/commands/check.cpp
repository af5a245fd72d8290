#include <fmt/format.h>

#include "app/commands/commands.h"
#include "app/commands/run_notes.h"
#include "app/standard_streams.h"

namespace medulla {

// Everything that a run does before its first step: reading, looking up, laying out. Not settling, which takes long.
int runCheck(const RunOptions& options) {
  const LoadedScene loaded = loadRun(options);
  const World world = makeWorld(loaded);
  printWarnings(loaded, options, world);
  // A run that diverges says so itself.
  if (loaded.scene.dynamics.integrator != Integrator::implicit && world.substep() > world.stableSubstep())
    tell("warning: substeps of {:.3g} s are above the stable {:.3g} s, and the run may diverge: use more of them\n",
         world.substep(), world.stableSubstep());
  fmt::print("valid yes\n");
  return 0;
}

}  // namespace medulla
