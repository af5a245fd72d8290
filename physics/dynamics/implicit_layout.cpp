#include <algorithm>
#include <iterator>

#include "physics/dynamics/implicit_stages.h"

namespace medulla {

namespace {

Quad all(bool free) {
  const double f = free ? 1 : 0;
  return {{f, f, f, 0}};
}

void layOutNodes(const WorldData& d, ImplicitData& s) {
  const Nodes& n = d.nodes;
  const double h2 = s.duration * s.duration;
  s.pull.resize(n.dynamicEnd);
  const auto pullOf = [&](const std::vector<HostRange>& ranges) {
    for (const HostRange& r : ranges)
      for (int i = 4 * r.firstGroup; i < 4 * r.endGroup; ++i)
        s.pull[i] = (h2 + s.duration * r.relaxation) * n.groups[i / 4].stiffness[i % 4];
  };
  pullOf(n.onLinks);
  pullOf(n.onSpheres);
  for (int i = 0; i < n.dynamicEnd; ++i) {
    const double m = n.mass[i], block = m + s.pull[i] + h2 * n.groups[i / 4].edges[i % 4];
    const bool free = n.inverseMass[i] > 0;
    s.nodeMobility.push_back(free ? 1 / block : 0);
    s.carriedMass.push_back(free ? m * (1 - m / block) : s.pull[i]);
  }
}

// What attachments on frames are stiffer along the normal n, e n n^T on c of all else:
//   (c + e n n^T)^-1 = 1/c - e / (c (c + e)) n n^T.
void layOutNormals(const WorldData& d, ImplicitData& s) {
  const Nodes& n = d.nodes;
  for (const HostRange& r : n.onSpheres) {
    if (!r.onFrames) continue;
    s.normalMobility.resize(n.dynamicEnd, 0);
    s.carriedNormal.resize(n.dynamicEnd, 0);
    for (int i = 4 * r.firstGroup; i < 4 * r.endGroup; ++i) {
      const double area = vectorOf(n.groups[i / 4].restArea, i % 4).squaredNorm(), mass = n.mass[i];
      const double excess = s.duration * (s.duration + r.relaxation) * area *
                            d.identified.skin[d.identified.ofNodeGroup[i / 4]].normalExcess[i % 4];
      if (excess == 0) continue;
      s.normalMobility[i] = excess * s.nodeMobility[i] * s.nodeMobility[i] / (1 + excess * s.nodeMobility[i]) / area;
      s.carriedNormal[i] = n.inverseMass[i] > 0 ? mass * mass * s.normalMobility[i] : excess / area;
    }
  }
}

}  // namespace

void layOutImplicit(const WorldData& d, double duration, ImplicitData& s) {
  s.duration = duration;
  s.inertia.resize(d.spheres.groups.size(), InertiaGroup{});
  for (int i = 0; i < d.spheres.count; ++i) {
    const SphereGroup& g = d.spheres.groups[i / 4];
    const int l = i % 4;
    s.freedom.push_back(all(g.inverseMass[l] > 0));
    s.freedom.push_back(all(g.freeToTurn[l] > 0));
    setSymmetric(s.inertia[i / 4].entry, l, inverseInertiaOf(g, l).inverse());
  }
  for (int i = 0; i < d.nodes.dynamicEnd; ++i) s.freedom.push_back(all(d.nodes.inverseMass[i] > 0));
  layOutNodes(d, s);
  layOutNormals(d, s);
  for (const BodyRange& r : d.ranges) {
    double& mass = s.bodyMass.emplace_back();
    for (const int i : spheresOf(r)) mass += d.spheres.groups[i / 4].mass[i % 4];
    for (const int i : r.node) mass += d.nodes.mass[i];
    s.totalMass += mass;
  }
  for (std::size_t b = 0; b < d.ranges.size(); ++b)
    s.bodyOf.insert(s.bodyOf.end(), 2 * static_cast<std::size_t>(d.ranges[b].sphereCount), static_cast<int>(b));
  for (int i = 0; i < d.nodes.dynamicEnd; ++i) s.bodyOf.push_back(d.nodes.groupHosts[i / 4].body);
  for (std::vector<double>* of : {&s.workOfPaths, &s.workOfLoads, &s.sums}) of->resize(d.ranges.size());
  for (std::vector<EnergyBalance>* of : {&s.bodies, &s.islands}) of->resize(d.ranges.size());
  s.joined = DisjointSets(d.ranges.size());
  s.island.resize(d.ranges.size());
  s.verdicts.resize(d.ranges.size());
  for (int k = 0; k < d.links.count; ++k) {
    const LinkGroup& g = d.links.groups[k / 4];
    s.pairs.push_back({static_cast<int>(g.sphere0[k % 4]), static_cast<int>(g.sphere1[k % 4])});
  }
  listIdentifiedPairs(d, s.pairs);
  layOutStars(d, s);
  s.stiffPairs = static_cast<int>(s.pairs.size());
  layOutMassOnFrames(d, s);
  std::vector<std::array<int, 2>> links;
  std::copy_if(s.pairs.begin(), s.pairs.end(), std::back_inserter(links),
               [](const auto& pair) { return pair[1] >= 0; });
  s.spheres.analyse(d.spheres.count, links);
  s.diagonal.resize(d.spheres.count);
  s.beside.resize(s.stiffPairs);
  s.lumped.resize(d.spheres.count);
  s.lumpedBeside.resize(s.pairs.size());
  s.blocks.resize(d.spheres.count);
  for (Motion* m : {&s.balance, &s.kept, &s.before.motion, &s.start.motion, &s.motion, &s.residual, &s.remaining,
                    &s.change, &s.direction, &s.image, &s.preconditioned})
    m->resize(s.freedom.size());
  s.carried.resize(d.nodes.dynamicEnd);
  s.given.resize(d.nodes.dynamicEnd);
}

}  // namespace medulla
