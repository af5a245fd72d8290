#include <algorithm>
#include <cstddef>

#include "physics/dynamics/edge_springs.h"
#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/link_blocks.h"

// The linear system of an implicit stage. With J the map from the motion of the spheres to that of the anchors, S the
// spheres' masses and links, M the nodes' masses and G the springs of the surface (attachments and edges, constant
// because they act on displacements):
//
//   | S + J^T G J   -J^T G |  spheres
//   |   -G J         M + G |  nodes
//
// The preconditioner takes D - M for G, D the nodes' own blocks of M + G, and eliminates the nodes exactly: a motion of
// hosts and nodes alike feels no spring in either. Not so with G itself and D for M + G: what D lacks of that, e say,
// weighs such a motion by e^2 / D more than its mass, and stiff or small bodies hovered. Without the pressure, a stiff
// direction per host. Contacts and tools are rows of rank one on top; in the preconditioner a contact stands with its
// own spheres' blocks alone.
namespace medulla {

namespace {

Vector6 blockOf(const Motion& m, std::size_t sphere) {
  const Quad &v = m[2 * sphere], &w = m[2 * sphere + 1];
  return (Vector6() << v.v[0], v.v[1], v.v[2], w.v[0], w.v[1], w.v[2]).finished();
}
void putBlock(const Vector6& b, Motion& m, std::size_t sphere) {
  m[2 * sphere] = {{b[0], b[1], b[2], 0}};
  m[2 * sphere + 1] = {{b[3], b[4], b[5], 0}};
}

// Some of the sphere's freedoms are.
bool isHeld(const ImplicitData& s, std::size_t sphere) {
  return s.freedom[2 * sphere].v[0] == 0 || s.freedom[2 * sphere + 1].v[0] == 0;
}

// Adds the hosts' pressures, each a row of rank one, to the impulses `given` of what stands in `carried`. The factor of
// M + G does without them: conjugate gradients take a few iterations more.
void applyPressure(const WorldData& d, ImplicitData& s) {
  const double h2 = s.duration * s.duration;
  for (const std::vector<HostRange>* ranges : {&d.nodes.onLinks, &d.nodes.onSpheres}) {
    for (const HostRange& range : *ranges) {
      Lanes volume = splat(0);
      for (int g = range.firstGroup; g < range.endGroup; ++g)
        volume = volume + dot(d.nodes.area[g], gatherFour(s.carried, 4 * g));
      const Lanes pressure = splat(h2 * range.bulk * sumOfLanes(volume));
      for (int g = range.firstGroup; g < range.endGroup; ++g)
        storeFour(fma(pressure, d.nodes.area[g], gatherFour(s.given, 4 * g)), s.given, 4 * g);
      if (range.onFrames) stiffenNormals(d, s, range);
    }
  }
}

// given = G (x - carried): impulses of attachments, edges and pressure on the nodes, of which `x` holds the velocities.
void applySurface(const WorldData& d, ImplicitData& s, const Quad* x) {
  std::vector<Quad>& displaced = s.carried;
  for (int i = 0; i < d.nodes.dynamicEnd; ++i) store(displaced[i], load(x[i]) - load(displaced[i]));
  const Lanes h2 = splat(s.duration * s.duration);
  for (int g = 0; g < d.nodes.dynamicEnd / 4; ++g) {
    const Lanes3 own = gatherFour(displaced, 4 * g);
    const Lanes3 edges = pullOfEdges(d.springs, d.nodes.groups.data(), displaced.data(), own, g);
    storeFour(fnma(h2, edges, loadFour(s.pull, 4 * g) * own), s.given, 4 * g);
  }
  applyPressure(d, s);
}

void negate(std::vector<Quad>& q) {
  for (Quad& a : q) store(a, splat(0) - load(a));
}

// The preconditioner's matrix: that of spheres, links and the surface's share in them, `diagonal` and `beside`; of held
// freedoms a row and column of the unit matrix; and of every load the part that each of its spheres would feel alone.
void loadFactor(const WorldData& d, ImplicitData& s, const std::vector<Block6>& diagonal,
                const std::vector<Block6>& beside) {
  s.spheres.clear();
  for (int i = 0; i < d.spheres.count; ++i) {
    Block6& to = s.spheres.diagonal(i);
    to = diagonal[i];
    if (!isHeld(s, i)) continue;
    const Vector6 m = blockOf(s.freedom, i);
    to = m.asDiagonal() * diagonal[i] * m.asDiagonal();
    for (int k = 0; k < 6; ++k)
      if (m[k] == 0) to(k, k) = 1;
  }
  int blocks = 0;
  for (std::size_t k = 0; k < s.pairs.size(); ++k) {
    const auto [i, j] = s.pairs[k];
    if (j < 0) continue;
    if (!isHeld(s, i) && !isHeld(s, j)) {
      s.spheres.addBlock(blocks++, beside[k]);
      continue;
    }
    const Vector6 m0 = blockOf(s.freedom, i), m1 = blockOf(s.freedom, j);
    s.spheres.addBlock(blocks++, m0.asDiagonal() * beside[k] * m1.asDiagonal());
  }
  const int quads = 2 * d.spheres.count;
  for (const LoadRow& row : s.rows) {
    if (row.weight == 0) continue;
    for (int k = row.first; k < row.end; ++k) {
      const int quad = s.rowQuad[k];
      if (quad >= quads || quad % 2 != 0) continue;  // a node; the turning half of the sphere before
      Vector6 c = Vector6::Zero();
      c.head<3>() = vectorOf(s.rowCoefficient[k]);
      if (k + 1 < row.end && s.rowQuad[k + 1] == quad + 1) c.tail<3>() = vectorOf(s.rowCoefficient[k + 1]);
      c = c.cwiseProduct(blockOf(s.freedom, quad / 2));
      s.spheres.diagonal(quad / 2).noalias() += row.weight * c * c.transpose();
    }
  }
}

// D^-1: the velocities that `impulses` give to nodes whose neighbours and hosts stay.
void moveNodes(const WorldData& d, const ImplicitData& s, const Quad* impulses, Quad* out) {
  for (int g = 0; g < d.nodes.dynamicEnd / 4; ++g) {
    const Lanes3 impulse = gatherFour(impulses, 4 * g);
    Lanes3 v = loadFour(s.nodeMobility, 4 * g) * impulse;
    if (!s.normalMobility.empty()) {
      const Lanes3& area = d.nodes.area[g];
      v = fnma(loadFour(s.normalMobility, 4 * g) * dot(area, impulse), area, v);
    }
    storeFour(v, out, 4 * g);
  }
}

void precondition(WorldData& d, ImplicitData& s, const Motion& r, Motion& z) {
  const std::size_t first = 2 * static_cast<std::size_t>(d.spheres.count);
  z = r;
  if (d.nodes.dynamicEnd > 0) {
    // Spheres: r_s + J^T F r_n, F = 1 - D^-1 M
    moveNodes(d, s, r.data() + first, s.given.data());
    for (int i = 0; i < d.nodes.dynamicEnd; ++i)
      store(s.given[i], fnma(splat(d.nodes.mass[i]), load(s.given[i]), load(r[first + i])));
    returnImpulses(d, s.given, z);
  }
  for (std::size_t i = 0; i < s.blocks.size(); ++i) s.blocks[i] = blockOf(z, i).cwiseProduct(blockOf(s.freedom, i));
  s.spheres.solve(s.blocks);
  for (std::size_t i = 0; i < s.blocks.size(); ++i) putBlock(s.blocks[i], z, i);
  if (d.nodes.dynamicEnd > 0) {
    // Nodes: J z_s + D^-1 (r_n - M J z_s)
    carryMotion(d, z, s.carried);
    for (int i = 0; i < d.nodes.dynamicEnd; ++i)
      store(s.given[i], fnma(splat(d.nodes.mass[i]), load(s.carried[i]), load(r[first + i])));
    moveNodes(d, s, s.given.data(), z.data() + first);
    for (int i = 0; i < d.nodes.dynamicEnd; ++i) addTo(z[first + i], load(s.carried[i]));
  }
  hold(s.freedom, z);
}

}  // namespace

void hold(const std::vector<Quad>& freedom, Motion& m) {
  for (std::size_t i = 0; i < m.size(); ++i) store(m[i], load(freedom[i]) * load(m[i]));
}

double product(const Motion& a, const Motion& b) {
  Lanes sum = splat(0);
  for (std::size_t i = 0; i < a.size(); ++i) sum = fma(load(a[i]), load(b[i]), sum);
  return sumOfLanes(sum);
}

void addScaled(double f, const Motion& b, Motion& a) {
  for (std::size_t i = 0; i < a.size(); ++i) store(a[i], fma(splat(f), load(b[i]), load(a[i])));
}

static void setMasses(const WorldData& d, ImplicitData& s) {
  const Lanes zero = splat(0);
  const Matrix3Lanes none = zeroMatrix();
  for (int i = 0; i < d.spheres.count; i += 4) {
    const Spheres& from = d.spheres;
    const Rotation r = rotationsFour(from.orientation, i);
    const Lanes(&inertia)[6] = s.inertia[i / 4].entry;
    const Lanes mass = from.groups[i / 4].mass;
    Matrix3Lanes turning = none;  // R I R^T, of the columns of R and of R I
    addOuter(rotate(r, {inertia[0], inertia[3], inertia[4]}), r.x, turning);
    addOuter(rotate(r, {inertia[3], inertia[1], inertia[5]}), r.y, turning);
    addOuter(rotate(r, {inertia[4], inertia[5], inertia[2]}), r.z, turning);
    const int end = std::min(4, from.count - i);
    visitBlocks({{{mass, zero, zero}, {zero, mass, zero}, {zero, zero, mass}}}, none, none, turning,
                [&](int lane, int k, Lanes quad) {
                  if (lane < end) _mm256_storeu_pd(s.diagonal[i + lane].data() + 4 * k, quad);
                });
  }
}

bool assembleSystem(WorldData& d, ImplicitData& s, bool definite) {
  setMasses(d, s);
  addLinkStiffness(d, s, definite);
  if (d.nodes.dynamicEnd > 0) {
    s.lumped = s.diagonal;
    std::fill(std::copy(s.beside.begin(), s.beside.end(), s.lumpedBeside.begin()), s.lumpedBeside.end(),
              Block6::Zero());
    addCarriedMass(d, s.carriedMass, s.lumped, s.lumpedBeside);
    addMassOnFrames(d, s);
    loadFactor(d, s, s.lumped, s.lumpedBeside);
  } else {
    loadFactor(d, s, s.diagonal, s.beside);
  }
  return s.spheres.factorise();
}

void applySystem(WorldData& d, ImplicitData& s, const Motion& x, Motion& y) {
  const std::size_t first = 2 * static_cast<std::size_t>(d.spheres.count);
  for (std::size_t i = 0; i < s.blocks.size(); ++i) s.blocks[i].noalias() = s.diagonal[i] * blockOf(x, i);
  for (std::size_t k = 0; k < s.beside.size(); ++k) {
    const auto [i, j] = s.pairs[k];
    if (j < 0) continue;
    s.blocks[i].noalias() += s.beside[k] * blockOf(x, j);
    s.blocks[j].noalias() += s.beside[k].transpose() * blockOf(x, i);
  }
  for (std::size_t i = 0; i < s.blocks.size(); ++i) putBlock(s.blocks[i], y, i);
  if (d.nodes.dynamicEnd > 0) {
    carryMotion(d, x, s.carried);
    applySurface(d, s, x.data() + first);
    for (int i = 0; i < d.nodes.dynamicEnd; ++i)
      store(y[first + i], fma(splat(d.nodes.mass[i]), load(x[first + i]), load(s.given[i])));
    negate(s.given);
    returnImpulses(d, s.given, y);
  }
  applyRows(s, x, y);
  hold(s.freedom, y);
}

void applyRows(const ImplicitData& s, const Motion& x, Motion& y) {
  for (const LoadRow& row : s.rows) {
    if (row.weight == 0) continue;
    double rate = 0;
    for (int k = row.first; k < row.end; ++k) rate += dotProduct(load(s.rowCoefficient[k]), load(x[s.rowQuad[k]]));
    addAlong(s, row, row.weight * rate, y);
  }
}

static Motion& setRemaining(ImplicitData& s) {
  s.remaining = s.residual;
  negate(s.remaining);
  hold(s.freedom, s.remaining);
  return s.remaining;
}

void solvePreconditioner(WorldData& d, ImplicitData& s, bool goesOn) {
  const Motion& r = setRemaining(s);
  precondition(d, s, r, s.change);
  const double curvature = goesOn ? product(s.direction, s.image) : 0;
  if (curvature > 0)
    addScaled((product(r, s.direction) - product(s.change, s.image)) / curvature, s.direction, s.change);
}

int solveSystem(WorldData& d, ImplicitData& s, double tolerance, Operator apply) {
  constexpr int kIterations = 200;
  std::fill(s.change.begin(), s.change.end(), Quad{});
  Motion& r = setRemaining(s);
  precondition(d, s, r, s.preconditioned);
  s.direction = s.preconditioned;
  double size = product(r, s.preconditioned);
  const double enough = tolerance * tolerance * size;
  for (int i = 0; i < kIterations; ++i) {
    if (!(size > enough)) return i;
    apply(d, s, s.direction, s.image);
    const double curvature = product(s.direction, s.image);
    // Along such a direction the residual is no minimum; what the preconditioner says is a way down all the same.
    if (!(curvature > 1e-3 * size)) {
      if (i == 0) s.change = s.direction;
      return i + 1;
    }
    const double step = product(r, s.direction) / curvature;
    addScaled(step, s.direction, s.change);
    addScaled(-step, s.image, r);
    precondition(d, s, r, s.preconditioned);
    // Not quite symmetric away from rest: the next direction is made conjugate to the last by its own image.
    const double keep = -product(s.preconditioned, s.image) / curvature;
    for (std::size_t k = 0; k < s.direction.size(); ++k)
      store(s.direction[k], fma(splat(keep), load(s.direction[k]), load(s.preconditioned[k])));
    size = product(r, s.preconditioned);
  }
  return kIterations;
}

}  // namespace medulla
