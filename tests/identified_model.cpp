#include "tests/identified_model.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tests/dynamics_states.h"

namespace medulla::synthetic {

namespace {

// Beams between the spheres: with the measures (along, across; torsion, bending) half way, of length L
//   EA/L, 12 EI/L^3, 12 EI/L^3; GJ/L, EI/L, EI/L.
IdentifiedLink beamBetween(int frame0, int frame1, const Vector3d& x0, const Vector3d& x1, const LinkSection& section,
                           double scale, double poisson) {
  IdentifiedLink link;
  link.frame0 = frame0;
  link.frame1 = frame1;
  link.restPoint0 = x0;
  link.restPoint1 = x1;
  const double length = (x1 - x0).norm();
  const Vector3d t = (x1 - x0) / length;
  const Vector3d other = std::abs(t.x()) > 0.9 ? Vector3d::UnitY() : Vector3d::UnitX();
  const Vector3d u = t.cross(other).normalized();
  link.axes << t.transpose(), u.transpose(), t.cross(u).transpose();
  const double bending = section.bendingMomentU / length, across = 12 * bending / (length * length);
  Eigen::Matrix<double, 6, 1> k;
  k << section.area / length, across, across, section.torsionConstant / (2 * (1 + poisson) * length), bending, bending;
  k.tail<3>() /= scale * scale;
  link.stiffness = k.asDiagonal();
  return link;
}

void shakeNetwork(IdentifiedNetwork& n, double share) {
  states::Random random(11);
  for (IdentifiedLink& l : n.links) {
    const Matrix6d root = l.stiffness.cwiseSqrt();
    Matrix6d mixed = Matrix6d::Identity();
    for (int i = 0; i < 36; ++i) mixed(i / 6, i % 6) += share * random.uniform();
    l.stiffness = root * mixed * mixed.transpose() * root;
    const Vector6d diagonal = root.diagonal();
    for (Vector6d* strain : {&l.strain0, &l.strain1}) {
      if (strain == &l.strain1 && l.frame1 >= static_cast<int>(n.frames.size())) continue;
      for (int i = 0; i < 6; ++i) (*strain)[i] = 5 * share * random.uniform() * diagonal[i];
    }
  }
  for (std::vector<SkinFrame>& of : n.skin)
    for (SkinFrame& f : of)
      for (int i = 0; i < 18; ++i) f.map(i % 3, i / 3) += share * random.uniform();
}

void blendNodes(const SoftBodyModel& m, std::size_t most, IdentifiedNetwork& n) {
  const int spheres = static_cast<int>(m.spheres.size());
  n.skin.resize(m.restNodes.size());
  for (std::size_t i = 0; i < m.restNodes.size(); ++i) {
    std::vector<std::pair<double, SkinFrame>> near;
    const auto add = [&](int frame, const Vector3d& point) {
      SkinFrame f;
      f.frame = frame;
      f.restPoint = point;
      const double squared = (m.restNodes[i] - point).squaredNorm();
      f.weight = 1 / std::max(squared, 1e-6);
      near.emplace_back(squared, f);
    };
    for (int k = 0; k < spheres; ++k) add(k, n.frames[k].restPosition);
    for (std::size_t p = 0; p < n.patches.size(); ++p)
      add(spheres + static_cast<int>(p), m.restNodes[n.patches[p].nodes.front()]);
    std::sort(near.begin(), near.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    near.resize(std::min(most, near.size()));
    double sum = 0;
    for (const auto& [squared, f] : near) sum += f.weight;
    for (auto& [squared, f] : near) {
      f.weight /= sum;
      n.skin[i].push_back(f);
    }
  }
}

}  // namespace

std::shared_ptr<SoftBodyModel> withNetwork(const SoftBodyModel& model, const NetworkSettings& settings,
                                           const Vector3d& arm, double poisson) {
  auto out = std::make_shared<SoftBodyModel>(model);
  auto network = std::make_shared<IdentifiedNetwork>();
  IdentifiedNetwork& n = *network;
  n.poisson = poisson;
  n.voxel = 1e-3;
  n.lengthScale = 0.5 * (model.spheres[1].restFrame - model.spheres[0].restFrame).norm();
  for (const FillingSphere& s : model.spheres) n.frames.push_back({s.restFrame + arm, s.volume, s.secondMoment});
  const LinkSection section = model.links[0].sections[0];
  for (const ElasticLink& l : model.links)
    n.links.push_back(beamBetween(l.sphere0, l.sphere1, n.frames[l.sphere0].restPosition,
                                  n.frames[l.sphere1].restPosition, l.sections[4], n.lengthScale, poisson));
  if (!settings.held.empty()) {
    n.patches.push_back({"vertices=held.csv", settings.held});
    Vector3d mean = Vector3d::Zero();
    for (const int node : settings.held) mean += model.restNodes[node] / static_cast<double>(settings.held.size());
    n.links.push_back(beamBetween(0, static_cast<int>(model.spheres.size()), n.frames[0].restPosition, mean, section,
                                  n.lengthScale, poisson));
  }
  blendNodes(model, settings.frames, n);
  n.layer = {1.5 * settings.surface, settings.surface, 2e-4};
  if (settings.uneven > 0) shakeNetwork(n, settings.uneven);
  out->identified = network;
  return out;
}

BodyDescription identifiedBody(std::shared_ptr<const SoftBodyModel> model, double young) {
  BodyDescription out = body(std::move(model), young);
  out.links = LinkModel::identified;
  for (const FixedPatch& p : out.model->identified->patches)
    out.fixedNodes.insert(out.fixedNodes.end(), p.nodes.begin(), p.nodes.end());
  return out;
}

}  // namespace medulla::synthetic
