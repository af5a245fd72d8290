#include "app/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "app/standard_streams.h"
#include "render/stage_times.h"

namespace medulla {

Progress::Progress(std::string what, double total, std::string unit)
    : what_(std::move(what)),
      unit_(std::move(unit)),
      total_(std::max(total, 1e-12)),
      terminal_(isatty(STDERR_FILENO) == 1),
      start_(wallSeconds()),
      last_(start_) {}

Progress::~Progress() {
  end();
}

void Progress::end() {
  if (drawn_ && terminal_) std::fputs("\r\x1b[K", stderr);
  drawn_ = false;
}

std::string Progress::text(double done, double elapsed) const {
  const double share = std::clamp(done / total_, 0.0, 1.0);
  const std::string amount = unit_ == "%" ? "" : fmt::format("{:.4g}/{:.4g} {}, ", done, total_, unit_);
  // Less than a hundredth foretells nothing.
  const std::string left = share < 0.01 ? "?" : fmt::format("{:.0f}", elapsed * (1 - share) / share);
  return fmt::format("{} {}{:.0f} %, {} s left", what_, amount, 100 * share, left);
}

void Progress::update(double done) {
  const double now = wallSeconds(), elapsed = now - start_;
  const double pause = terminal_ ? 0.1 : 5;
  if (elapsed < (terminal_ ? 0.5 : 2) || (drawn_ && now - last_ < pause)) return;
  last_ = now;
  drawn_ = true;
  if (!terminal_) {
    tell("{}\n", text(done, elapsed));
    return;
  }
  constexpr int kWidth = 30;
  const int filled = static_cast<int>(kWidth * std::clamp(done / total_, 0.0, 1.0));
  tell("\r\x1b[K[{}{}] {}", std::string(filled, '#'), std::string(kWidth - filled, '.'), text(done, elapsed));
  std::fflush(stderr);
}

}  // namespace medulla
