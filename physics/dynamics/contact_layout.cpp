#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

#include "physics/dynamics/contact_stages.h"
#include "physics/dynamics/identified_mechanics.h"
#include "physics/dynamics/rigid_support.h"
#include "physics/model/mesh_topology.h"
#include "physics/sort_unique.h"

namespace medulla {

namespace {

using Eigen::Vector3d;

// Lists are made anew when a ball has moved half of this: a wider margin makes lists longer, a narrower one more often.
constexpr double kMarginOverRadius = 0.3;  // of the mean radius, beyond what one substep can close

// Balls and cones of one body that overlap at rest never meet; neither do those that all but touch, which the first
// bending would bring together: this share of the smaller radius apart, or less.
constexpr double kTouchingAtRest = 0.1;

void addBalls(WorldData& d) {
  ContactData& c = d.contact;
  c.restBall.resize(d.spheres.position.size());
  c.inverseCellMass.resize(d.spheres.position.size(), 0);
  c.inverseYoung.resize(d.spheres.position.size(), 0);
  double sum = 0;
  int count = 0;
  for (std::size_t b = 0; b < d.bodies.size(); ++b) {
    const BodyDescription& body = d.bodies[b];
    for (int i = 0; i < d.ranges[b].sphereCount; ++i) {
      const FillingSphere& s = body.model->spheres[i];
      const int k = d.ranges[b].firstSphere + i;
      c.restBall[k] = quadOf(s.restBallCentre - s.restFrame);
      c.restBall[k].v[3] = s.radius;
      c.inverseYoung[k] = 1 / body.tissue.young;
      if (d.spheres.groups[k / 4].inverseMass[k % 4] > 0)
        c.inverseCellMass[k] = 1 / (body.tissue.density * sphereCell(body, i).volume);
      sum += s.radius;
      ++count;
    }
  }
  c.freeMove = 0.5 * kMarginOverRadius * sum / std::max(1, count);
  c.reach = leastReach(d);
  c.margin = 2 * c.freeMove + c.reach;
  c.ball = c.restBall;
  c.arm.resize(c.ball.size());
  c.spheres.resize(d.spheres.position.size());
  c.swept.resize(d.ranges.size());
}

// Balls that are linked never meet.
void addColliders(WorldData& d) {
  ContactData& c = d.contact;
  for (std::size_t b = 0; b < d.bodies.size(); ++b) {
    const SoftBodyModel& m = *d.bodies[b].model;
    const auto first = static_cast<std::uint32_t>(d.ranges[b].firstSphere);
    std::vector<bool> linked(m.spheres.size(), false);
    if (c.mode == ContactMode::swept) {
      for (const ElasticLink& l : m.links) {
        c.colliders.push_back({first + l.sphere0, first + l.sphere1, static_cast<int>(b)});
        linked[l.sphere0] = linked[l.sphere1] = true;
      }
    }
    const auto firstBall = static_cast<std::uint32_t>(c.colliders.size());
    for (std::uint32_t i = 0; i < m.spheres.size(); ++i)
      if (!linked[i]) c.colliders.push_back({first + i, first + i, static_cast<int>(b)});
    c.excluded.resize(c.colliders.size());
    if (c.mode == ContactMode::swept) continue;
    for (const ElasticLink& l : m.links)
      c.excluded[firstBall + std::min(l.sphere0, l.sphere1)].push_back(firstBall + std::max(l.sphere0, l.sphere1));
  }
  c.boxes.resize(c.colliders.size());
}

// Two bodies meet if one of them names the other, or if neither names anybody.
void decideWhoCollides(WorldData& d) {
  const int count = static_cast<int>(d.bodies.size());
  const auto names = [&](int a, int b) {
    const std::vector<int>& n = *d.bodies[a].neighbours;
    return std::find(n.begin(), n.end(), b) != n.end();
  };
  d.contact.collides.resize(static_cast<std::size_t>(count) * count);
  for (int a = 0; a < count; ++a) {
    const auto& own = d.bodies[a].neighbours;
    for (const int n : own.value_or(std::vector<int>()))
      if (n < 0 || n >= count)
        throw std::runtime_error(
            fmt::format("body '{}' has neighbour {}: expected 0 to {}", d.bodies[a].name, n, count - 1));
    for (int b = 0; b < count; ++b) {
      const auto& others = d.bodies[b].neighbours;
      const bool named = (own && names(a, b)) || (others && names(b, a));
      d.contact.collides[static_cast<std::size_t>(a) * count + b] = a == b || named || (!own && !others);
    }
    const double friction = d.bodies[a].tissue.friction;
    if (!(friction >= 0 && std::isfinite(friction)))
      throw std::runtime_error(
          fmt::format("the friction of body '{}' is {}: expected 0 or more", d.bodies[a].name, friction));
    d.contact.rootFriction.push_back(std::sqrt(friction));
  }
}

// Corners in one place are one, whatever a file has numbered them; edges that meet halfway are rims. Triangles that are
// none have no edges.
std::vector<OpenRim> openRims(const SurfaceTree& tree) {
  std::map<std::array<double, 3>, int> places;
  TriangleMesh mesh;
  std::vector<std::size_t> whole;  // triangles of the tree
  for (std::size_t i = 0; i < tree.corners.size(); ++i) {
    const std::array<Vector3d, 3>& t = tree.corners[i];
    std::array<int, 3> corners;
    for (int k = 0; k < 3; ++k)
      corners[k] = places.try_emplace({t[k].x(), t[k].y(), t[k].z()}, static_cast<int>(places.size())).first->second;
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    mesh.triangles.push_back(corners);
    whole.push_back(i);
  }
  mesh.vertices.resize(places.size());
  const std::vector<std::array<int, 3>> onEdges = trianglesOnEdges(mesh);
  std::vector<bool> isOpen(places.size(), false);
  for (std::size_t t = 0; t < onEdges.size(); ++t)
    for (int k = 0; k < 3; ++k)
      if (onEdges[t][k] == 1) isOpen[mesh.triangles[t][k]] = isOpen[mesh.triangles[t][(k + 1) % 3]] = true;
  std::vector<OpenRim> out(tree.corners.size(), OpenRim{});
  for (std::size_t t = 0; t < onEdges.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      out[whole[t]].edge[k] = onEdges[t][k] == 1;
      out[whole[t]].corner[k] = isOpen[mesh.triangles[t][k]];
    }
  return out;
}

void addStatics(ContactData& c, const std::vector<StaticShape>& statics) {
  for (const StaticShape& s : statics) {
    const bool sizes = s.kind != StaticShape::Kind::box || s.size.minCoeff() > 0;
    if (!sizes || (s.kind == StaticShape::Kind::sphere && !(s.radius > 0)))
      throw std::runtime_error("a static shape has no size: expected more than 0 m");
    if (!(s.friction >= 0 && std::isfinite(s.friction)))
      throw std::runtime_error(fmt::format("the friction of a static shape is {}: expected 0 or more", s.friction));
    StaticContactShape& out = c.statics.emplace_back();
    out.kind = s.kind;
    out.worldFromShape = s.worldFromShape;
    out.halfSize = 0.5 * s.size;
    out.radius = s.radius;
    out.rootFriction = std::sqrt(s.friction);
    if (s.kind != StaticShape::Kind::mesh) continue;
    if (s.mesh.triangles.empty()) throw std::runtime_error("a static mesh has no triangles");
    TriangleMesh inWorld = s.mesh;
    for (Vector3d& v : inWorld.vertices) v = s.worldFromShape * v;
    out.tree = makeSurfaceTree(inWorld);
    out.rim = openRims(out.tree);
  }
}

template <class Visit>
void forEachPair(const ContactData& c, const Visit& visit) {
  for (const PairGroup& g : c.pairs) {
    const ConeContact closest = closestOfPairs(c, g);
    for (int k = 0; k < 4; ++k) {
      if (!std::isfinite(g.gapAtList[k])) continue;
      const auto radius = [&](const Collider& of, double along) {
        return (1 - along) * c.ball[of.sphere0].v[3] + along * c.ball[of.sphere1].v[3];
      };
      const double smaller = std::min(radius(c.colliders[g.collider0[k]], closest.s[k]),
                                      radius(c.colliders[g.collider1[k]], closest.t[k]));
      visit(g.collider0[k], g.collider1[k], closest.gap[k], smaller);
    }
  }
}

// Among pairs as far apart as that may be, however short the lists of a run are beside small balls of other bodies.
void excludeWhatTouchesAtRest(WorldData& d) {
  ContactData& c = d.contact;
  const double margin = c.margin;
  for (const Quad& ball : c.ball) c.margin = std::max(c.margin, kTouchingAtRest * ball.v[3]);
  listNeighbours(d);
  c.margin = margin;
  c.listsAreOld = true;
  forEachPair(c, [&](std::uint32_t i, std::uint32_t j, double gap, double smaller) {
    if (c.colliders[i].body == c.colliders[j].body && gap < kTouchingAtRest * smaller) c.excluded[i].push_back(j);
  });
  for (std::vector<std::uint32_t>& e : c.excluded) sortUnique(e);
}

// Of whose triangles every corner is held; in the world.
TriangleMesh heldSurface(const BodyDescription& body) {
  TriangleMesh held;
  std::vector<char> isHeld(body.model->restNodes.size(), false);
  for (const int n : body.fixedNodes) isHeld[n] = true;
  for (const Vector3d& x : body.model->restNodes) held.vertices.push_back(body.worldFromModel * x);
  for (const auto& t : body.model->triangles)
    if (isHeld[t[0]] && isHeld[t[1]] && isHeld[t[2]]) held.triangles.push_back(t);
  return held;
}

// What is glued to a shape is held by the tissue between. A rigid ball that stood on it besides would bear what that
// does again: a slab on a table that it is fixed to felt twice as hard to a tool. So a ball does not stand on the place
// below it if that is held there, or a quarter of its radius beside; it may still rest on any other. Of a skin nodes
// are not held.
void findWhatIsFixedToStatics(WorldData& d) {
  constexpr double kBeside = 0.25;
  ContactData& c = d.contact;
  c.fixedAt.assign(c.statics.size() * c.ball.size(), Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  for (std::size_t b = 0; b < d.bodies.size(); ++b) {
    const BodyDescription& body = d.bodies[b];
    if (!holdsByNodes(body)) continue;
    const TriangleMesh held = heldSurface(body);
    if (held.triangles.empty()) continue;
    const SurfaceTree tree = makeSurfaceTree(held);
    for (std::size_t k = 0; k < c.statics.size(); ++k)
      for (const int i : spheresOf(d.ranges[b])) {
        const Vector3d below = nearestPoint(c.statics[k], vectorOf(c.ball[i]));
        if (closestPoint(tree, below).distance < kBeside * c.ball[i].v[3]) c.fixedAt[k * c.ball.size() + i] = below;
      }
  }
}

void noteStartOverlap(ContactData& c, int b0, int b1, double depth) {
  const auto same = [&](const BodyOverlap& o) { return o.body0 == b0 && o.body1 == b1; };
  const auto found = std::find_if(c.startOverlaps.begin(), c.startOverlaps.end(), same);
  if (found == c.startOverlaps.end())
    c.startOverlaps.push_back({b0, b1, depth});
  else
    found->depth = std::max(found->depth, depth);
}

void noteStartOverlaps(WorldData& d) {
  constexpr double kInUse = 0.01;  // of the radius: what lies on something may begin so deep in it
  ContactData& c = d.contact;
  forEachPair(c, [&](std::uint32_t i, std::uint32_t j, double gap, double) {
    const int b0 = c.colliders[i].body, b1 = c.colliders[j].body;
    if (gap < 0 && b0 != b1) noteStartOverlap(c, b0, b1, -gap);
  });
  findStaticContacts(d, 0);
  for (const Contact& contact : c.contacts)
    if (-contact.gap > kInUse * contact.smallerRadius)
      noteStartOverlap(c, d.spheres.bodyOf[contact.sphere[0]], -1, -contact.gap);
  c.contacts.clear();
  std::sort(c.startOverlaps.begin(), c.startOverlaps.end(), [](const BodyOverlap& a, const BodyOverlap& b) {
    return a.body0 != b.body0 ? a.body0 < b.body0 : a.body1 < b.body1;
  });
}

}  // namespace

void layOutContact(WorldData& d, const std::vector<StaticShape>& statics) {
  ContactData& c = d.contact;
  c.mode = d.settings.contact;
  c.change.resize(d.spheres.position.size());
  if (c.mode == ContactMode::none) return;
  decideWhoCollides(d);
  addStatics(c, statics);
  addBalls(d);
  addColliders(d);
  placeBalls(d);
  findWhatIsFixedToStatics(d);
  excludeWhatTouchesAtRest(d);
  listNeighbours(d);
  noteStartOverlaps(d);
}

}  // namespace medulla
