#pragma once

#include <Eigen/Core>
#include <atomic>
#include <future>
#include <stdexcept>

// Work on two threads; each may again do parts on two. How it is divided never depends on the machine, so that results
// do not; where no other thread can be had, one does all of it.
namespace medulla {

// Work on another thread while this one goes on. The work calls the function that it is given now and then, which
// throws once nobody waits for its result any more: the destructor waits for it to end.
template <typename Result>
class Alongside {
 public:
  template <typename Work>  // Result(const std::function<void(double)>&)
  explicit Alongside(Work work)
      : result_(std::async(std::launch::async | std::launch::deferred, [this, work] {
          return work([this](double) {
            if (isStopped_) throw std::runtime_error("stopped");
          });
        })) {}
  Alongside(const Alongside&) = delete;
  Alongside& operator=(const Alongside&) = delete;
  ~Alongside() { isStopped_ = true; }

  Result get() { return result_.get(); }  // once; throws what the work threw

 private:
  std::atomic<bool> isStopped_ = false;
  std::future<Result> result_;
};

// Calls use(first, count) for both halves of `all` columns at once. The first half is a multiple of 12, the rows that
// Eigen's product kernel takes at a time (and three times its columns): each column meets the same kernel as if there
// were no halves, and products have the same bits.
template <typename Use>
void inHalves(Eigen::Index all, const Use& use) {
  constexpr Eigen::Index unit = 12;
  const Eigen::Index half = (all / 2 + unit / 2) / unit * unit;
  if (half == 0 || half == all) return use(Eigen::Index{0}, all);
  std::future<void> other =
      std::async(std::launch::async | std::launch::deferred, [&use, half, all] { use(half, all - half); });
  use(Eigen::Index{0}, half);
  other.get();
}

}  // namespace medulla
