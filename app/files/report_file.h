#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "physics/model/build.h"

namespace medulla {

// One result of a command: a line "name value [unit]" on standard output, a row in a CSV file.
struct Result {
  std::string name, value, unit;  // unit is empty for counts and ratios
};

// Six digits are more than anyone compares; counts are whole.
template <typename T>
std::string numberText(T value) {
  if constexpr (std::is_floating_point_v<T>) return fmt::format("{:.6g}", value);
  return fmt::format("{}", value);
}
inline std::string vectorText(const Eigen::Vector3d& v) {
  return fmt::format("{:.6g} {:.6g} {:.6g}", v.x(), v.y(), v.z());
}

// The quality report of a model build, in the order in which it is shown.
std::vector<Result> buildResults(const BuildReport& report);

// `formulas`: of the beams' formulas on the bulk loads, where they were tried.
std::vector<Result> identifiedResults(const IdentifiedNetwork& network, const std::optional<IdentifiedError>& formulas);

// Sums over the bodies of one build; the cover is that of all volumes together, the gap the largest in metres.
std::vector<Result> totalResults(const std::vector<BuildReport>& reports);

// CSV with the header name,value,unit. Errors are those of OutputFile.
void writeReport(const std::string& path, const std::vector<Result>& results);

}  // namespace medulla
