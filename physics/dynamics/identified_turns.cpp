#include <algorithm>
#include <cmath>

#include "physics/dynamics/angles.h"
#include "physics/dynamics/identified_stages.h"

// A quaternion and its negative are one orientation. Links tell them apart, so that half a turn between two frames is
// no seam. But a link turned beyond kFoldAngle would come to rest one full turn from the body's rest pose: flipping a
// quaternion's sign removes that turn.
namespace medulla {

namespace {

double cosineOfHalf(const Identified& s, std::uint32_t frame0, std::uint32_t frame1) {
  return dotProduct(load(s.frames[frame0].orientation), load(s.frames[frame1].orientation));
}

// `visit(frame0, frame1)` of every link of a body.
template <class Visit>
void visitLinks(const Identified& s, const IdentifiedBody& body, const Visit& visit) {
  for (int g = body.firstLinkGroup; g < body.endLinkGroup; ++g)
    for (int lane = 0; lane < 4; ++lane)
      if (s.links[g].frame0[lane] != s.links[g].frame1[lane])  // some fill the group up
        visit(s.links[g].frame0[lane], s.links[g].frame1[lane]);
}

// Of half the largest angle between linked frames.
double leastCosine(const Identified& s, const IdentifiedBody& body) {
  double least = 1;
  visitLinks(s, body, [&](auto a, auto b) { least = std::min(least, cosineOfHalf(s, a, b)); });
  return least;
}

// On the ridge itself, from either side, a body is pushed both ways, and no implicit step leaves it.
bool isTooFar(double cosine) {
  constexpr double kRidge = 1e-3;  // of the cosine: a tenth of a degree
  return cosine < kFoldCosine + kRidge;
}

struct TurnedLink {
  std::uint32_t frame0, frame1;
  double alike;  // 1: the same orientation
};

// The most alike first, sign or no sign.
std::vector<TurnedLink> sortedLinks(const Identified& s, const IdentifiedBody& body) {
  std::vector<TurnedLink> out;
  visitLinks(s, body, [&](auto a, auto b) { out.push_back({a, b, std::abs(cosineOfHalf(s, a, b))}); });
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.alike > b.alike; });
  return out;
}

void negate(Quad& q) {
  for (double& entry : q.v) entry = -entry;
}

void negateFrames(Identified& s, const std::vector<int>& frames) {
  for (const int frame : frames) negate(s.frames[frame].orientation);
}

// What is held is one group, every sphere one of its own. Links join groups one after the other; where one tells its
// frames a whole turn apart, the smaller group changes its sign if that leaves less energy, or whatever it leaves.
void alignSigns(WorldData& d, const IdentifiedBody& body, bool whateverItLeaves) {
  Identified& s = d.identified;
  std::vector<std::vector<int>> members(s.frames.size());
  std::vector<int> group(s.frames.size());
  int held = -1;
  for (int i = body.firstFrame; i < body.endFrame; ++i) {
    group[i] = i;
    if (s.carried[i].sphere < 0) group[i] = held = held < 0 ? i : held;
    members[group[i]].push_back(i);
  }
  double energy = identifiedLinkEnergy(s, body);
  for (const TurnedLink& link : sortedLinks(s, body)) {
    int to = group[link.frame0], from = group[link.frame1];
    if (to == from) continue;
    if (from == held || (to != held && members[from].size() > members[to].size())) std::swap(to, from);
    if (cosineOfHalf(s, link.frame0, link.frame1) < 0) {
      negateFrames(s, members[from]);
      const double other = identifiedLinkEnergy(s, body);
      if (other < energy || whateverItLeaves) {
        energy = other;
        for (const int frame : members[from]) negate(d.spheres.orientation[s.carried[frame].sphere]);
      } else {
        negateFrames(s, members[from]);
      }
    }
    for (const int frame : members[from]) group[frame] = to;
    members[to].insert(members[to].end(), members[from].begin(), members[from].end());
  }
}

}  // namespace

void dropCostlyTurns(WorldData& d) {
  constexpr double kHalfOf90 = 0.7071067811865476;
  for (IdentifiedBody& body : d.identified.bodies) {
    const double cosine = leastCosine(d.identified, body);
    body.turnedOver = body.turnedOver || cosine < kHalfOf90;
    if (isTooFar(cosine)) alignSigns(d, body, false);
  }
}

void dropWholeTurns(WorldData& d, int body) {
  const IdentifiedBody& of = d.identified.bodies[body];
  if (isTooFar(leastCosine(d.identified, of))) alignSigns(d, of, true);
}

}  // namespace medulla
