#pragma once

#include "physics/model/identified_network.h"

namespace medulla {

// Of bodies that are no more than bars, whose links are theirs.
inline bool isRowOfCells(const std::vector<IdentifiedLink>& links, std::size_t frames) {
  constexpr double kPerCell = 1.5;  // links
  return static_cast<double>(links.size()) < kPerCell * static_cast<double>(frames);
}

}  // namespace medulla
