#include <fmt/format.h>

#include "app/commands/commands.h"
#include "app/commands/run_notes.h"

namespace medulla {

// Everything that a run does before its first step: reading, looking up, laying out. Not settling, which takes long.
int runCheck(const RunOptions& options) {
  const LoadedScene loaded = loadRun(options);
  goldenPictures(loaded.scene);
  printWarnings(loaded, options, makeWorld(loaded));
  fmt::print("valid yes\n");
  return 0;
}

}  // namespace medulla
