#pragma once

#include <array>
#include <map>
#include <vector>

namespace medulla {

// Numbers of pairs of spheres; those that there are not are appended.
class PairNumbers {
 public:
  explicit PairNumbers(std::vector<std::array<int, 2>>& pairs) : pairs_(&pairs) {
    for (std::size_t k = 0; k < pairs.size(); ++k)
      if (pairs[k][1] >= 0) numbers_[pairs[k]] = static_cast<int>(k);
  }
  int of(int a, int b) {  // -1 - k: pair k is (b, a)
    const auto turned = numbers_.find({b, a});
    if (turned != numbers_.end()) return -1 - turned->second;
    const auto [found, isNew] = numbers_.try_emplace({a, b}, static_cast<int>(pairs_->size()));
    if (isNew) pairs_->push_back(found->first);
    return found->second;
  }

 private:
  std::vector<std::array<int, 2>>* pairs_;
  std::map<std::array<int, 2>, int> numbers_;
};

}  // namespace medulla
