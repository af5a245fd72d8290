#pragma once

#include "app/commands/run.h"

// On standard error: what can run, but is hardly meant, and what a run came to that hardly was.
namespace medulla {

void printWarnings(const LoadedScene& loaded, const RunOptions& options, const World& world);  // before it

void printNotes(const LoadedScene& loaded, const RunTotals& totals, const World& world);  // after it

}  // namespace medulla
