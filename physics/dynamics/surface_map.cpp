#include "physics/dynamics/anchor.h"
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
  f.thicknessRate = f.thicknessSlope * lengthRate;
}

// What forces on a link's anchors do to its two spheres; the transpose of setFrameRates() and the anchors' velocities.
struct EndLoads {
  Lanes3 force0, torque0, force1, torque1;
};

EndLoads endLoads(const LinkFrame& f, const Lanes3& sum, const Lanes3& along, const Lanes3& moment, Lanes twist1,
                  Lanes thickness) {
  const Lanes twist0 = dot(f.n, moment) - twist1;
  const Lanes3 byDirection = cross(moment, f.n) - twist0 * f.spinLever0 - twist1 * f.spinLever1;
  const Lanes3 swing = fma(f.inverseLength, byDirection, (f.thicknessSlope * thickness) * f.n);
  EndLoads out;
  out.force1 = along + swing;
  out.force0 = sum - out.force1;
  out.torque0 = fma(twist0, f.spinAxis0, cross(f.arm0, out.force0));
  out.torque1 = fma(twist1, f.spinAxis1, cross(f.arm1, out.force1));
  return out;
}

void addTo(Quad& q, Lanes a) {
  store(q, load(q) + a);
}

void returnFromLinks(WorldData& d, Motion& motion) {
  for (std::size_t k = 0; k < d.links.groups.size(); ++k) {
    const LinkFrame& f = d.links.frames[k];
    const LinkGroup& g = d.links.groups[k];
    const EndLoads e = endLoads(f, f.loadSum, f.loadAlong, f.loadMoment, f.loadTwist, f.loadThickness);
    Quad q[4][4];
    const Lanes3* parts[4] = {&e.force0, &e.torque0, &e.force1, &e.torque1};
    for (int p = 0; p < 4; ++p) {
      Lanes a = parts[p]->x, b = parts[p]->y, c = parts[p]->z, w = splat(0);
      transpose(a, b, c, w);
      store(q[p][0], a);
      store(q[p][1], b);
      store(q[p][2], c);
      store(q[p][3], w);
    }
    const int end = std::min(4, d.links.count - 4 * static_cast<int>(k));
    for (int l = 0; l < end; ++l) {
      addTo(motion[2 * g.sphere0[l]], load(q[0][l]));
      addTo(motion[2 * g.sphere0[l] + 1], load(q[1][l]));
      addTo(motion[2 * g.sphere1[l]], load(q[2][l]));
      addTo(motion[2 * g.sphere1[l] + 1], load(q[3][l]));
    }
  }
}

}  // namespace

void carryMotion(WorldData& d, const Motion& motion, std::vector<Quad>& carried) {
  for (std::size_t k = 0; k < d.links.groups.size(); ++k) setFrameRates(d.links.groups[k], motion, d.links.frames[k]);
  for (const HostRange& range : d.nodes.onLinks) {
    const LinkHost h = linkHost(d, range.host);
    for (int g = range.firstGroup; g < range.endGroup; ++g) {
      const Lanes along = d.nodes.groups[g].along;
      const Lanes3 omega = fma(fma(d.nodes.groups[g].twistShare, h.spinAlong, h.spin0), h.n, h.turning);
      const Lanes3& offset = d.nodes.offset[g];
      const Lanes3 base = fma(along, h.lineVelocity, h.originVelocity);
      storeFour(fma(h.thicknessRate, offset, base + cross(omega, offset)), carried, 4 * g);
    }
  }
  for (const HostRange& range : d.nodes.onSpheres) {
    const Lanes3 v = splat(motion[2 * range.host]), omega = splat(motion[2 * range.host + 1]);
    for (int g = range.firstGroup; g < range.endGroup; ++g)
      storeFour(v + cross(omega, d.nodes.offset[g]), carried, 4 * g);
  }
}

void returnImpulses(WorldData& d, const std::vector<Quad>& impulses, Motion& motion) {
  const Lanes zero = splat(0);
  const Lanes3 none{zero, zero, zero};
  for (LinkFrame& f : d.links.frames) {
    f.loadSum = f.loadAlong = f.loadMoment = none;
    f.loadTwist = f.loadThickness = zero;
  }
  for (const HostRange& range : d.nodes.onLinks) {
    LinkFrame& f = d.links.frames[range.host / 4];
    const int lane = range.host % 4;
    const Lanes3 n = splatLane(f.n, lane);
    Lanes3 sum = none, along = none, moment = none;
    Lanes twist = zero, thickness = zero;
    for (int g = range.firstGroup; g < range.endGroup; ++g) {
      const Lanes s = d.nodes.groups[g].along;
      const Lanes3& offset = d.nodes.offset[g];
      const Lanes3 impulse = gatherFour(impulses, 4 * g), turn = cross(offset, impulse);
      sum = sum + impulse;
      along = fma(s, impulse, along);
      moment = moment + turn;
      twist = fma(d.nodes.groups[g].twistShare, dot(n, turn), twist);
      thickness = thickness + dot(offset, impulse);
    }
    setLoads(f, lane, sumOfLanes(sum, twist), sumOfLanes(along, thickness), sumOfLanes(moment, zero));
  }
  returnFromLinks(d, motion);
  for (const HostRange& range : d.nodes.onSpheres) {
    Lanes3 sum = none, moment = none;
    for (int g = range.firstGroup; g < range.endGroup; ++g) {
      const Lanes3 impulse = gatherFour(impulses, 4 * g);
      sum = sum + impulse;
      moment = moment + cross(d.nodes.offset[g], impulse);
    }
    addTo(motion[2 * range.host], sumOfLanes(sum, zero));
    addTo(motion[2 * range.host + 1], sumOfLanes(moment, zero));
  }
}

namespace {

struct Row12 {
  Lanes c[12];
};

// Rows of J for one direction of four nodes of a link: what a unit force there does to the two spheres.
Row12 linkRow(const LinkFrame& f, const NodeGroup& g, const Lanes3& offset, const Lanes3& direction) {
  const Lanes3 moment = cross(offset, direction);
  const EndLoads e =
      endLoads(f, direction, g.along * direction, moment, g.twistShare * dot(f.n, moment), dot(offset, direction));
  return {{e.force0.x, e.force0.y, e.force0.z, e.torque0.x, e.torque0.y, e.torque0.z, e.force1.x, e.force1.y,
           e.force1.z, e.torque1.x, e.torque1.y, e.torque1.z}};
}

template <int size>
void addSquare(const Lanes* row, Lanes weight, Lanes* sum) {
  int e = 0;
  for (int i = 0; i < size; ++i) {
    const Lanes scaled = weight * row[i];
    for (int j = i; j < size; ++j, ++e) sum[e] = fma(scaled, row[j], sum[e]);
  }
}

LinkFrame oneLink(const LinkFrame& f, int lane) {  // only what linkRow() needs
  LinkFrame out;
  out.n = splatLane(f.n, lane);
  out.arm0 = splatLane(f.arm0, lane);
  out.arm1 = splatLane(f.arm1, lane);
  out.spinAxis0 = splatLane(f.spinAxis0, lane);
  out.spinAxis1 = splatLane(f.spinAxis1, lane);
  out.spinLever0 = splatLane(f.spinLever0, lane);
  out.spinLever1 = splatLane(f.spinLever1, lane);
  out.inverseLength = splat(f.inverseLength[lane]);
  out.thicknessSlope = splat(f.thicknessSlope[lane]);
  return out;
}

Lanes3 unit(int k) {
  const Lanes zero = splat(0), one = splat(1);
  return {k == 0 ? one : zero, k == 1 ? one : zero, k == 2 ? one : zero};
}

Lanes massesOf(const std::vector<double>& mass, int g) {
  return _mm256_loadu_pd(&mass[4 * g]);
}

}  // namespace

void addCarriedMass(const WorldData& d, const std::vector<double>& mass, std::vector<Block6>& diagonal,
                    std::vector<Block6>& beside) {
  for (const HostRange& range : d.nodes.onLinks) {
    const LinkFrame f = oneLink(d.links.frames[range.host / 4], range.host % 4);
    Lanes sum[78];
    for (Lanes& s : sum) s = splat(0);
    for (int g = range.firstGroup; g < range.endGroup; ++g)
      for (int k = 0; k < 3; ++k)
        addSquare<12>(linkRow(f, d.nodes.groups[g], d.nodes.offset[g], unit(k)).c, massesOf(mass, g), sum);
    Eigen::Matrix<double, 12, 12> m;
    int e = 0;
    for (int i = 0; i < 12; ++i)
      for (int j = i; j < 12; ++j, ++e) m(i, j) = m(j, i) = sumOfLanes(sum[e]);
    const LinkGroup& g = d.links.groups[range.host / 4];
    diagonal[g.sphere0[range.host % 4]] += m.topLeftCorner<6, 6>();
    diagonal[g.sphere1[range.host % 4]] += m.bottomRightCorner<6, 6>();
    beside[range.host] += m.topRightCorner<6, 6>();
  }
  for (const HostRange& range : d.nodes.onSpheres) {
    Lanes sum[21];
    for (Lanes& s : sum) s = splat(0);
    for (int g = range.firstGroup; g < range.endGroup; ++g) {
      for (int k = 0; k < 3; ++k) {
        const Lanes3 force = unit(k), torque = cross(d.nodes.offset[g], force);
        const Lanes row[6] = {force.x, force.y, force.z, torque.x, torque.y, torque.z};
        addSquare<6>(row, massesOf(mass, g), sum);
      }
    }
    Block6 m;
    int e = 0;
    for (int i = 0; i < 6; ++i)
      for (int j = i; j < 6; ++j, ++e) m(i, j) = m(j, i) = sumOfLanes(sum[e]);
    diagonal[range.host] += m;
  }
}

}  // namespace medulla
