#include "physics/model/plane_section.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "physics/model/disjoint_sets.h"
#include "physics/model/torsion_constant.h"

namespace medulla {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr int kScanLines = 64;  // second moments of a disc to 0.1 %

struct Span {
  double low, high;
};
constexpr Span kNothing{1e30, -1e30};
using Outline = std::vector<std::array<Vector2d, 2>>;

// Where the triangles cut the plane. A vertex on the plane counts as above it: outlines stay closed.
Outline cut(const TriangleMesh& mesh, const Plane& plane) {
  const Vector3d normal = plane.u.cross(plane.v);
  Outline outline;
  for (const std::array<int, 3>& t : mesh.triangles) {
    std::array<double, 3> height;
    for (int k = 0; k < 3; ++k) height[k] = (mesh.vertices[t[k]] - plane.origin).dot(normal);
    std::array<Vector2d, 2> ends;
    int found = 0;
    for (int k = 0; k < 3; ++k) {
      // From the lower vertex number: both triangles at an edge find the same point.
      const int i = t[k] < t[(k + 1) % 3] ? k : (k + 1) % 3, j = i == k ? (k + 1) % 3 : k;
      if ((height[i] >= 0) == (height[j] >= 0)) continue;
      const double s = height[i] / (height[i] - height[j]);
      const Vector3d p = mesh.vertices[t[i]] + s * (mesh.vertices[t[j]] - mesh.vertices[t[i]]) - plane.origin;
      ends[found++] = {p.dot(plane.u), p.dot(plane.v)};
    }
    if (found == 2) outline.push_back(ends);
  }
  return outline;
}

// The part of a scan line in the cell of `site`: power differences are linear along a line, each rival cuts one side.
// Beyond the cell's reach there is none of it.
Span cellSpan(const PowerSites& sites, int site, const Vector3d& start, const Vector3d& along) {
  const Vector3d& a = sites.centres[site];
  const double middle = (a - start).dot(along), reach = sites.reaches[site];
  const double chord = reach * reach - (start + middle * along - a).squaredNorm();
  if (chord <= 0) return kNothing;
  Span part{middle - std::sqrt(chord), middle + std::sqrt(chord)};
  for (std::size_t k = 0; k < sites.centres.size(); ++k) {
    if (static_cast<int>(k) == site) continue;
    // power(a) - power(k) = at + slope t along the line
    const Vector3d towards = sites.centres[k] - a;
    const double at =
        (start - a).squaredNorm() - sites.weights[site] - (start - sites.centres[k]).squaredNorm() + sites.weights[k];
    const double slope = 2 * towards.dot(along);
    if (slope > 0)
      part.high = std::min(part.high, -at / slope);
    else if (slope < 0)
      part.low = std::max(part.low, -at / slope);
    else if (at > 0)
      return kNothing;
  }
  return part;
}

// Area, centroid and second moments of the region that the spans make up.
SectionMoments momentsOf(const std::vector<SectionSpan>& spans) {
  SectionMoments out;
  Vector2d first = Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (const SectionSpan& s : spans) {
    const double length = s.high - s.low, area = s.step * length;
    const Vector2d middle((s.low + s.high) / 2, s.across);
    out.area += area;
    first += area * middle;
    second += area * (middle * middle.transpose());
    second.diagonal() += area / 12 * Vector2d(length * length, s.step * s.step);
  }
  if (out.area <= 0) return out;
  out.centroid = first / out.area;
  out.secondMoment = second - out.area * out.centroid * out.centroid.transpose();
  return out;
}

std::vector<double> crossingsOf(const Outline& outline, double b) {
  std::vector<double> crossings;
  for (const std::array<Vector2d, 2>& e : outline) {
    if ((e[0].y() <= b) == (e[1].y() <= b)) continue;
    crossings.push_back(e[0].x() + (b - e[0].y()) / (e[1].y() - e[0].y()) * (e[1].x() - e[0].x()));
  }
  std::sort(crossings.begin(), crossings.end());
  return crossings;
}

Span heightsOf(const Outline& outline) {
  Span out = kNothing;
  for (const std::array<Vector2d, 2>& e : outline) {
    out.low = std::min({out.low, e[0].y(), e[1].y()});
    out.high = std::max({out.high, e[0].y(), e[1].y()});
  }
  return out;
}

}  // namespace

Plane planeAcross(const Vector3d& origin, const Vector3d& normal) {
  int least = 0;
  normal.cwiseAbs().minCoeff(&least);
  const Vector3d u = Vector3d::Unit(least).cross(normal).normalized();
  return {origin, u, normal.cross(u)};
}

SectionMoments planeSection(const TriangleMesh& mesh, const Plane& plane, const PowerSites* sites,
                            std::pair<int, int> pair) {
  const Outline outline = cut(mesh, plane);
  if (outline.empty()) return {};
  const auto [low, high] = heightsOf(outline);
  const double step = (high - low) / kScanLines;
  const std::array<int, 2> cells{pair.first, pair.second};
  const std::size_t count = pair.first == pair.second ? 1 : 2;
  // Of the scan line at `b`, what is inside: one span after the other.
  const auto visitSpans = [&](double b, const auto& visit) {
    std::array<Span, 2> parts = {{{-1e30, 1e30}}};
    for (std::size_t p = 0; sites != nullptr && p < count; ++p)
      parts[p] = cellSpan(*sites, cells[p], plane.origin + b * plane.v, plane.u);
    const std::vector<double> crossings = crossingsOf(outline, b);
    for (std::size_t k = 0; k + 1 < crossings.size(); k += 2)
      for (std::size_t p = 0; p < count; ++p)
        visit(std::max(crossings[k], parts[p].low), std::min(crossings[k + 1], parts[p].high));
  };
  std::vector<SectionSpan> spans;
  for (int line = 0; line < kScanLines; ++line) {
    const double across = low + (line + 0.5) * step;
    visitSpans(across, [&](double from, double to) {
      if (from < to) spans.push_back({from, to, across, step});
    });
  }
  SectionMoments section = momentsOf(spans);
  if (section.area <= 0) return section;
  visitSpans(0, [&](double from, double to) { section.holdsOrigin |= from <= 0 && 0 <= to; });
  section.torsionConstant =
      torsionConstant(spans, section.centroid, std::sqrt(section.secondMoment.trace() / section.area));
  return section;
}

// What is outside on a scan line, gap by gap, hangs together with what it faces on the next line. A hole is what does
// not hang together with the outermost gaps.
bool sectionHasHole(const TriangleMesh& mesh, const Plane& plane) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const Outline outline = cut(mesh, plane);
  const auto [low, high] = heightsOf(outline);
  std::vector<Span> gaps{{-kFar, kFar}};  // below the section
  std::vector<std::array<std::size_t, 2>> facing;
  std::size_t before = 0;  // first gap of the line before
  for (int line = 0; !outline.empty() && line <= kScanLines; ++line) {
    const std::size_t begin = gaps.size();
    std::vector<double> ends{-kFar, kFar};
    if (line < kScanLines) {
      const std::vector<double> crossings = crossingsOf(outline, low + (line + 0.5) * (high - low) / kScanLines);
      ends.insert(ends.begin() + 1, crossings.begin(), crossings.end());
    }
    for (std::size_t k = 0; k + 1 < ends.size(); k += 2) {
      for (std::size_t g = before; g < begin; ++g)
        if (gaps[g].low < ends[k + 1] && ends[k] < gaps[g].high) facing.push_back({g, gaps.size()});
      gaps.push_back({ends[k], ends[k + 1]});
    }
    before = begin;
  }
  DisjointSets sets(gaps.size());
  for (const auto& [a, b] : facing) sets.join(static_cast<int>(a), static_cast<int>(b));
  for (std::size_t g = 0; g < gaps.size(); ++g)
    if (std::isfinite(gaps[g].low) && std::isfinite(gaps[g].high) && sets.of(static_cast<int>(g)) != sets.of(0))
      return true;
  return false;
}

}  // namespace medulla
