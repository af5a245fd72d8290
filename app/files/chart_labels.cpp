#include "app/files/chart_labels.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace medulla {

namespace {

// Of a font of ten points, a little wider than its digits; half a mark, and a line with some air.
constexpr double kCharacter = 6.2, kTextHeight = 10, kHalfMark = 5, kHalfLine = 3;

}  // namespace

bool ChartLabels::isFree(const Box& box) const {
  return std::none_of(taken_.begin(), taken_.end(), [&](const Box& b) {
    return b.low.x < box.high.x && box.low.x < b.high.x && b.low.y < box.high.y && box.low.y < b.high.y;
  });
}

void ChartLabels::addMark(Place centre) {
  taken_.push_back({{centre.x - kHalfMark, centre.y - kHalfMark}, {centre.x + kHalfMark, centre.y + kHalfMark}});
}

void ChartLabels::addLine(Place from, Place to) {
  const int parts = 1 + static_cast<int>(std::hypot(to.x - from.x, to.y - from.y) / kHalfLine);
  for (int k = 0; k <= parts; ++k) {
    const double t = static_cast<double>(k) / parts, x = std::lerp(from.x, to.x, t), y = std::lerp(from.y, to.y, t);
    taken_.push_back({{x - kHalfLine, y - kHalfLine}, {x + kHalfLine, y + kHalfLine}});
  }
}

std::optional<ChartLabels::Place> ChartLabels::place(Place mark, std::size_t characters) {
  const double halfWidth = 0.5 * kCharacter * static_cast<double>(characters), halfHeight = 0.5 * kTextHeight;
  const double up = kHalfMark + halfHeight, aside = kHalfMark + halfWidth;
  const std::array<Place, 8> ways{
      {{0, up}, {0, -up}, {aside, 0}, {-aside, 0}, {aside, up}, {-aside, up}, {aside, -up}, {-aside, -up}}};
  for (const Place& way : ways) {
    const Place centre{mark.x + way.x, mark.y + way.y};
    const Box box{{centre.x - halfWidth, centre.y - halfHeight}, {centre.x + halfWidth, centre.y + halfHeight}};
    if (!isFree(box)) continue;
    taken_.push_back(box);
    return centre;
  }
  return std::nullopt;
}

}  // namespace medulla
