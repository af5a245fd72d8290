#include "tests/synthetic_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace medulla::synthetic {

Tube straightTube(int spheres, double length, double radius, int rings, int segments) {
  Tube t;
  for (int i = 0; i < spheres; ++i) t.centre.emplace_back(length * i / (spheres - 1), 0, 0);
  t.radius.assign(spheres, radius);
  t.rings = rings;
  t.segments = segments;
  return t;
}

namespace {

// The closed surface swept along the tube's centre line: rings of nodes between two poles.
void sweepSurface(const Tube& tube, SoftBodyModel& m) {
  const int n = static_cast<int>(tube.centre.size());
  std::vector<double> station(n, 0);
  for (int i = 1; i < n; ++i) station[i] = station[i - 1] + (tube.centre[i] - tube.centre[i - 1]).norm();
  struct Section {
    Vector3d centre, tangent;
    double radius;
  };
  const auto section = [&](double share) {
    const double s = share * station[n - 1];
    int i = 0;
    while (i < n - 2 && station[i + 1] < s) ++i;
    const double f = (s - station[i]) / (station[i + 1] - station[i]);
    const Vector3d line = tube.centre[i + 1] - tube.centre[i];
    return Section{tube.centre[i] + f * line, line.normalized(),
                   tube.radius[i] + f * (tube.radius[i + 1] - tube.radius[i])};
  };
  const Section first = section(0), last = section(1);
  m.restNodes.push_back(first.centre - first.radius * first.tangent);
  const Vector3d up = Vector3d(0.31, 0.22, 0.92).normalized();
  for (int k = 0; k < tube.rings; ++k) {
    const Section s = section((k + 0.5) / tube.rings);
    const Vector3d e1 = s.tangent.cross(up).normalized(), e2 = s.tangent.cross(e1);
    for (int j = 0; j < tube.segments; ++j) {
      const double a = 2 * std::numbers::pi * j / tube.segments;
      m.restNodes.push_back(s.centre + s.radius * (std::cos(a) * e1 + std::sin(a) * e2));
    }
  }
  m.restNodes.push_back(last.centre + last.radius * last.tangent);
  const auto id = [&](int ring, int j) { return 1 + ring * tube.segments + j % tube.segments; };
  const int pole = static_cast<int>(m.restNodes.size()) - 1;
  for (int j = 0; j < tube.segments; ++j) {
    m.triangles.push_back({0, id(0, j + 1), id(0, j)});
    m.triangles.push_back({pole, id(tube.rings - 1, j), id(tube.rings - 1, j + 1)});
    for (int k = 0; k + 1 < tube.rings; ++k) {
      m.triangles.push_back({id(k, j), id(k, j + 1), id(k + 1, j)});
      m.triangles.push_back({id(k, j + 1), id(k + 1, j + 1), id(k + 1, j)});
    }
  }
  std::set<std::array<int, 2>> edges;
  for (const auto& t : m.triangles)
    for (int k = 0; k < 3; ++k) edges.insert({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
  m.edges.assign(edges.begin(), edges.end());
}

}  // namespace

void addLink(SoftBodyModel& m, int a, int b, double radius, double share) {
  const Vector3d t = (m.spheres[b].restFrame - m.spheres[a].restFrame).normalized();
  const double area = share * std::numbers::pi * radius * radius, moment = area * radius * radius / 4;
  const Vector3d other = std::abs(t.x()) > 0.9 ? Vector3d::UnitY() : Vector3d::UnitX();
  ElasticLink link;
  link.sphere0 = a;
  link.sphere1 = b;
  link.sections.fill({area, moment, moment, 2 * moment});
  link.restU = t.cross(other).normalized();
  m.links.push_back(link);
}

namespace {

// Every node to its nearest link, or sphere where no link lies beside it (paper 2.3); `surfaceShare` of the volume.
void attachNodes(SoftBodyModel& m, double surfaceShare) {
  double volume = 0, area = 0;
  for (const FillingSphere& s : m.spheres) volume += s.volume;
  m.attachments.assign(m.restNodes.size(), {});
  for (const auto& t : m.triangles) {
    const Vector3d a = m.restNodes[t[0]], b = m.restNodes[t[1]], c = m.restNodes[t[2]];
    const double third = 0.5 * (b - a).cross(c - a).norm() / 3;
    for (int k : t) m.attachments[k].area += third;
    area += 3 * third;
  }
  for (std::size_t i = 0; i < m.restNodes.size(); ++i) {
    Attachment& a = m.attachments[i];
    a.volume = surfaceShare * volume * a.area / area;
    double best = 1e30;
    for (std::size_t k = 0; k < m.links.size(); ++k) {
      const Vector3d p0 = m.spheres[m.links[k].sphere0].restFrame, d = m.spheres[m.links[k].sphere1].restFrame - p0;
      const double s = (m.restNodes[i] - p0).dot(d) / d.squaredNorm();
      const Vector3d offset = m.restNodes[i] - p0 - s * d;
      if (s < 0 || s > 1 || offset.squaredNorm() >= best) continue;
      best = offset.squaredNorm();
      a.onLink = true;
      a.host = static_cast<int>(k);
      a.along = s;
      a.restOffset = offset;
    }
    for (std::size_t k = 0; k < m.spheres.size(); ++k) {
      const Vector3d offset = m.restNodes[i] - m.spheres[k].restFrame;
      if (0.9999 * offset.squaredNorm() >= best) continue;
      best = 0.9999 * offset.squaredNorm();
      a.onLink = false;
      a.host = static_cast<int>(k);
      a.along = 0;
      a.restOffset = offset;
    }
    double nearest = 1e30;
    for (std::size_t k = 0; k < m.spheres.size(); ++k) {
      const double distance = (m.restNodes[i] - m.spheres[k].restFrame).squaredNorm();
      if (distance >= nearest) continue;
      nearest = distance;
      a.massSphere = static_cast<int>(k);
    }
  }
}

}  // namespace

std::shared_ptr<SoftBodyModel> chainModel(const Tube& tube, double surfaceShare, bool closeFirstTriple) {
  auto model = std::make_shared<SoftBodyModel>();
  SoftBodyModel& m = *model;
  m.name = "tube";
  const int n = static_cast<int>(tube.centre.size());
  for (int i = 0; i < n; ++i) {
    const Vector3d before = tube.centre[std::max(0, i - 1)], after = tube.centre[std::min(n - 1, i + 1)];
    const Vector3d t = (after - before).normalized();
    const double length = (after - before).norm() * (i == 0 || i == n - 1 ? 1 : 0.5), r = tube.radius[i];
    FillingSphere s;
    s.restBallCentre = s.restFrame = s.restLinkEnd = tube.centre[i];
    s.radius = r;
    s.volume = std::numbers::pi * r * r * length;
    s.secondMoment =
        s.volume * (r * r / 4 * (Matrix3d::Identity() - t * t.transpose()) + length * length / 12 * t * t.transpose());
    m.spheres.push_back(s);
  }
  for (int i = 0; i + 1 < n; ++i) addLink(m, i, i + 1, 0.5 * (tube.radius[i] + tube.radius[i + 1]));
  if (closeFirstTriple) addLink(m, 0, 2, tube.radius[0], 0.3);
  sweepSurface(tube, m);
  attachNodes(m, surfaceShare);
  return model;
}

std::shared_ptr<SoftBodyModel> unevenChain(int spheres, int rings) {
  auto model = chainModel(straightTube(spheres, 0.02 * (spheres - 1), 0.01, rings, 6));
  for (ElasticLink& link : model->links) {
    for (int k = 0; k < ElasticLink::kSections; ++k) {
      LinkSection& s = link.sections[k];
      const double wider = 1 + 0.1 * k;
      s = {wider * s.area, 1.7 * wider * s.bendingMomentU, wider * s.bendingMomentV, wider * wider * s.torsionConstant};
    }
  }
  model->spheres.front().restLinkEnd += Vector3d(-0.004, 0.002, 0.001);
  model->spheres.back().restLinkEnd += Vector3d(0.003, -0.001, 0.002);
  return model;
}

std::shared_ptr<SoftBodyModel> shortTube() {
  return chainModel(straightTube(5, 0.08, 0.012, 8, 10));
}

namespace {

// The sizes of the speed comparison. `scale` metres per unit.
std::shared_ptr<SoftBodyModel> wavyTube(int spheres, double length, double radius, int rings, int segments, bool arch,
                                        bool closeFirstTriple = false) {
  constexpr double scale = 0.25;
  Tube t;
  for (int i = 0; i < spheres; ++i) {
    const double u = static_cast<double>(i) / (spheres - 1);
    const Vector3d wave(0, 0.15 * std::sin(0.35 * u * spheres), 0.05 * std::cos(0.2 * u * spheres));
    t.centre.push_back(scale * (Vector3d(length * u, 0, 0) + (arch ? Vector3d(0, 0.1 * std::sin(3 * u), 0) : wave)));
  }
  t.radius.assign(spheres, scale * radius);
  t.rings = rings;
  t.segments = segments;
  return chainModel(t, 0.1, closeFirstTriple);
}

// 12 x 10 spheres in a plane, inside a tube of 1010 nodes.
std::shared_ptr<SoftBodyModel> slab() {
  constexpr double scale = 0.25;
  constexpr int columns = 12, rows = 10, stations = 41;
  auto model = std::make_shared<SoftBodyModel>();
  SoftBodyModel& m = *model;
  m.name = "slab";
  const double pitch = 0.1 * scale, thickness = 0.05 * scale;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      FillingSphere s;
      s.restBallCentre = s.restFrame = s.restLinkEnd = pitch * Vector3d(x, y, 0);
      s.radius = thickness;
      s.volume = pitch * pitch * 2 * thickness;
      s.secondMoment = s.volume / 12 *
                       Vector3d(pitch * pitch, pitch * pitch, 4 * thickness * thickness).asDiagonal().toDenseMatrix();
      m.spheres.push_back(s);
    }
  }
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      if (x + 1 < columns) addLink(m, y * columns + x, y * columns + x + 1, thickness, 0.55);
      if (y + 1 < rows) addLink(m, y * columns + x, (y + 1) * columns + x, thickness, 0.55);
    }
  }
  Tube t;
  for (int i = 0; i < stations; ++i) {
    const double x = -1 + 2.0 * i / (stations - 1);
    t.centre.push_back(scale * Vector3d(0.6 * x + 0.55, 0.45, 0));
    t.radius.push_back(scale * 0.5 * std::sqrt(std::max(0.03, 1 - x * x)));
  }
  t.rings = 42;
  t.segments = 24;
  sweepSurface(t, m);
  attachNodes(m, 0.1);
  return model;
}

}  // namespace

BodyDescription body(std::shared_ptr<const SoftBodyModel> model, double young, std::vector<FixedSphere> fixed) {
  BodyDescription b;
  b.name = model->name;
  b.model = std::move(model);
  b.tissue.young = young;
  b.tissue.density = 1000;
  b.fixed = std::move(fixed);
  return b;
}

std::vector<BodyDescription> gallbladderScene() {
  return {body(wavyTube(7, 0.6, 0.08, 13, 18, true, true), 2e4, {{0, FixedFreedom::all}, {6, FixedFreedom::all}})};
}

std::vector<BodyDescription> abdomenScene() {
  const auto everyEighth = [](int spheres) {
    std::vector<FixedSphere> fixed;
    for (int i = 0; i < spheres; i += 8) fixed.push_back({i, FixedFreedom::all});
    fixed.push_back({spheres - 1, FixedFreedom::all});
    return fixed;
  };
  std::vector<BodyDescription> scene{
      body(wavyTube(200, 10, 0.05, 200, 12, false), 2e4, everyEighth(200)),
      body(wavyTube(60, 3, 0.06, 75, 12, false), 2e4, everyEighth(60)),
      body(wavyTube(24, 1.2, 0.1, 46, 16, true), 2e4, everyEighth(24)),
      body(wavyTube(7, 0.6, 0.08, 13, 18, true), 2e4, everyEighth(7)),
      body(slab(), 2e4,
           {{0, FixedFreedom::all}, {11, FixedFreedom::all}, {108, FixedFreedom::all}, {119, FixedFreedom::all}})};
  for (std::size_t i = 0; i < scene.size(); ++i)
    scene[i].worldFromModel.translation() = Vector3d(0, 0.3 * static_cast<double>(i), 0);
  return scene;
}

}  // namespace medulla::synthetic
