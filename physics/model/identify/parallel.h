#pragma once

#include <functional>
#include <future>
#include <vector>

namespace medulla {

// Calls task(0) to task(count - 1) at once, the first on this thread; returns when all have ended, and throws what the
// first of them threw. How the work is divided must not depend on the machine, so that results do not. Where no more
// threads can be had, tasks run one after another.
inline void runTogether(int count, const std::function<void(int)>& task) {
  std::vector<std::future<void>> others;
  for (int k = 1; k < count; ++k)
    others.push_back(std::async(std::launch::async | std::launch::deferred, [&task, k] { task(k); }));
  if (count > 0) task(0);
  for (std::future<void>& other : others) other.get();
}

}  // namespace medulla
