#pragma once

#include <string>

#include "app/files/log_table.h"

namespace medulla {

enum class PlotFormat { png, svg };

// A script for gnuplot that draws a log over time, panel under panel: per tool its force, and how far device and proxy
// are apart, with the times of contact and grab shaded; then volume, modelled nodes, energies, and where `frameTimes`
// is given (--frame-times) what the frames took. Two tools share no panel; bodies do. Throws std::runtime_error naming
// the log and the first column that is missing, or that has no rows.
std::string plotScript(const LogTable& log, const LogTable* frameTimes, const std::string& title, PlotFormat format);

}  // namespace medulla
