#include <algorithm>
#include <cmath>

#include "physics/dynamics/contact_stages.h"

// Balls against shapes that do not move.
namespace medulla {

namespace {

using Eigen::Vector3d;

constexpr std::uint64_t kStaticKey = std::uint64_t{1} << 63;

struct Nearest {
  double distance;  // m, of the ball's centre from the surface; < 0 behind it
  Vector3d normal;  // unit, world, away from the shape
};

Nearest nearestOnPlane(const StaticContactShape& s, const Vector3d& p) {
  const Vector3d normal = s.worldFromShape.linear().col(1);
  return {normal.dot(p - s.worldFromShape.translation()), normal};
}

Nearest nearestOnSphere(const StaticContactShape& s, const Vector3d& p) {
  const Vector3d way = p - s.worldFromShape.translation();
  const double length = way.norm();
  return {length - s.radius, length > 1e-12 ? Vector3d(way / length) : Vector3d::UnitY()};
}

Nearest nearestOnBox(const StaticContactShape& s, const Vector3d& p) {
  const Vector3d local = s.worldFromShape.linear().transpose() * (p - s.worldFromShape.translation());
  const Vector3d beyond = local.cwiseAbs() - s.halfSize, outside = beyond.cwiseMax(0);
  const Vector3d sign = local.unaryExpr([](double x) { return x < 0 ? -1.0 : 1.0; });
  const double distance = outside.norm();
  if (distance > 0) return {distance, s.worldFromShape.linear() * (outside.cwiseProduct(sign) / distance)};
  int axis = 0;
  const double depth = beyond.maxCoeff(&axis);
  return {depth, s.worldFromShape.linear().col(axis) * sign[axis]};
}

Nearest nearestOn(const StaticContactShape& s, const Vector3d& p) {
  if (s.kind == StaticShape::Kind::plane) return nearestOnPlane(s, p);
  return s.kind == StaticShape::Kind::sphere ? nearestOnSphere(s, p) : nearestOnBox(s, p);
}

// What a ball touches of a mesh: the nearest point, and faces that it rests on beside it. Without those a ball in a
// groove would be handed from one side to the other and sink a little each time.
struct Touches {
  static constexpr int kMost = 4;
  // Faces that lie nearly the same way are one: the next nearest takes over smoothly.
  static constexpr double kSameDirection = 0.9;
  int count = 0;
  Nearest at[kMost];

  void add(const Nearest& n) {
    for (int k = 0; k < count; ++k)
      if (at[k].normal.dot(n.normal) > kSameDirection) return;
    if (count < kMost) at[count++] = n;
  }
};

struct Foot {
  double distance = std::numeric_limits<double>::infinity();
  double height = 0;  // over the triangle's plane
  Vector3d point, faceNormal;
  bool onRim = false;  // below the plane, where the surface ends: nothing is behind it there
};

bool isOnRim(const std::array<Vector3d, 3>& t, const OpenRim& rim, const Vector3d& point) {
  constexpr double kSame = 1e-18;  // squared, of an edge's length
  for (int k = 0; k < 3; ++k) {
    const Vector3d edge = t[(k + 1) % 3] - t[k], way = point - t[k];
    const double same = kSame * edge.squaredNorm();
    if (rim.corner[k] && way.squaredNorm() <= same) return true;
    if (rim.edge[k] && way.cross(edge).squaredNorm() <= same * edge.squaredNorm()) return true;
  }
  return false;
}

Foot footOn(const StaticContactShape& shape, int triangle, const Vector3d& p) {
  const std::array<Vector3d, 3>& t = shape.tree.corners[triangle];
  Foot f;
  f.point = closestOnTriangle(p, t);
  f.distance = (p - f.point).norm();
  const Vector3d across = (t[1] - t[0]).cross(t[2] - t[0]);
  const double area = across.norm();
  f.faceNormal = area > 0 ? Vector3d(across / area) : Vector3d::Zero();
  f.height = f.faceNormal.dot(p - f.point);
  f.onRim = f.height < 0 && isOnRim(t, shape.rim[triangle], f.point);
  return f;
}

// The nearest point's side of the surface is that of the triangle which sees it most squarely: of several triangles
// that share an edge or corner nearest to p, the others may have p behind their plane.
bool isNearer(const Foot& a, const Foot& b) {
  constexpr double kSame = 1e-9;
  if (a.distance < b.distance * (1 - kSame)) return true;
  return a.distance <= b.distance * (1 + kSame) && std::abs(a.height) > std::abs(b.height);
}

Nearest contactAt(const Foot& f, const Vector3d& p) {
  const double side = f.height < 0 && !f.onRim ? -1 : 1;
  if (f.distance < 1e-12) return {0, f.faceNormal};
  return {side * f.distance, side / f.distance * (p - f.point)};
}

// What lies behind a surface is held to be in it only `behind` m deep: farther away it is beyond, as under a table.
struct Depth {
  double within, behind;  // m, of the ball's centre
};
// Triangles come with their distance of some time ago; meanwhile the ball has moved by at most `moved`.
Touches touchesOf(const StaticContactShape& shape, const TriangleDistance* begin, const TriangleDistance* end,
                  const Vector3d& p, const Depth& depth, double moved) {
  const double within = depth.within;
  Foot nearest;
  for (const TriangleDistance* t = begin; t != end; ++t) {
    if (t->distance - moved > std::min(within, nearest.distance)) break;
    const Foot f = footOn(shape, t->triangle, p);
    if (isNearer(f, nearest)) nearest = f;
  }
  Touches touches;
  if (!(nearest.distance < within)) return touches;
  const Nearest at = contactAt(nearest, p);
  if (!(at.distance > -depth.behind)) return touches;
  touches.add(at);
  for (const TriangleDistance* t = begin; t != end && t->distance - moved < within; ++t) {
    const Foot f = footOn(shape, t->triangle, p);
    if (f.distance < within && f.height > (1 - 1e-9) * f.distance) touches.add(contactAt(f, p));
  }
  return touches;
}

void addContact(WorldData& d, const StaticNeighbour& n, const Nearest& at, int ordinal, bool misses) {
  ContactData& c = d.contact;
  const Quad& ball = c.ball[n.sphere];
  const Vector3d point = vectorOf(ball) - at.distance * at.normal;
  if ((point - c.fixedAt[n.shape * c.ball.size() + n.sphere]).norm() < ball.v[3]) return;
  const int body = d.spheres.bodyOf[n.sphere];
  Contact& contact = c.contacts.emplace_back();
  contact.key =
      kStaticKey | std::uint64_t{n.shape} << 34 | std::uint64_t{n.sphere} << 2 | static_cast<std::uint64_t>(ordinal);
  contact.gap = at.distance - ball.v[3];
  contact.smallerRadius = ball.v[3];
  contact.normal = Lanes{at.normal.x(), at.normal.y(), at.normal.z(), 0};
  contact.friction = c.rootFriction[body] * c.statics[n.shape].rootFriction;
  contact.ends = 1;
  contact.sphere[0] = n.sphere;
  contact.weight[0] = 1;
  contact.reach[1] = -(ball.v[3] + 0.5 * contact.gap);
  contact.misses = misses;
}

double distanceFrom(const WorldData& d, const StaticNeighbour& n, const Vector3d& p) {
  const ContactData& c = d.contact;
  const StaticContactShape& shape = c.statics[n.shape];
  if (shape.kind != StaticShape::Kind::mesh) return nearestOn(shape, p).distance;
  double least = std::numeric_limits<double>::infinity();
  for (int k = n.firstTriangle; k < n.endTriangle; ++k)
    least = std::min(least, (p - closestOnTriangle(p, shape.tree.corners[c.nearTriangles[k].triangle])).norm());
  return least;
}

// Whether the ball, at this distance now, comes to touch the shape within the substep, as it moves now: by steps as
// long as the way is clear. Asked where anything is fast: see contact_find.cpp.
bool willTouch(const WorldData& d, const StaticNeighbour& n, double distance) {
  constexpr int kSteps = 32;         // then it all but does
  constexpr double kTouches = 1e-3;  // of its radius
  const Quad& ball = d.contact.ball[n.sphere];
  const double radius = ball.v[3];
  if (!(distance > radius) || !(d.contact.reach > leastReach(d))) return true;
  const Vector3d from = vectorOf(ball), velocity = ballVelocity(d, n.sphere);
  const double speed = velocity.norm();
  double time = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double gap = distanceFrom(d, n, from + time * velocity) - radius;
    if (gap < kTouches * radius) return true;
    time += gap / speed;
    if (!(time < d.substep)) return false;
  }
  return true;
}

}  // namespace

std::array<int, 2> bodiesOf(const WorldData& d, std::uint64_t key) {
  const std::vector<Collider>& colliders = d.contact.colliders;
  if (key & kStaticKey) return {d.spheres.bodyOf[static_cast<std::uint32_t>(key >> 2)], -1};
  return {colliders[key >> 32].body, colliders[key & 0xffffffff].body};
}

bool isNear(const StaticContactShape& shape, const Vector3d& p, double distance) {
  if (shape.kind == StaticShape::Kind::mesh) return closestPoint(shape.tree, p, distance).distance < distance;
  return nearestOn(shape, p).distance < distance;
}

Vector3d nearestPoint(const StaticContactShape& shape, const Vector3d& p) {
  if (shape.kind == StaticShape::Kind::mesh) return closestPoint(shape.tree, p).point;
  const Nearest at = nearestOn(shape, p);
  return p - at.distance * at.normal;
}

void listStaticNeighbours(WorldData& d) {
  ContactData& c = d.contact;
  c.staticNeighbours.clear();
  c.nearTriangles.clear();
  for (std::uint32_t k = 0; k < c.statics.size(); ++k) {
    const StaticContactShape& shape = c.statics[k];
    for (std::uint32_t i = 0; i < c.ball.size(); ++i) {
      if (c.inverseCellMass[i] == 0 || d.rest[d.spheres.bodyOf[i]].asleep) continue;  // fixed or a pad, or asleep
      const Vector3d p = vectorOf(c.ball[i]);
      const double radius = c.ball[i].v[3];
      const int first = static_cast<int>(c.nearTriangles.size());
      double gap = 0;
      if (shape.kind == StaticShape::Kind::mesh) {
        trianglesWithin(shape.tree, p, radius + c.margin, c.nearTriangles);
        const int end = static_cast<int>(c.nearTriangles.size());
        if (first == end) continue;
        gap = c.nearTriangles[first].distance - radius;
      } else {
        gap = nearestOn(shape, p).distance - radius;
        if (!(gap <= c.margin)) continue;
      }
      c.staticNeighbours.push_back({k, i, gap, first, static_cast<int>(c.nearTriangles.size())});
    }
  }
}

void findStaticContacts(WorldData& d, double moved) {
  ContactData& c = d.contact;
  const double reach = c.reach;
  for (const StaticNeighbour& n : c.staticNeighbours) {
    if (!(n.gapAtList - moved < reach)) continue;
    const StaticContactShape& shape = c.statics[n.shape];
    const Vector3d p = vectorOf(c.ball[n.sphere]);
    const double within = c.ball[n.sphere].v[3] + reach, always = c.ball[n.sphere].v[3] + leastReach(d);
    if (shape.kind != StaticShape::Kind::mesh) {
      const Nearest at = nearestOn(shape, p);
      const bool misses = at.distance < within && !willTouch(d, n, at.distance);
      if (at.distance < (misses ? always : within)) addContact(d, n, at, 0, misses);
      continue;
    }
    const TriangleDistance* near = c.nearTriangles.data();
    const Depth depth{within, always};
    const Touches touches = touchesOf(shape, near + n.firstTriangle, near + n.endTriangle, p, depth, moved);
    const bool misses = touches.count > 0 && !willTouch(d, n, touches.at[0].distance);
    for (int k = 0; k < touches.count; ++k)
      if (!misses || touches.at[k].distance < always) addContact(d, n, touches.at[k], k, misses);
  }
}

}  // namespace medulla
