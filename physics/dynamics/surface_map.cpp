#include "physics/dynamics/anchor_row.h"
#include "physics/dynamics/implicit_stages.h"

namespace medulla {

namespace {

Lanes3 gatherMotion(const Motion& m, const std::uint32_t* i, int part) {
  return gather(m[2 * i[0] + part], m[2 * i[1] + part], m[2 * i[2] + part], m[2 * i[3] + part]);
}

void setFrameRates(const LinkGroup& g, const Motion& motion, LinkFrame& f) {
  const Lanes3 omega0 = gatherMotion(motion, g.sphere0, 1), omega1 = gatherMotion(motion, g.sphere1, 1);
  const Lanes3 v0 = gatherMotion(motion, g.sphere0, 0) + cross(omega0, f.arm0);
  const Lanes3 v1 = gatherMotion(motion, g.sphere1, 0) + cross(omega1, f.arm1);
  f.originVelocity = v0;
  f.lineVelocity = v1 - v0;
  const Lanes lengthRate = dot(f.n, f.lineVelocity);
  const Lanes3 nRate = f.inverseLength * fnma(lengthRate, f.n, f.lineVelocity);
  f.turning = cross(f.n, nRate);
  f.spin0 = dot(f.spinAxis0, omega0) - dot(f.spinLever0, nRate);
  f.spinAlong = dot(f.spinAxis1, omega1) - dot(f.spinLever1, nRate) - f.spin0;
  if (!g.hasBeams) return;
  f.thicknessRate = f.thicknessSlope * lengthRate;
  setBendRates(g, omega0, omega1, lengthRate, f);
}

}  // namespace

void returnLinkLoads(const WorldData& d, const std::vector<LinkLoads>& loads, Motion& motion) {
  for (std::size_t k = 0; k < d.links.groups.size(); ++k) {
    const LinkFrame& f = d.links.frames[k];
    const LinkGroup& g = d.links.groups[k];
    const EndLoads e = sphereLoads(g, f, gatherLoads(&loads[4 * k], g.hasBeams));
    Quad q[4][4];
    const Lanes3* parts[4] = {&e.force0, &e.torque0, &e.force1, &e.torque1};
    for (int p = 0; p < 4; ++p) storeFour(*parts[p], q[p], 0);
    const int end = std::min(4, d.links.count - 4 * static_cast<int>(k));
    for (int l = 0; l < end; ++l) {
      addTo(motion[2 * g.sphere0[l]], load(q[0][l]));
      addTo(motion[2 * g.sphere0[l] + 1], load(q[1][l]));
      addTo(motion[2 * g.sphere1[l]], load(q[2][l]));
      addTo(motion[2 * g.sphere1[l] + 1], load(q[3][l]));
    }
  }
}

void carryMotion(WorldData& d, const Motion& motion, std::vector<Quad>& carried) {
  for (std::size_t k = 0; k < d.links.groups.size(); ++k) setFrameRates(d.links.groups[k], motion, d.links.frames[k]);
  for (const HostRange& range : d.nodes.onLinks) {
    const LinkHost h = linkHost(d, range.host);
    for (int g = range.firstGroup; g < range.endGroup; ++g) {
      const NodeGroup& group = d.nodes.groups[g];
      const Lanes3 omega = fma(fma(group.twistShare, h.spinAlong, h.spin0), h.n, h.turning);
      const Lanes3& offset = d.nodes.offset[g];
      const Lanes3 base = baseVelocityOf(h, group, offset, dot(h.axisU, offset), dot(h.axisV, offset));
      storeFour(base + cross(omega, offset), carried, 4 * g);
    }
  }
  setIdentifiedFrameRates(d, motion);
  for (const HostRange& range : d.nodes.onSpheres) {
    if (range.onFrames) {
      carryOnFrames(d, range, carried);
      continue;
    }
    const Lanes3 v = splat(motion[2 * range.host]), omega = splat(motion[2 * range.host + 1]);
    for (int g = range.firstGroup; g < range.endGroup; ++g)
      storeFour(v + cross(omega, d.nodes.offset[g]), carried, 4 * g);
  }
}

void returnImpulses(WorldData& d, const std::vector<Quad>& impulses, Motion& motion) {
  for (const HostRange& range : d.nodes.onLinks) {
    const LinkHost h = linkHost(d, range.host);
    AnchorLoads sum = noLoads();
    for (int g = range.firstGroup; g < range.endGroup; ++g) {
      const Lanes3 impulse = gatherFour(impulses, 4 * g);
      const Lanes3& offset = d.nodes.offset[g];
      addLoads(h, d.nodes.groups[g], offset, impulse, cross(offset, impulse), sum);
    }
    setLoads(h, sum, d.links.loads[range.host]);
  }
  returnLinkLoads(d, d.links.loads, motion);
  for (FrameLoad& load : d.identified.loads) load = {};
  for (const HostRange& range : d.nodes.onSpheres) {
    if (range.onFrames) {
      returnImpulsesToFrames(d, range, impulses);
      continue;
    }
    Lanes3 sum = zeroVectors(), moment = sum;
    for (int g = range.firstGroup; g < range.endGroup; ++g) {
      const Lanes3 impulse = gatherFour(impulses, 4 * g);
      sum = sum + impulse;
      moment = moment + cross(d.nodes.offset[g], impulse);
    }
    addTo(motion[2 * range.host], sumOfLanes(sum));
    addTo(motion[2 * range.host + 1], sumOfLanes(moment));
  }
  returnFrameImpulses(d, motion);
}

namespace {

template <int size>
void addSquare(const Lanes* row, Lanes weight, Lanes* sum) {
  int e = 0;
  for (int i = 0; i < size; ++i) {
    const Lanes scaled = weight * row[i];
    for (int j = i; j < size; ++j, ++e) sum[e] = fma(scaled, row[j], sum[e]);
  }
}

// From the sums that addSquare() made.
template <int size>
Eigen::Matrix<double, size, size> symmetricOf(const Lanes* sum) {
  Eigen::Matrix<double, size, size> m;
  int e = 0;
  for (int i = 0; i < size; ++i)
    for (int j = i; j < size; ++j, ++e) m(i, j) = m(j, i) = sumOfLanes(sum[e]);
  return m;
}

Lanes massesOf(const std::vector<double>& mass, int g) {
  return loadFour(mass, 4 * g);
}

}  // namespace

void addCarriedMass(const WorldData& d, const std::vector<double>& mass, std::vector<Block6>& diagonal,
                    std::vector<Block6>& beside) {
  for (const HostRange& range : d.nodes.onLinks) {
    const OneLink link = oneLink(d, range.host);
    Lanes sum[78];
    for (Lanes& s : sum) s = splat(0);
    for (int g = range.firstGroup; g < range.endGroup; ++g)
      for (int k = 0; k < 3; ++k)
        addSquare<12>(anchorRow(link, d.nodes.groups[g], d.nodes.offset[g], unit(k)).c, massesOf(mass, g), sum);
    const Eigen::Matrix<double, 12, 12> m = symmetricOf<12>(sum);
    diagonal[link.sphere0] += m.topLeftCorner<6, 6>();
    diagonal[link.sphere1] += m.bottomRightCorner<6, 6>();
    beside[range.host] += m.topRightCorner<6, 6>();
  }
  for (const HostRange& range : d.nodes.onSpheres) {
    if (range.onFrames) continue;
    Lanes sum[21];
    for (Lanes& s : sum) s = splat(0);
    for (int g = range.firstGroup; g < range.endGroup; ++g) {
      for (int k = 0; k < 3; ++k) {
        const Lanes3 force = unit(k), torque = cross(d.nodes.offset[g], force);
        const Lanes row[6] = {force.x, force.y, force.z, torque.x, torque.y, torque.z};
        addSquare<6>(row, massesOf(mass, g), sum);
      }
    }
    diagonal[range.host] += symmetricOf<6>(sum);
  }
}

}  // namespace medulla
