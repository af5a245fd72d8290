#pragma once

#include <optional>
#include <string>

namespace medulla {

// The SVG or PNG that gnuplot writes to standard output for a script; nothing where it is not installed. Throws
// std::runtime_error with gnuplot's complaint, or where the picture is not whole.
std::optional<std::string> runGnuplot(const std::string& script);

// The script into STEM.gnuplot and what gnuplot makes of it into STEM.svg; without gnuplot a line on standard error
// says how to draw it.
void drawByGnuplot(const std::string& stem, const std::string& script);

}  // namespace medulla
