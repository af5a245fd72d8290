#include <Eigen/Geometry>
#include <algorithm>

#include "physics/dynamics/identified_measures.h"
#include "physics/dynamics/identified_stages.h"
#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/link_blocks.h"
#include "physics/dynamics/pair_numbers.h"
#include "physics/dynamics/skin_map.h"

// Identified links and skins in an implicit step: G^T K G of the measures, and the skins' map with its transpose.
namespace medulla {

namespace {

// Rates of the six measures for one motion of the two frames, in the order of the stiffness.
struct Column {
  Lanes c[6];
};

Column columnOf(const IdentifiedLinkGroup& link, const LinkTurn& m, const Lanes3& velocity, const Lanes3& spin,
                const Lanes3& meanSpin) {
  const auto seen = [&](const Lanes3& a) { return rotateBack(m.middle, a); };
  const LinkRates r = measuredRates(link, m, ratesOf(link, m, seen(velocity), seen(spin), seen(meanSpin)));
  const Lanes3 w = link.lengthScale * r.w;
  return {{r.t.x, r.t.y, r.t.z, w.x, w.y, w.z}};
}

// By the line between the frames (three columns), and by the turning of sphere 0 and of sphere 1, on whose arms they
// are.
void setColumns(const IdentifiedLinkGroup& link, const LinkTurn& m, const Lanes3& arm0, const Lanes3& arm1,
                Column (&g)[9]) {
  const Lanes half = splat(0.5), minus = splat(-1), zero = splat(0), one = splat(1);
  const Lanes3 none = zeroVectors();
  for (int k = 0; k < 3; ++k) {
    const Lanes3 e{k == 0 ? one : zero, k == 1 ? one : zero, k == 2 ? one : zero};
    g[k] = columnOf(link, m, e, none, none);
    g[3 + k] = columnOf(link, m, cross(arm0, e), minus * e, half * e);
    g[6 + k] = columnOf(link, m, cross(e, arm1), e, half * e);
  }
}

Lanes3 gatherArms(const std::vector<CarriedFrame>& carried, const std::uint32_t* i) {
  return gather(carried[i[0]].worldArm, carried[i[1]].worldArm, carried[i[2]].worldArm, carried[i[3]].worldArm);
}

Column timesStiffness(const IdentifiedLinkGroup& link, const Column& a) {
  Column out;
  for (int i = 0; i < 6; ++i) {
    out.c[i] = splat(0);
    for (int j = 0; j < 6; ++j) out.c[i] = fma(link.stiffness[entryOf(i, j)], a.c[j], out.c[i]);
  }
  return out;
}

// scale a^T K b for the three columns each from a and b on.
Matrix3Lanes product(const Column* a, const Column* kb, Lanes scale) {
  Lanes entry[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      entry[i][j] = a[i].c[0] * kb[j].c[0];
      for (int e = 1; e < 6; ++e) entry[i][j] = fma(a[i].c[e], kb[j].c[e], entry[i][j]);
      entry[i][j] = scale * entry[i][j];
    }
  }
  Matrix3Lanes out;
  for (int i = 0; i < 3; ++i) out.row[i] = {entry[i][0], entry[i][1], entry[i][2]};
  return out;
}

void setBlocks(const IdentifiedLinkGroup& link, const Column (&g)[9], Lanes scale, LinkBlocks& to) {
  Column kg[9];
  for (int j = 0; j < 9; ++j) kg[j] = timesStiffness(link, g[j]);
  to.line = product(g, kg, scale);
  to.line0 = product(g, kg + 3, scale);
  to.line1 = product(g, kg + 6, scale);
  to.turn0 = product(g + 3, kg + 3, scale);
  to.between = product(g + 3, kg + 6, scale);
  to.turn1 = product(g + 6, kg + 6, scale);
}

// A sphere's place in the star of a cell, which grows by those that it lacks; -1 of what is held.
int placeIn(std::vector<int>& star, int sphere) {
  if (sphere < 0) return -1;
  const auto found = std::find(star.begin(), star.end(), sphere);
  if (found != star.end()) return static_cast<int>(found - star.begin());
  star.push_back(sphere);
  return static_cast<int>(star.size()) - 1;
}

// The stars' spheres, each by its own; sets starPlace, counted from each star's first.
std::vector<std::vector<int>> collectStars(const WorldData& d, ImplicitData& s) {
  std::vector<std::vector<int>> stars(d.spheres.count);
  const int first = s.linkPairs - d.identified.linkCount;
  for (int k = 0; k < d.identified.linkCount; ++k) {
    const auto [sphere0, sphere1] = s.pairs[first + k];
    std::array<int, 4>& places = s.starPlace[k];
    places[0] = placeIn(stars[sphere0], sphere0);
    places[1] = placeIn(stars[sphere0], sphere1);
    if (sphere1 < 0) continue;
    places[2] = placeIn(stars[sphere1], sphere0);
    places[3] = placeIn(stars[sphere1], sphere1);
  }
  return stars;
}

// What a link's measures add to the strain of one cell, by the motions of its two spheres.
void addStrainRates(const Lanes (&strain)[6], const Column (&g)[9], int lane, int own, int other, ImplicitData& s) {
  Vector6 of0 = Vector6::Zero(), of1 = of0;
  for (int e = 0; e < 6; ++e) {
    for (int k = 0; k < 3; ++k) {
      const double line = strain[e][lane] * g[k].c[e][lane];
      of0[k] -= line;
      of1[k] += line;
      of0[3 + k] += strain[e][lane] * g[3 + k].c[e][lane];
      of1[3 + k] += strain[e][lane] * g[6 + k].c[e][lane];
    }
  }
  s.starRate[own] += of0;
  if (other >= 0) s.starRate[other] += of1;
}

void addStrainRates(const IdentifiedLinkGroup& link, const Column (&g)[9], int lane, const std::array<int, 4>& places,
                    ImplicitData& s) {
  if (places[0] >= 0) addStrainRates(link.strain0, g, lane, places[0], places[1], s);
  if (places[2] >= 0) addStrainRates(link.strain1, g, lane, places[2], places[3], s);
}

void addStarBlocks(ImplicitData& s) {
  for (const StrainStar& star : s.stars) {
    const double scale = s.duration * (s.duration + star.relaxation);
    const int* pair = s.starPair.data() + star.firstPair;
    for (int a = star.first; a < star.end; ++a) {
      const Vector6 scaled = scale * s.starRate[a];
      s.diagonal[s.starSphere[a]].noalias() += scaled * s.starRate[a].transpose();
      for (int b = a + 1; b < star.end; ++b, ++pair)
        if (*pair >= 0)
          s.beside[*pair].noalias() += scaled * s.starRate[b].transpose();
        else
          s.beside[-1 - *pair].noalias() += s.starRate[b] * scaled.transpose();
    }
  }
}

}  // namespace

void layOutStars(const WorldData& d, ImplicitData& s) {
  const Identified& identified = d.identified;
  s.linkPairs = static_cast<int>(s.pairs.size());
  s.starPlace.assign(identified.linkCount, {-1, -1, -1, -1});
  if (identified.strains.empty()) return;
  const std::vector<std::vector<int>> stars = collectStars(d, s);
  PairNumbers numbers(s.pairs);
  for (std::size_t i = 0; i < stars.size(); ++i) {
    const int first = static_cast<int>(s.starSphere.size());
    s.stars.push_back({first, first + static_cast<int>(stars[i].size()), static_cast<int>(s.starPair.size()), 0});
    s.starSphere.insert(s.starSphere.end(), stars[i].begin(), stars[i].end());
    for (std::size_t a = 0; a < stars[i].size(); ++a)
      for (std::size_t b = a + 1; b < stars[i].size(); ++b) s.starPair.push_back(numbers.of(stars[i][a], stars[i][b]));
  }
  s.starRate.resize(s.starSphere.size());
  const int first = s.linkPairs - identified.linkCount;
  int next = 0;
  for (const IdentifiedLinkGroup& link : identified.links) {
    for (int lane = 0; lane < 4; ++lane) {
      if (link.frame0[lane] == link.frame1[lane]) continue;
      const std::array<int, 2> ends = s.pairs[first + next];
      std::array<int, 4>& places = s.starPlace[next++];
      for (int p = 0; p < 4; ++p) {
        if (places[p] < 0) continue;
        StrainStar& star = s.stars[ends[p / 2]];
        places[p] += star.first;
        star.relaxation = link.relaxation[lane];
      }
    }
  }
}

void addIdentifiedStiffness(const WorldData& d, ImplicitData& s) {
  const Identified& identified = d.identified;
  std::fill(s.starRate.begin(), s.starRate.end(), Vector6::Zero());
  std::fill(s.beside.begin() + s.linkPairs, s.beside.end(), Block6::Zero());
  int next = d.links.count;
  for (const IdentifiedLinkGroup& link : identified.links) {
    const FrameState* frames = identified.frames.data();
    const LinkTurn m = measureLink(link, gatherFrames(frames, link.frame0), gatherFrames(frames, link.frame1));
    Column g[9];
    setColumns(link, m, gatherArms(identified.carried, link.frame0), gatherArms(identified.carried, link.frame1), g);
    const Lanes h = splat(s.duration);
    LinkBlocks blocks;
    setBlocks(link, g, h * (h + link.relaxation), blocks);
    int pair[4];
    for (int lane = 0; lane < 4; ++lane) {
      const bool fillsUp = link.frame0[lane] == link.frame1[lane];
      if (!fillsUp) addStrainRates(link, g, lane, s.starPlace[next - d.links.count], s);
      pair[lane] = fillsUp ? -1 : next++;
    }
    addLinkBlocks(blocks, pair, s);
  }
  addStarBlocks(s);
}

void listIdentifiedPairs(const WorldData& d, std::vector<std::array<int, 2>>& pairs) {
  const Identified& s = d.identified;
  for (const IdentifiedLinkGroup& link : s.links)
    for (int lane = 0; lane < 4; ++lane)
      if (link.frame0[lane] != link.frame1[lane])
        pairs.push_back({s.carried[link.frame0[lane]].sphere, s.carried[link.frame1[lane]].sphere});
}

void setIdentifiedFrameRates(WorldData& d, const Motion& motion) {
  Identified& s = d.identified;
  for (std::size_t i = 0; i < s.frames.size(); ++i) {
    const CarriedFrame& c = s.carried[i];
    if (c.sphere < 0) continue;
    const Lanes omega = load(motion[2 * c.sphere + 1]);
    store(s.frames[i].velocity, load(motion[2 * c.sphere]) + crossProduct(omega, load(c.worldArm)));
    store(s.frames[i].angularVelocity, omega);
  }
}

void carryOnFrames(WorldData& d, const HostRange& range, std::vector<Quad>& carried) {
  Identified& s = d.identified;
  const SkinHost& host = s.hosts[s.skin[s.ofNodeGroup[range.firstGroup]].host];
  SkinTermState* states = &s.termStates[host.firstTerms];
  const HostFrame own = seeFrames<true>(s, host, states);
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const SkinPlace place = placeSkin<true>(s, s.skin[s.ofNodeGroup[g]], states);
    const Lanes3 along = cross(own.omega, rotate(own.rotation, place.offset));
    storeFour(own.velocity + along + rotate(own.rotation, place.offsetRate), carried, 4 * g);
  }
}

void returnImpulsesToFrames(WorldData& d, const HostRange& range, const std::vector<Quad>& impulses) {
  FrameReturn back(d, range);
  for (int g = range.firstGroup; g < range.endGroup; ++g) back.add(g, gatherFour(impulses, 4 * g), zeroVectors());
  back.finish();
}

void stiffenNormals(const WorldData& d, ImplicitData& s, const HostRange& range) {
  const Lanes scale = splat(s.duration * (s.duration + range.relaxation));
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes excess = d.identified.skin[d.identified.ofNodeGroup[g]].normalExcess;
    const Lanes lifted = scale * excess * dot(d.nodes.area[g], gatherFour(s.carried, 4 * g));
    storeFour(fma(lifted, d.nodes.area[g], gatherFour(s.given, 4 * g)), s.given, 4 * g);
  }
}

void returnFrameImpulses(const WorldData& d, Motion& motion) {
  const Identified& s = d.identified;
  for (std::size_t i = 0; i < s.frames.size(); ++i) {
    const CarriedFrame& c = s.carried[i];
    if (c.sphere < 0) continue;
    giveToSphere(c, s.loads[i], motion[2 * c.sphere], motion[2 * c.sphere + 1]);
  }
}

}  // namespace medulla
