#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace medulla {

// What hangs together, joined pair by pair (union-find). A set is known by the lowest number in it, whatever the order
// of the pairs.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count = 0) : parent_(count) { separate(); }

  void separate() { std::iota(parent_.begin(), parent_.end(), 0); }

  int of(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  // False where both are in one set already.
  bool join(int i, int j) {
    const int a = of(i), b = of(j);
    parent_[std::max(a, b)] = std::min(a, b);
    return a != b;
  }

 private:
  std::vector<int> parent_;
};

}  // namespace medulla
