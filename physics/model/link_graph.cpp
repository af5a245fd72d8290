#include "physics/model/link_graph.h"

#include <algorithm>
#include <cmath>

#include "physics/model/disjoint_sets.h"

namespace medulla {

namespace {

struct Candidate {
  double contactRatio, score;
  std::array<int, 2> spheres;
};

// Asked of the surface, not of points on the way: those would miss a slit.
bool staysInside(const SurfaceTree& tree, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  constexpr int kNoVertex = -1;
  return isInside(tree, 0.5 * (a + b)) && !segmentCrosses(tree, a, b, kNoVertex);
}

std::vector<Candidate> candidatesOf(const SurfaceTree& tree, const std::vector<MassProperties>& cells,
                                    const ContactAreas& contacts) {
  std::vector<Candidate> candidates;
  for (const auto& [pair, area] : contacts) {
    const MassProperties &a = cells[pair.first], &b = cells[pair.second];
    const double side = std::cbrt(std::min(a.volume, b.volume));
    const double ratio = area / (side * side), last = staysInside(tree, a.centroid, b.centroid) ? 1 : 1e-3;
    candidates.push_back({ratio, last * ratio, {pair.first, pair.second}});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  return candidates;
}

}  // namespace

SphereLinks linkCells(const SurfaceTree& tree, const std::vector<MassProperties>& cells, const ContactAreas& contacts,
                      const std::vector<Ball>& balls) {
  constexpr int degreeMax = 12;
  constexpr double contactRatioMin = 0.15;  // cells that only share a corner or an edge fall below
  const std::vector<Candidate> candidates = candidatesOf(tree, cells, contacts);
  SphereLinks links;
  std::vector<Candidate> further;
  DisjointSets sets(balls.size());
  std::vector<int> degree(balls.size(), 0);
  const auto add = [&](const std::array<int, 2>& pair) {
    links.push_back(pair);
    ++degree[pair[0]];
    ++degree[pair[1]];
  };
  for (const Candidate& c : candidates)
    if (sets.join(c.spheres[0], c.spheres[1]))
      add(c.spheres);
    else if (c.contactRatio > contactRatioMin)
      further.push_back(c);
  for (const Candidate& c : further)
    if (degree[c.spheres[0]] < degreeMax && degree[c.spheres[1]] < degreeMax) add(c.spheres);
  joinComponents(balls, links);
  std::sort(links.begin(), links.end());
  return links;
}

void joinComponents(const std::vector<Ball>& balls, SphereLinks& links) {
  const int count = static_cast<int>(balls.size());
  DisjointSets sets(balls.size());
  for (const std::array<int, 2>& link : links) sets.join(link[0], link[1]);
  for (;;) {
    double shortest = std::numeric_limits<double>::infinity();
    std::array<int, 2> best{};
    for (int i = 0; i < count; ++i) {
      for (int j = i + 1; j < count; ++j) {
        const double length = (balls[i].centre - balls[j].centre).norm();
        if (length < shortest && sets.of(i) != sets.of(j)) {
          shortest = length;
          best = {i, j};
        }
      }
    }
    if (!std::isfinite(shortest)) return;
    links.push_back(best);
    sets.join(best[0], best[1]);
  }
}

int countComponents(int spheres, const SphereLinks& links) {
  DisjointSets sets(static_cast<std::size_t>(spheres));
  int components = spheres;
  for (const std::array<int, 2>& link : links) components -= sets.join(link[0], link[1]) ? 1 : 0;
  return components;
}

std::vector<int> linkCounts(std::size_t spheres, const std::vector<ElasticLink>& links) {
  std::vector<int> counts(spheres, 0);
  for (const ElasticLink& link : links) {
    ++counts[link.sphere0];
    ++counts[link.sphere1];
  }
  return counts;
}

}  // namespace medulla
