#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

#include "assets/shapes/organs.h"
#include "assets/shapes/sdf.h"

namespace medulla {

using Eigen::Vector2d;
using Eigen::Vector3d;

static const double snout = 1250;  // x of the tip of the rostrum

struct Station {
  double fromSnout, top, bottom, halfWidth;  // mm
};

// Girth after photographs of Tursiops truncatus: fineness 5.5, thickest at 38 % of the length.
static const std::array<Station, 17> stations = {{{150, 14, -44, 40},
                                                  {178, 66, -62, 66},
                                                  {220, 108, -82, 92},
                                                  {290, 142, -108, 116},
                                                  {370, 160, -134, 134},
                                                  {500, 186, -172, 162},
                                                  {700, 210, -214, 194},
                                                  {950, 222, -235, 210},
                                                  {1200, 214, -226, 204},
                                                  {1450, 188, -190, 174},
                                                  {1700, 152, -140, 130},
                                                  {1900, 122, -102, 88},
                                                  {2050, 100, -76, 58},
                                                  {2200, 76, -54, 37},
                                                  {2320, 54, -34, 27},
                                                  {2380, 38, -18, 20},
                                                  {2400, 34, -14, 18}}};

// Cubic Hermite through a column of the stations, with slopes from the neighbours.
static double along(double Station::*column, int i, double t) {
  const int last = static_cast<int>(stations.size()) - 1;
  const auto slope = [&](int j) {
    const Station &a = stations[std::max(j - 1, 0)], &b = stations[std::min(j + 1, last)];
    return (b.*column - a.*column) / (b.fromSnout - a.fromSnout);
  };
  const Station &a = stations[i], &b = stations[i + 1];
  const double width = b.fromSnout - a.fromSnout, u = (t - a.fromSnout) / width, v = 1 - u;
  return v * v * (1 + 2 * u) * a.*column + u * u * (1 + 2 * v) * b.*column +
         width * u * v * (v * slope(i) - u * slope(i + 1));
}

// Trunk and tail stock: elliptic sections.
static double trunk(const Vector3d& p) {
  const double t = std::clamp(snout - p.x(), stations.front().fromSnout, stations.back().fromSnout);
  int i = 0;
  while (i + 2 < static_cast<int>(stations.size()) && t > stations[i + 1].fromSnout) ++i;
  const double top = along(&Station::top, i, t), bottom = along(&Station::bottom, i, t);
  const double halfHeight = 0.5 * (top - bottom), halfWidth = along(&Station::halfWidth, i, t);
  const Vector2d q(p.y() - 0.5 * (top + bottom), p.z());
  const double k = q.cwiseQuotient(Vector2d(halfHeight, halfWidth)).norm();
  const double slope = q.cwiseQuotient(Vector2d(halfHeight * halfHeight, halfWidth * halfWidth)).norm();
  const double across = slope < 1e-9 ? -std::min(halfHeight, halfWidth) : k * (k - 1) / slope;
  const Station &a = stations[i], &b = stations[i + 1];
  const double flare =
      std::max({std::abs(b.top - a.top), std::abs(b.bottom - a.bottom), std::abs(b.halfWidth - a.halfWidth)}) /
      (b.fromSnout - a.fromSnout);
  const double beyond = snout - p.x() - t, outside = std::max(across, 0.0);
  const double d = across / std::sqrt(1 + flare * flare);
  return beyond == 0 ? d : std::sqrt(outside * outside + beyond * beyond);
}

// Rostrum with the mouth line, eyes and blowhole. The small blend keeps the crease in front of the melon.
static double withHead(double d, const Vector3d& p, const DolphinMouth& mouth) {
  const Vector3d q(p.x(), p.y(), 0.8 * p.z());
  const double upper = roundCone(q, {snout - 25, -3, 0}, {snout - 270, 14, 0}, 24, 54);
  const double lower = roundCone(q, {snout - 17, -20, 0}, {snout - 270, -34, 0}, 22, 58);
  d = smoothMin(d, smoothMin(upper, lower, 10), 22);
  const double behind = snout - p.x();
  const double fromMouth = (p.y() + 12 - 26 * smoothStep(160, 290, behind)) / mouth.halfWidth;
  const double lips = std::max(1 - fromMouth * fromMouth, 0.0);
  d += mouth.depth * lips * lips * (1 - smoothStep(275, 305, behind));
  d = smoothMin(d, (Vector3d(p.x(), p.y(), std::abs(p.z())) - Vector3d(snout - 345, 24, 122)).norm() - 13, 7);
  return smoothMax(d, -roundCone(p, {snout - 366, 172, -12}, {snout - 366, 172, 12}, 9, 9), 8);
}

// One fin at q = (chord, span, thickness): between a leading and a trailing edge given at this span, with their slopes
// against it, up to `tip`; `rim` is half the thickness of its edge.
struct FinOutline {
  double leading, trailing, leadingSlope, trailingSlope, tip;
};

static double fin(const Vector3d& q, const FinOutline& outline, double thickness, double rim) {
  const double ahead = (outline.leading - q.x()) / std::sqrt(1 + outline.leadingSlope * outline.leadingSlope);
  const double behind = (q.x() - outline.trailing) / std::sqrt(1 + outline.trailingSlope * outline.trailingSlope);
  const double beside = std::max(smoothMax(smoothMax(ahead, behind, 12), q.y() - outline.tip, 14), -60 - q.y());
  if (beside > 0) return std::sqrt(beside * beside + q.z() * q.z()) - rim;
  const double chord = std::max(outline.trailing - outline.leading, 1.0);
  const double s = std::clamp((q.x() - outline.leading) / chord, 0.0, 1.0);
  const double profile = 2.6 * std::sqrt(s) * (1 - s);  // thickest at a third of the chord
  const double half = 0.5 * thickness * chord * profile * std::min(-beside / 14, 1.0);
  return 0.9 * (std::abs(q.z()) - half - rim);
}

// Falcate: swept back, the trailing edge hollow.
static double dorsalFin(const Vector3d& p, double rim) {
  const double height = 235, span = p.y() - 198, w = std::clamp(span / height, -0.3, 1.2), a = std::max(w, 0.0);
  const double hollow = 4 * std::min(a, 1.0) * (1 - std::min(a, 1.0));
  const FinOutline outline{1075 + 235 * w + 160 * a * a * a,
                           1430 - 34 * hollow + 95 * a * a * a - 75 * std::min(w, 0.0), 1 + 2.0 * a * a,
                           1.2 * a * a - 0.5 * (1 - 2 * a), height};
  return fin({snout - p.x(), span, p.z()}, outline, 0.14, rim);
}

// Horizontal, with a notch between them.
static double flukes(const Vector3d& p, double rim) {
  const double halfSpan = 320, span = std::abs(p.z()), a = std::min(span / halfSpan, 1.15), b = std::min(a, 1.0);
  const FinOutline outline{2215 + 150 * a + 125 * a * a * a,
                           2400 + 62 * smoothStep(0, 0.24, a) + 44 * a - 80 * b * (1 - b), 0.5 + 1.1 * a * a, 0.15,
                           halfSpan};
  return fin({snout - p.x(), span, p.y() - 10 + 10 * a * a}, outline, 0.13, rim);
}

// Outwards, down and back from behind the head.
static double pectoralFin(const Vector3d& p, double rim) {
  const Vector3d out = Vector3d(-0.46, -0.55, 0.72).normalized();
  const Vector3d back = (Vector3d(-1, 0, 0) + out * out.x()).normalized();
  const Vector3d q = Vector3d(p.x(), p.y(), std::abs(p.z())) - Vector3d(snout - 580, -120, 140);
  const double length = 350, span = q.dot(out), w = std::clamp(span / length, -0.2, 1.2), a = std::max(w, 0.0);
  const FinOutline outline{-80 + 22 * w + 110 * a * a * a, 76 + 64 * std::min(a, 1.0) * (1 - 0.5 * a) - 46 * a * a,
                           0.06 + 0.94 * a * a, 0.18 - 0.4 * a, length};
  return fin({q.dot(back), span, q.dot(back.cross(out))}, outline, 0.16, rim);
}

double dolphin(const Vector3d& p, double finRim, const DolphinMouth& mouth) {
  double d = withHead(trunk(p), p, mouth);
  d = smoothMin(d, dorsalFin(p, finRim), 45);
  d = smoothMin(d, flukes(p, finRim), 40);
  return smoothMin(d, pectoralFin(p, finRim), 45);
}

}  // namespace medulla
