#include <Eigen/Geometry>
#include <cmath>

#include "physics/dynamics/identified_measures.h"
#include "physics/dynamics/identified_stages.h"
#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/link_blocks.h"
#include "physics/dynamics/skin_map.h"

// Identified links and skins in an implicit step: G^T K G of the measures, and the skins' map with its transpose.
namespace medulla {

namespace {

// Rates of the six measures for one motion of the two frames, in the order of the stiffness: the neo-Hookean measure's
// for that along.
struct Column {
  Lanes c[6];
};

Column columnOf(const IdentifiedLinkGroup& link, const LinkTurn& m, const Lanes3& velocity, const Lanes3& spin,
                const Lanes3& meanSpin) {
  const auto seen = [&](const Lanes3& a) { return rotateBack(m.middle, a); };
  const LinkRates r = ratesOf(link, m, seen(velocity), seen(spin), seen(meanSpin));
  const Lanes3 t = fma((m.slope - splat(1)) * dot(r.t, link.along), link.along, r.t), w = link.lengthScale * r.w;
  return {{t.x, t.y, t.z, w.x, w.y, w.z}};
}

// By the line between the frames (three columns), and by the turning of sphere 0 and of sphere 1, on whose arms they
// are.
void setColumns(const IdentifiedLinkGroup& link, const LinkTurn& m, const Lanes3& arm0, const Lanes3& arm1,
                Column (&g)[9]) {
  const Lanes half = splat(0.5), minus = splat(-1), zero = splat(0), one = splat(1);
  const Lanes3 none{zero, zero, zero};
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

}  // namespace

void addIdentifiedStiffness(const WorldData& d, ImplicitData& s) {
  const Identified& identified = d.identified;
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
    for (int lane = 0; lane < 4; ++lane)  // some fill the group up
      pair[lane] = link.frame0[lane] == link.frame1[lane] ? -1 : next++;
    addLinkBlocks(blocks, pair, s);
  }
}

void listIdentifiedPairs(const WorldData& d, std::vector<std::array<int, 2>>& pairs) {
  const Identified& s = d.identified;
  for (const IdentifiedLinkGroup& link : s.links)
    for (int lane = 0; lane < 4; ++lane)
      if (link.frame0[lane] != link.frame1[lane])
        pairs.push_back({s.carried[link.frame0[lane]].sphere, s.carried[link.frame1[lane]].sphere});
}

void setFrameRates(WorldData& d, const Motion& motion) {
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
  const HomeFrame home = homeFrame(s, host);
  SkinTermState* states = &s.termStates[host.firstTerms];
  seeFrames(s, host, home, states);
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const SkinPlace place = placeSkin<true>(s, s.skin[s.ofNodeGroup[g]], states);
    const Lanes3 along = cross(home.omega, rotate(home.rotation, place.offset));
    storeFour(home.velocity + along + rotate(home.rotation, place.offsetRate), carried, 4 * g);
  }
}

void returnImpulsesToFrames(WorldData& d, const HostRange& range, const std::vector<Quad>& impulses) {
  const Lanes zero = splat(0);
  FrameReturn back(d, range);
  for (int g = range.firstGroup; g < range.endGroup; ++g) back.add(g, gatherFour(impulses, 4 * g), {zero, zero, zero});
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
    const Lanes force = load(s.loads[i].force), torque = load(s.loads[i].torque);
    if (c.sphere < 0) continue;
    Quad &linear = motion[2 * c.sphere], &angular = motion[2 * c.sphere + 1];
    store(linear, load(linear) + force);
    store(angular, load(angular) + torque + crossProduct(load(c.worldArm), force));
  }
}

// Nodes on frames without a link between them have no block to be added to. What bounds the whole from above stands for
// it: |sum J_k x_k|^2 <= (sum a_j) sum |J_k x_k|^2 / a_k for any a, here the share that each sphere has of the node.
void addCarriedMassOnFrames(const WorldData& d, const HostRange& range, const std::vector<double>& mass,
                            std::vector<Block6>& diagonal) {
  for (int i = 4 * range.firstGroup; i < 4 * range.endGroup; ++i) {
    if (mass[i] == 0) continue;
    const HostPoint p = hostPointOnFrames(d, i);
    double whole = 0;
    for (int k = 0; k < p.count; ++k) whole += p.force[k].norm();
    for (int k = 0; k < p.count; ++k) {
      if (p.force[k].isZero(0)) continue;
      Eigen::Matrix<double, 6, 3> rows;
      rows.topRows<3>() = p.force[k];
      rows.bottomRows<3>() = p.torque[k];
      diagonal[p.spheres[k]] += mass[i] * whole / p.force[k].norm() * rows * rows.transpose();
    }
  }
}

}  // namespace medulla
